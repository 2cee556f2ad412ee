// LAZ files against their LAS twins, damaged ones, and a decoder that misbehaves.
#include "io/points/laz.h"

#include <csignal>
#include <fstream>
#include <thread>

#include "io/points/laz_child.h"
#include "tests/io/points/las_bytes.h"

namespace btms::test {
namespace {

bool is_built() {
  std::error_code ignored;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
  return std::filesystem::exists(program.parent_path().parent_path() / "share/btms/laz/decode.js");
}

// Children of this process that are still there, zombies included.
std::string children() {
  std::string all;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream in(thread.path() / "children");
    for (std::string pid; in >> pid;) all += pid + " ";
  }
  return all;
}

class Laz : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* const data = std::getenv("BTMS_DATA");
    if (data == nullptr) GTEST_SKIP() << "BTMS_DATA is not set: no LAZ files to read";
    if (!is_built()) GTEST_SKIP() << "this build has no LAZ decoder";
    data_ = data;
  }
  void TearDown() override { EXPECT_EQ(children(), "") << "a decoder is left"; }

  std::filesystem::path at(const std::string& name) const { return data_ / name; }
  Bytes example() const { return read_bytes(at("formats/Example.laz")); }

  std::filesystem::path data_;
  TemporaryFolder folder_;
};

TEST_F(Laz, HasThePointsOfItsTwin) {
  for (const std::string name : {"formats/Example", "lake/topography"}) {
    SCOPED_TRACE(name);
    const auto las = open_points(at(name + ".las")), laz = open_points(at(name + ".laz"));
    ASSERT_EQ(las->size(), laz->size());
    const PointBlock expected = read_all(*las), found = read_all(*laz);
    EXPECT_TRUE(found.x_mm == expected.x_mm && found.y_mm == expected.y_mm && found.z_mm == expected.z_mm);
    EXPECT_EQ(laz->info().crs, las->info().crs);
    EXPECT_EQ(read_classes(at(name + ".laz")), read_classes(at(name + ".las")));
  }
}

TEST_F(Laz, OfEveryKindCanBeRead) {
  const std::vector<std::pair<std::string, std::uint64_t>> files = {
      {"formats/example.copc.laz", 30}, {"formats/eb.laz", 9310}, {"formats/las14_pdrf6.laz", 135}};
  for (const auto& [name, points] : files) {
    const auto file = open_points(at(name));
    EXPECT_EQ(file->size(), points) << name;
    EXPECT_EQ(file->info().format.substr(0, 4), "LAZ ");
    EXPECT_EQ(read_all(*file).dropped(), 0U) << name;
  }
}

TEST_F(Laz, ManyFilesFromManyThreads) {
  std::vector<std::unique_ptr<PointFile>> files;
  for (int i = 0; i < 10; ++i) files.push_back(open_points(at("formats/Example.laz")));
  const PointBlock expected = read_all(*files[0]);
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 3; ++t) {
    threads.emplace_back([&, t] {
      PointBlock block;
      for (std::size_t i = t; i < files.size(); i += 2) {
        files[i]->read(7, 20, block);
        for (std::size_t k = 0; k < 20; ++k) wrong += block.x_mm[k] != expected.x_mm[7 + k] ? 1 : 0;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST_F(Laz, LabelsAreLas) {
  const auto file = open_points(at("formats/example.copc.laz"));
  const auto writer = create_labels(*file, folder_.path());
  writer->write(0, std::vector<Label>(file->size(), Label::kTerrain));
  writer->commit();
  EXPECT_EQ(writer->path(), folder_ / "example.copc.las");
  EXPECT_EQ(std::filesystem::file_size(writer->path()), label_bytes(*file));
  const auto copy = open_points(writer->path());
  EXPECT_EQ(read_all(*copy).x_mm, read_all(*file).x_mm);
  EXPECT_EQ(read_classes(writer->path()), std::vector<std::uint32_t>(30, 2));
}

// All cut files are refused, most of them before a decoder is started.
TEST_F(Laz, TruncatedIsRefused) {
  const Bytes whole = example();
  for (std::size_t n = 0; n < whole.size(); n += n + 40 < whole.size() ? 37 : 5) {
    SCOPED_TRACE(n);
    const auto path = folder_.write("cut.laz", std::span(whole).first(n));
    expect_error(ErrorCode::kBadInput, path, {""}, [&] { read_all(*open_points(path)); });
  }
}

TEST_F(Laz, LyingHeadersAreRefused) {
  const auto refused = [&](const std::vector<std::string>& says, const std::function<void(Bytes&)>& damage) {
    Bytes bytes = example();
    damage(bytes);
    const auto path = folder_.write("bad.laz", bytes);
    expect_error(ErrorCode::kBadInput, path, says, [&] { read_all(*open_points(path)); });
  };
  const std::size_t points = load<std::uint32_t>(&example()[96]), table = load<std::uint64_t>(&example()[points]);
  refused({"4000000000 points", "found 1"}, [](Bytes& b) { store(&b[107], 4'000'000'000U); });
  refused({"table of chunks", "byte 99999999"}, [&](Bytes& b) { store(&b[points], std::uint64_t{99'999'999}); });
  refused({"table of chunks", "byte 5"}, [&](Bytes& b) { store(&b[points], std::uint64_t{5}); });
  refused({"declares 4294967295 chunks"}, [&](Bytes& b) { store(&b[table + 4], 0xFFFFFFFFU); });
  refused({"point format 5"}, [](Bytes& b) { b[104] = 0x85; });
  refused({"records of 10 bytes"}, [](Bytes& b) { store(&b[105], std::uint16_t{10}); });
  refused({"not compressed"}, [](Bytes& b) { b[104] &= 0x7F; });
  refused({"VLRs"}, [](Bytes& b) { store(&b[100], 0xFFFFFFFFU); });
}

// Any program can stand for the decoder.
class LazChild : public ::testing::Test {
 protected:
  void SetUp() override { path_ = folder_.write("a.laz", std::string("content")); }
  void TearDown() override { EXPECT_EQ(children(), "") << "a child is left"; }

  std::string run(const std::string& script, std::uint64_t bytes, int patience_s = 60) {
    std::string got;
    run_laz_decoder({{"/bin/sh", "-c", script}, patience_s}, path_, bytes,
                    [&](std::span<const std::uint8_t> piece) { got.append(piece.begin(), piece.end()); });
    return got;
  }
  void expect_refused(const std::vector<std::string>& says, const std::string& script, std::uint64_t bytes) {
    expect_error(ErrorCode::kBadInput, path_, says, [&] { run(script, bytes, 1); });
  }
  TemporaryFolder folder_;
  std::filesystem::path path_;
};

TEST_F(LazChild, GetsTheFileAndNothingElse) {
  EXPECT_EQ(run("/bin/cat", 7), "content");
  EXPECT_EQ(run("[ -e /proc/$$/fd/3 ] && echo y || echo n", 2), "n\n") << "a file of the parent";
  EXPECT_EQ(run("echo \"$HOME\"", 1), "\n");
}
TEST_F(LazChild, IsStoppedWhenItHangs) { expect_refused({"said nothing for 1 s"}, "exec /bin/sleep 100", 7); }
TEST_F(LazChild, IsQuotedWhenItFails) { expect_refused({"no such luck"}, "echo no such luck >&2; exit 3", 7); }
TEST_F(LazChild, MayDie) { expect_refused({"signal 9"}, "kill -9 $$", 7); }
TEST_F(LazChild, MaySayTooMuchOrTooLittle) {
  expect_refused({"more than the header"}, "while :; do echo words; done", 7);
  expect_refused({"found 7 bytes", "expected 8"}, "/bin/cat", 8);
}
TEST_F(LazChild, MayFloodItsErrors) {
  expect_refused({"aaaa"}, "/usr/bin/head -c 300000 /dev/zero | /usr/bin/tr '\\0' a >&2; exit 1", 7);
}
TEST_F(LazChild, MustExist) {
  expect_error(ErrorCode::kFailed, path_, {"/no/such/program"}, [&] {
    run_laz_decoder({{"/no/such/program"}, 1}, path_, 7, [](std::span<const std::uint8_t>) {});
  });
}

}  // namespace
}  // namespace btms::test
