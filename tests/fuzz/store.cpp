// The parts of a map that are parsed without HDF5: manifest, chunks, the values of layers.
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <string>

#include "io/store/chunk_codec.h"
#include "io/store/hash.h"
#include "io/store/layers.h"
#include "io/store/manifest.h"
#include "io/store/upper_layers.h"
#include "tests/fuzz/fuzz.h"

namespace btms::fuzz {
namespace {

Bytes bytes_of(const std::string& text) { return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}; }

void parse(Bytes text) {
  accepted(
      [&] {
        const Manifest manifest = parse_manifest(text, "manifest.json");
        const std::string again = manifest_text(manifest);
        require(manifest_text(parse_manifest(bytes_of(again), "again")) == again,
                "a manifest that was written is read again as it is");
        for (const ShardEntry& shard : manifest.shards)
          require(shard.bounds().cells() <= kMaxShardCells && !shard.tiles.empty(), "a shard has a bearable size");
      },
      {ErrorCode::kBadInput, ErrorCode::kVerification});
  is_of_older_program(text);
}

// Where the digits behind "name":" start; npos where there are none.
std::size_t digits_of(const std::string& text, const std::string& name, std::size_t digits) {
  const std::size_t at = text.find("\"" + name + "\":\"");
  if (at == text.npos) return at;
  const std::size_t from = at + name.size() + 4;
  return from + digits <= text.size() ? from : text.npos;
}

// Hashes that a fuzzer can't guess, made right: of the parameters (the line they stand on), then of the whole.
std::string with_hashes(std::string text) {
  const std::string key = "\n\"parameters\":";
  if (const std::size_t from = text.find(key), to = text.find(",\n", from + 1); from != text.npos && to != text.npos)
    if (const std::size_t at = digits_of(text, "parameters_xxh3", 16); at != text.npos)
      text.replace(at, 16, hex64(xxh3_64(bytes_of(text).subspan(from + key.size(), to - from - key.size()))));
  if (const std::size_t at = digits_of(text, "xxh3", 16); at != text.npos)
    text.replace(at, 16, hex64(xxh3_64(bytes_of(text).subspan(at + 16))));
  return text;
}

// A small box from the front of the input.
CellBox small_box(Front& front) {
  const auto col = static_cast<std::int8_t>(front.byte()), row = static_cast<std::int8_t>(front.byte());
  const int cols = 1 + front.byte() % 9, rows = 1 + front.byte() % 9;
  return {col, row, col + cols, row + rows};
}

// `n` bytes: those of the input, repeated; zeros of an empty one.
std::vector<std::uint8_t> stretched(Bytes bytes, std::size_t n) {
  std::vector<std::uint8_t> out(n);
  for (std::size_t i = 0; i < n && !bytes.empty(); ++i) out[i] = bytes[i % bytes.size()];
  return out;
}

void one_raster(const LayerInfo& layer, const CellBox& box, Bytes bytes) {
  TerrainTile tile(1000, box);
  const auto values = stretched(bytes, layer_shape(layer, box, 0).elements() * element_bytes(layer.element));
  accepted(
      [&] {
        scatter(layer, values, tile);
        require(gather(layer, tile) == values, "a raster comes back as it was stored");
        for (const LayerInfo& gis : layer_table())
          if (!gis.in_tgf) gather(gis, tile);
      },
      {ErrorCode::kVerification});
}

void upper_lists(const CellBox& box, Bytes bytes) {
  constexpr std::size_t kEntry_bytes = 17;
  const std::size_t n = bytes.size() / kEntry_bytes;
  std::vector<ListedUpper> listed(n);
  std::size_t at = 0;
  for (const LayerInfo& layer : layer_table()) {
    if (layer.raster != Raster::kPerUpper || !layer.in_tgf) continue;
    const Bytes values = bytes.subspan(at * n, element_bytes(layer.element) * n);
    at += element_bytes(layer.element);
    if (layer.id == LayerId::kUpper && !are_sound_places(values, box)) return;
    scatter_upper(layer, values, listed);
    require(std::equal(values.begin(), values.end(), gather_upper(layer, listed).begin()), "a list comes back");
  }
  require(at == kEntry_bytes, "all layers of further surfaces were given values");
  const std::vector<ListedUpper> stored = listed;
  accepted(
      [&] {
        TerrainTile tile(1000, box);
        tile.upper = unlist_upper(std::move(listed), box);
        require(is_sound_list(tile.upper, box), "a list that was accepted is sound");
        require(list_upper(tile) == stored, "a list comes back as it was stored");
        upper_elevations_m(tile);
      },
      {ErrorCode::kVerification});
}

// Chunks of the engine against zlib, the library behind HDF5's own filter.
void decode_chunk(Bytes stream, std::size_t element, std::size_t bytes) {
  std::vector<std::uint8_t> stored(stream.begin(), stream.end());
  const std::uint32_t sum = fletcher32(stream);
  stored.resize(stored.size() + sizeof sum);
  std::memcpy(stored.data() + stream.size(), &sum, sizeof sum);
  std::vector<std::uint8_t> values(bytes), theirs(bytes);
  ChunkDecoder decoder;
  if (!decoder.decode(stored, element, values)) return;
  uLongf produced = theirs.size();
  require(::uncompress(theirs.data(), &produced, stream.data(), stream.size()) == Z_OK && produced == bytes,
          "what is accepted is a zlib stream of that length");
  if (element > 1) {
    const std::size_t n = bytes / element;
    std::vector<std::uint8_t> shuffled = theirs;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < element; ++k) theirs[i * element + k] = shuffled[k * n + i];
  }
  require(values == theirs, "a chunk has the values that zlib finds in it");
  stored[stream.size() / 2] ^= 1;
  require(!decoder.decode(stored, element, values), "a chunk with a flipped bit is refused");
}

void encode_chunk(Bytes values, std::size_t element) {
  const std::vector<std::uint8_t> stored = ChunkEncoder().encode(values, element);
  std::vector<std::uint8_t> back(values.size());
  require(ChunkDecoder().decode(stored, element, back), "an encoded chunk is accepted");
  require(std::equal(values.begin(), values.end(), back.begin()), "an encoded chunk comes back");
  decode_chunk(Bytes(stored).first(stored.size() - 4), element, values.size());
}

}  // namespace

void manifest(Bytes bytes) {
  parse(bytes);
  const std::string text = with_hashes({bytes.begin(), bytes.end()});
  parse(bytes_of(text));
  accepted([&] { parse_entries(bytes, {Lattice(2000), {64, {}}}); });
}

void chunk(Bytes bytes) {
  Front front(bytes);
  const std::uint8_t mode = front.byte();
  const std::size_t element = std::array<std::size_t, 3>{1, 2, 4}[mode % 3];
  const std::size_t values = (front.word() % 4096 + 1u) * element;
  if (mode < 128) return decode_chunk(front.rest(), element, values);
  encode_chunk(stretched(front.rest(), values), element);
}

void layers(Bytes bytes) {
  Front front(bytes);
  const std::uint8_t which = front.byte();
  const CellBox box = small_box(front);
  const auto table = layer_table();
  const LayerInfo& layer = table[which % table.size()];
  if (layer.raster == Raster::kPerUpper) return upper_lists(box, front.rest());
  if (layer.in_tgf) one_raster(layer, box, front.rest());
}

}  // namespace btms::fuzz
