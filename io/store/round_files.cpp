#include "io/store/round_files.h"

#include <fcntl.h>
#include <isa-l/igzip_lib.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <set>
#include <string_view>

#include "engine/error.h"
#include "io/files/deflate.h"
#include "io/store/hash.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMagic = 0x31646365'736d7462;  // "btmsecd1"
constexpr std::uint64_t kMaxRecord_bytes = std::uint64_t{1} << 34;

// What the name of a file says: n<number>.k<rank>of<ranks>.r<revision>
struct FileName {
  int number = 0, rank = 0, ranks = 0;
  std::uint64_t revision = 0;
  std::string text() const {
    std::string out = "n";
    out.append(std::to_string(number)).append(".k").append(std::to_string(rank)).append("of");
    return out.append(std::to_string(ranks)).append(".r").append(std::to_string(revision));
  }
};

std::optional<FileName> parse_name(const std::string& name) {
  FileName out;
  std::string_view rest = name;
  const auto take = [&](std::string_view before, auto& number) {
    if (!rest.starts_with(before)) return false;
    rest.remove_prefix(before.size());
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    return error == std::errc();
  };
  if (!take("n", out.number) || !take(".k", out.rank) || !take("of", out.ranks) || !take(".r", out.revision) ||
      out.text() != name)
    return {};
  return out;
}

std::vector<FileName> files_in(const fs::path& folder) {
  std::vector<FileName> out;
  std::error_code ignored;
  for (fs::directory_iterator it(folder, ignored), end; !ignored && it != end; it.increment(ignored))
    if (const auto name = parse_name(it->path().filename().string())) out.push_back(*name);
  std::sort(out.begin(), out.end(), [](const FileName& a, const FileName& b) {
    return std::tie(a.revision, a.number, a.rank, a.ranks) < std::tie(b.revision, b.number, b.rank, b.ranks);
  });
  return out;
}

bool read_at(const Descriptor& fd, std::uint64_t offset, std::span<std::uint8_t> to) {
  while (!to.empty()) {
    const ssize_t got = ::pread(fd.get(), to.data(), to.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    offset += static_cast<std::uint64_t>(got);
    to = to.subspan(static_cast<std::size_t>(got));
  }
  return true;
}

// The last bytes of a file.
struct Trailer {
  std::uint64_t blocks = 0, xxh3 = 0, magic = kMagic;  // of the index before it
};

using Block = RoundFiles::Block;
static_assert(std::has_unique_object_representations_v<Block>);

std::span<std::uint8_t> raw(std::vector<Block>& blocks) {
  return {reinterpret_cast<std::uint8_t*>(blocks.data()), blocks.size() * sizeof(Block)};
}

// The index; nothing of a file that is damaged.
std::optional<std::vector<Block>> read_index(const fs::path& file) {
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (fd.get() < 0) return {};
  const off_t size = ::lseek(fd.get(), 0, SEEK_END);
  Trailer trailer;
  if (size < static_cast<off_t>(sizeof trailer)) return {};
  const std::uint64_t end = static_cast<std::uint64_t>(size) - sizeof trailer;
  if (!read_at(fd, end, {reinterpret_cast<std::uint8_t*>(&trailer), sizeof trailer}) || trailer.magic != kMagic ||
      trailer.blocks > end / sizeof(Block))
    return {};
  std::vector<Block> blocks(trailer.blocks);
  const std::uint64_t begin = end - trailer.blocks * sizeof(Block);
  if (!read_at(fd, begin, raw(blocks)) || xxh3_64(raw(blocks)) != trailer.xxh3) return {};
  for (const Block& b : blocks)
    if (b.offset > begin || b.stored_bytes > begin - b.offset || b.bytes > kMaxRecord_bytes) return {};
  return blocks;
}

std::vector<std::uint8_t> compressed(const std::vector<std::uint8_t>& record) {
  if (record.size() > UINT32_MAX / 2) return record;
  std::vector<std::uint8_t> out(record.size());
  const auto bytes = Deflater(Wrapper::kNone).deflate(record, out);
  if (!bytes || *bytes == record.size()) return record;  // of equal size it is read as not compressed
  out.resize(*bytes);
  return out;
}

std::optional<std::vector<std::uint8_t>> expanded(std::vector<std::uint8_t>&& stored, std::uint64_t bytes) {
  if (stored.size() == bytes) return std::move(stored);
  // No deflate stream grows more than this.
  if (bytes > UINT32_MAX || bytes / 1100 > stored.size()) return {};
  std::vector<std::uint8_t> out(bytes);
  inflate_state state;
  isal_inflate_init(&state);
  state.next_in = stored.data();
  state.avail_in = static_cast<std::uint32_t>(stored.size());
  state.next_out = out.data();
  state.avail_out = static_cast<std::uint32_t>(out.size());
  if (isal_inflate_stateless(&state) != ISAL_DECOMP_OK || state.total_out != bytes) return {};
  return out;
}

}  // namespace

RoundFiles::RoundFiles(fs::path map_folder, const RoundFilesOptions& options)
    : folder_(std::move(map_folder) / kRoundFolder), options_(options) {
  if (!options.follow && !options.resume) return;
  std::map<std::pair<int, int>, int> there;  // files, by number and count of ranks
  for (const std::string& name : options.files)
    if (!fs::exists(folder_ / name))
      throw Error(ErrorCode::kVerification, "is missing: build the map anew, without --update",
                  (folder_ / name).string());
  for (const FileName& name : files_in(folder_)) {
    if (options.follow ? name.revision >= options.revision || name.revision < options.since
                       : name.revision != options.revision)
      continue;
    const fs::path file = folder_ / name.text();
    const auto index = read_index(file);
    if (!index && options.follow)
      throw Error(ErrorCode::kVerification, "is damaged: build the map anew, without --update", file.string());
    if (!index) continue;
    // Of later revisions last: they hold what is newest.
    for (const Block& block : *index) known_[name.number][block.tile] = {file, block};
    // The build may have been taken up before, with more or fewer ranks.
    if (options.resume && ++there[{name.number, name.ranks}] == name.ranks) interrupted_.insert(name.number);
  }
}

RoundFiles::~RoundFiles() = default;

bool RoundFiles::interrupted_after(int number) const { return !options_.follow && interrupted_.contains(number); }

bool RoundFiles::time_to_save() const {
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard lock(mutex_);
  if (std::chrono::duration<double>(now - last_saved_).count() < options_.checkpoint_every_s) return false;
  last_saved_ = now;
  return true;
}

std::vector<TileId> RoundFiles::tiles(int number) const {
  std::vector<TileId> out;
  if (const auto it = known_.find(number); it != known_.end())
    for (const auto& entry : it->second) out.push_back(entry.first);
  return out;
}

std::optional<std::vector<std::uint8_t>> RoundFiles::load(int number, TileId tile) const {
  const auto of_number = known_.find(number);
  if (of_number == known_.end()) return {};
  const auto it = of_number->second.find(tile);
  if (it == of_number->second.end()) return {};
  const auto& [file, block] = it->second;
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  std::vector<std::uint8_t> stored(block.stored_bytes);
  if (fd.get() < 0 || !read_at(fd, block.offset, stored) || xxh3_64(stored) != block.xxh3) return {};
  return expanded(std::move(stored), block.bytes);
}

void RoundFiles::save(int number, TileId tile, std::vector<std::uint8_t>&& record) {
  const std::vector<std::uint8_t> stored = compressed(record);
  Block block{tile, 0, stored.size(), record.size(), xxh3_64(stored)};
  AtomicFile* file = nullptr;
  {
    const std::lock_guard lock(mutex_);
    Writing& writing = writing_[number];
    if (!writing.file) {
      make_folders(folder_);
      writing.file = std::make_unique<AtomicFile>(
          folder_ / FileName{number, options_.rank, options_.ranks, options_.revision}.text());
    }
    block.offset = writing.end;
    writing.end += stored.size();
    writing.blocks.push_back(block);
    file = writing.file.get();
  }
  file->write(block.offset, stored);
}

void RoundFiles::finish(int number) {
  const std::lock_guard lock(mutex_);
  Writing writing;
  if (const auto node = writing_.extract(number)) writing = std::move(node.mapped());
  const fs::path path = folder_ / FileName{number, options_.rank, options_.ranks, options_.revision}.text();
  if (!writing.file) {
    // Where every rank's file counts, one without records counts too.
    if (options_.follow || fs::exists(path)) return;
    make_folders(folder_);
    writing.file = std::make_unique<AtomicFile>(path);
  }
  writing.file->write(writing.end, raw(writing.blocks));
  Trailer trailer{writing.blocks.size(), xxh3_64(raw(writing.blocks))};
  writing.file->write(writing.end + writing.blocks.size() * sizeof(Block),
                      {reinterpret_cast<const std::uint8_t*>(&trailer), sizeof trailer});
  writing.file->place();
  sync_folder(folder_);
}

bool has_round_files(const fs::path& map_folder, std::uint64_t revision) {
  const auto files = files_in(map_folder / kRoundFolder);
  return std::any_of(files.begin(), files.end(), [&](const FileName& f) { return f.revision == revision; });
}

void remove_round_files(const fs::path& map_folder, std::uint64_t revision) {
  const fs::path folder = map_folder / kRoundFolder;
  std::error_code ignored;
  remove_stale_temporaries(folder);
  for (const FileName& name : files_in(folder))
    if (name.revision == revision) fs::remove(folder / name.text(), ignored);
  fs::remove(folder, ignored);  // fails while anything is in it
}

std::vector<std::string> damaged_round_files(const fs::path& map_folder, std::uint64_t revision, std::uint64_t since) {
  const fs::path folder = map_folder / kRoundFolder;
  std::vector<std::string> damaged;
  for (const FileName& name : files_in(folder)) {
    if (name.revision < since || name.revision > revision) continue;
    const auto index = read_index(folder / name.text());
    const Descriptor fd(::open((folder / name.text()).c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    const auto is_sound = [&](const Block& block) {
      std::vector<std::uint8_t> stored(block.stored_bytes);
      return read_at(fd, block.offset, stored) && xxh3_64(stored) == block.xxh3;
    };
    if (!index || fd.get() < 0 || !std::all_of(index->begin(), index->end(), is_sound)) damaged.push_back(name.text());
  }
  return damaged;
}

std::vector<std::string> newest_round_files(const fs::path& map_folder, std::uint64_t revision, std::uint64_t since) {
  const fs::path folder = map_folder / kRoundFolder;
  std::vector<FileName> files = files_in(folder);
  std::reverse(files.begin(), files.end());  // the newest first
  std::set<std::pair<int, TileId>> held;
  std::vector<std::string> out;
  for (const FileName& name : files) {
    bool wanted = false;
    if (since > 0 && name.revision >= since && name.revision <= revision)
      for (const Block& block : read_index(folder / name.text()).value_or(std::vector<Block>{}))
        wanted |= held.insert({name.number, block.tile}).second;
    if (wanted) out.push_back(name.text());
  }
  return out;
}

void prune_round_files(const fs::path& map_folder, std::uint64_t revision, std::uint64_t since) {
  const fs::path folder = map_folder / kRoundFolder;
  std::error_code ignored;
  remove_stale_temporaries(folder);
  const std::vector<std::string> wanted = newest_round_files(map_folder, revision, since);
  for (const FileName& name : files_in(folder))
    if (std::find(wanted.begin(), wanted.end(), name.text()) == wanted.end()) fs::remove(folder / name.text(), ignored);
  fs::remove(folder, ignored);  // fails while anything is in it
}

}  // namespace btms
