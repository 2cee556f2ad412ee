// The table of formats, the list of inputs, and paths that are no point files.
#include <sys/stat.h>

#include "io/points/extension.h"
#include "tests/io/points/las_bytes.h"

namespace btms::test {
namespace {

TEST(PointFile, KnowsItsExtensions) {
  EXPECT_EQ(known_point_extensions(),
            (std::vector<std::string>{".las", ".laz", ".bin", ".pcd", ".ply", ".npy", ".xyz", ".csv", ".txt", ".asc"}));
  const TemporaryFolder folder;
  EXPECT_EQ(open_points(folder.write("A.LAS", las_bytes({})))->size(), 3u);
  const auto text = folder.write("a.doc", std::string("1 2 3"));
  expect_error(ErrorCode::kUsage, text, {".doc", ".las .laz .bin .pcd .ply .npy .xyz .csv .txt .asc"},
               [&] { open_points(text); });
  const auto laz = folder.write("a.laz", las_bytes({}));
  expect_error(ErrorCode::kBadInput, laz, {"not compressed", "call it .las"}, [&] { open_points(laz); });
}

TEST(PointFile, ReadsClassesWhateverTheCaseOfTheExtension) {
  const TemporaryFolder folder;
  EXPECT_EQ(read_classes(folder.write("a.LABEL", Bytes{40, 0, 1, 0})), (std::vector<std::uint32_t>{40}));
  EXPECT_EQ(read_classes(folder.write("a.Labels", Bytes{1, 0})), (std::vector<std::uint32_t>{1, 0}));
  EXPECT_EQ(read_classes(folder.write("a.LAS", las_bytes({}))).size(), 3u);
  EXPECT_EQ(lower_extension("A.b.LaZ"), ".laz");
}

TEST(PointFile, RefusesWhatIsNotARegularFile) {
  const TemporaryFolder folder;
  for (const char* extension : {".las", ".laz", ".bin", ".pcd", ".ply", ".xyz"}) {
    SCOPED_TRACE(extension);
    const std::string e = extension;
    const auto refused = [&](const std::string& name, const std::string& says) {
      expect_error(ErrorCode::kBadInput, folder / name, {says}, [&] { open_points(folder / name); });
    };
    std::filesystem::create_directory(folder / ("folder" + e));
    refused("folder" + e, "not a regular file");
    ASSERT_EQ(::mkfifo((folder / ("fifo" + e)).c_str(), 0600), 0);
    refused("fifo" + e, "not a regular file");  // and does not wait for a writer
    std::filesystem::create_symlink("/dev/zero", folder / ("zero" + e));
    refused("zero" + e, "not a regular file");
    std::filesystem::create_symlink("loop" + e, folder / ("loop" + e));
    refused("loop" + e, "Too many levels");
    std::filesystem::create_symlink("nothing", folder / ("dangling" + e));
    refused("dangling" + e, "No such file");
    refused("missing" + e, "No such file");
    if (::geteuid() != 0) {
      std::filesystem::permissions(folder.write("secret" + e, Bytes(16)), std::filesystem::perms::none);
      refused("secret" + e, "Permission denied");
    }
  }
}

TEST(PointFile, HoldsNoHandleBetweenReads) {
  const TemporaryFolder folder;
  const auto open_handles = [] { return files_in("/proc/self/fd"); };
  const auto path = folder.write("a.las", las_bytes({}));
  const std::size_t before = open_handles();
  std::vector<std::unique_ptr<PointFile>> files;
  for (int i = 0; i < 100; ++i) files.push_back(open_points(path));
  for (const auto& file : files) read_all(*file);
  EXPECT_EQ(open_handles(), before);
}

class Inputs : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"b.las", "a.bin", "c.PCD", "notes.txt", "d.laz"}) folder.write(name, std::string("x"));
    std::filesystem::create_directories(folder / "sub.las");
    folder.write("sub.las/inner.bin", std::string("x"));
    std::filesystem::create_directories(folder / "empty");
    folder.write("[1].las", std::string("x"));
    folder.write("1.las", std::string("x"));
  }
  std::vector<std::string> names(std::vector<std::string> arguments) {
    for (std::string& argument : arguments) argument = (folder / argument).string();
    std::vector<std::string> result;
    const InputList list = expand_inputs(arguments);
    warnings = list.warnings;
    for (const auto& path : list.paths) result.push_back(path.lexically_relative(folder.path()).string());
    return result;
  }
  TemporaryFolder folder;
  std::vector<std::string> warnings;  // of the last names()
};

using Names = std::vector<std::string>;

TEST_F(Inputs, KeepTheOrderGiven) { EXPECT_EQ(names({"c.PCD", "a.bin"}), (Names{"c.PCD", "a.bin"})); }
TEST_F(Inputs, OfAFolderAreItsPointFilesByName) {
  EXPECT_EQ(names({""}), (Names{"1.las", "[1].las", "a.bin", "b.las", "c.PCD", "d.laz"}));
}
TEST_F(Inputs, OfAPatternAreItsMatchesByName) {
  EXPECT_EQ(names({"?.*[sn]"}), (Names{"1.las", "a.bin", "b.las"}));
  EXPECT_EQ(names({"sub*"}), (Names{"sub.las/inner.bin"}));
}
TEST_F(Inputs, ANameThatExistsIsNoPattern) { EXPECT_EQ(names({"[1].las"}), (Names{"[1].las"})); }
TEST_F(Inputs, MustMatchSomething) {
  for (const char* argument : {"missing.las", "*.nothing", "empty", "nowhere/*.las", "b.las/*.las"}) {
    SCOPED_TRACE(argument);
    expect_error(ErrorCode::kUsage, folder / argument, {"no "}, [&] { names({"b.las", argument}); });
  }
}
TEST_F(Inputs, CountAFileOnceWhateverItIsCalled) {
  std::filesystem::create_symlink("b.las", folder / "link.las");
  EXPECT_EQ(names({"b.las", "a.bin", "./b.las", "link.las"}), (Names{"b.las", "a.bin"}));
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_NE(warnings[1].find("link.las"), std::string::npos);
  EXPECT_EQ(names({"a.bin"}), (Names{"a.bin"}));
  EXPECT_TRUE(warnings.empty());
}

}  // namespace
}  // namespace btms::test
