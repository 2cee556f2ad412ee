#include "io/store/journal.h"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <map>
#include <string_view>

#include "engine/error.h"
#include "io/files/atomic_file.h"
#include "io/files/read_file.h"
#include "io/store/cf_file.h"
#include "io/store/hash.h"
#include "io/store/json_field.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

std::uint64_t hash_of(std::string_view text) {
  return xxh3_64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

std::string line(const std::string& text) { return hex64(hash_of(text)) + " " + text + "\n"; }

// The JSON of the sound lines, up to the first that isn't, and where they end in the file.
struct SoundLines {
  std::vector<std::string> lines;
  std::uint64_t end_bytes = 0;
};

SoundLines sound_lines(const fs::path& file) {
  SoundLines out;
  const std::vector<std::uint8_t> bytes = read_file(file, kMaxManifest_bytes, ErrorCode::kVerification);
  std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (std::size_t end; (end = rest.find('\n')) != std::string_view::npos; rest.remove_prefix(end + 1)) {
    const std::string_view whole = rest.substr(0, end);
    if (whole.size() < 18 || whole[16] != ' ' || hex64(hash_of(whole.substr(17))) != whole.substr(0, 16)) break;
    out.lines.emplace_back(whole.substr(17));
    out.end_bytes += whole.size() + 1;
  }
  return out;
}

Json parse(const std::string& text) {
  return parse_json({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

// An object; an empty one in place of anything else.
Json object_or_none(Json value) { return value.is_object() ? std::move(value) : Json::object(); }
Json members(const std::string& text) {
  try {
    return object_or_none(parse(text));
  } catch (const Error&) {
    return Json::object();
  }
}
Json members(const Json& object, const char* name) { return object_or_none(object.value(name, Json())); }

std::vector<fs::path> journals_in(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code ignored;
  for (fs::directory_iterator it(folder, ignored), end; !ignored && it != end; it.increment(ignored))
    if (is_journal_name(it->path().filename().string())) out.push_back(it->path());
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace

std::string build_identity(const MapInfo& info) {
  Json inputs = Json::array();
  for (const InputRecord& in : info.inputs) inputs.push_back({in.name, in.bytes, in.content, in.changed_ns});
  Json parameters = Json::object();
  for (const ParameterInfo& p : parameter_table()) parameters[std::string(p.name)] = parameter_text(info.parameters, p);
  Json out{{"inputs", inputs},
           {"parameters", parameters},
           {"reference system", info.crs_wkt},
           {"--crs", info.crs_given},
           {"tile edge", info.layout.grid.edge_cells},
           {"schema", kSchemaVersion},
           {"updatable", info.updatable_since > 0},
           {"updated revision", info.follows}};
  if (info.trajectory) out["trajectory"] = {info.trajectory->name, info.trajectory->bytes, info.trajectory->content};
  return json_line(out);
}

std::string identity_difference(const std::string& a, const std::string& b) {
  if (a == b) return {};
  const Json one = members(a), other = members(b);
  std::string names;
  const auto note = [&](const std::string& name) { names += (names.empty() ? "" : ", ") + name; };
  for (const char* name :
       {"inputs", "reference system", "--crs", "tile edge", "trajectory", "updatable", "updated revision", "schema"})
    if (one.value(name, Json()) != other.value(name, Json())) note(name);
  const Json ours = members(one, "parameters"), theirs = members(other, "parameters");
  for (const auto& [name, value] : ours.items())
    if (theirs.value(name, Json()) != value) note(name);
  return names.empty() ? "the program" : names;
}

std::string journal_name(int rank) {
  std::string name = kJournal;
  return rank == 0 ? name : name.append(".").append(std::to_string(rank));
}

bool is_journal_name(const std::string& name) {
  if (name == kJournal) return true;
  const std::string prefix = std::string(kJournal) + ".";
  return name.starts_with(prefix) && name.size() > prefix.size() && name.size() < prefix.size() + 6 &&
         std::all_of(name.begin() + static_cast<std::ptrdiff_t>(prefix.size()), name.end(),
                     [](char c) { return c >= '0' && c <= '9'; });
}

Journal::Journal(const fs::path& folder, int rank, std::uint64_t revision, const std::string& identity)
    : path_(folder / journal_name(rank)),
      fd_(::open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0666)) {
  if (fd_.get() < 0) throw Error(ErrorCode::kFailed, "cannot create it: " + system_reason(errno), path_.string());
  // A torn line would hide all that is added behind it.
  const SoundLines sound = sound_lines(path_);
  if (::ftruncate(fd_.get(), static_cast<off_t>(sound.end_bytes)) != 0)
    throw Error(ErrorCode::kFailed, "cannot shorten it: " + system_reason(errno), path_.string());
  if (!sound.lines.empty()) return;
  append(line(json_line({{"revision", revision}, {"identity", identity}})));
  sync_folder(folder);
}

void Journal::append(const std::string& text) {
  const auto fail = [&](const char* doing) {
    throw Error(ErrorCode::kFailed, std::string("cannot ") + doing + " it: " + system_reason(errno), path_.string());
  };
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t put = ::write(fd_.get(), text.data() + done, text.size() - done);
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) fail("write");
    done += static_cast<std::size_t>(put);
  }
  if (::fdatasync(fd_.get()) != 0) fail("sync");
}

void Journal::add(const std::vector<ShardEntry>& shards) {
  std::string text;
  for (const ShardEntry& s : shards) text += line(entry_text(s));
  append(text);
}

std::optional<Interrupted> read_journals(const fs::path& folder) {
  std::optional<Interrupted> out;
  for (const fs::path& file : journals_in(folder)) {
    try {
      const std::vector<std::string> lines = sound_lines(file).lines;
      if (lines.empty()) continue;
      const Json head = parse(lines[0]);
      const auto revision =
          static_cast<std::uint64_t>(integer_member(head, "revision", 1, std::numeric_limits<std::int64_t>::max()));
      const std::string identity = text_member(head, "identity");
      if (!out) out = Interrupted{revision, identity, {}};
      if (revision != out->revision || identity != out->identity) continue;
      out->entries.insert(out->entries.end(), lines.begin() + 1, lines.end());
    } catch (const Error&) {
      continue;  // nobody's journal
    }
  }
  return out;
}

std::vector<ShardEntry> journaled_shards(const Interrupted& interrupted, const MapLayout& layout) {
  std::map<TileId, ShardEntry> shards;
  for (const std::string& text : interrupted.entries) try {
      ShardEntry entry = parse_entry_text(text, layout);
      shards[entry.id] = std::move(entry);
    } catch (const Error&) {
      continue;  // of another layout
    }
  std::vector<ShardEntry> out;
  for (auto& [id, entry] : shards) out.push_back(std::move(entry));
  return out;
}

void remove_journals(const fs::path& folder) {
  std::error_code ignored;
  for (const fs::path& file : journals_in(folder)) fs::remove(file, ignored);
}

}  // namespace btms
