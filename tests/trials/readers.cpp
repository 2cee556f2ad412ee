// Trial: readers never wait for a writer, nor see half of what it writes.
//
// Processes open a map over and over and read all of it, each tile checked, while a writer replaces it again and again
// by one of two maps, and is killed now and then in the middle. A reader must always find a whole map, one of the two.
// It can finish what it has opened as long as no more than one revision was published meanwhile; outrun by two, it is
// told so and opens the map again.
#include <sys/mman.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <random>

#include "engine/error.h"
#include "tests/trials/disturbed.h"

namespace btms::test {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kMostReaders = 64;
constexpr auto kHangs = std::chrono::seconds(20);

// What readers tell, in memory they share with the writer.
struct Shared {
  std::atomic<bool> stop;
  struct Reader {
    std::atomic<std::uint64_t> maps, tiles, outrun, torn;
  } readers[kMostReaders];
};

class Reading {
 public:
  Reading(fs::path map, std::vector<std::string> legal, Shared::Reader& told)
      : map_(std::move(map)), legal_(std::move(legal)), told_(told) {}

  void once() {
    std::uint64_t revision = 0;
    try {
      const auto reader = MapReader::open(map_);
      revision = reader->info().revision;
      const std::string digest = reader->info().digest.hex();
      if (revision < last_) complain("revision " + std::to_string(revision) + " after " + std::to_string(last_));
      last_ = revision;
      if (std::find(legal_.begin(), legal_.end(), digest) == legal_.end()) complain("digest " + digest);
      Digest sum;
      for (const TileId id : reader->tiles()) {
        sum += btms::digest(*reader->load(id));
        ++told_.tiles;
      }
      if (sum.hex() != digest) complain("tiles of another map");
      ++told_.maps;
    } catch (const Error& e) {
      if (revision > 0 && is_outrun(revision, e))
        ++told_.outrun;
      else
        complain(e.what());
    }
  }

 private:
  bool is_outrun(std::uint64_t revision, const Error& e) const {
    return std::string(e.what()).find("is missing") != std::string::npos &&
           MapReader::open(map_)->info().revision >= revision + 2;
  }
  void complain(const std::string& what) {
    ++told_.torn;
    std::printf("BAD a reader: %s\n", what.c_str());
    std::fflush(stdout);
  }

  const fs::path map_;
  const std::vector<std::string> legal_;
  Shared::Reader& told_;
  std::uint64_t last_ = 0;
};

// The writer's side: two ways to build the map, and what came of it.
class Writing {
 public:
  Writing(const TempFolder& folder, unsigned seed) : map_(folder / "map"), city_(folder / "city"), random_(seed) {
    need(test::run({"synth", "--scene", "city", "--points", "100000", "-o", city_}));
    const auto begun = Clock::now();
    for (const bool coarse : {false, true}) {
      need(test::run(build(coarse)));
      legal.push_back(map_digest(map_));
    }
    usual_ = (Clock::now() - begun) / 2;
  }

  fs::path map() const { return map_; }

  // One build; killed somewhere in the middle, or left to end.
  void once(bool kill) {
    coarse_ = !coarse_;
    Running program(build(coarse_));
    if (!kill) {
      const Outcome outcome = program.wait();
      if (outcome.status == 0) return void(++published);
      const bool locked = outcome.err.find("another build") != std::string::npos;
      ++(locked ? lock_errors : failures);
      std::printf("BAD the writer: %s\n", outcome.err.c_str());
      return;
    }
    std::this_thread::sleep_for(usual_ * (random_() % 1000) / 1000);
    killed += !program.has_ended();
    program.send(SIGKILL);
    program.wait();
  }

  std::vector<std::string> legal;
  int published = 0, killed = 0, lock_errors = 0, failures = 0;

 private:
  static void need(const Outcome& outcome) {
    if (outcome.status != 0) throw Error(ErrorCode::kFailed, "the trial could not be set up: " + outcome.err);
  }
  std::vector<std::string> build(bool coarse) {
    return {"build",        city_,
            "-o",           map_,
            "--resolution", coarse ? "1" : "0.5",
            "--executor",   random_() % 2 == 0 ? "tbb" : "ranks:2"};
  }

  const std::string map_, city_;
  std::mt19937 random_;
  Clock::duration usual_{};
  bool coarse_ = false;
};

int run_trial(int seconds, int readers, int kills, unsigned seed) {
  const TempFolder folder;
  Writing writing(folder, seed);
  void* memory = mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw Error(ErrorCode::kFailed, "no shared memory");
  Shared& shared = *new (memory) Shared{};

  std::vector<pid_t> children;
  for (int r = 0; r < readers; ++r) {
    const pid_t pid = fork();
    if (pid < 0) throw Error(ErrorCode::kFailed, "a reader could not be started");
    if (pid == 0) {
      Reading reading(writing.map(), writing.legal, shared.readers[r]);
      while (!shared.stop) reading.once();
      _exit(0);
    }
    children.push_back(pid);
  }

  const auto begun = Clock::now();
  const auto passed_s = [&] { return std::chrono::duration<double>(Clock::now() - begun).count(); };
  // Kills are spread over the time; builds in between end.
  for (int builds = 0; passed_s() < seconds || writing.killed < kills; ++builds) {
    const bool due = writing.killed < kills && passed_s() * kills >= seconds * writing.killed;
    writing.once(due && builds % 2 == 1);
    if (builds % 50 == 49)
      std::printf("%3.0f s: %d published, %d killed\n", passed_s(), writing.published, writing.killed),
          std::fflush(stdout);
  }

  // A reader that waits for anything never sees the end.
  shared.stop = true;
  int hung = 0, died = 0;
  const auto end = Clock::now();
  for (const pid_t pid : children) {
    int status = 0;
    pid_t ended = 0;
    while ((ended = waitpid(pid, &status, WNOHANG)) == 0 && Clock::now() - end < kHangs)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (ended == 0) {
      ++hung;
      kill(pid, SIGKILL);
      waitpid(pid, &status, 0);
    } else if (status != 0) {
      ++died;
    }
  }
  std::uint64_t maps = 0, tiles = 0, outrun = 0, torn = 0;
  for (int r = 0; r < readers; ++r) {
    const Shared::Reader& reader = shared.readers[r];
    maps += reader.maps;
    tiles += reader.tiles;
    outrun += reader.outrun;
    torn += reader.torn;
    if (reader.maps == 0) ++hung;
  }
  munmap(memory, sizeof(Shared));
  const std::string left = temporary_in(writing.map());
  if (!left.empty() && writing.published > 0) std::printf("there is %s, of the last that was killed\n", left.c_str());
  std::printf(
      "%.0f s, %d readers, %d published, %d killed: %llu maps and %llu tiles read, %llu outrun by two revisions; "
      "%d lock errors, %llu torn, %d hung, %d died, %d builds failed\n",
      passed_s(), readers, writing.published, writing.killed, static_cast<unsigned long long>(maps),
      static_cast<unsigned long long>(tiles), static_cast<unsigned long long>(outrun), writing.lock_errors,
      static_cast<unsigned long long>(torn), hung, died, writing.failures);
  return writing.lock_errors + writing.failures + hung + died == 0 && torn == 0 ? 0 : 1;
}

}  // namespace
}  // namespace btms::test

int main(int argc, char** argv) {
  CLI::App app("Readers beside a writer that replaces the map and is killed: no waiting, nothing torn");
  int seconds = 60, readers = 8, kills = 20;
  unsigned seed = 1;
  app.add_option("seconds", seconds, "So long")->check(CLI::Range(1, 100'000));
  app.add_option("readers", readers, "So many at a time")->check(CLI::Range(1, btms::test::kMostReaders));
  app.add_option("kills", kills, "Times the writer is killed, at least; takes longer if need be");
  app.add_option("--seed", seed, "Other times to kill");
  CLI11_PARSE(app, argc, argv);
  try {
    return btms::test::run_trial(seconds, readers, kills, seed);
  } catch (const std::exception& error) {
    std::printf("BAD %s\n", error.what());
    return 1;
  }
}
