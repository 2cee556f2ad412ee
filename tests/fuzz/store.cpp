// The parts of a map that are parsed without HDF5: manifest, chunks, the values of layers, journal, records.
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <string>

#include "engine/model/square_layers.h"
#include "engine/tiling/record.h"

#include "io/store/chunk_codec.h"
#include "io/store/hash.h"
#include "io/store/journal.h"
#include "io/store/layers.h"
#include "io/store/manifest.h"
#include "io/store/round_files.h"
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

// Readers of these files follow no links, so they are real ones.
void write_file(const std::filesystem::path& file, Bytes bytes) {
  std::ofstream out(file, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  require(out.good(), "a file in memory can be written");
}

// Every line of a journal begins with the hash of the rest.
std::string with_line_hashes(std::string text) {
  for (std::size_t at = 0, end; (end = text.find('\n', at)) != text.npos; at = end + 1)
    if (end - at >= 18) text.replace(at, 16, hex64(xxh3_64(bytes_of(text).subspan(at + 17, end - at - 17))));
  return text;
}

void read_journal(Bytes bytes) {
  const MapLayout layout{Lattice(2000), {64, {}}};
  write_file(folder() / kJournal, bytes);
  const auto found = read_journals(folder());
  if (!found) return;
  const auto shards = journaled_shards(*found, layout);
  require(shards.size() <= found->entries.size(), "every shard has a line");
  MapInfo info;
  info.layout = layout;
  const std::string own = build_identity(info);
  for (const auto& [a, b] : {std::pair(found->identity, own), std::pair(own, found->identity)})
    require(identity_difference(a, b).empty() == (a == b), "what differs has a name");
  Journal(folder(), 0, found->revision, found->identity).add(shards);
  const auto again = read_journals(folder());
  require(again && again->revision == found->revision && again->identity == found->identity &&
              again->entries.size() == found->entries.size() + shards.size(),
          "a journal goes on behind its sound lines");
}

// A file of records: what the index and the trailer can't guess, made right. 16 bytes steer: records' places.
std::vector<std::uint8_t> with_index(Bytes bytes) {
  Front front(bytes);
  std::vector<RoundFiles::Block> blocks(front.byte() % 4u);
  for (RoundFiles::Block& b : blocks) {
    b.tile = {front.byte() % 3, 0};
    b.offset = front.byte();
    b.stored_bytes = front.byte();
    b.bytes = std::uint64_t{front.byte()} << (front.byte() % 36);
  }
  const Bytes stored = front.rest();
  for (RoundFiles::Block& b : blocks)
    if (b.offset <= stored.size() && b.stored_bytes <= stored.size() - b.offset)
      b.xxh3 = xxh3_64(stored.subspan(b.offset, b.stored_bytes));
  std::vector<std::uint8_t> file(stored.begin(), stored.end());
  const auto append = [&](const void* from, std::size_t n) {
    const auto* p = static_cast<const std::uint8_t*>(from);
    file.insert(file.end(), p, p + n);
  };
  const Bytes index{reinterpret_cast<const std::uint8_t*>(blocks.data()), blocks.size() * sizeof blocks[0]};
  const std::uint64_t trailer[] = {blocks.size(), xxh3_64(index), 0x31646365'736d7462};
  append(index.data(), index.size());
  append(trailer, sizeof trailer);
  return file;
}

void read_rounds(Bytes bytes) {
  std::filesystem::create_directories(folder() / kRoundFolder);
  write_file(folder() / kRoundFolder / "n5.k0of1.r1", bytes);
  RoundFilesOptions options;
  options.resume = true;
  const RoundFiles files(folder(), options);
  for (const TileId tile : files.tiles(5)) {
    const auto record = files.load(5, tile);
    if (!record) continue;
    std::vector<std::uint32_t> words;
    std::vector<std::uint8_t> rest;
    const CellBox box = record_box(*record);
    if (unpack_record(record, box, words, rest))
      require(pack_record(box, words, rest) == *record, "a record comes back as it was stored");
  }
  damaged_round_files(folder(), 1, 1);
  newest_round_files(folder(), 1, 1);
}

}  // namespace

void journal(Bytes bytes) {
  read_journal(bytes);
  const std::string text = with_line_hashes({bytes.begin(), bytes.end()});
  read_journal(bytes_of(text));
}

void rounds(Bytes bytes) {
  read_rounds(bytes);
  read_rounds(with_index(bytes));
}

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
