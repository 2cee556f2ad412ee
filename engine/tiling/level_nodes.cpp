#include "engine/tiling/level_nodes.h"

#include <cstring>

namespace btms {
namespace {

std::vector<LevelNode> inner(const TileField<LevelNode>& nodes) {
  std::vector<LevelNode> out;
  out.reserve(static_cast<std::size_t>(nodes.interior().cells()) * kTriangles);
  for_each_inner(nodes, [&](std::size_t at, std::size_t, Cell) {
    out.insert(out.end(), nodes.values().begin() + static_cast<std::ptrdiff_t>(at),
               nodes.values().begin() + static_cast<std::ptrdiff_t>(at + kTriangles));
  });
  return out;
}

}  // namespace

LevelNodes::LevelNodes(const PassContext& context, const Records& records, std::int32_t halo)
    : fields(context.pager, context.table.tiles().size()),
      context_(context),
      records_(records),
      halo_(halo),
      here_(context.table.tiles().size()),
      rejected_before_(context.table.tiles().size()) {}

void LevelNodes::begin(int round, const TileSet& fit, TileSet& created) {
  round_ = round;
  judged_ = false;
  created.assign(here_.size(), 0);
  for (std::size_t i = 0; i < here_.size(); ++i) {
    rejected_before_[i].clear();
    if (here_[i] && !fit[i]) fields.drop(i);
    created[i] = fit[i] && !here_[i];
  }
  here_ = fit;
}

void LevelNodes::create(std::size_t i) { fields[i] = TileField<LevelNode>(context_.table.tiles()[i].box, halo_); }

void LevelNodes::fetch(std::size_t i) {
  const Tile& tile = context_.table.tiles()[i];
  std::vector<LevelNode> kept;
  records_.recall(record_number(round_, Step::kNodes), tile.id, tile.box, kept);
  std::vector<NodeKey> ids;
  std::vector<std::uint8_t> verdicts;
  records_.recall(record_number(round_, Step::kVerdicts), tile.id, tile.box, ids, verdicts, rejected_before_[i]);
  create(i);
  records_.require(kept.size() == static_cast<std::size_t>(tile.box.cells()) * kTriangles &&
                       rejected_before_[i].size() == kept.size(),
                   tile.id);
  for_each_inner(fields[i], [&](std::size_t at, std::size_t k, Cell) {
    std::copy_n(kept.begin() + static_cast<std::ptrdiff_t>(k), kTriangles,
                fields[i].values().begin() + static_cast<std::ptrdiff_t>(at));
  });
  if (judged_) apply_record(i);
}

void LevelNodes::apply_record(std::size_t i) {
  for_each_inner(fields[i], [&](std::size_t at, std::size_t k, Cell) {
    for (std::size_t t = 0; t < kTriangles; ++t)
      if (rejected_before_[i][k + t]) fields[i].values()[at + t].level_class = LevelClass::kRejected;
  });
}

void LevelNodes::need(const TileSet& tiles) {
  TileSet missing(here_.size());
  for (std::size_t i = 0; i < here_.size(); ++i) missing[i] = tiles[i] && !here_[i];
  if (count(missing) == 0) return;
  context_.on(missing).for_each_tile("recall", {writes(fields)}, [&](std::size_t i, int) { fetch(i); });
  add(here_, missing);
}

Changes LevelNodes::fitted(const TileSet& fit) {
  const int number = record_number(round_, Step::kNodes);
  const auto& tiles = context_.table.tiles();
  Changes changes(tiles.size());
  if (!records_.follow() && !records_.keep()) return Changes::everywhere(context_.table);
  context_.on(fit).for_each_tile("compare", {reads(fields)}, [&](std::size_t i, int) {
    const CellBox& box = tiles[i].box;
    const std::vector<LevelNode> now = inner(fields[i]);
    std::vector<LevelNode> before;
    std::vector<NodeKey> ids;
    std::vector<std::uint8_t> verdicts;
    if (records_.follow() && records_.load(number, tiles[i].id, box, before) && before.size() == now.size() &&
        records_.load(record_number(round_, Step::kVerdicts), tiles[i].id, box, ids, verdicts, rejected_before_[i]) &&
        rejected_before_[i].size() == now.size()) {
      for_each_inner(fields[i], [&](std::size_t, std::size_t k, Cell c) {
        if (std::memcmp(&now[k], &before[k], kTriangles * sizeof(LevelNode)) != 0)
          changes.boxes[i] = changes.boxes[i].hull({c.col, c.row, c.col + 1, c.row + 1});
      });
    } else {
      rejected_before_[i].clear();
      changes.boxes[i] = box;
    }
    if (!changes.boxes[i].empty()) records_.save(number, tiles[i].id, box, now);
  });
  records_.finish(number);
  changes.share(context_.ranks);
  return changes;
}

void LevelNodes::judged(const TileSet& judged) {
  judged_ = true;
  if (!records_.follow()) return;
  TileSet known(here_.size());
  for (std::size_t i = 0; i < here_.size(); ++i) known[i] = here_[i] && !judged[i];
  context_.on(known).for_each_tile("verdict", {writes(fields)}, [&](std::size_t i, int) { apply_record(i); });
}

}  // namespace btms
