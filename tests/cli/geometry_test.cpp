// Odd geometry through every format that can express it, by both methods (docs/malformed_inputs.md, 55 to 70).
#include <cmath>
#include <optional>
#include <ostream>
#include <set>

#include "io/store/map_store.h"
#include "tests/cli/program.h"
#include "tests/io/points/las_bytes.h"
#include "tests/io/points/pcd_bytes.h"
#include "tests/support/cloud.h"

namespace btms::test {
namespace {

using Cloud = std::vector<std::array<double, 3>>;  // metres

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();

Cloud metres(const std::vector<CloudPoint>& points) {
  Cloud cloud;
  for (const CloudPoint& p : points)
    cloud.push_back({static_cast<double>(p.x_mm) / 1000, static_cast<double>(p.y_mm) / 1000, p.z_mm / 1000.0});
  return cloud;
}

Cloud scene() {
  static const Cloud kScene = metres(hard_scene(0, 0, 60'000, 12'000));
  return kScene;
}

Cloud joined(Cloud a, const Cloud& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Cloud moved(Cloud cloud, double x, double y) {
  for (auto& p : cloud) p = {p[0] + x, p[1] + y, p[2]};
  return cloud;
}

template <class Point>
Cloud made(int n, const Point& point) {
  Cloud cloud;
  for (int i = 0; i < n; ++i) cloud.push_back(point(i));
  return cloud;
}

// As a .las of whole millimetres, a .pcd of doubles or a .bin of floats.
void write_cloud(const fs::path& path, const Cloud& cloud) {
  Bytes bytes;
  if (path.extension() == ".las") {
    LasSpec spec;
    spec.xyz.clear();
    for (std::size_t axis = 0; axis < 2; ++axis) spec.offset[axis] = std::floor(cloud[0][axis]);
    for (const auto& p : cloud) {
      std::array<std::int32_t, 3> mm;
      for (std::size_t axis = 0; axis < 3; ++axis)
        mm[axis] = static_cast<std::int32_t>(std::llround((p[axis] - spec.offset[axis]) * 1000));
      spec.xyz.push_back(mm);
    }
    bytes = las_bytes(spec);
    for (std::size_t axis = 0; axis < 3; ++axis) {  // a box that says nothing
      store(&bytes[179 + 16 * axis], 1e9);
      store(&bytes[187 + 16 * axis], -1e9);
    }
  } else if (path.extension() == ".pcd") {
    for (const auto& p : cloud)
      for (const double v : p) append(bytes, v);
    bytes = pcd_header("binary", cloud.size(), "x y z", "8 8 8") + bytes;
  } else {
    for (const auto& [x, y, z] : cloud)
      for (const double v : {x, y, z, 0.0}) append(bytes, static_cast<float>(v));
  }
  write_text(path, {bytes.begin(), bytes.end()});
}

using Words = std::vector<std::string>;

const Words kAll = {".las", ".pcd", ".bin"}, kFloats = {".pcd", ".bin"};
// The least that makes a plane is enough, so that nothing but the rule in question is in the way.
const Words kFixed = {"--preset", "paper-single-scan", "--resolution", "2", "--min-points", "3", "--keep-nodes", "1"};
const Words kLevels = {"--preset", "city"};
const std::vector<Words> kMethods = {kFixed, kLevels};
const std::vector<Words> kWays = {{"--tile-cells", "1"}, {"--tile-cells", "whole", "--executor", "ranks:2"}};

nlohmann::json build(const TempFolder& folder, const std::string& file, const Words& method, const Words& way = {}) {
  Words call = {"build", folder / file, "-o", folder / "map.btms"};
  call.insert(call.end(), method.begin(), method.end());
  call.insert(call.end(), way.begin(), way.end());
  return run_json(call);
}

struct Odd {
  int number;
  const char* name;
  Words formats;
  Cloud cloud;
  std::array<int, 3> dropped{};    // not finite, out of range, astray
  std::optional<Cloud> same = {};  // has the same map
  bool plane = true;               // by the fixed method
};
void PrintTo(const Odd& row, std::ostream* out) { *out << row.number << ' ' << row.name; }

const std::vector<Odd>& odd_clouds() {
  static const std::vector<Odd> kClouds = {
      {55, "NanAndInf", kFloats, joined(scene(), {{kNan, 1, 1}, {1, kInf, 1}, {1, 1, -kInf}}), {3, 0, 0}, scene()},
      {56, "Huge", kFloats, joined(scene(), {{1e30, 1, 1}, {1, -1e30, 1}, {1, 1, 1e30}}), {0, 3, 0}, scene()},
      {56, "HighAboveTheSky", kAll, joined(scene(), {{1, 1, 2e5}, {1, 1, -2e5}}), {0, 2, 0}, scene()},
      {57,
       "DenormalsAndMinusZero",
       kFloats,
       joined(scene(), {{-0.0, 1e-42, 3}, {-1e-42, -0.0, -0.0}}),
       {},
       joined(scene(), {{0, 0, 3}, {0, 0, 0}})},
      {58, "AllTheSame", kAll, Cloud(200, {3.3, 4.4, 5.5}), {}, {}, false},
      {59, "OnePoint", kAll, {{3, 4, 5}}, {}, {}, false},
      {59, "TwoPoints", kAll, {{3, 4, 5}, {3.2, 4, 5.1}}, {}, {}, false},
      {59, "ThreePoints", kAll, {{0.9, 0.2, 5}, {1.1, 0.2, 5}, {1, 0.4, 5}}},
      {60,
       "AlongX",
       kAll,
       made(200,
            [](int i) {
              return std::array{0.6 + 0.002 * i, 0.1, 5.0};
            }),
       {},
       {},
       false},
      {60,
       "Rising",
       kAll,
       made(200,
            [](int i) {
              return std::array{0.6 + 0.002 * i, 0.1, 5 + 0.001 * i};
            }),
       {},
       {},
       false},
      {60,
       "Upright",
       kAll,
       made(200,
            [](int i) {
              return std::array{0.9, 0.1, 0.05 * i};
            }),
       {},
       {},
       false},
      {61, "OnEveryBorder", kAll,
       made(81 * 81,
            [](int i) {
              return std::array{i % 81 / 2.0 - 20, i / 81 / 2.0 - 20, 1.0};
            })},
      {64, "OnePointFarAway", kAll, joined(scene(), {{2e6, -2e6, 7}}), {0, 0, 1}, scene()},
      {64, "OnePointAtTheEndOfTheWorld", kFloats, joined(scene(), {{1e7, 1e7, 7}}), {0, 0, 1}, scene()},
      {68, "Checkerboard", kAll,
       [] {
         Cloud cloud = scene();
         std::erase_if(cloud,
                       [](const auto& p) { return (static_cast<int>(p[0] / 8) + static_cast<int>(p[1] / 8)) % 2; });
         return cloud;
       }()},
      {69, "AroundZero", kAll, moved(scene(), -32, -32)},
      {70, "Utm", {".las", ".pcd"}, moved(scene(), 499'968, 4'499'968)},
  };
  return kClouds;
}

class OddCloud : public testing::TestWithParam<Odd> {};
INSTANTIATE_TEST_SUITE_P(Table, OddCloud, testing::ValuesIn(odd_clouds()),
                         [](const auto& row) { return std::to_string(row.param.number) + row.param.name; });

// Whatever the format, the tiles and the ranks.
TEST_P(OddCloud, HasOneMap) {
  const Odd& odd = GetParam();
  const auto [not_finite, out_of_range, strays] = odd.dropped;
  const nlohmann::json dropped{{"not_finite", not_finite}, {"out_of_range", out_of_range}, {"strays", strays}};
  const TempFolder folder;
  for (const Words& method : kMethods) {
    SCOPED_TRACE(method[1]);
    std::set<std::string> digests;
    nlohmann::json built;
    for (const std::string& format : odd.formats) {
      write_cloud(folder / ("a" + format), odd.cloud);
      built = build(folder, "a" + format, method);
      digests.insert(built["digest"]);
      EXPECT_EQ(built["dropped"], dropped);
      EXPECT_EQ(built["points"].get<int>() + not_finite + out_of_range + strays, odd.cloud.size());
    }
    for (const Words& way : kWays) digests.insert(build(folder, "a" + odd.formats[0], method, way)["digest"]);
    if (odd.same) {
      write_cloud(folder / "same.pcd", *odd.same);
      digests.insert(build(folder, "same.pcd", method)["digest"]);
    }
    EXPECT_EQ(digests.size(), 1u);
    if (method == kFixed) {
      EXPECT_EQ(built["nodes"]["observed"] > 0, odd.plane) << built["nodes"];
    }
  }
}

// What is in a cell of a map: its nodes, and the heights of their corners where they have any.
struct Content {
  std::array<NodeSurface, kTriangles> nodes;
  std::array<std::array<std::int32_t, 3>, kTriangles> corners_mm{};
  friend bool operator==(const Content&, const Content&) = default;
};

using Contents = std::map<std::pair<std::int32_t, std::int32_t>, Content>;  // by row and column

// Cells with anything in them, moved back by so many.
Contents contents(const std::string& map, std::int32_t east_cells = 0, std::int32_t north_cells = 0) {
  Contents all;
  const auto reader = MapReader::open(map);
  for (const TileId id : reader->tiles()) {
    const auto tile = reader->load(id);
    for (std::int32_t row = tile->box.row0; row < tile->box.row1; ++row)
      for (std::int32_t col = tile->box.col0; col < tile->box.col1; ++col) {
        Content content;
        for (std::uint8_t t = 0; t < kTriangles; ++t) {
          const NodeId node{{col, row}, t};
          content.nodes[t] = tile->nodes[tile->node_index(node)];
          if (content.nodes[t].state != NodeState::kUnknown) content.corners_mm[t] = tile->corners_mm(node);
        }
        if (!(content == Content{})) all[{row - north_cells, col - east_cells}] = content;
      }
  }
  return all;
}

std::int32_t most_apart_mm(const Content& a, const Content& b) {
  std::int32_t most = 0;
  for (std::size_t t = 0; t < kTriangles; ++t)
    for (std::size_t i = 0; i < 3; ++i) most = std::max(most, std::abs(a.corners_mm[t][i] - b.corners_mm[t][i]));
  return most;
}

// 61
TEST(OddGeometry, APointOnABorderIsInOneNode) {
  const TempFolder folder;
  for (const Odd& odd : odd_clouds()) {
    if (odd.number != 61) continue;
    write_cloud(folder / "a.bin", odd.cloud);
    build(folder, "a.bin", kFixed);
    std::size_t points = 0;
    for (const auto& [cell, content] : contents(folder / "map.btms"))
      for (const NodeSurface& node : content.nodes) points += node.count;
    EXPECT_EQ(points, odd.cloud.size());
  }
}

// 62: a million copies have the planes of one of each. Coarse to fine, more points pull more against the prior.
TEST(OddGeometry, DuplicatesHaveThePlanesOfOneOfEach) {
  const TempFolder folder;
  const Cloud once = made(256 * 256, [](int i) {
    const int x = i % 256, y = i / 256;
    return std::array{x / 8.0, y / 8.0, std::floor(x * x / 32.0 + 3 * y) / 1000};
  });
  Cloud many;
  for (int i = 0; i < 16; ++i) many = joined(many, once);
  write_cloud(folder / "once.bin", once);
  write_cloud(folder / "many.bin", many);
  for (const Words& method : kMethods) {
    build(folder, "once.bin", method);
    const Contents one = contents(folder / "map.btms");
    build(folder, "many.bin", method);
    const Contents all = contents(folder / "map.btms");
    ASSERT_EQ(one.size(), all.size());
    std::int32_t most_mm = 0;
    for (const auto& [cell, content] : one) most_mm = std::max(most_mm, most_apart_mm(content, all.at(cell)));
    EXPECT_LE(most_mm, method == kFixed ? 0 : 20) << method[1];
  }
}

// 63: the sums of 10 million points in one node do not overflow, 100 km up.
TEST(OddGeometry, ANodeHoldsTenMillionPoints) {
  const TempFolder folder;
  write_cloud(folder / "around.bin", made(14'400, [](int i) {
                return std::array{i % 120 / 2.0, i / 120 / 2.0, 100'000.0};
              }));
  write_cloud(folder / "node.bin", made(1000, [](int i) {  // in one triangle, rising from 100 000 m by a hundredth
                return std::array{20.75 + i % 32 / 64.0, 20 + i / 32 / 128.0, 100'000 + i % 32 / 4 / 128.0};
              }));
  {
    std::ofstream file(folder / "many.bin", std::ios::binary);
    file << read_text(folder / "around.bin");
    const std::string node = read_text(folder / "node.bin");
    for (int i = 0; i < 10'000; ++i) file << node;
  }
  for (const Words& method : kMethods) {
    EXPECT_EQ(build(folder, "many.bin", method)["points"], 10'014'400);
    const auto place = run_json({"query", folder / "map.btms", "--at", "21,20.125"});
    EXPECT_EQ(place["state"], "observed") << place;
    EXPECT_NEAR(place["z"].get<double>(), 100'000.01, 0.02) << place;
  }
}

// 64: two places are two places, however far apart, and a line of few points that leads somewhere is one.
TEST(OddGeometry, TwoSurveysFarApartAreBothKept) {
  const TempFolder folder;
  write_cloud(folder / "a.pcd", joined(scene(), moved(scene(), 5e5, 0)));
  const auto built = build(folder, "a.pcd", kLevels);
  EXPECT_EQ(built["dropped"]["strays"], 0);
  EXPECT_EQ(built["points"], 2 * scene().size());
}

// 64: points all over the world are refused, and where they are is said, before anything is allocated for them.
TEST(OddGeometry, PointsAllOverTheWorldAreRefused) {
  const TempFolder folder;
  Random random(1);
  write_cloud(folder / "a.bin", made(200'000, [&](int) {
                const auto any = [&] { return static_cast<double>(random.between(-10'000'000, 10'000'000)); };
                return std::array{any(), any(), 1.0};
              }));
  const std::uint64_t base = run({"--version"}).peak_rss_bytes;
  for (const Words& method : kMethods) {
    Words call = {"build", folder / "a.bin", "-o", folder / "map.btms"};
    call.insert(call.end(), method.begin(), method.end());
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    for (const char* words : {"--max-nodes", "furthest out are near x = "})
      EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_EQ(names_in(folder.path()), Words{"a.bin"});
    if (kSanitized) continue;
    EXPECT_LT(outcome.cpu_seconds, 1);
    EXPECT_LE(outcome.peak_rss_bytes, base + 2 * fs::file_size(folder / "a.bin") + (64 << 20));
  }
}

// 65: birds, and echoes from below: no other point's label changes. Coarse to fine, the node of the well has lost its
// lowest point of the ground, and heights a few millimetres.
TEST(OddGeometry, BirdsAndWellsChangeNothingAroundThem) {
  const TempFolder folder;
  const Cloud plain = scene();
  const Cloud odd = joined(plain, {{20.5, 21.25, 300}, {41.5, 30.25, -300}});
  write_cloud(folder / "plain.las", plain);
  write_cloud(folder / "odd.las", odd);
  const std::size_t at = points_offset({}), stride = format_bytes(0);
  for (const Words& method : kMethods) {
    SCOPED_TRACE(method[1]);
    build(folder, "plain.las", method);
    const Contents before = contents(folder / "map.btms");
    run_json({"label", folder / "map.btms", folder / "plain.las", "-o", folder / "labelled", "--force"});
    build(folder, "odd.las", method);
    const Contents after = contents(folder / "map.btms");
    run_json({"label", folder / "map.btms", folder / "odd.las", "-o", folder / "labelled", "--force"});

    EXPECT_EQ(before.size(), after.size());
    std::int32_t most_mm = 0;
    for (const auto& [cell, content] : before) {
      if (cell == std::pair{10, 10} || cell == std::pair{15, 20}) continue;
      if (method == kFixed) {
        EXPECT_TRUE(after.at(cell) == content) << "row " << cell.first << ", column " << cell.second;
      }
      most_mm = std::max(most_mm, most_apart_mm(content, after.at(cell)));
    }
    EXPECT_LE(most_mm, method == kFixed ? 0 : 20);
    const std::string a = read_text(folder / "labelled/plain.las"), b = read_text(folder / "labelled/odd.las");
    std::size_t others = 0;
    for (std::size_t i = 0; i < plain.size(); ++i) others += a[at + i * stride + 15] != b[at + i * stride + 15];
    EXPECT_EQ(others, 0u);
    EXPECT_EQ(b[at + plain.size() * stride + 15] & 0x1F, 1) << "the bird";
    EXPECT_EQ(b[at + (plain.size() + 1) * stride + 15] & 0x1F, 7) << "the well";
  }
}

// 66: a street over a road is a second surface, never a mean of both.
TEST(OddGeometry, RoadsAboveEachOtherAreTwoSurfaces) {
  const TempFolder folder;
  Cloud cloud = metres(BridgeScene::points(0, 0, 80'000));
  // A mobile scanner sees the road below, too.
  for (const auto& p : metres(BridgeScene::points(0, 0, 80'000, 2))) {
    const auto x = static_cast<std::int64_t>(p[0] * 1000), y = static_cast<std::int64_t>(p[1] * 1000);
    if (BridgeScene::on_deck(x, y)) cloud.push_back({p[0], p[1], BridgeScene::ground_mm(x) / 1000.0});
  }
  write_cloud(folder / "a.las", cloud);
  build(folder, "a.las", kLevels);
  const auto place = run_json({"query", folder / "map.btms", "--at", "60.5,60.5"});
  EXPECT_NEAR(place["z"].get<double>(), BridgeScene::ground_mm(60'500) / 1000.0, 0.3) << place;
  ASSERT_EQ(place["upper"].size(), 1u) << place;
  EXPECT_NEAR(place["upper"][0]["z"].get<double>(), BridgeScene::street_mm(60'500) / 1000.0, 0.2) << place;
}

// 67: feet that nobody declares are metres, and the report says how large that makes the map.
TEST(OddGeometry, TheExtentIsReported) {
  const TempFolder folder;
  write_cloud(folder / "a.las", moved(scene(), 500, -300));
  const auto extent = build(folder, "a.las", kFixed)["extent_m"];
  const std::array<double, 4> expected = {500, -300, 560, -240};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(extent[i].get<double>(), expected[i], 64);
  const Outcome text = run({"build", folder / "a.las", "-o", folder / "map.btms"});
  EXPECT_NE(text.out.find("extent"), std::string::npos) << text.out;
}

// 69 and 70: a cloud moved by a multiple of the coarsest resolution has the same heights bit for bit, across zero and
// at the coordinates of UTM, where a millimetre is the last digit but one of a double.
TEST(OddGeometry, HeightsMoveWithTheCloud) {
  const TempFolder folder;
  write_cloud(folder / "here.pcd", scene());
  for (const Words& method : kMethods) {
    build(folder, "here.pcd", method);
    const Contents here = contents(folder / "map.btms");
    ASSERT_GT(here.size(), 500u);
    for (const auto& [east, north] : {std::pair{-32, -32}, {499'968, 4'499'968}}) {
      write_cloud(folder / "there.las", moved(scene(), east, north));
      build(folder, "there.las", method);
      EXPECT_TRUE(contents(folder / "map.btms", east / 2, north / 2) == here) << east << " m east";
    }
  }
}

constexpr std::array<std::uint8_t, kTriangles> kMirrored = {kWest, kNorth, kEast, kSouth};

// 69: the mirrored cloud has the mirrored heights: floor, not truncation, on both sides of zero. Coarse to fine, sums
// of floats run from west to east, and of a node's lowest points of one height the same side's is taken.
TEST(OddGeometry, HeightsAreMirrored) {
  const TempFolder folder;
  Cloud cloud = scene();
  for (auto& p : cloud)  // off the borders, which belong to one side; 1 mm off the diagonals, too
    for (std::size_t axis = 0; axis < 2; ++axis)
      p[axis] = (std::floor(p[axis] * 1000 / 4) * 4 + (axis == 0 ? 1 : 2)) / 1000;
  write_cloud(folder / "here.pcd", cloud);
  for (auto& p : cloud) p[0] = -p[0];
  write_cloud(folder / "there.pcd", cloud);
  for (const Words& method : kMethods) {
    build(folder, "here.pcd", method);
    const Contents here = contents(folder / "map.btms");
    build(folder, "there.pcd", method);
    const Contents there = contents(folder / "map.btms");
    ASSERT_EQ(here.size(), there.size());
    std::int32_t most_mm = 0;
    for (const auto& [cell, content] : here) {
      const auto found = there.find({cell.first, -1 - cell.second});
      ASSERT_NE(found, there.end());
      Content back;
      for (std::uint8_t t = 0; t < kTriangles; ++t) {
        const std::uint8_t mirror = kMirrored[t];
        const auto [centre, first, second] = found->second.corners_mm[mirror];
        back.corners_mm[t] = {centre, second, first};
        EXPECT_EQ(found->second.nodes[mirror].count, content.nodes[t].count);
      }
      most_mm = std::max(most_mm, most_apart_mm(content, back));
    }
    EXPECT_LE(most_mm, method == kFixed ? 1 : 50);
  }
}

}  // namespace
}  // namespace btms::test
