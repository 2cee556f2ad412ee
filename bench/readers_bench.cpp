// Point files: the city in every format, through the page cache, and the labels of a LAS file.
//   BM_Read            open and read all points, blocks of 32 Ki points a task: LAS, KITTI, PCD ascii, binary,
//   compressed
//                      checked: every coordinate is the scene's, to the millimetre
//   BM_WriteLasLabels  a classified copy of the LAS file, fsynced
//                      checked: the classes read back; no other byte differs
// `copies` compares with reading the same file into a small buffer, or with copying it and fsync, by one thread.
#include <algorithm>
#include <fstream>

#include "bench/bench_city.h"
#include "bench/measure.h"
#include "bench/point_formats.h"
#include "io/points/las_header.h"
#include "io/points/point_file.h"

namespace btms::bench {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlockPoints = 1 << 15;

// Calls take(first, block) with every block, from several threads.
template <class Take>
void read_all(const fs::path& path, const Threads& threads, Take&& take) {
  const auto file = open_points(path);
  std::vector<PointBlock> blocks(static_cast<std::size_t>(threads.count()));
  const auto size = static_cast<std::size_t>(file->size());
  threads.for_each((size + kBlockPoints - 1) / kBlockPoints, [&](std::size_t i, int worker) {
    PointBlock& block = blocks[static_cast<std::size_t>(worker)];
    const std::size_t first = i * kBlockPoints;
    file->read(first, std::min(kBlockPoints, size - first), block);
    take(first, block);
  });
}

void verify_points(const fs::path& path, const Threads& threads) {
  const PointBlock& all = city().points->all();
  std::vector<std::size_t> right(static_cast<std::size_t>(all.size() / kBlockPoints + 1));
  read_all(path, threads, [&](std::size_t first, const PointBlock& block) {
    std::size_t& n = right[first / kBlockPoints];
    for (std::size_t i = 0; i < block.size(); ++i)
      n += block.x_mm[i] == all.x_mm[first + i] && block.y_mm[i] == all.y_mm[first + i] &&
           block.z_mm[i] == all.z_mm[first + i];
  });
  std::size_t sum = 0;
  for (const std::size_t n : right) sum += n;
  verify(sum == all.size(), "points of " + path.string());
}

fs::path las() { return city().las; }
fs::path kitti() {
  const fs::path path = folder() / "city.bin";
  if (!fs::exists(path)) write_kitti(path, city().points->all());
  return path;
}
template <PcdKind kind>
fs::path pcd() {
  const fs::path path = folder() / ("city" + std::to_string(static_cast<int>(kind)) + ".pcd");
  if (!fs::exists(path)) write_pcd(path, city().points->all(), kind);
  return path;
}

void BM_Read(benchmark::State& state, fs::path (*file)()) {
  const fs::path path = file();
  const auto threads = make_threads(state.range(0));
  verify_once(path.string() + std::to_string(state.range(0)), [&] { verify_points(path, *threads); });
  Measure m(state, city().points->size(), read_file(path));
  for (auto _ : state)
    m.time([&] {
      read_all(path, *threads,
               [](std::size_t, const PointBlock& block) { benchmark::DoNotOptimize(block.x_mm.data()); });
    });
}

// Some of every label, without a pattern that follows blocks.
std::vector<Label> made_labels(std::size_t n) {
  std::vector<Label> labels;
  labels.reserve(n);
  for (std::size_t i = 0; i < n; ++i) labels.push_back(static_cast<Label>(i * 2654435761u >> 7 & 3));
  return labels;
}

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void verify_labels(const PointFile& input, const fs::path& output, const std::vector<Label>& labels) {
  const LasHeader header = read_las_header(InputFile(input.path()));
  std::string expected = bytes_of(input.path());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const std::size_t at = header.points_offset + i * header.record_bytes + las_class_byte(header.format).offset;
    constexpr char kClass[] = {0, 2, 1, 7};  // by label; a dropped point keeps its own
    if (labels[i] != Label::kDropped) expected[at] = kClass[static_cast<std::size_t>(labels[i])];
  }
  verify(bytes_of(output) == expected, "bytes of the labelled file");
  const std::vector<std::uint32_t> classes = read_classes(output);
  for (std::size_t i = 0; i < labels.size(); ++i)
    verify(labels[i] != Label::kTerrain || classes[i] == 2, "class of a point read back");
}

void BM_WriteLasLabels(benchmark::State& state) {
  const auto input = open_points(city().las);
  const auto labels = made_labels(static_cast<std::size_t>(input->size()));
  const auto threads = make_threads(state.range(0));
  const fs::path to = folder() / "labels";
  const auto write = [&] {
    const auto writer = create_labels(*input, to);
    threads->for_each((labels.size() + kBlockPoints - 1) / kBlockPoints, [&](std::size_t i, int) {
      const std::size_t first = i * kBlockPoints;
      writer->write(first, std::span(labels).subspan(first, std::min(kBlockPoints, labels.size() - first)));
    });
    writer->commit();
  };
  verify_once("labels" + std::to_string(state.range(0)), [&] {
    write();
    verify_labels(*input, to / "city.las", labels);
  });
  Measure m(state, input->size(), copy_file(city().las));
  for (auto _ : state) {
    fs::remove_all(to);
    m.time(write);
  }
  fs::remove_all(to);
}

void on_threads(benchmark::internal::Benchmark* b) {
  b->ArgName("threads")->Arg(1)->Arg(2)->UseManualTime()->Unit(benchmark::kMillisecond);
}
BENCHMARK_CAPTURE(BM_Read, las, las)->Apply(on_threads);
BENCHMARK_CAPTURE(BM_Read, kitti, kitti)->Apply(on_threads);
BENCHMARK_CAPTURE(BM_Read, pcd_ascii, pcd<PcdKind::kAscii>)->Apply(on_threads);
BENCHMARK_CAPTURE(BM_Read, pcd_binary, pcd<PcdKind::kBinary>)->Apply(on_threads);
BENCHMARK_CAPTURE(BM_Read, pcd_compressed, pcd<PcdKind::kCompressed>)->Apply(on_threads);
BENCHMARK(BM_WriteLasLabels)->Apply(on_threads);

}  // namespace
}  // namespace btms::bench
