#include "io/store/shard_overview.h"

#include <cstring>

#include "io/store/chunk_codec.h"
#include "io/store/stored_chunks.h"

namespace btms {
namespace {

constexpr std::size_t kMostDeflated = 1032;  // bytes from one

}  // namespace

ShardOverview::ShardOverview(const CellBox& box) : box_(box) {
  std::size_t n = 0;
  for (int level = kFirstOverview; level <= kMaxLevel; ++level) {
    first_.push_back(n);
    n += static_cast<std::size_t>(squares_sampled_in(box, level).cells()) * raster_layers().size();
  }
  first_.push_back(n);
}

ShardOverview::ShardOverview(const TerrainTile& tile) : ShardOverview(tile.box) {
  std::vector<const RasterLayer*> layers;
  for (const RasterLayer& layer : raster_layers()) layers.push_back(&layer);
  const TileSamples samples(tile, layers);
  values_.reserve(first_.back());
  for (int level = kFirstOverview; level <= kMaxLevel; ++level) {
    const CellBox squares = squares_sampled_in(box_, level);
    for (const RasterLayer* layer : layers)
      for (std::int32_t row = squares.row0; row < squares.row1; ++row)
        for (std::int32_t col = squares.col0; col < squares.col1; ++col)
          values_.push_back(samples.of(*layer, Cell{col, row}, level));
  }
}

ShardOverview::ShardOverview(const CellBox& box, std::span<const std::uint8_t> stored) : ShardOverview(box) {
  const std::size_t n = first_.back();
  if (stored.size() < n * sizeof(float) / kMostDeflated) damaged_shard("its overview is too short");
  values_.resize(n);
  if (n == 0 && stored.empty()) return;
  if (!ChunkDecoder().decode(stored, sizeof(float),
                             {reinterpret_cast<std::uint8_t*>(values_.data()), n * sizeof(float)}))
    damaged_shard("its overview is damaged");
}

std::vector<std::uint8_t> ShardOverview::stored() const {
  if (values_.empty()) return {};
  return ChunkEncoder().encode({reinterpret_cast<const std::uint8_t*>(values_.data()), values_.size() * sizeof(float)},
                               sizeof(float));
}

bool ShardOverview::is_same(const ShardOverview& other) const {
  return box_ == other.box_ && values_.size() == other.values_.size() &&
         (values_.empty() || std::memcmp(values_.data(), other.values_.data(), values_.size() * sizeof(float)) == 0);
}

float ShardOverview::at(std::size_t layer, Cell square, int level) const {
  const CellBox squares = squares_sampled_in(box_, level);
  const auto cols = static_cast<std::size_t>(squares.cols()), cells = static_cast<std::size_t>(squares.cells());
  return values_[first_[static_cast<std::size_t>(level - kFirstOverview)] + layer * cells +
                 static_cast<std::size_t>(square.row - squares.row0) * cols +
                 static_cast<std::size_t>(square.col - squares.col0)];
}

}  // namespace btms
