#include "io/store/chunk_index.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <type_traits>

#include "io/files/read_file.h"
#include "io/store/chunk_codec.h"
#include "io/store/chunk_grid.h"
#include "io/store/hash.h"

namespace btms {
namespace {

constexpr std::uint64_t kMagic = 0x31786469'736d7462;  // "btmsidx1"

// The last bytes of a file. Before it lies the overview, before that are the places.
struct IndexEnd {
  std::uint64_t upper = 0, chunks = 0, places_xxh3 = 0;
  std::uint64_t overview_bytes = 0, overview_xxh3 = 0;
  std::uint64_t values_xxh3 = 0;  // of the shard this belongs to
  std::uint64_t xxh3 = 0;         // of the numbers before it
  std::uint64_t magic = kMagic;

  std::uint64_t own_hash() const {
    return xxh3_64({reinterpret_cast<const std::uint8_t*>(this), offsetof(IndexEnd, xxh3)});
  }
};
static_assert(std::has_unique_object_representations_v<ChunkPlace> &&
              std::has_unique_object_representations_v<IndexEnd>);

// Of the last bytes of a file, as many as are there.
std::optional<IndexEnd> end_of(std::span<const std::uint8_t> bytes) {
  IndexEnd end;
  if (bytes.size() < sizeof end) return {};
  std::memcpy(&end, bytes.data() + bytes.size() - sizeof end, sizeof end);
  if (end.magic != kMagic || end.xxh3 != end.own_hash()) return {};
  return end;
}

std::size_t chunks_across(std::size_t extent, std::size_t chunk) { return (extent + chunk - 1) / chunk; }

std::size_t chunk_count(const LayerInfo& layer, const CellBox& box, std::size_t upper) {
  if (layer.raster == Raster::kPerUpper && upper == 0) return 0;
  const LayerShape shape = layer_shape(layer, box, upper), chunk = chunk_shape(layer, box, upper);
  return chunks_across(shape.rows, chunk.rows) * chunks_across(shape.cols, chunk.cols);
}

// The end of a file, from its overview on, or from its places.
struct Tail {
  IndexEnd end;
  std::vector<std::uint8_t> bytes;
};

std::optional<Tail> read_tail(const IndexedFile& file, bool with_places) {
  constexpr std::uint64_t kGuess_bytes = 8192;  // enough for most shards
  const auto last = [&](std::uint64_t n) {
    return read_file_part(file.path, file.bytes, file.bytes - n, n, ErrorCode::kVerification);
  };
  std::vector<std::uint8_t> bytes = last(std::min(kGuess_bytes, file.bytes));
  const auto end = end_of(bytes);
  if (!end) return {};
  if (end->values_xxh3 != file.values_xxh3) damaged_shard("its index is of other values than the manifest's");
  std::uint64_t wanted = sizeof(IndexEnd), left = file.bytes - wanted;
  const auto add = [&](std::uint64_t n, std::uint64_t each) {
    if (n > left / each) damaged_shard("its index is longer than the file");
    wanted += n * each;
    left -= n * each;
  };
  add(end->overview_bytes, 1);
  if (with_places) add(end->chunks, sizeof(ChunkPlace));
  if (wanted > bytes.size()) bytes = last(wanted);
  bytes.erase(bytes.begin(), bytes.end() - static_cast<std::ptrdiff_t>(wanted));
  return Tail{*end, std::move(bytes)};
}

}  // namespace

void append_chunk_index(std::vector<std::uint8_t>& file, std::size_t upper, std::span<const ChunkPlace> places,
                        std::span<const std::uint8_t> overview, std::uint64_t values_xxh3) {
  const std::span bytes{reinterpret_cast<const std::uint8_t*>(places.data()), places.size_bytes()};
  IndexEnd end{upper, places.size(), xxh3_64(bytes), overview.size(), xxh3_64(overview), values_xxh3};
  end.xxh3 = end.own_hash();
  const auto* last = reinterpret_cast<const std::uint8_t*>(&end);
  file.insert(file.end(), bytes.begin(), bytes.end());
  file.insert(file.end(), overview.begin(), overview.end());
  file.insert(file.end(), last, last + sizeof end);
}

std::span<const std::uint8_t> overview_in(std::span<const std::uint8_t> file) {
  const auto end = end_of(file);
  if (!end || end->overview_bytes > file.size() - sizeof(IndexEnd)) return {};
  const std::span overview = file.subspan(file.size() - sizeof(IndexEnd) - end->overview_bytes, end->overview_bytes);
  return xxh3_64(overview) == end->overview_xxh3 ? overview : std::span<const std::uint8_t>();
}

std::optional<std::vector<std::uint8_t>> read_overview(const IndexedFile& file) {
  std::optional<Tail> tail = read_tail(file, false);
  if (!tail) return {};
  tail->bytes.resize(tail->bytes.size() - sizeof(IndexEnd));
  if (xxh3_64(tail->bytes) != tail->end.overview_xxh3) damaged_shard("its overview is damaged");
  return std::move(tail->bytes);
}

std::optional<std::vector<std::uint8_t>> read_chunk(const IndexedFile& file, const CellBox& box, const LayerInfo& layer,
                                                    std::size_t row0, std::size_t col0) {
  const std::optional<Tail> tail = read_tail(file, true);
  if (!tail) return {};
  const auto index = IndexedChunks::of_tail(tail->bytes, file.bytes, box);
  if (!index) damaged_shard("its index of chunks is damaged");
  const ChunkPlace at = index->place(layer, row0, col0);
  std::vector<std::uint8_t> stored =
      read_file_part(file.path, file.bytes, at.offset, at.bytes, ErrorCode::kVerification);
  if (!stored.empty() && !has_checksum(stored))
    damaged_shard("a chunk of layer " + dataset_name(layer) + " is damaged");
  return stored;
}

std::optional<IndexedChunks> IndexedChunks::of(std::span<const std::uint8_t> file, const CellBox& box) {
  auto index = of_tail(file, file.size(), box);
  if (index) index->file_ = file;
  return index;
}

std::optional<IndexedChunks> IndexedChunks::of_tail(std::span<const std::uint8_t> tail, std::uint64_t file_bytes,
                                                    const CellBox& box) {
  const auto found = end_of(tail);
  if (!found || found->upper > most_upper(box) || found->overview_bytes > tail.size() - sizeof(IndexEnd)) return {};
  const IndexEnd& end = *found;
  const std::size_t end_at = tail.size() - sizeof end - end.overview_bytes;

  IndexedChunks index({}, box);
  index.upper_ = end.upper;
  std::size_t chunks = 0;
  for (const LayerInfo& layer : layer_table()) {
    index.first_.push_back(chunks);
    chunks += chunk_count(layer, box, end.upper);
  }
  // The box is only the manifest's claim: how many there are is compared before memory is taken for them.
  if (end.chunks != chunks || chunks > end_at / sizeof(ChunkPlace)) return {};
  const std::size_t begin_at = end_at - chunks * sizeof(ChunkPlace);
  const std::span stored = tail.subspan(begin_at, chunks * sizeof(ChunkPlace));
  if (xxh3_64(stored) != end.places_xxh3) return {};
  index.places_.resize(chunks);
  std::memcpy(index.places_.data(), stored.data(), stored.size());
  const std::uint64_t begin = file_bytes - tail.size() + begin_at;
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
