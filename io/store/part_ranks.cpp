#include "io/store/part_ranks.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <thread>

#include "engine/error.h"
#include "io/files/atomic_file.h"
#include "io/files/descriptor.h"
#include "io/files/read_file.h"
#include "io/store/hash.h"
#include "io/store/journal.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

constexpr char kAbout[] = "about.json";
constexpr std::uint64_t kMostAbout_bytes = std::uint64_t{1} << 26;
// Of a level with up to so many nodes parts tell each other all components: some 3 bytes a node and round.
constexpr std::uint64_t kToldInFull = std::uint64_t{1} << 28;
constexpr std::uint64_t kMagic = 0x31747261'736d7462;  // "btmsart1"

std::string number(std::uint64_t n) { return std::to_string(n); }

// A message file: this, then one Segment a receiver, then what they get.
struct Head {
  std::uint64_t magic = kMagic, segments = 0;
};
struct Segment {
  std::uint64_t bytes = 0, xxh3 = 0;
};

using Segments = std::vector<std::span<const std::uint8_t>>;

Bytes message_of(const Segments& segments) {
  std::size_t size = sizeof(Head) + segments.size() * sizeof(Segment);
  for (const auto& segment : segments) size += segment.size();
  Bytes all(size);
  std::uint8_t* at = all.data();
  const auto put = [&](const void* from, std::size_t n) {
    if (n > 0) std::memcpy(at, from, n);
    at += n;
  };
  const Head head{kMagic, segments.size()};
  put(&head, sizeof head);
  for (const auto& segment : segments) {
    const Segment entry{segment.size(), xxh3_64(segment)};
    put(&entry, sizeof entry);
  }
  for (const auto& segment : segments) put(segment.data(), segment.size());
  return all;
}

Bytes read_segment(const fs::path& file, std::size_t k) {
  const auto damaged = [&] {
    return Error(ErrorCode::kVerification,
                 "this message of a part is damaged; remove the folder and start all parts anew", file.string());
  };
  const std::uint64_t size = fs::file_size(file);
  const auto part = [&](std::uint64_t offset, void* to, std::uint64_t n) {
    if (offset > size || n > size - offset) throw damaged();
    const auto bytes = read_file_part(file, size, offset, n, ErrorCode::kVerification);
    if (n > 0) std::memcpy(to, bytes.data(), n);
  };
  Head head;
  part(0, &head, sizeof head);
  if (head.magic != kMagic || head.segments <= k || head.segments > size / sizeof(Segment)) throw damaged();
  std::vector<Segment> table(head.segments);
  part(sizeof head, table.data(), table.size() * sizeof(Segment));
  std::uint64_t offset = sizeof head + table.size() * sizeof(Segment);
  for (std::size_t i = 0; i < k; ++i) {
    if (table[i].bytes > size - offset) throw damaged();
    offset += table[i].bytes;
  }
  if (table[k].bytes > size - offset) throw damaged();
  Bytes bytes = read_file_part(file, size, offset, table[k].bytes, ErrorCode::kVerification);
  if (xxh3_64(bytes) != table[k].xxh3) throw damaged();
  return bytes;
}

class PartRanks final : public Ranks {
 public:
  PartRanks(fs::path folder, const PartOptions& options) : folder_(std::move(folder)), options_(options) {
    make_folders(folder_);
    const fs::path lock = folder_ / ("lock." + number(static_cast<unsigned>(options_.part)));
    lock_ = Descriptor(::open(lock.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666));
    if (lock_.get() < 0) throw Error(ErrorCode::kFailed, "could not open: " + system_reason(errno), lock.string());
    if (::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0)
      throw Error(ErrorCode::kFailed, name(options_.part) + " is at work already", folder_.string());
    agree();
  }

  int rank() const override { return options_.part; }
  int size() const override { return options_.parts; }
  bool in_step() const override { return false; }
  std::uint64_t message_bytes() const override { return std::uint64_t{64} << 20; }
  bool tells_all(std::uint64_t nodes) const override { return nodes <= kToldInFull; }
  void enter(const std::string& topic) override { topic_ = topic; }

 private:
  std::vector<Bytes> do_exchange(std::vector<Bytes> out) override {
    const auto own = static_cast<std::size_t>(options_.part);
    Bytes mine = std::move(out[own]);
    out[own].clear();
    tell(Segments(out.begin(), out.end()));
    out.clear();
    std::vector<Bytes> in(static_cast<std::size_t>(options_.parts));
    for (std::size_t r = 0; r < in.size(); ++r) in[r] = r == own ? std::move(mine) : read_segment(listen(r), own);
    ++count_[topic_];
    return in;
  }

  // A part hears itself, too: what depends on when it was asked is as it was the first time.
  std::vector<Bytes> do_share(Bytes mine) override {
    tell({mine});
    std::vector<Bytes> in(static_cast<std::size_t>(options_.parts));
    for (std::size_t r = 0; r < in.size(); ++r) in[r] = read_segment(listen(r), 0);
    ++count_[topic_];
    return in;
  }

  std::string name(int part) const {
    return "part " + number(static_cast<unsigned>(part) + 1) + " of " + number(static_cast<unsigned>(options_.parts));
  }
  fs::path message(std::size_t part) { return folder_ / (topic_ + "." + number(count_[topic_]) + "." + number(part)); }

  // What was said before stays.
  void tell(const Segments& segments) {
    const fs::path file = message(static_cast<std::size_t>(options_.part));
    if (!fs::exists(file)) write_file(file, message_of(segments));
  }

  // The message of another part, once it is there.
  fs::path listen(std::size_t part) {
    const fs::path file = message(part);
    auto pause = std::chrono::milliseconds(1);
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(options_.wait_s);
    while (!fs::exists(file)) {
      if (options_.stop_requested()) throw Error(ErrorCode::kCancelled, "stopped while waiting for another part");
      if (std::chrono::steady_clock::now() >= until)
        throw Error(ErrorCode::kUnfinished, name(options_.part) + " waits for part " + number(part + 1) + " (" +
                                                topic_ + "): run the parts again, or all at once with a longer --wait");
      std::this_thread::sleep_for(pause);
      pause = std::min(2 * pause, std::chrono::milliseconds(100));
    }
    return file;
  }

  // The first part says what all are about.
  void agree() {
    const nlohmann::json mine{{"parts", options_.parts}, {"identity", options_.identity}};
    const fs::path about = folder_ / kAbout;
    if (!fs::exists(about)) write_file(about, mine.dump());
    const PartsState there = read_parts(folder_);
    std::string what;
    if (there.parts != options_.parts)
      what = number(static_cast<unsigned>(there.parts)) + " parts";
    else if (there.identity != options_.identity)
      what = "another build: " + identity_difference(there.identity, options_.identity);
    if (!what.empty())
      throw Error(ErrorCode::kUsage, "here are the messages of " + what + "; remove the folder to begin anew",
                  folder_.string());
  }

  fs::path folder_;
  PartOptions options_;
  Descriptor lock_;
  std::string topic_ = "points";
  std::map<std::string, std::uint64_t> count_;  // messages, by topic
};

}  // namespace

fs::path parts_folder(const fs::path& map) {
  const fs::path plain = map.has_filename() ? map : map.parent_path();
  return plain.string() + ".parts";
}

std::unique_ptr<Ranks> part_ranks(const fs::path& folder, const PartOptions& options) {
  return std::make_unique<PartRanks>(folder, options);
}

PartsState read_parts(const fs::path& folder) {
  PartsState state;
  const auto text = read_file(folder / kAbout, kMostAbout_bytes, ErrorCode::kUsage);
  try {
    const auto json = nlohmann::json::parse(text.begin(), text.end());
    state.parts = json.at("parts").get<int>();
    state.identity = json.at("identity").get<std::string>();
  } catch (const nlohmann::json::exception&) {
    throw Error(ErrorCode::kVerification, "damaged; remove the folder and start all parts anew",
                (folder / kAbout).string());
  }
  if (state.parts < 1 || state.parts > kMostParts)
    throw Error(ErrorCode::kVerification, "damaged; remove the folder and start all parts anew",
                (folder / kAbout).string());
  state.reached.resize(static_cast<std::size_t>(state.parts));
  std::vector<fs::file_time_type> when(state.reached.size(), fs::file_time_type::min());
  std::error_code ignored;
  for (fs::directory_iterator it(folder, ignored), end; !ignored && it != end; it.increment(ignored)) {
    const std::string name = it->path().filename().string();  // TOPIC.COUNT.PART
    const std::size_t last = name.rfind('.'), first = name.find('.');
    if (first == last || name.find_first_not_of("0123456789", last + 1) != std::string::npos || name.size() > 100)
      continue;
    const auto part = static_cast<std::size_t>(std::atoi(name.c_str() + last + 1));
    const auto written = fs::last_write_time(it->path(), ignored);
    if (part >= when.size() || written < when[part]) continue;
    when[part] = written;
    state.reached[part] = name.substr(0, first);
  }
  return state;
}

void remove_parts(const fs::path& folder) { fs::remove_all(folder); }

}  // namespace btms
