// What a sandboxed child may do, and what the parent learns of its end.
#include "io/store/sandbox.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <numeric>
#include <thread>
#include <vector>

#include "io/store/sandboxed_layers.h"
#include "io/store/shard_file.h"
#include "tests/io/store/made_map.h"

namespace btms {
namespace {

constexpr SandboxLimits kLimits{std::uint64_t{64} << 20, 1};

// The message when `work` runs in a sandbox and nothing is read from it; empty when it went well.
std::string end_of(const std::function<void()>& work) {
  try {
    run_sandboxed(
        kLimits, [&](SandboxOutput&) { work(); }, [](SandboxInput&) {});
    return {};
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kVerification) << e.what();
    return e.what();
  }
}

TEST(Sandbox, HandsOverWhatIsWritten) {
  std::vector<std::uint8_t> sent(1'000'000), received(sent.size());
  std::iota(sent.begin(), sent.end(), std::uint8_t{0});
  run_sandboxed(
      kLimits, [&](SandboxOutput& out) { out.write(sent); }, [&](SandboxInput& in) { in.read(received); });
  EXPECT_EQ(received, sent);
}

TEST(Sandbox, TooLittleAndTooMuchAreErrors) {
  const std::vector<std::uint8_t> sent(10);
  std::vector<std::uint8_t> more(11), less(9);
  for (auto* wanted : {&more, &less})
    EXPECT_EQ(thrown_code([&] {
                run_sandboxed(
                    kLimits, [&](SandboxOutput& out) { out.write(sent); }, [&](SandboxInput& in) { in.read(*wanted); });
              }),
              ErrorCode::kVerification);
}

TEST(Sandbox, TellsHowTheChildEnded) {
  EXPECT_EQ(end_of([] {}), "");
  EXPECT_EQ(end_of([] { throw Error(ErrorCode::kBadInput, "what was wrong"); }), "what was wrong");
  EXPECT_NE(end_of([] { std::abort(); }).find("signal 6"), std::string::npos);
  EXPECT_NE(end_of([] { raise(SIGSEGV); }).find("signal 11"), std::string::npos);
  EXPECT_NE(end_of([] { ::_exit(0x55); }).find("without an answer"), std::string::npos);
}

TEST(Sandbox, RefusesEverythingButComputing) {
  const auto refused = [](const char* call, const std::function<void()>& work) {
    EXPECT_NE(end_of(work).find(std::string("refused the system call ") + call), std::string::npos) << end_of(work);
  };
  const pid_t parent = ::getpid();
  refused("socket", [] { ::socket(AF_INET, SOCK_STREAM, 0); });
  refused("kill", [=] { ::kill(parent, 0); });
  refused("unlink", [] { ::unlink("/nothing/there"); });
  refused("clone", [] { static_cast<void>(::fork()); });
  refused("execve", [] { ::execl("/bin/true", "true", nullptr); });
  refused("read", [] {
    char c = 0;
    static_cast<void>(!::read(0, &c, 1));
  });
  refused("mmap", [] { ::mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0); });
  refused("tgkill", [=] { ::syscall(SYS_tgkill, parent, parent, 0); });
  refused("write", [] { static_cast<void>(!::write(2, "x", 1)); });
  EXPECT_EQ(end_of([] {
              if (::open("/etc/passwd", O_RDONLY) >= 0) throw std::runtime_error("opened a file");
            }),
            "");
}

TEST(Sandbox, BoundsMemory) {
  EXPECT_NE(end_of([] { std::vector<char>(std::size_t{1} << 30, 'x'); }).find("memory"), std::string::npos);
  EXPECT_EQ(end_of([] { std::vector<char>(std::size_t{1} << 24, 'x'); }), "");
}

// By its own clock, or, where the machine is so busy that it gets none of it, by the parent's.
TEST(Sandbox, BoundsTime) {
  const std::string end = end_of([] {
    for (volatile int forever = 1; forever != 0;) {
    }
  });
  EXPECT_NE(end.find("was stopped: it "), std::string::npos) << end;
}

TEST(Sandbox, AParentThatThrowsLeavesNoChildBehind) {
  EXPECT_THROW(run_sandboxed(
                   kLimits,
                   [](SandboxOutput&) {
                     for (volatile int forever = 1; forever != 0;) {
                     }
                   },
                   [](SandboxInput&) { throw std::logic_error("no"); }),
               std::logic_error);
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
}

TEST(SandboxedLayers, GiveTheSameTile) {
  for (const Cell size : {Cell{40, 30}, Cell{128, 128}}) {
    const TerrainTile tile = noisy_tile(layout_of(2000, 128), {0, 0, size.col, size.row});
    const EncodedShard shard = encode_shard(tile, {});
    const StoredShard stored{shard.file, 2000, tile.box};
    const TerrainTile direct = decode_shard(stored, shard.values_xxh3);
    const TerrainTile fenced = decode_shard(stored, shard.values_xxh3, read_layers_sandboxed);
    EXPECT_EQ(digest(direct), digest(tile));
    EXPECT_EQ(digest(fenced), digest(tile));
    EXPECT_EQ(fenced.corner_mm, tile.corner_mm);
    EXPECT_EQ(fenced.upper, tile.upper);
    EXPECT_EQ(thrown_code([&] { decode_shard(stored, shard.values_xxh3 + 1, read_layers_sandboxed); }),
              ErrorCode::kVerification);
  }
}

TEST(SandboxedLayers, ClaimsOfGiantShardsAreRefused) {
  const std::vector<std::uint8_t> bytes(1000);
  const StoredShard stored{bytes, 2000, {0, 0, 1 << 14, 1 << 13}};
  EXPECT_EQ(thrown_code([&] { read_layers_sandboxed(stored, Wanted::kModel, {}, {}); }), ErrorCode::kVerification);
}

// Several threads at once, each with children of its own, as `btms verify --untrusted` does.
TEST(SandboxedLayers, ManyThreads) {
  const TerrainTile tile = noisy_tile(layout_of(2000, 128), {0, 0, 20, 20});
  const EncodedShard shard = encode_shard(tile, {});
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 10; ++i)
        EXPECT_EQ(digest(decode_shard({shard.file, 2000, tile.box}, shard.values_xxh3, read_layers_sandboxed)),
                  digest(tile));
    });
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace btms
