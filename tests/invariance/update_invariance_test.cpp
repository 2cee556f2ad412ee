// A build that follows another equals a build of all points from nothing, bit for bit, and works on no tile that the
// halos of its rounds, and verdicts that have changed, don't reach.
#include <gtest/gtest.h>

#include <map>
#include <mutex>

#include "engine/tiling/build.h"
#include "tests/invariance/invariance.h"

namespace btms::test {
namespace {

using Cloud = std::vector<CloudPoint>;

class RememberedRounds final : public RoundMemory {
 public:
  bool following = false;

  bool follows() const override { return following; }
  bool interrupted_after(int number) const override { return !following && finished_.contains(number); }
  bool keeps_all() const override { return keeping; }
  bool time_to_save() const override { return true; }
  std::vector<TileId> tiles(int number) const override {
    std::vector<TileId> out;
    for (const auto& entry : records_)
      if (entry.first.first == number) out.push_back(entry.first.second);
    return out;
  }
  std::optional<std::vector<std::uint8_t>> load(int number, TileId tile) const override {
    const std::lock_guard lock(mutex_);
    const auto it = records_.find({number, tile});
    if (it == records_.end()) return {};
    return it->second;
  }
  void save(int number, TileId tile, std::vector<std::uint8_t>&& record) override {
    const std::lock_guard lock(mutex_);
    EXPECT_TRUE(fresh_.emplace(std::pair(number, tile), std::move(record)).second) << "saved twice";
  }
  void finish(int number) override {
    const std::lock_guard lock(mutex_);
    finished_.insert({number, true});
    if (!following)  // an interrupted build finds them again
      for (const auto& entry : fresh_)
        if (entry.first.first == number) records_[entry.first] = entry.second;
  }
  // The map is published.
  void publish() {
    for (auto& [key, record] : fresh_) records_[key] = std::move(record);
    fresh_.clear();
    finished_.clear();
    following = true;
  }
  bool keeping = true;

 private:
  mutable std::mutex mutex_;
  std::map<std::pair<int, TileId>, std::vector<std::uint8_t>> records_, fresh_;
  std::map<int, bool> finished_;
};

// A map that is kept up to date.
struct Kept {
  Parameters parameters;
  std::int32_t tile_cells;
  RememberedRounds rounds;
  MemoryMap map;
  BuildSummary summary;

  void build(const Cloud& points, const Threads& threads) {
    const CloudSource source(points);
    const PointSource* sources[] = {&source};
    BuildOptions options;
    options.parameters = parameters;
    options.tile_cells = tile_cells;
    options.memory = &rounds;
    options.before = rounds.following ? &map : nullptr;
    Progress progress;
    MemoryMap next;
    summary = build_map(
        sources, options, threads, *single_rank(),
        [&](const MapLayout& layout) -> TileSink& { return next = MemoryMap(layout); }, progress);
    map = std::move(next);
    rounds.publish();
  }
};

void expect_equal_maps(const MemoryMap& a, const MemoryMap& b) {
  ASSERT_EQ(a.tiles(), b.tiles());
  for (const TileId id : a.tiles())
    EXPECT_EQ(digest(*a.load(id)).hex(), digest(*b.load(id)).hex()) << id.tx << "," << id.ty;
}

struct Edit {
  const char* name;
  std::function<void(Cloud&)> apply;
};

Cloud without(const Cloud& points, std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1) {
  Cloud out;
  for (const CloudPoint& p : points)
    if (p.x_mm < x0 || p.x_mm >= x1 || p.y_mm < y0 || p.y_mm >= y1) out.push_back(p);
  return out;
}

void follow_edits(const Parameters& parameters, Cloud points, std::int32_t tile_cells, const std::vector<Edit>& edits) {
  const auto threads = tbb_threads(2);
  Kept kept{parameters, tile_cells, {}, {}, {}};
  kept.build(points, *threads);
  expect_equal_maps(kept.map, build_plain(points, parameters, tile_cells));
  for (const Edit& edit : edits) {
    SCOPED_TRACE(edit.name);
    edit.apply(points);
    kept.build(points, *threads);
    expect_equal_maps(kept.map, build_plain(points, parameters, tile_cells));
    const BuildSummary& s = kept.summary;
    EXPECT_LE(s.tiles_recomputed, s.tiles_in_reach);
    EXPECT_LE(s.tiles_renewed, s.tiles_recomputed + s.tiles);
    std::cout << edit.name << ": " << s.tiles_recomputed << " of " << s.tiles << " tiles worked on, "
              << s.tiles_in_reach << " in reach, " << s.tiles_renewed << " renewed\n";
  }
}

Parameters levels_of_city(int levels) {
  Parameters p = preset("city");
  p.levels = levels;
  return p;
}

const std::vector<Edit>& small_edits() {
  static const std::vector<Edit> edits{
      {"nothing", [](Cloud&) {}},
      {"one point more",
       [](Cloud& c) {
         c.push_back({c[0].x_mm + 100'000, c[0].y_mm, c[0].z_mm});
       }},
      {"one point less", [](Cloud& c) { c.pop_back(); }},
      {"another order", [](Cloud& c) { std::reverse(c.begin(), c.end()); }},
      {"a ditch",
       [](Cloud& c) {
         for (CloudPoint& p : c)
           if (p.x_mm - c[0].x_mm / 1'000'000 * 1'000'000 > 0 && p.y_mm % 200'000 < 9'000) p.z_mm -= 1'500;
       }},
  };
  return edits;
}

TEST(UpdateInvariance, OfAHardSceneEditByEdit) {
  constexpr std::int64_t x = 352'123'456, y = 5'744'987'654, size = 200'000;
  std::vector<Edit> edits = small_edits();
  edits.push_back({"a corner goes", [](Cloud& c) { c = without(c, x, y, x + 45'000, y + 60'000); }});
  edits.push_back({"and comes back otherwise", [](Cloud& c) {
                     for (const CloudPoint& p : hard_scene(x, y, 60'000, 6'000, 7)) c.push_back(p);
                   }});
  edits.push_back({"the map grows", [](Cloud& c) {
                     for (const CloudPoint& p : hard_scene(x + size, y + 30'000, 60'000, 6'000, 9)) c.push_back(p);
                   }});
  edits.push_back({"a far island", [](Cloud& c) {
                     for (const CloudPoint& p : hard_scene(x + 3 * size, y, 30'000, 3'000, 9)) c.push_back(p);
                   }});
  edits.push_back({"which goes again", [](Cloud& c) { c = without(c, x + 2 * size, y, x + 4 * size, y + size); }});
  Cloud kept_back;
  edits.push_back({"a part goes", [&](Cloud& c) {
                     kept_back = c;
                     c = without(c, x + 140'000, y + 120'000, x + size, y + size);
                   }});
  edits.push_back({"and is back as it was", [&](Cloud& c) { c = kept_back; }});
  edits.push_back({"a roof", [](Cloud& c) {
                     for (CloudPoint& p : c)
                       if (p.x_mm > x + 100'000 && p.x_mm < x + 130'000 && p.y_mm > y + 90'000 && p.y_mm < y + 112'000)
                         p.z_mm = 14'000;
                   }});
  follow_edits(levels_of_city(4), hard_scene(x, y, size, 60'000), 1, edits);
}

// Where a bridge comes and goes, what it joins is judged anew, however far it reaches.
TEST(UpdateInvariance, OfBridges) {
  constexpr std::int64_t x = 352'123'456, y = 5'744'983'154;
  const Cloud all = BridgeScene::points(x, y, 80'000);
  Cloud without_deck;
  for (CloudPoint p : all) {
    if (BridgeScene::on_deck(p.x_mm - x, p.y_mm - y)) p.z_mm = BridgeScene::ground_mm(p.x_mm - x);
    without_deck.push_back(p);
  }
  Cloud half;
  for (std::size_t i = 0; i < all.size(); ++i) half.push_back(all[i].y_mm - y < 61'000 ? all[i] : without_deck[i]);
  for (const std::int32_t tile : {1, 3})
    follow_edits(levels_of_city(4), without_deck, tile,
                 {{"a bridge comes", [&](Cloud& c) { c = all; }},
                  {"half of it goes", [&](Cloud& c) { c = half; }},
                  {"the rest goes", [&](Cloud& c) { c = without_deck; }}});
}

// 0.5 m apart, rising from z0 to z1 along x.
void add_plane(Cloud& c, std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1, std::int64_t z0,
               std::int64_t z1) {
  for (std::int64_t y = y0 + 100; y < y1; y += 500)
    for (std::int64_t x = x0 + 100; x < x1; x += 500)
      c.push_back({x, y, static_cast<std::int32_t>(z0 + (z1 - z0) * (x - x0) / (x1 - x0))});
}

// Nodes beyond x with a state, or a further surface of a kind.
std::size_t observed_beyond(const MemoryMap& map, std::int64_t x_mm) {
  std::size_t n = 0;
  for (const TileId id : map.tiles()) {
    const auto tile = map.load(id);
    for (std::int32_t row = tile->box.row0; row < tile->box.row1; ++row)
      for (std::int32_t col =
               static_cast<std::int32_t>(std::max<std::int64_t>(tile->box.col0, x_mm / tile->resolution_mm));
           col < tile->box.col1; ++col)
        for (std::uint8_t t = 0; t < kTriangles; ++t)
          n += tile->nodes[tile->node_index({{col, row}, t})].state == NodeState::kObserved;
  }
  return n;
}
std::size_t reachable(const MemoryMap& map) {
  std::size_t n = 0;
  for (const TileId id : map.tiles())
    for (const UpperNode& u : map.load(id)->upper) n += u.kind == UpperKind::kReachable;
  return n;
}

// A plateau with a wall towards the only ground beside it is no terrain; a ramp at its end makes all of it terrain.
TEST(UpdateInvariance, OfAPlateauThatARampJoinsToTheGround) {
  Cloud ground, plateau;  // the ground is the larger one: beside a pit nothing is a roof
  add_plane(ground, 0, -100'000, 60'000, 0, 0, 0);
  add_plane(ground, 0, 24'000, 60'000, 124'000, 0, 0);
  add_plane(plateau, 60'000, 0, 320'000, 24'000, 6'000, 6'000);
  plateau.insert(plateau.end(), ground.begin(), ground.end());
  Cloud walled = plateau, joined = plateau;
  add_plane(walled, 0, 0, 60'000, 24'000, 0, 0);
  add_plane(joined, 0, 0, 30'000, 24'000, 0, 0);
  add_plane(joined, 30'000, 0, 60'000, 24'000, 0, 6'000);
  const Parameters p = levels_of_city(4);
  ASSERT_NE(observed_beyond(build_plain(walled, p, 1), 200'000), observed_beyond(build_plain(joined, p, 1), 200'000))
      << "the verdict on the far end of the plateau should change";
  for (const std::int32_t tile : {1, 3})
    follow_edits(p, walled, tile,
                 {{"a ramp", [&](Cloud& c) { c = joined; }}, {"a wall", [&](Cloud& c) { c = walled; }}});
}

// The ends of a bridge decide about its middle.
TEST(UpdateInvariance, OfABridgeThatGetsItsEnds) {
  Cloud valley;
  add_plane(valley, 0, 0, 100'000, 90'000, 6'000, 6'000);
  add_plane(valley, 100'000, 30'000, 109'000, 60'000, 6'000, 0);
  add_plane(valley, 100'000, 60'000, 130'000, 90'000, 6'000, 0);
  add_plane(valley, 109'000, 30'000, 391'000, 60'000, 0, 0);
  add_plane(valley, 130'000, 60'000, 370'000, 90'000, 0, 0);
  add_plane(valley, 391'000, 30'000, 400'000, 60'000, 0, 6'000);
  add_plane(valley, 370'000, 60'000, 400'000, 90'000, 0, 6'000);
  add_plane(valley, 400'000, 0, 500'000, 90'000, 6'000, 6'000);
  add_plane(valley, 120'000, 39'000, 380'000, 51'000, 6'000, 6'000);
  Cloud ended = valley;
  add_plane(ended, 99'000, 39'000, 120'000, 51'000, 6'000, 6'000);
  add_plane(ended, 380'000, 39'000, 401'000, 51'000, 6'000, 6'000);
  const Parameters p = levels_of_city(4);
  ASSERT_EQ(reachable(build_plain(valley, p, 1)), 0u);
  ASSERT_GT(reachable(build_plain(ended, p, 1)), 500u);
  for (const std::int32_t tile : {1, 3})
    follow_edits(p, valley, tile,
                 {{"both ends", [&](Cloud& c) { c = ended; }}, {"no ends", [&](Cloud& c) { c = valley; }}});
}

TEST(UpdateInvariance, OfAScannersMap) {
  Parameters p = preset("partial-map");
  p.resolution_m = 0.2;
  p.vehicle_width_m = 0.5;
  follow_edits(p, hard_scene(-4'000, -5'000, 24'000, 40'000), 2,
               {{"nothing", [](Cloud&) {}},
                {"a hole", [](Cloud& c) { c = without(c, 2'000, 2'000, 5'000, 4'000); }},
                {"a box", [](Cloud& c) {
                   for (CloudPoint& q : c)
                     if (q.x_mm > 10'000 && q.x_mm < 11'000 && q.y_mm > 9'000 && q.y_mm < 10'500) q.z_mm += 900;
                 }}});
}

}  // namespace
}  // namespace btms::test
