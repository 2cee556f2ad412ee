#include "engine/tiling/touched.h"

#include <xxhash.h>

#include <algorithm>
#include <cstdlib>
#include <mutex>
#include <tuple>

#include "engine/model/digest.h"

namespace btms {
namespace {

// What the points of a bin are: the sum of their hashes, whatever their order.
struct BinPrint {
  BinId bin;
  std::uint64_t points = 0;
  std::uint64_t low = 0, high = 0;

  void add(std::uint32_t node, std::int16_t x_mm, std::int16_t y_mm, std::int32_t z_mm) {
    struct {
      std::uint32_t node;
      std::int32_t z_mm;
      std::int16_t x_mm, y_mm;
    } const point{node, z_mm, x_mm, y_mm};
    const XXH128_hash_t hash = XXH3_128bits(&point, sizeof point);
    low += hash.low64;
    high += hash.high64;  // carries are not needed: two sums of 64 bits
    ++points;
  }
  bool same(const BinPrint& o) const { return points == o.points && low == o.low && high == o.high; }
};
bool before(const BinPrint& a, const BinPrint& b) {
  return std::tie(a.bin.by, a.bin.bx) < std::tie(b.bin.by, b.bin.bx);
}

}  // namespace

Changes touched_cells(const PassContext& context, const OrderedPoints& points, Records& records) {
  if (!records.keep()) return Changes::everywhere(context.table);
  const int number = record_number(0, Step::kPoints);
  const auto& tiles = context.table.tiles();
  std::vector<std::vector<BinPrint>> prints(tiles.size());
  std::mutex mutex;
  points.for_each_bin("compare", context.threads, context.progress, nullptr,
                      [&](std::size_t i, BinId id, const OrderedPoints::Bin& bin, int) {
                        BinPrint print{id};
                        std::uint32_t at = 0;
                        for (std::uint32_t node = 0; node < bin.end.size(); ++node)
                          for (; at < bin.end[node]; ++at) print.add(node, bin.x_mm[at], bin.y_mm[at], bin.z_mm[at]);
                        const std::lock_guard lock(mutex);
                        prints[i].push_back(print);
                      });
  Changes out(tiles.size());
  TileSet unknown(tiles.size());
  context.for_each_tile("compare", {}, [&](std::size_t i, int) {
    std::vector<BinPrint>& now = prints[i];
    std::sort(now.begin(), now.end(), before);
    std::vector<BinPrint> then;
    if (!records.follow() || !records.load(number, tiles[i].id, tiles[i].box, then)) {
      out.boxes[i] = tiles[i].box;
      unknown[i] = records.follow();
    } else {
      const auto touch = [&](const BinPrint& p) {
        out.boxes[i] = out.boxes[i].hull({p.bin.bx, p.bin.by, p.bin.bx + 1, p.bin.by + 1});
      };
      auto a = now.begin();
      auto b = then.begin();
      while (a != now.end() || b != then.end()) {
        if (b == then.end() || (a != now.end() && before(*a, *b)))
          touch(*a++);
        else if (a == now.end() || before(*b, *a))
          touch(*b++);
        else if (!(a++)->same(*b++))
          touch(*(a - 1));
      }
    }
    if (!out.boxes[i].empty()) records.save(number, tiles[i].id, tiles[i].box, now);
  });
  for (std::size_t i = 0; i < unknown.size(); ++i)
    if (unknown[i]) records.forget(tiles[i].id);
  if (records.follow())
    for (const TileId id : records.memory()->tiles(number)) {
      const std::int32_t i = context.table.index_of(id);
      const auto record = records.memory()->load(number, id);
      constexpr std::int32_t kMost = 1 << 24;  // of cells of the coarsest level, in either direction
      const CellBox box = record ? record_box(*record) : CellBox{};
      if (!record || std::max(std::abs(box.col0), std::abs(box.col1)) > kMost ||
          std::max(std::abs(box.row0), std::abs(box.row1)) > kMost)
        throw Error(ErrorCode::kVerification,
                    "what the map remembers of its points is damaged: build the map anew, without --update");
      if (i >= 0 && box == tiles[static_cast<std::size_t>(i)].box) continue;
      out.gone.push_back(box);
      // An empty record: there is no such tile any more.
      if (i < 0 && !box.empty() && context.ranks.rank() == 0) records.memory()->save(number, id, {});
    }
  records.finish(number);
  out.share(context.ranks);
  return out;
}

}  // namespace btms
