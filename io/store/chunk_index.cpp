#include "io/store/chunk_index.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

#include "io/store/chunk_grid.h"
#include "io/store/hash.h"

namespace btms {
namespace {

constexpr std::uint64_t kMagic = 0x31786469'736d7462;  // "btmsidx1"

// The last bytes of a file.
struct IndexEnd {
  std::uint64_t upper = 0, chunks = 0, xxh3 = 0, magic = kMagic;  // the hash is of the places and the two before it
};
static_assert(std::has_unique_object_representations_v<ChunkPlace> &&
              std::has_unique_object_representations_v<IndexEnd>);

std::uint64_t hash_of(std::span<const std::uint8_t> places, const IndexEnd& end) {
  const std::uint64_t counts[] = {end.upper, end.chunks};
  return xxh3_64({reinterpret_cast<const std::uint8_t*>(counts), sizeof counts}, xxh3_64(places));
}

std::size_t chunks_across(std::size_t extent, std::size_t chunk) { return (extent + chunk - 1) / chunk; }

std::size_t chunk_count(const LayerInfo& layer, const CellBox& box, std::size_t upper) {
  if (layer.raster == Raster::kPerUpper && upper == 0) return 0;
  const LayerShape shape = layer_shape(layer, box, upper), chunk = chunk_shape(layer, box, upper);
  return chunks_across(shape.rows, chunk.rows) * chunks_across(shape.cols, chunk.cols);
}

}  // namespace

void append_chunk_index(std::vector<std::uint8_t>& file, std::size_t upper, std::span<const ChunkPlace> places) {
  const std::span bytes{reinterpret_cast<const std::uint8_t*>(places.data()), places.size_bytes()};
  IndexEnd end{upper, places.size()};
  end.xxh3 = hash_of(bytes, end);
  const auto* last = reinterpret_cast<const std::uint8_t*>(&end);
  file.insert(file.end(), bytes.begin(), bytes.end());
  file.insert(file.end(), last, last + sizeof end);
}

std::optional<IndexedChunks> IndexedChunks::of(std::span<const std::uint8_t> file, const CellBox& box) {
  IndexEnd end;
  if (file.size() < sizeof end) return {};
  const std::size_t end_at = file.size() - sizeof end;
  std::memcpy(&end, file.data() + end_at, sizeof end);
  if (end.magic != kMagic || end.upper > most_upper(box)) return {};

  IndexedChunks index(file, box);
  index.upper_ = end.upper;
  std::size_t chunks = 0;
  for (const LayerInfo& layer : layer_table()) {
    index.first_.push_back(chunks);
    chunks += chunk_count(layer, box, end.upper);
  }
  // The box is only the manifest's claim: how many there are is compared before memory is taken for them.
  if (end.chunks != chunks || chunks > end_at / sizeof(ChunkPlace)) return {};
  const std::size_t begin = end_at - chunks * sizeof(ChunkPlace);
  const std::span stored = file.subspan(begin, chunks * sizeof(ChunkPlace));
  if (hash_of(stored, end) != end.xxh3) return {};
  index.places_.resize(chunks);
  std::memcpy(index.places_.data(), stored.data(), stored.size());
  const auto beyond = [begin](const ChunkPlace& p) { return p.offset > begin || p.bytes > begin - p.offset; };
  if (std::any_of(index.places_.begin(), index.places_.end(), beyond)) return {};
  return index;
}

ChunkPlace IndexedChunks::place(const LayerInfo& layer, std::size_t row0, std::size_t col0) const {
  const auto which = static_cast<std::size_t>(&layer - layer_table().data());
  const LayerShape shape = layer_shape(layer, box_, upper_), chunk = chunk_shape(layer, box_, upper_);
  return places_[first_[which] + row0 / chunk.rows * chunks_across(shape.cols, chunk.cols) + col0 / chunk.cols];
}

std::span<const std::uint8_t> IndexedChunks::chunk(const LayerInfo& layer, std::size_t row0, std::size_t col0) {
  const ChunkPlace at = place(layer, row0, col0);
  return file_.subspan(at.offset, at.bytes);
}

}  // namespace btms
