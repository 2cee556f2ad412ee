#include "engine/tiling/point_bins.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "engine/error.h"
#include "engine/lattice/divider.h"

namespace btms {
namespace {

constexpr std::size_t kBlockPoints = 1 << 16;   // 512 KiB of binned points
constexpr std::size_t kMaxDenseBins = 1 << 16;  // bins in a block's bounding box that a plain histogram covers

struct Scratch {
  PointBlock block;
  std::vector<std::uint32_t> bin, start;
  std::vector<BinnedPoint> binned;
  std::vector<std::pair<BinId, std::uint32_t>> order;
};

struct BlockRuns {
  std::unique_ptr<BinnedPoint[]> points;
  std::vector<PointBins::Run> runs;
  PointBins::Counts counts;
};

// Closes the gaps that dropped points leave.
std::size_t compact(PointBlock& block) {
  if (block.dropped() == 0) return block.size();
  std::size_t n = 0;
  for (std::size_t i = 0; i < block.size(); ++i) {
    if (block.x_mm[i] == PointBlock::kDroppedX) continue;
    block.x_mm[n] = block.x_mm[i];
    block.y_mm[n] = block.y_mm[i];
    block.z_mm[n++] = block.z_mm[i];
  }
  return n;
}

// Offsets from (x0, y0) to bin numbers (row by row, `cols` bins a row) and binned points.
void locate(const PointBlock& block, std::size_t n, std::int64_t x0, std::int64_t y0, std::uint32_t edge_mm,
            std::uint32_t cols, std::uint32_t* bin, BinnedPoint* binned) {
  const Divider divide(edge_mm);
  const std::int64_t* x = block.x_mm.data();
  const std::int64_t* y = block.y_mm.data();
  const std::int32_t* z = block.z_mm.data();
  for (std::size_t i = 0; i < n; ++i) {
    const auto u = static_cast<std::uint32_t>(x[i] - x0), v = static_cast<std::uint32_t>(y[i] - y0);
    const std::uint32_t bx = divide(u), by = divide(v);
    bin[i] = by * cols + bx;
    binned[i] = {static_cast<std::uint16_t>(u - bx * edge_mm), static_cast<std::uint16_t>(v - by * edge_mm), z[i]};
  }
}

// Counting sort by bin number; runs of equal bins.
void sort_dense(Scratch& s, std::size_t n, std::size_t bins, BinId first, std::uint32_t cols, BlockRuns& out) {
  s.start.assign(bins + 1, 0);
  for (std::size_t i = 0; i < n; ++i) ++s.start[s.bin[i] + 1];
  for (std::size_t b = 0; b < bins; ++b) {
    const std::uint32_t begin = s.start[b], size = s.start[b + 1];
    s.start[b + 1] = begin + size;
    if (size == 0) continue;
    out.runs.push_back(
        {{first.bx + static_cast<std::int32_t>(b % cols), first.by + static_cast<std::int32_t>(b / cols)},
         out.points.get() + begin,
         size});
  }
  for (std::size_t i = 0; i < n; ++i) out.points[s.start[s.bin[i]]++] = s.binned[i];
}

// Points strewn over a huge area: comparison sort on the bins themselves.
void sort_sparse(Scratch& s, std::size_t n, std::int32_t edge_mm, BlockRuns& out) {
  s.order.resize(n);
  for (std::uint32_t i = 0; i < n; ++i)
    s.order[i] = {{static_cast<std::int32_t>(floor_div(s.block.x_mm[i], edge_mm)),
                   static_cast<std::int32_t>(floor_div(s.block.y_mm[i], edge_mm))},
                  i};
  std::sort(s.order.begin(), s.order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t k = 0; k < n; ++k) {
    const auto [bin, i] = s.order[k];
    out.points[k] = {static_cast<std::uint16_t>(s.block.x_mm[i] - std::int64_t{bin.bx} * edge_mm),
                     static_cast<std::uint16_t>(s.block.y_mm[i] - std::int64_t{bin.by} * edge_mm), s.block.z_mm[i]};
    if (out.runs.empty() || out.runs.back().bin != bin) out.runs.push_back({bin, out.points.get() + k, 0});
    ++out.runs.back().size;
  }
}

void bin_block(Scratch& s, const BinGrid& grid, BlockRuns& out) {
  out.counts.not_finite = s.block.not_finite;
  out.counts.out_of_range = s.block.out_of_range;
  const std::size_t n = compact(s.block);
  out.counts.points = n;
  if (n == 0) return;
  out.points = std::make_unique_for_overwrite<BinnedPoint[]>(n);

  const auto [x_lo, x_hi] =
      std::minmax_element(s.block.x_mm.begin(), s.block.x_mm.begin() + static_cast<std::ptrdiff_t>(n));
  const auto [y_lo, y_hi] =
      std::minmax_element(s.block.y_mm.begin(), s.block.y_mm.begin() + static_cast<std::ptrdiff_t>(n));
  const std::int64_t edge = grid.edge_mm();
  const BinId first{static_cast<std::int32_t>(floor_div(*x_lo, edge)),
                    static_cast<std::int32_t>(floor_div(*y_lo, edge))};
  const std::int64_t x0 = first.bx * edge, y0 = first.by * edge;
  const std::int64_t cols = (*x_hi - x0) / edge + 1, rows = (*y_hi - y0) / edge + 1;
  if (*x_hi - x0 > Divider::kMaxOffset || *y_hi - y0 > Divider::kMaxOffset ||
      cols * rows > static_cast<std::int64_t>(kMaxDenseBins)) {
    sort_sparse(s, n, grid.edge_mm(), out);
    return;
  }
  s.bin.resize(n);
  s.binned.resize(n);
  locate(s.block, n, x0, y0, static_cast<std::uint32_t>(edge), static_cast<std::uint32_t>(cols), s.bin.data(),
         s.binned.data());
  sort_dense(s, n, static_cast<std::size_t>(cols * rows), first, static_cast<std::uint32_t>(cols), out);
}

struct BlockRange {
  const PointSource* source;
  std::uint64_t first;
  std::size_t count;
};

std::vector<BlockRange> share_of(std::span<const PointSource* const> sources, const Ranks& ranks) {
  std::vector<BlockRange> mine;
  std::size_t number = 0;
  for (const PointSource* source : sources)
    for (std::uint64_t first = 0; first < source->size(); first += kBlockPoints)
      if (number++ % static_cast<std::size_t>(ranks.size()) == static_cast<std::size_t>(ranks.rank()))
        mine.push_back(
            {source, first, static_cast<std::size_t>(std::min<std::uint64_t>(kBlockPoints, source->size() - first))});
  return mine;
}

struct RunHeader {
  BinId bin;
  std::uint32_t size;
  std::uint32_t padding;  // keeps the points behind it aligned
};

}  // namespace

BinGrid::BinGrid(const Lattice& l) : lattice(l), edge_cells(1) {
  while (edge_cells < 32 && std::int64_t{2} * edge_cells * l.resolution_mm() <= 65536) edge_cells *= 2;
}

PointBins PointBins::read(std::span<const PointSource* const> sources, const BinGrid& grid, const Threads& threads,
                          const Ranks& ranks, Progress& progress) {
  const std::vector<BlockRange> ranges = share_of(sources, ranks);
  std::uint64_t total = 0;
  for (const BlockRange& r : ranges) total += r.count;
  progress.begin("partition", total, "points");

  std::vector<BlockRuns> results(ranges.size());
  std::vector<Scratch> scratch(static_cast<std::size_t>(threads.count()));
  threads.for_each(ranges.size(), [&](std::size_t i, int worker) {
    if (progress.stop_requested()) throw Error(ErrorCode::kCancelled, "stopped while reading points");
    Scratch& s = scratch[static_cast<std::size_t>(worker)];
    ranges[i].source->read(ranges[i].first, ranges[i].count, s.block);
    bin_block(s, grid, results[i]);
    progress.advance(ranges[i].count);
  });

  PointBins bins;
  for (BlockRuns& r : results) {
    bins.counts_.points += r.counts.points;
    bins.counts_.not_finite += r.counts.not_finite;
    bins.counts_.out_of_range += r.counts.out_of_range;
    bins.runs_.insert(bins.runs_.end(), r.runs.begin(), r.runs.end());
    bins.blocks_.push_back(std::move(r.points));
    r.runs = {};
  }
  bins.group();
  return bins;
}

void PointBins::append(Bytes& out, const Run& run) {
  const RunHeader header{run.bin, run.size, 0};
  const std::size_t at = out.size(), points_bytes = run.size * sizeof(BinnedPoint);
  out.resize(at + sizeof header + points_bytes);
  std::memcpy(out.data() + at, &header, sizeof header);
  std::memcpy(out.data() + at + sizeof header, run.points, points_bytes);
}

void PointBins::receive(std::vector<Bytes> in) {
  blocks_.clear();
  runs_.clear();
  received_ = std::move(in);
  for (const Bytes& bytes : received_)
    for (std::size_t at = 0; at < bytes.size();) {
      RunHeader header;
      std::memcpy(&header, bytes.data() + at, sizeof header);
      at += sizeof header;
      runs_.push_back({header.bin, reinterpret_cast<const BinnedPoint*>(bytes.data() + at), header.size});
      at += header.size * sizeof(BinnedPoint);
    }
  group();
}

void PointBins::group() {
  std::sort(runs_.begin(), runs_.end(), [](const Run& a, const Run& b) { return a.bin < b.bin; });
  bins_.clear();
  for (std::size_t i = 0; i < runs_.size();) {
    std::size_t end = i;
    std::uint64_t size = 0;
    for (; end < runs_.size() && runs_[end].bin == runs_[i].bin; ++end) size += runs_[end].size;
    bins_.push_back({runs_[i].bin, size, std::span(runs_).subspan(i, end - i)});
    i = end;
  }
}

}  // namespace btms
