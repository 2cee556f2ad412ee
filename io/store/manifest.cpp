#include "io/store/manifest.h"

#include <algorithm>
#include <limits>
#include <string_view>

#include "engine/error.h"
#include "io/store/cf_file.h"
#include "io/store/chunk_codec.h"
#include "io/store/hash.h"
#include "io/store/json_field.h"

namespace btms {
namespace {

constexpr std::int64_t kMaxInt64 = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kMaxIndex = kCellBias;  // of cells and tiles
constexpr std::int64_t kMaxShard_bytes = std::int64_t{1} << 40;
constexpr char kFormat[] = "btms-map";
// The file starts with its own hash, of all bytes after this prefix.
constexpr char kHashPrefix[] = "{\"xxh3\":\"";
constexpr std::size_t kHashedFrom = sizeof kHashPrefix - 1 + 16;

[[noreturn]] void bad(const std::string& why) { throw Error(ErrorCode::kBadInput, why); }

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

Json parameters_json(const Parameters& p) {
  Json out = Json::object();
  for (const ParameterInfo& info : parameter_table()) out[std::string(info.name)] = parameter_text(p, info);
  return out;
}

Parameters parse_parameters(const Json& object) {
  if (!object.is_object()) bad("\"parameters\" is no object");
  Parameters p;
  for (const auto& [name, value] : object.items()) {
    if (!value.is_string()) bad("parameter \"" + name + "\" is no text");
    set_parameter(p, name, value.get<std::string>());
  }
  if (object.size() != parameter_table().size()) bad("\"parameters\" has not all parameters");
  return p;
}

std::int32_t index(const Json& array, std::size_t i, const char* name) {
  return static_cast<std::int32_t>(integer(array[i], name, -kMaxIndex, kMaxIndex));
}

TileId parse_id(const Json& array, const char* name) {
  if (!array.is_array() || array.size() < 2) bad(std::string("\"") + name + "\" is no tile");
  return {index(array, 0, name), index(array, 1, name)};
}

TileEntry parse_tile(const Json& array, const MapLayout& layout) {
  if (!array.is_array() || array.size() != 6) bad("a tile is no array of six numbers");
  const TileEntry t{
      parse_id(array, "tiles"),
      {index(array, 2, "tiles"), index(array, 3, "tiles"), index(array, 4, "tiles"), index(array, 5, "tiles")}};
  if (t.box.empty() || t.box.cells() > kMaxShardCells) bad("a tile has an impossible box");
  // In 64 bits: box_of() would wrap for wild ids.
  const std::int64_t col0 = std::int64_t{t.id.tx} * layout.grid.edge_cells + layout.grid.origin.col;
  const std::int64_t row0 = std::int64_t{t.id.ty} * layout.grid.edge_cells + layout.grid.origin.row;
  if (t.box.col0 < col0 || t.box.col1 > col0 + layout.grid.edge_cells || t.box.row0 < row0 ||
      t.box.row1 > row0 + layout.grid.edge_cells)
    bad("a tile's box lies outside of the tile");
  return t;
}

bool is_plain_name(const std::string& name) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
           c == '-';
  };
  return !name.empty() && name.size() <= 200 && name[0] != '.' && std::all_of(name.begin(), name.end(), plain);
}

Json entry_json(const ShardEntry& s) {
  Json tiles = Json::array();
  for (const TileEntry& t : s.tiles)
    tiles.push_back({t.id.tx, t.id.ty, t.box.col0, t.box.row0, t.box.col1, t.box.row1});
  const CellBox b = s.bounds();
  return {{"id", {s.id.tx, s.id.ty}},
          {"file", s.file},
          {"bytes", s.bytes},
          {"file_xxh3", hex64(s.file_xxh3)},
          {"values_xxh3", hex64(s.values_xxh3)},
          {"digest", s.digest.hex()},
          {"bounds", {b.col0, b.row0, b.col1, b.row1}},
          {"tiles", std::move(tiles)}};
}

ShardEntry parse_entry(const Json& object, const MapLayout& layout) {
  ShardEntry s;
  s.id = parse_id(member(object, "id"), "id");
  s.file = text_member(object, "file");
  if (!is_plain_name(s.file)) bad("shard file is no plain name");
  s.bytes = static_cast<std::uint64_t>(integer_member(object, "bytes", 1, kMaxShard_bytes));
  s.file_xxh3 = hash_member(object, "file_xxh3");
  s.values_xxh3 = hash_member(object, "values_xxh3");
  s.digest = digest_member(object, "digest");
  for (const Json& t : array_member(object, "tiles")) {
    s.tiles.push_back(parse_tile(t, layout));
    if (shard_of(layout, s.tiles.back().id) != s.id) bad("a tile is in the wrong shard");
    if (s.tiles.size() > 1 && !(s.tiles[s.tiles.size() - 2].id < s.tiles.back().id)) bad("tiles are out of order");
  }
  if (s.tiles.empty()) bad("a shard has no tiles");
  const CellBox b = s.bounds();
  if (b.cells() > kMaxShardCells) bad("a shard is impossibly large");
  if (array_member(object, "bounds") != Json{b.col0, b.row0, b.col1, b.row1})
    bad("a shard's bounds are not its tiles'");
  return s;
}

std::vector<ShardEntry> parse_shards(const Json& array, const MapLayout& layout) {
  std::vector<ShardEntry> shards;
  for (const Json& object : array) {
    shards.push_back(parse_entry(object, layout));
    if (shards.size() > 1 && !(shards[shards.size() - 2].id < shards.back().id)) bad("shards are out of order");
  }
  return shards;
}

MapLayout parse_layout(const Json& object) {
  const std::int64_t r_mm =
      integer_member(object, "resolution_mm", Lattice::kMinResolution_mm, Lattice::kMaxResolution_mm);
  if (r_mm % 2 != 0) bad("\"resolution_mm\" is odd");
  MapLayout layout{Lattice(static_cast<std::int32_t>(r_mm)), {}};
  layout.grid.edge_cells = static_cast<std::int32_t>(integer_member(object, "tile_edge_cells", 1, kMaxIndex));
  const TileId origin = parse_id(member(object, "origin"), "origin");
  layout.grid.origin = {origin.tx, origin.ty};
  return layout;
}

Manifest parse_head(const Json& root) {
  if (text_member(root, "format") != kFormat) bad("not a B-TMS map");
  const std::int64_t version = integer_member(root, "schema_version", 1, kMaxInt64);
  if (version < kSchemaVersion)
    bad("this map was made by an older program (schema version " + std::to_string(version) + ", now " +
        std::to_string(kSchemaVersion) + "); build it again from its points");
  if (version > kSchemaVersion)
    bad("schema version " + std::to_string(version) + ", this program reads " + std::to_string(kSchemaVersion));
  Manifest m;
  m.info.revision = static_cast<std::uint64_t>(integer_member(root, "revision", 1, kMaxInt64));
  m.info.crs_wkt = text_member(root, "crs_wkt");
  m.info.crs_given = root.contains("crs_given");
  m.info.layout = parse_layout(member(root, "layout"));
  m.info.preset = text_member(root, "preset");
  const Json& parameters = member(root, "parameters");
  m.info.parameters = parse_parameters(parameters);
  if (hash_member(root, "parameters_xxh3") != xxh3_64(bytes_of(json_line(parameters))))
    bad("parameters and their hash differ");
  m.info.points = static_cast<std::uint64_t>(integer_member(root, "points", 0, kMaxInt64));
  m.info.dropped = static_cast<std::uint64_t>(integer_member(root, "dropped", 0, kMaxInt64));
  for (const Json& in : array_member(root, "inputs"))
    m.info.inputs.push_back({text_member(in, "name"),
                             static_cast<std::uint64_t>(integer_member(in, "points", 0, kMaxInt64)),
                             static_cast<std::uint64_t>(integer_member(in, "bytes", 0, kMaxInt64)),
                             in.contains("path") ? text_member(in, "path") : std::string(),
                             in.contains("content") ? text_member(in, "content") : std::string()});
  if (root.contains("updatable_since")) {
    m.info.updatable_since = static_cast<std::uint64_t>(integer_member(root, "updatable_since", 1, kMaxInt64));
    for (const Json& name : array_member(root, "round_files")) {
      if (!name.is_string() || !is_plain_name(name.get<std::string>())) bad("a file of rounds is no plain name");
      m.info.round_files.push_back(name.get<std::string>());
    }
  }
  if (root.contains("trajectory")) {
    const Json& t = root["trajectory"];
    m.info.trajectory = {text_member(t, "name"), static_cast<std::uint64_t>(integer_member(t, "poses", 0, kMaxInt64)),
                         static_cast<std::uint64_t>(integer_member(t, "bytes", 0, kMaxInt64)),
                         t.contains("content") ? text_member(t, "content") : std::string()};
  }
  m.info.digest = digest_member(root, "digest");
  return m;
}

// Before anything is parsed: what is not whole is malformed, what is whole and changed fails verification.
void check_own_hash(std::span<const std::uint8_t> text) {
  constexpr std::size_t kPrefix = sizeof kHashPrefix - 1;
  if (text.size() < kHashedFrom || !std::equal(kHashPrefix, kHashPrefix + kPrefix, text.begin()))
    bad("\"xxh3\" is not the first member: not a B-TMS map");
  constexpr std::string_view kEnd = "]}\n";
  if (text.size() < kHashedFrom + kEnd.size() || !std::equal(kEnd.begin(), kEnd.end(), text.end() - kEnd.size()))
    bad("the text ends too early");
  const std::string digits(text.begin() + kPrefix, text.begin() + kHashedFrom);
  const std::uint64_t found = xxh3_64(text.subspan(kHashedFrom)), stated = hex_value(digits, "xxh3");
  if (found != stated)
    throw Error(ErrorCode::kVerification, "manifest hashes to " + hex64(found) + " but states " + hex64(stated));
}

}  // namespace

CellBox ShardEntry::bounds() const {
  CellBox hull;
  for (const TileEntry& t : tiles) hull = hull.hull(t.box);
  return hull;
}

std::string manifest_text(const Manifest& m) {
  const MapInfo& info = m.info;
  const TileGrid& grid = info.layout.grid;
  const Json parameters = parameters_json(info.parameters);
  Json inputs = Json::array();
  for (const InputRecord& in : info.inputs)
    inputs.push_back(
        {{"name", in.name}, {"points", in.points}, {"bytes", in.bytes}, {"path", in.path}, {"content", in.content}});

  std::string body = "\"";
  const auto line = [&](const char* name, const Json& value) {
    body += std::string(",\n\"") + name + "\":" + json_line(value);
  };
  line("format", kFormat);
  line("schema_version", kSchemaVersion);
  line("revision", info.revision);
  line("crs_wkt", info.crs_wkt);
  if (info.crs_given) line("crs_given", true);
  line("layout", {{"resolution_mm", info.layout.lattice.resolution_mm()},
                  {"tile_edge_cells", grid.edge_cells},
                  {"origin", {grid.origin.col, grid.origin.row}}});
  line("preset", info.preset);
  line("parameters", parameters);
  line("parameters_xxh3", hex64(xxh3_64(bytes_of(json_line(parameters)))));
  line("compression", {{"filters", "shuffle deflate fletcher32"}, {"level", kDeflateLevel}, {"library", "ISA-L"}});
  line("points", info.points);
  line("dropped", info.dropped);
  line("inputs", inputs);
  if (const auto& t = info.trajectory)
    line("trajectory", {{"name", t->name}, {"poses", t->poses}, {"bytes", t->bytes}, {"content", t->content}});
  if (info.updatable_since > 0) {
    line("updatable_since", info.updatable_since);
    line("round_files", info.round_files);
  }
  line("digest", info.digest.hex());
  body += ",\n\"shards\":[";
  for (std::size_t i = 0; i < m.shards.size(); ++i)
    body += (i == 0 ? "\n" : ",\n") + json_line(entry_json(m.shards[i]));
  body += "]}\n";
  return kHashPrefix + hex64(xxh3_64(bytes_of(body))) + body;
}

Manifest parse_manifest(std::span<const std::uint8_t> text, const std::string& file) {
  try {
    check_own_hash(text);
    const Json root = parse_json(text);
    Manifest m = parse_head(root);
    m.shards = parse_shards(array_member(root, "shards"), m.info.layout);
    Digest sum;
    for (const ShardEntry& s : m.shards) sum += s.digest;
    if (sum != m.info.digest) bad("\"digest\" is not the sum of the shards'");
    return m;
  } catch (const Error& e) {
    throw Error(e.code() == ErrorCode::kVerification ? e.code() : ErrorCode::kBadInput, e.what(), file);
  }
}

bool is_of_older_program(std::span<const std::uint8_t> text) {
  try {
    check_own_hash(text);
    const Json root = parse_json(text);
    return text_member(root, "format") == kFormat &&
           integer_member(root, "schema_version", 1, kMaxInt64) < kSchemaVersion;
  } catch (const Error&) {
    return false;
  }
}

std::string entry_text(const ShardEntry& entry) { return json_line(entry_json(entry)); }

ShardEntry parse_entry_text(std::string_view text, const MapLayout& layout) {
  return parse_entry(parse_json({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}), layout);
}

std::vector<std::uint8_t> entries_bytes(const std::vector<ShardEntry>& shards) {
  Json array = Json::array();
  for (const ShardEntry& s : shards) array.push_back(entry_json(s));
  const std::string text = json_line(array);
  return {text.begin(), text.end()};
}

std::vector<ShardEntry> parse_entries(std::span<const std::uint8_t> bytes, const MapLayout& layout) {
  const Json array = parse_json(bytes);
  if (!array.is_array()) bad("manifest entries are no array");
  return parse_shards(array, layout);
}

}  // namespace btms
