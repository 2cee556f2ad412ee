// What the program makes of malformed files (docs/malformed_inputs.md): refused in words, in no time, without touching
// anything; or accepted with a warning; and what is not warned of gives the map of the sound file.
#include <sys/stat.h>

#include <cmath>
#include <map>

#include "tests/cli/program.h"
#include "tests/io/points/malformed_las.h"
#include "tests/io/points/malformed_pcd.h"
#include "tests/io/points/malformed_ply.h"
#include "tests/io/points/malformed_xyz.h"

namespace btms::test {
namespace {

std::string text_of(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

Bytes scan_bytes(const std::vector<std::array<float, 3>>& points) {
  Bytes bytes;
  for (const auto& [x, y, z] : points)
    for (const float v : {x, y, z, 0.5F}) append(bytes, v);
  return bytes;
}

Bytes swapped(Bytes bytes) {
  for (auto at = bytes.begin(); at != bytes.end(); at += 4) std::reverse(at, at + 4);
  return bytes;
}

const std::vector<Malformed>& bad_scans() {
  static const std::vector<Malformed> kFiles = {
      {51, "HalfAPoint", {"40 bytes", "multiple of 16"}, [] { return Bytes(40); }},
      {54, "Swapped", {"looks byte-swapped"}, [] { return swapped(scan_bytes(floor_and_wall())); }},
  };
  return kFiles;
}

// A map and labels that must not change, and what comes and goes beside them.
class Malformation : public testing::Test {
 protected:
  void SetUp() override {
    write_scan(folder_ / "good.bin", floor_and_wall());
    run_json({"build", folder_ / "good.bin", "-o", map(), "--preset", "paper-single-scan"});
    fs::create_directory(out());
    for (const char* name : {"bad.las", "bad.label", "bad.labels"})
      write_text(folder_.path() / "out" / name, "precious");
    base_bytes_ = run({"--version"}).peak_rss_bytes;
  }
  std::string map() const { return folder_ / "map.btms"; }
  std::string out() const { return folder_ / "out"; }

  // Everything there is, and what is in it.
  std::map<std::string, std::string> contents() const {
    std::map<std::string, std::string> all;
    std::error_code ignored;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path()))
      all[entry.path().string()] = entry.is_regular_file(ignored) ? read_text(entry.path()) : "";
    return all;
  }

  // One line that names the file and holds every word, at once in an address space of 512 MB, and nothing changed.
  void expect_refused(std::vector<std::string> call, const std::string& file, const std::vector<std::string>& says,
                      int status = 3) {
    SCOPED_TRACE(testing::PrintToString(call));
    const auto before = contents();
    call.emplace_back("--json");
    const Outcome outcome = kSanitized ? run(call) : run_in_memory(512, call);
    EXPECT_EQ(outcome.status, status) << outcome.err;
    std::string error = outcome.err.substr(outcome.err.find("error: ") + 7);
    EXPECT_EQ(error.find('\n'), error.size() - 1) << error;
    EXPECT_NE(error.find(file), std::string::npos) << error;
    for (const std::string& words : says) EXPECT_NE(error.find(words), std::string::npos) << words << " in " << error;
    const auto details = nlohmann::json::parse(outcome.out, nullptr, false)["error"];
    EXPECT_EQ(details["code"], status == 3 ? "bad_input" : "usage");
    EXPECT_EQ(details["message"].get<std::string>() + "\n", error);
    EXPECT_TRUE(contents() == before) << "something was touched";
    if (kSanitized) return;
    std::error_code ignored;
    const std::uintmax_t bytes = fs::is_regular_file(file, ignored) ? fs::file_size(file) : 0;
    EXPECT_LT(outcome.cpu_seconds, 1);
    EXPECT_LE(outcome.peak_rss_bytes, base_bytes_ + 2 * bytes + (64 << 20));
  }

  void expect_refused_everywhere(const std::string& file, const std::vector<std::string>& says) {
    expect_refused({"info", file}, file, says);
    expect_refused({"build", folder_ / "good.bin", file, "-o", map()}, file, says);
    expect_refused({"label", map(), file, "-o", out(), "--force"}, file, says);
    expect_refused({"segment", file, "-o", out(), "--force"}, file, says);
  }

  void expect_all_refused(const std::vector<Malformed>& list, const std::string& name) {
    for (const Malformed& bad : list) {
      SCOPED_TRACE(std::to_string(bad.number) + " " + bad.name);
      const Bytes bytes = bad.make();
      write_text(folder_ / name, text_of(bytes));
      expect_refused_everywhere(folder_ / name, bad.says);
    }
  }

  nlohmann::json build(const std::string& file) {
    return run_json({"build", file, "-o", folder_ / "odd.btms", "--preset", "paper-single-scan"});
  }

  // With its warnings, and the map of `sound` where there are no others.
  void expect_accepted(const Malformed& odd, const std::string& name, const Bytes& sound) {
    SCOPED_TRACE(std::to_string(odd.number) + " " + odd.name);
    const Bytes bytes = odd.make();
    write_text(folder_ / name, text_of(bytes));
    const auto info = run_json({"info", folder_ / name});
    expect_warnings(info["warnings"], odd.says);
    if (info["points"] == 0) return expect_refused({"build", folder_ / name, "-o", map()}, name, {"no point left"});
    const auto built = build(folder_ / name);
    expect_warnings(built["inputs"][0]["warnings"], odd.says);
    if (sound.empty()) return;
    write_text(folder_ / ("sound-" + name), text_of(sound));
    EXPECT_EQ(built["digest"], build(folder_ / ("sound-" + name))["digest"]);
  }

  static void expect_warnings(const nlohmann::json& warnings, const std::vector<std::string>& says) {
    ASSERT_EQ(warnings.size(), says.size()) << warnings;
    for (std::size_t i = 0; i < says.size(); ++i)
      EXPECT_NE(warnings[i].get<std::string>().find(says[i]), std::string::npos) << warnings[i];
  }

  TempFolder folder_;
  std::uint64_t base_bytes_ = 0;
};

TEST_F(Malformation, OfLasIsRefused) { expect_all_refused(bad_las_files(), "bad.las"); }
TEST_F(Malformation, OfPcdIsRefused) { expect_all_refused(bad_pcd_files(), "bad.pcd"); }
TEST_F(Malformation, OfPcdNumbersIsRefused) { expect_all_refused(unreadable_pcd_files(), "bad.pcd"); }
TEST_F(Malformation, OfPlyIsRefused) { expect_all_refused(bad_ply_files(), "bad.ply"); }
TEST_F(Malformation, OfPlyNumbersIsRefused) {
  for (const Malformed& bad : unreadable_ply_files()) {
    write_text(folder_ / "bad.ply", text_of(bad.make()));
    expect_refused({"build", folder_ / "bad.ply", "-o", map()}, "bad.ply", bad.says);
  }
}
TEST_F(Malformation, OfPlyIsAccepted) {
  for (const Malformed& odd : odd_ply_files()) expect_accepted(odd, "odd.ply", {});
}
TEST_F(Malformation, OfTextIsRefused) { expect_all_refused(bad_xyz_files(), "bad.csv"); }
TEST_F(Malformation, OfTextNumbersIsRefused) {
  for (const Malformed& bad : unreadable_xyz_files()) {
    write_text(folder_ / "bad.txt", text_of(bad.make()));
    expect_refused({"build", folder_ / "bad.txt", "-o", map()}, "bad.txt", bad.says);
  }
}
TEST_F(Malformation, OfTextIsAccepted) {
  for (const Malformed& odd : odd_xyz_files()) expect_accepted(odd, "odd.xyz", {});
}
TEST_F(Malformation, OfScansIsRefused) { expect_all_refused(bad_scans(), "bad.bin"); }

TEST_F(Malformation, OfLasIsAccepted) {
  for (const Malformed& odd : odd_las_files()) expect_accepted(odd, "odd.las", las_bytes({}));
}
TEST_F(Malformation, OfPcdIsAccepted) {
  for (const Malformed& odd : odd_pcd_files()) expect_accepted(odd, "odd.pcd", {});
  const std::string dos =
      "VERSION .6\r\nCOLUMNS x y z\r\nSIZE 4 4 4\r\nTYPE F F F\r\nWIDTH 1\r\nDATA ascii\r\n1 2 3\r\n";
  expect_accepted({42, "DosLines", {}, [&] { return text_bytes(dos); }}, "odd.pcd",
                  pcd_header("ascii", 1) + "1 2 3\n" + Bytes());
  Bytes doubles;
  for (const double v : {691'234.567, 5'334'000.001, 512.25}) append(doubles, v);
  expect_accepted({37, "Doubles", {}, [&] { return pcd_header("binary", 1, "x y z", "8 8 8") + doubles; }}, "odd.pcd",
                  pcd_header("ascii", 1) + "691234.567 5334000.001 512.25\n" + Bytes());
}

// 52: a scanner that saw nothing is no error, but there is no map of it.
TEST_F(Malformation, AnEmptyScanIsAScan) {
  expect_accepted({52, "Empty", {"scan is empty"}, [] { return Bytes(); }}, "odd.bin", {});
  EXPECT_EQ(run({"segment", folder_ / "odd.bin", "-o", out()}).status, 0);
  EXPECT_EQ(fs::file_size(folder_ / "out/odd.label"), 0u);
}

// 16
TEST_F(Malformation, PointsOutOfRangeAreDroppedAndCounted) {
  LasSpec spec;
  spec.offset = {0, 0, 133'000};
  spec.xyz = {{0, 0, 0}, {1000, 0, 0}, {0, 1000, 2'000'000'000}, {0, 0, 500}};
  write_text(folder_ / "far.las", text_of(las_bytes(spec)));
  const auto built = build(folder_ / "far.las");
  EXPECT_EQ(built["points"], 3);
  EXPECT_EQ(built["dropped"]["out_of_range"], 1);
  EXPECT_EQ(built["dropped"]["not_finite"], 0);
  spec.offset = {1e11, 0, 0};
  write_text(folder_ / "far.las", text_of(las_bytes(spec)));
  expect_refused({"build", folder_ / "far.las", "-o", map()}, "far.las", {"no point left", "4 out of range"});
}

// 21
TEST_F(Malformation, PointsOutsideTheDeclaredBoxAreKeptAndCounted) {
  const LasSpec spec;
  const Bytes lies = changed(spec, [](Bytes& b) { store(&b[195], 2.0); });  // max y; one of the points has 2.5
  write_text(folder_ / "lies.las", text_of(lies));
  write_text(folder_ / "sound.las", text_of(las_bytes(spec)));
  const auto built = build(folder_ / "lies.las"), sound = build(folder_ / "sound.las");
  EXPECT_EQ(sound["outside_box"], 0);
  EXPECT_EQ(built["outside_box"], 1);
  EXPECT_EQ(built["digest"], sound["digest"]);
  EXPECT_NE(built["warnings"].dump().find("1 point outside the bounding box"), std::string::npos) << built["warnings"];
}

// 28
TEST_F(Malformation, FeetAreConvertedAndSaidSo) {
  LasSpec feet, metres;
  feet.vlrs = {geokeys({{1024, 1}, {3072, 32767}, {3076, 9002}})};
  feet.xyz = {{10'000, 20'000, 30'000}};
  metres.xyz = {{3048, 6096, 9144}};
  expect_accepted({28,
                   "Feet",
                   {"horizontal coordinates are in units of 0.3048 m", "heights are in units of 0.3048 m"},
                   [&] { return las_bytes(feet); }},
                  "odd.las", las_bytes(metres));
}

// 28
TEST_F(Malformation, DegreesInASystemWithoutANameAreRefused) {
  expect_all_refused({{28,
                       "Degrees",
                       {"in degrees", "don't name", "reproject"},
                       [] {
                         return las_bytes(with_crs(geokeys({{1024, 2}, {2048, 32767}})));
                       }}},
                     "bad.las");
}

// 53
TEST_F(Malformation, LabelsOfAnotherCountAreRefused) {
  for (const char* name : {"truth.label", "cut.label", "odd.label"}) write_text(folder_ / name, std::string(40, '\0'));
  fs::resize_file(folder_ / "cut.label", 36);
  fs::resize_file(folder_ / "odd.label", 39);
  const auto eval = [&](const std::string& prediction) {
    return std::vector<std::string>{
        "eval", "--truth", folder_ / "truth.label", "--prediction", folder_ / prediction, "--sensor-height", "0"};
  };
  expect_refused(eval("cut.label"), folder_ / "cut.label", {"found 9", "expected 10", "truth.label"});
  expect_refused(eval("odd.label"), folder_ / "odd.label", {"39 bytes", "multiple of 4"});
}

// 71: the program never waits at a FIFO and never reads a device.
TEST_F(Malformation, OfPathsIsRefused) {
  for (const std::string extension : {".las", ".pcd", ".bin"}) {
    const std::string fifo = folder_ / ("fifo" + extension), zero = folder_ / ("zero" + extension),
                      loop = folder_ / ("loop" + extension), nothing = folder_ / ("nothing" + extension),
                      secret = folder_ / ("secret" + extension);
    ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
    fs::create_symlink("/dev/zero", zero);
    fs::create_symlink("loop" + extension, loop);
    fs::create_symlink("gone", nothing);
    expect_refused_everywhere(fifo, {"not a regular file"});
    expect_refused_everywhere(zero, {"not a regular file"});
    expect_refused_everywhere(loop, {"Too many levels of symbolic links"});
    expect_refused_everywhere(nothing, {"No such file"});
    if (geteuid() == 0) continue;
    write_text(secret, "16 bytes of them");
    fs::permissions(secret, fs::perms::none);
    expect_refused_everywhere(secret, {"Permission denied"});
    fs::permissions(secret, fs::perms::owner_all);
  }
  // A folder is a list of files; one without any is a mistake of the caller.
  fs::create_directory(folder_ / "folder.las");
  expect_refused({"build", folder_ / "folder.las", "-o", map()}, folder_ / "folder.las", {"no point files"}, 2);
}

}  // namespace
}  // namespace btms::test
