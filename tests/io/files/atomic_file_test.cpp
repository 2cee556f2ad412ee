// Files that appear whole or not at all.
#include "io/files/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <csignal>
#include <cstring>

#include "tests/io/points/files.h"

namespace btms::test {
namespace {

Bytes text_of(const char* text) { return {text, text + std::strlen(text)}; }

TEST(AtomicFile, AppearsAndReplacesOnlyWhenCommitted) {
  const TemporaryFolder folder;
  for (const char* content : {"one", "two"}) {
    AtomicFile file(folder / "a");
    file.write(0, text_of(content));
    EXPECT_TRUE(std::strcmp(content, "one") == 0 ? !std::filesystem::exists(folder / "a")
                                                 : read_bytes(folder / "a") == text_of("one"));
    file.check(text_of(content));
    file.commit();
    EXPECT_EQ(read_bytes(folder / "a"), text_of(content));
  }
  { AtomicFile(folder / "a").write(0, text_of("three")); }
  EXPECT_EQ(read_bytes(folder / "a"), text_of("two"));
  EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(AtomicFile, NoticesContentThatIsNotWhatWasMeant) {
  const TemporaryFolder folder;
  AtomicFile file(folder / "a");
  file.write(0, text_of("abcd"));
  for (const char* other : {"abce", "abc", "abcde"})
    expect_error(ErrorCode::kFailed, folder / "a", {"reads back differently"}, [&] { file.check(text_of(other)); });
}

// Files longer than the limit can't be written: to the writer it looks like a full disk.
TEST(AtomicFile, AFullDiskIsAnErrorAndLeavesNothing) {
  const TemporaryFolder folder;
  folder.write("old", std::string("old"));
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit tight{4096, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &tight);
  const Bytes big(10'000, 7);
  expect_error(ErrorCode::kFailed, folder / "old", {"reserve"}, [&] { AtomicFile(folder / "old").reserve(10'000); });
  expect_error(ErrorCode::kFailed, folder / "old", {"write"}, [&] { AtomicFile(folder / "old").write(0, big); });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(read_bytes(folder / "old"), text_of("old"));
  EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(AtomicFile, OfAKilledProcessIsGoneWithTheNext) {
  const TemporaryFolder folder;
  folder.write("new", std::string("old"));
  const pid_t child = ::fork();
  if (child == 0) {
    AtomicFile file(folder / "new");
    file.write(0, Bytes(100));
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  AtomicFile file(folder / "new");
  file.commit();
  EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(AtomicFile, RemovesOnlyTemporaryFilesThatNobodyWrites) {
  const TemporaryFolder folder;
  folder.write(".btms-12-0.tmp", std::string("left behind"));
  for (const char* name : {".btms-12.tmp", ".btms-a-0.tmp", ".btms-12-0.tmpx", ".btms--0.tmp", "btms-12-0.tmp"})
    folder.write(name, std::string("a user's"));
  const Descriptor living(::open(folder.write(".btms-12-1.tmp", std::string("x")).c_str(), O_RDONLY));
  ASSERT_EQ(::flock(living.get(), LOCK_EX), 0);
  std::filesystem::create_symlink(folder / "btms-12-0.tmp", folder / ".btms-12-2.tmp");
  AtomicFile(folder / "a").commit();
  EXPECT_EQ(files_in(folder.path()), 8u);
  EXPECT_FALSE(std::filesystem::exists(folder / ".btms-12-0.tmp"));
}

TEST(AtomicFile, NamesTheFileInItsErrors) {
  const TemporaryFolder folder;
  expect_error(ErrorCode::kFailed, folder / "none/a", {"No such file"}, [&] { AtomicFile(folder / "none/a"); });
  std::filesystem::create_directories(folder / "b");
  expect_error(ErrorCode::kFailed, folder / "b", {"rename"}, [&] { AtomicFile(folder / "b").commit(); });
  EXPECT_EQ(files_in(folder.path()), 1u);
}

}  // namespace
}  // namespace btms::test
