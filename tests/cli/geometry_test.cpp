// Odd geometry through every format that can express it, by both methods (docs/malformed_inputs.md, 55 to 70).
#include <cmath>
#include <optional>
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
const std::vector<Words> kWays = {{"--tile-cells", "1"}, {"--tile-cells", "whole"}, {"--executor", "ranks:2"}};

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
       made(41 * 41,
            [](int i) {
              return std::array{i % 41 - 20.0, i / 41 - 20.0, 1.0};
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

// One map, whatever the format, the tiles and the ranks.
TEST(OddGeometry, HasOneMap) {
  for (const Odd& odd : odd_clouds()) {
    SCOPED_TRACE(std::to_string(odd.number) + " " + odd.name);
    const TempFolder folder;
    for (const Words& method : kMethods) {
      SCOPED_TRACE(method[1]);
      std::set<std::string> digests;
      nlohmann::json built;
      for (const std::string& format : odd.formats) {
        write_cloud(folder / ("a" + format), odd.cloud);
        built = build(folder, "a" + format, method);
        digests.insert(built["digest"]);
        EXPECT_EQ(built["dropped"],
                  nlohmann::json(
                      {{"not_finite", odd.dropped[0]}, {"out_of_range", odd.dropped[1]}, {"strays", odd.dropped[2]}}));
        EXPECT_EQ(built["points"],
                  odd.cloud.size() - static_cast<unsigned>(odd.dropped[0] + odd.dropped[1] + odd.dropped[2]));
      }
      const std::string file = "a" + odd.formats[0];
      for (const Words& way : kWays) digests.insert(build(folder, file, method, way)["digest"]);
      if (odd.same) {
        write_cloud(folder / "same.pcd", *odd.same);
        digests.insert(build(folder, "same.pcd", method)["digest"]);
      }
      EXPECT_EQ(digests.size(), 1u);
      if (&method == &kMethods[0]) EXPECT_EQ(built["nodes"]["observed"] > 0, odd.plane) << built["nodes"];
    }
  }
}

// What is in a cell of a map.
struct Content {
  std::array<std::int32_t, 5> z_mm;  // centre, then corners row by row from the south-west
  std::array<NodeSurface, kTriangles> nodes;
  friend bool operator==(const Content&, const Content&) = default;
};

using Contents = std::map<std::pair<std::int32_t, std::int32_t>, Content>;  // by row and column

// Cells with anything in them, moved back by `cells`.
Contents contents(const std::string& map, std::int32_t east_cells = 0, std::int32_t north_cells = 0) {
  Contents all;
  const auto reader = MapReader::open(map);
  for (const TileId id : reader->tiles()) {
    const auto tile = reader->load(id);
    for (std::int32_t row = tile->box.row0; row < tile->box.row1; ++row)
      for (std::int32_t col = tile->box.col0; col < tile->box.col1; ++col) {
        const auto corner = [&](std::int32_t c, std::int32_t r) { return tile->corner_mm[tile->corner_index({c, r})]; };
        Content content{{tile->centre_mm[tile->cell_index({col, row})], corner(col, row), corner(col + 1, row),
                         corner(col, row + 1), corner(col + 1, row + 1)},
                        {}};
        for (std::uint8_t t = 0; t < kTriangles; ++t) content.nodes[t] = tile->nodes[tile->node_index({{col, row}, t})];
        if (!(content.nodes == std::array<NodeSurface, kTriangles>{}))
          all[{row - north_cells, col - east_cells}] = content;
      }
  }
  return all;
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
    for (const auto& [cell, content] : one)
      for (std::size_t i = 0; i < 5; ++i) most_mm = std::max(most_mm, std::abs(content.z_mm[i] - all.at(cell).z_mm[i]));
    EXPECT_LE(most_mm, &method == &kMethods[0] ? 0 : 20) << method[1];
  }
}

// 63: the sums of 10 million points at 100 km of height do not overflow.
TEST(OddGeometry, ANodeHoldsTenMillionPoints) {
  const TempFolder folder;
  const Cloud some = made(1000, [](int i) {  // all in one triangle, on a plane
    const int x = i % 32, y = i / 32;
    return std::array{0.75 + x / 64.0, y / 128.0, 100'000 + x / 64.0};
  });
  write_cloud(folder / "some.bin", some);
  const std::string bytes = read_text(folder / "some.bin");
  {
    std::ofstream file(folder / "many.bin", std::ios::binary);
    for (int i = 0; i < 10'000; ++i) file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  for (const Words& method : kMethods) {
    EXPECT_EQ(build(folder, "many.bin", method)["points"], 10'000'000);
    const auto place = run_json({"query", folder / "map.btms", "--at", "1,0.125"});
    EXPECT_NEAR(place["z"].get<double>(), 100'000.25, 0.15) << place;
    EXPECT_NE(place["state"], "unknown");
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
  write_cloud(folder / "a.pcd", made(200'000, [&](int) {
                const auto any = [&] { return static_cast<double>(random.between(-10'000'000, 10'000'000)); };
                return std::array{any(), any(), 1.0};
              }));
  const std::uint64_t base = run({"--version"}).peak_rss_bytes;
  for (const Words& method : kMethods) {
    Words call = {"build", folder / "a.pcd", "-o", folder / "map.btms"};
    call.insert(call.end(), method.begin(), method.end());
    const Outcome outcome = run(call);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    for (const char* words : {"--max-nodes", "furthest out are near x = "})
      EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_EQ(names_in(folder.path()), Words{"a.pcd"});
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    EXPECT_LT(outcome.cpu_seconds, 1);
    EXPECT_LE(outcome.peak_rss_bytes, base + 2 * fs::file_size(folder / "a.pcd") + (64 << 20));
#endif
  }
}

// 65: birds, and echoes from below. Nothing changes but their own labels.
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
    for (const auto& [cell, content] : before) {
      const bool hit = cell == std::pair{10, 10} || cell == std::pair{15, 20};
      if (!hit) EXPECT_TRUE(after.at(cell) == content) << "row " << cell.first << ", column " << cell.second;
    }
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

// 69: the mirrored cloud has the mirrored heights: floor, not truncation, on both sides of zero.
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
    std::size_t wrong = 0;
    for (const auto& [cell, content] : here) {
      const auto mirrored = there.find({cell.first, -1 - cell.second});
      ASSERT_NE(mirrored, there.end());
      const auto& z = mirrored->second.z_mm;
      const std::array<std::int32_t, 5> back = {z[0], z[2], z[1], z[4], z[3]};
      for (std::size_t i = 0; i < 5; ++i) wrong += std::abs(back[i] - content.z_mm[i]) > 1;
    }
    EXPECT_EQ(wrong, 0u) << method[1];
  }
}

}  // namespace
}  // namespace btms::test
