// Writes the files that fuzzing starts from: FOLDER/TARGET/NAME, made by what makes the files of the tests.
//   fuzz_seeds FOLDER
#include <cstdio>
#include <cstring>
#include <fstream>

#include "apps/server/service.h"
#include "engine/tiling/record.h"
#include "io/store/chunk_codec.h"
#include "io/store/hash.h"
#include "io/store/journal.h"
#include "io/store/json_field.h"
#include "io/store/layers.h"
#include "io/store/manifest.h"
#include "tests/fuzz/fuzz.h"
#include "tests/io/points/las_bytes.h"
#include "tests/io/points/pcd_bytes.h"
#include "tests/io/points/ply_bytes.h"

namespace btms::test {
namespace {

std::filesystem::path root;

void seed(const char* target, const std::string& name, const Bytes& bytes) {
  std::filesystem::create_directories(root / target);
  std::ofstream(root / target / name, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}
void seed(const char* target, const std::string& name, const std::string& text) {
  seed(target, name, text_bytes(text));
}

const char* const kWkt =
    "PROJCRS[\"UTM 32N\",BASEGEOGCRS[\"ETRS89\",DATUM[\"ETRS89\",ELLIPSOID[\"GRS 1980\",6378137,298.257222101]]],"
    "CONVERSION[\"c\",METHOD[\"Transverse Mercator\",ID[\"EPSG\",9807]],PARAMETER[\"Longitude of natural "
    "origin\",9,ANGLEUNIT[\"degree\",0.0174532925199433],ID[\"EPSG\",8802]]],CS[Cartesian,2],AXIS[\"e\",east],"
    "AXIS[\"n\",north],LENGTHUNIT[\"metre\",1]]";
const char* const kFeet =
    "PROJCS[\"feet\",GEOGCS[\"NAD83\",DATUM[\"NAD83\",SPHEROID[\"GRS 1980\",6378137,298.257]],PRIMEM[\"Greenwich\",0],"
    "UNIT[\"degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"central_meridian\",-75],"
    "PARAMETER[\"scale_factor\",0.9996],PARAMETER[\"false_easting\",1640416.67],UNIT[\"US survey "
    "foot\",0.304800609601]]";

void seed_las() {
  for (std::uint8_t format = 0; format <= 10; ++format) {
    LasSpec spec = las_spec(format < 6 ? format % 5 : 4, format);
    spec.extra_bytes = format % 3;
    seed("las", "format" + std::to_string(format), las_bytes(spec));
  }
  LasSpec spec = las_spec(4, 6);
  spec.vlrs = {{"LASF_Projection", 2112, text_bytes(kWkt)}};
  seed("las", "wkt", las_bytes(spec));
  spec.vlrs = {{"LASF_Projection", 2112, text_bytes(kFeet)}};
  seed("las", "wkt_feet", las_bytes(spec));
  spec.vlrs = {};
  spec.evlrs = {{"LASF_Projection", 2112, text_bytes("EPSG:25832")}, {"other", 7, text_bytes("content")}};
  seed("las", "evlrs", las_bytes(spec));
  spec = las_spec(2, 3);
  spec.vlrs = {geokeys({{1024, 1}, {3072, 25832}, {3076, 9001}, {4099, 9002}}), {"laszip encoded", 1, {}}};
  seed("las", "geokeys", las_bytes(spec));
  spec = las_spec(3, 4);
  spec.xyz.clear();
  seed("las", "no_points", las_bytes(spec));
}

void seed_pcd() {
  seed("pcd", "ascii", pcd_header("ascii", 3) + text_bytes("1 2 3\n-1.5e3 nan 0\n\n+7 8 inf"));
  Bytes floats, wide;
  for (int i = 0; i < 12; ++i) append(floats, static_cast<float>(i) * 1.5f);
  for (int i = 0; i < 6; ++i) {
    append(wide, std::uint16_t{7});
    append(wide, i * 2.25);
  }
  seed("pcd", "binary", pcd_header("binary", 4) + floats);
  seed("pcd", "binary_double",
       pcd_header("binary", 2, "a x b y c z", "2 8 2 8 2 8", "U F I F U F", "1 1 1 1 1 1") + wide);
  seed("pcd", "compressed", pcd_header("binary_compressed", 4) + compressed(floats));
  seed("pcd", "compressed_zeros", pcd_header("binary_compressed", 500) + compressed(Bytes(6000), 3));
  seed("pcd", "fields",
       pcd_header("binary_compressed", 2, "x y z n", "4 4 4 4", "F F F F", "1 1 1 3") + compressed(Bytes(48)));
  seed("pcd", "none", pcd_header("ascii", 0) + Bytes());
  seed("kitti", "scan", floats);
  seed("kitti", "empty", Bytes());
  Bytes far = floats;
  store(&far[0], 1e30f);
  store(&far[20], std::numeric_limits<float>::quiet_NaN());
  seed("kitti", "dropped", far);
}

void seed_xyz() {
  seed("xyz", "blanks", text_bytes("# remark\n1 2 3\n-1.5e3 nan 0\n\n+7 8 inf"));
  seed("xyz", "cloudcompare", text_bytes("//X Y Z Classification\n2\n1 2 3 2\n4 5 6 1\n"));
  seed("xyz", "csv", text_bytes("\"X\",\"Y\",\"Z\",\"label\"\r\n1,2,3,\r\n4,,6,7\r\n"));
  seed("xyz", "semicolons", text_bytes("\xEF\xBB\xBFid;z;y;x\nP1;1,5;2;3\n"));
}

void seed_ply() {
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string mixed = "property short a\nproperty double y\nproperty int x\nproperty uint8 z\n";
  seed("ply", "ascii", ply_header("ascii", 3) + text_bytes("1 2 3\n-1.5e3 nan 0\n\n+7 8 inf"));
  seed("ply", "ascii_faces", ply_header("ascii", 1, mixed, faces) + text_bytes("3 0 1 2\n1 2 3 4\n"));
  seed("ply", "little", ply_header("binary_little_endian", 4) + Bytes(48, 66));
  seed("ply", "big",
       ply_header("binary_big_endian", 2, mixed, faces, "element edge 1\nproperty int v\n") +
           (std::string{2, 0, 0, 0, 1, 0, 0, 0, 2} + Bytes(34, 64)));
}

void seed_npy() {
  const std::string start("\x93NUMPY\x01\0", 8), newer("\x93NUMPY\x02\0", 8);
  const std::string floats = "{'descr': '<f4', 'fortran_order': False, 'shape': (4, 3), }";
  const std::string swapped = "{\"shape\":(2,4),\"fortran_order\":False,\"descr\":\">f8\"}\n";
  const auto length = [](const std::string& text) { return static_cast<char>(text.size()); };
  seed("npy", "floats", start + std::string{length(floats), 0} + floats + Bytes(48, 66));
  seed("npy", "swapped", newer + std::string{length(swapped), 0, 0, 0} + swapped + Bytes(64, 64));
}

void seed_lzf() {
  Bytes runs(300);
  for (std::size_t i = 0; i < 40; ++i) runs[i * 7] = static_cast<std::uint8_t>(i / 3);
  const Bytes packed = lzf_compress(runs);
  for (std::uint8_t mode = 0; mode < 3; ++mode)
    seed("lzf", "mode" + std::to_string(mode), std::string{static_cast<char>(mode), 40, 1, 44, 1} + packed);
  seed("lzf", "repeated", std::string{2, 60, 0, 44, 1} + runs);
}

void seed_texts() {
  seed("poses", "kitti", std::string("# x\n1 0 0 5 0 1 0 -7.25 0 0 1 1e2\n0 -1 0 5\t1 0 0 7 0 0 1 2\n"));
  seed("poses", "tum", std::string("0.0, 1, 2, 3, 0, 0, 0, 1\r\n0.1, +1, 2, 3, 0, 0.5, 0, 0.5\r\n"));
  seed("poses", "places", std::string("1 2 3\n4 5 6\n\n-1e5 0 nan\n"));
  seed("poses", "calibration", std::string("P0: 1 2\nTr: 0 -1 0 0.1 0 0 -1 -0.2 1 0 0 0.3\n"));
  seed("config", "preset", std::string("preset: single-scan\nresolution_m: 2.0\n"));
  seed("config", "words", std::string("node_model: pca\n'levels': 3\n? min_points\n: \"12\"\n"));
  seed("config", "flow", std::string("{resolution_m: &r 1.0, refit_distance_m: *r, preset: !!str city}\n"));
  seed("config", "documents", std::string("%YAML 1.2\n---\nkeep_nodes: 12 # some\n...\n---\n- a\n- |\n  b\n"));
  seed("crs", "wkt2", std::string(kWkt));
  seed("crs", "wkt1", std::string(kFeet));
  seed("crs", "epsg", std::string("EPSG:25832"));
  seed("crs", "compound", std::string("EPSG:25832+5783"));
  seed("crs", "degrees", std::string("EPSG:4326"));
}

void seed_labels() {
  const std::string truth{40, 0, 0, 0, 70, 0, 1, 0, 99, 0, 0, 0}, prediction{1, 0, 1};
  seed("labels", "bytes", std::string{'\x80', 12, 0} + truth + prediction);
  LasSpec spec;
  seed("labels", "las", (std::string{1, 12, 0} + truth) + las_bytes(spec));
}

void seed_store() {
  Manifest manifest;
  manifest.info.layout = {Lattice(2000), {64, {3, -5}}};
  manifest.info.preset = "city";
  manifest.info.inputs = {{"a.las", 12, 5000}, {"b.las", 0, 227}};
  manifest.info.trajectory = TrajectoryRecord{"t.txt", 4, 100};
  manifest.info.points = 12;
  seed("manifest", "no_shards", manifest_text(manifest));
  for (std::int32_t i = 0; i < 2; ++i) {
    ShardEntry shard;
    shard.id = {i, i - 1};
    shard.file = "shard_" + std::to_string(i) + ".nc";
    shard.bytes = 1000;
    const CellBox box = manifest.info.layout.grid.box_of(shard.id);
    shard.tiles = {{shard.id, {box.col0 + 1, box.row0, box.col1, box.row1 - 2}}};
    manifest.shards.push_back(shard);
  }
  seed("manifest", "shards", manifest_text(manifest));
  seed("manifest", "entries", entries_bytes(manifest.shards).empty() ? Bytes() : entries_bytes(manifest.shards));

  const auto journal_line = [](const std::string& text) {
    return hex64(xxh3_64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()})) + " " + text + "\n";
  };
  std::string lines = journal_line(json_line({{"revision", 3}, {"identity", build_identity(manifest.info)}}));
  seed("journal", "head", lines);
  for (const ShardEntry& shard : manifest.shards) lines += journal_line(entry_text(shard));
  seed("journal", "shards", lines);
  seed("rounds", "none", Bytes{0});
  Bytes one{1, 0, 0, 52, 52, 0};  // a record of 52 bytes, stored as it is
  const Bytes record = pack_record({0, 0, 2, 2}, std::vector<std::uint32_t>{1, 2, 3}, Bytes{4, 5, 6, 7});
  one.insert(one.end(), record.begin(), record.end());
  one[3] = one[4] = static_cast<std::uint8_t>(record.size());
  seed("rounds", "stored", one);

  for (std::uint8_t element = 0; element < 3; ++element) {
    Bytes values(std::size_t{64} << element);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::uint8_t>(i / 9 * element);
    Bytes stored = ChunkEncoder().encode(values, std::size_t{1} << element);
    stored.resize(stored.size() - 4);
    seed("chunk", "decode" + std::to_string(element), std::string{static_cast<char>(element), 63, 0} + stored);
    const auto mode = static_cast<char>(129 + element);  // 129 is a multiple of 3
    seed("chunk", "encode" + std::to_string(element), std::string{mode, 63, 1} + values);
  }

  const auto table = layer_table();
  for (std::size_t i = 0; i < table.size(); ++i) {
    Bytes values(17 * 3);  // three entries of a list: places first
    for (std::size_t k = 0; k < 3; ++k) {
      store(&values[4 * k], static_cast<std::uint32_t>(5 * k));
      values[values.size() - 1 - k] = 1;
    }
    if (table[i].in_tgf) seed("layers", table[i].name, std::string{static_cast<char>(i), 2, 3, 3, 4} + values);
  }
}

// Every endpoint as it describes itself.
void seed_requests() {
  int n = 0;
  for (const Endpoint& endpoint : endpoints()) {
    std::string target = endpoint.pattern;
    for (std::size_t at; (at = target.find("{m}")) != target.npos;) target.replace(at, 3, "m");
    for (std::size_t at; (at = target.find("{}")) != target.npos;) target.replace(at, 2, "0");
    std::string query;
    for (const Parameter& p : endpoint.parameters) {
      const std::string type = p.type;
      std::string value = type.substr(0, type.find('|'));
      if (type == "number" || type == "integer") value = "3";
      if (type == "string") value = std::string(p.name) == "bbox" ? "1,1,9,9" : "elevation";
      if (std::string(p.name) == "coords") value = "POLYGON((1%202,3%204,5%206,1%202))";
      query += (query.empty() ? "?" : "&") + std::string(p.name) + "=" + value;
    }
    const std::string body = endpoint.body ? endpoint.body : "";
    seed("request", std::to_string(n++),
         std::string(endpoint.method) + " " + target + query + "\naccept-encoding: gzip\n\n" + body);
  }
}

}  // namespace
}  // namespace btms::test

int main(int count, char** arguments) {
  using namespace btms::test;
  if (count != 2) {
    std::fputs("fuzz_seeds FOLDER\n", stderr);
    return 2;
  }
  root = arguments[1];
  seed_las();
  seed_pcd();
  seed_ply();
  seed_xyz();
  seed_npy();
  seed_lzf();
  seed_texts();
  seed_labels();
  seed_store();
  seed_requests();
}
