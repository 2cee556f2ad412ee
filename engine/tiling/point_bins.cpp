#include "engine/tiling/point_bins.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <tuple>
#include <utility>

#include "engine/error.h"
#include "engine/lattice/divider.h"
#include "engine/lattice/wide.h"

namespace btms {
namespace {

constexpr std::size_t kBlockPoints = 1 << 16;   // 512 KiB of binned points
constexpr std::size_t kMaxDenseBins = 1 << 16;  // bins in a block's bounding box that a plain histogram covers

struct BlockScratch {
  PointBlock block;
  std::vector<std::uint32_t> bin, start;
  std::vector<std::uint64_t> packed;
  std::vector<std::pair<BinId, std::uint32_t>> order;
};

// A run of points of one bin in a sorted block.
struct BlockRun {
  BinId bin;
  std::uint32_t first, size;
};

struct SortedBlock {
  std::unique_ptr<BinnedPoint[]> points;
  std::vector<BlockRun> runs;
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

struct Bounds {
  std::int64_t x_lo, x_hi, y_lo, y_hi;
};

BTMS_WIDE Bounds bounds_of(const std::int64_t* x, const std::int64_t* y, std::size_t n) {
  Bounds b{x[0], x[0], y[0], y[0]};
  for (std::size_t i = 1; i < n; ++i) {
    b.x_lo = std::min(b.x_lo, x[i]);
    b.x_hi = std::max(b.x_hi, x[i]);
    b.y_lo = std::min(b.y_lo, y[i]);
    b.y_hi = std::max(b.y_hi, y[i]);
  }
  return b;
}

// Offsets from (x0, y0) to bin numbers (row by row, `cols` bins a row) and points in bins, each packed in a word so
// that the loop is one of 64-bit lanes.
BTMS_WIDE void locate(const std::int64_t* x, const std::int64_t* y, const std::int32_t* z, std::size_t n,
                      std::int64_t x0, std::int64_t y0, std::uint32_t edge_mm, std::uint32_t cols, std::uint32_t* bin,
                      std::uint64_t* packed) {
  const Divider divide(edge_mm);
  for (std::size_t i = 0; i < n; ++i) {
    const auto u = static_cast<std::uint32_t>(x[i] - x0), v = static_cast<std::uint32_t>(y[i] - y0);
    const std::uint32_t bx = divide(u), by = divide(v);
    bin[i] = by * cols + bx;
    packed[i] =
        (std::uint64_t{static_cast<std::uint32_t>(z[i])} << 32) | ((v - by * edge_mm) << 16) | (u - bx * edge_mm);
  }
}
static_assert(std::endian::native == std::endian::little && offsetof(BinnedPoint, y_mm) == 2);

// Counting sort by bin number; runs of equal bins.
void sort_dense(BlockScratch& s, std::size_t n, std::size_t bins, BinId first, std::uint32_t cols, SortedBlock& out) {
  // Neighbours in a file tend to share a bin: counters in turn don't wait for each other.
  constexpr std::size_t kCounters = 4;
  s.start.assign(kCounters * bins, 0);
  for (std::size_t i = 0; i < n; ++i) ++s.start[(i % kCounters) * bins + s.bin[i]];
  std::uint32_t begin = 0;
  for (std::size_t b = 0; b < bins; ++b) {
    std::uint32_t size = 0;
    for (std::size_t c = 0; c < kCounters; ++c) size += s.start[c * bins + b];
    s.start[b] = begin;
    if (size > 0)
      out.runs.push_back(
          {{first.bx + static_cast<std::int32_t>(b % cols), first.by + static_cast<std::int32_t>(b / cols)},
           begin,
           size});
    begin += size;
  }
  for (std::size_t i = 0; i < n; ++i) std::memcpy(&out.points[s.start[s.bin[i]]++], &s.packed[i], sizeof(BinnedPoint));
}

// Points strewn over a huge area: comparison sort on the bins themselves.
void sort_sparse(BlockScratch& s, std::size_t n, std::int32_t edge_mm, SortedBlock& out) {
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
    if (out.runs.empty() || out.runs.back().bin != bin) out.runs.push_back({bin, static_cast<std::uint32_t>(k), 0});
    ++out.runs.back().size;
  }
}

void bin_block(BlockScratch& s, const BinGrid& grid, SortedBlock& out) {
  out.counts.not_finite = s.block.not_finite;
  out.counts.out_of_range = s.block.out_of_range;
  out.counts.outside_box = s.block.outside_box;
  const std::size_t n = compact(s.block);
  out.counts.points = n;
  if (n == 0) return;
  out.points = std::make_unique_for_overwrite<BinnedPoint[]>(n);

  const auto [x_lo, x_hi, y_lo, y_hi] = bounds_of(s.block.x_mm.data(), s.block.y_mm.data(), n);
  const std::int64_t edge = grid.edge_mm();
  const BinId first{static_cast<std::int32_t>(floor_div(x_lo, edge)), static_cast<std::int32_t>(floor_div(y_lo, edge))};
  const std::int64_t x0 = first.bx * edge, y0 = first.by * edge;
  const std::int64_t cols = (x_hi - x0) / edge + 1, rows = (y_hi - y0) / edge + 1;
  if (x_hi - x0 > Divider::kMaxOffset || y_hi - y0 > Divider::kMaxOffset ||
      cols * rows > static_cast<std::int64_t>(kMaxDenseBins)) {
    sort_sparse(s, n, grid.edge_mm(), out);
    return;
  }
  s.bin.resize(n);
  s.packed.resize(n);
  locate(s.block.x_mm.data(), s.block.y_mm.data(), s.block.z_mm.data(), n, x0, y0, static_cast<std::uint32_t>(edge),
         static_cast<std::uint32_t>(cols), s.bin.data(), s.packed.data());
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
                          const Ranks& ranks, Pager& pager, Progress& progress) {
  const std::vector<BlockRange> ranges = share_of(sources, ranks);
  std::uint64_t total = 0;
  for (const BlockRange& r : ranges) total += r.count;
  progress.begin("partition", total, "points");

  PointBins bins;
  bins.pager_ = &pager;
  bins.blocks_.resize(ranges.size());
  std::vector<std::vector<BlockRun>> runs(ranges.size());
  std::vector<Counts> counts(ranges.size());
  std::vector<BlockScratch> scratch(static_cast<std::size_t>(threads.count()));
  threads.for_each(ranges.size(), [&](std::size_t i, int worker) {
    if (progress.stop_requested()) throw Error(ErrorCode::kCancelled, "stopped while reading points");
    BlockScratch& s = scratch[static_cast<std::size_t>(worker)];
    ranges[i].source->read(ranges[i].first, ranges[i].count, s.block);
    SortedBlock sorted;
    bin_block(s, grid, sorted);
    bins.blocks_[i] = std::make_unique<Block>();
    bins.keep(std::move(sorted.points), sorted.counts.points, *bins.blocks_[i]);
    runs[i] = std::move(sorted.runs);
    counts[i] = sorted.counts;
    progress.advance(ranges[i].count);
  });

  std::size_t pieces = 0;
  for (const auto& list : runs) pieces += list.size();
  bins.listed_ = std::make_unique<Pager::Claim>(pager, pieces * (sizeof(Piece) + sizeof(BlockRun)));
  bins.pieces_.reserve(pieces);
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    bins.counts_.points += counts[i].points;
    bins.counts_.not_finite += counts[i].not_finite;
    bins.counts_.out_of_range += counts[i].out_of_range;
    bins.counts_.outside_box += counts[i].outside_box;
    for (const BlockRun& run : runs[i])
      bins.pieces_.push_back({run.bin, static_cast<std::uint32_t>(i), run.first, run.size});
    runs[i] = {};
  }
  bins.listed_ = std::make_unique<Pager::Claim>(pager, pieces * sizeof(Piece));
  bins.group();
  return bins;
}

PointBins::PointBins(PointBins&& o) noexcept
    : pager_(o.pager_),
      blocks_(std::move(o.blocks_)),
      pieces_(std::move(o.pieces_)),
      first_piece_(std::move(o.first_piece_)),
      counts_(o.counts_),
      listed_(std::move(o.listed_)) {
  o.blocks_.clear();
}

PointBins::~PointBins() {
  for (const auto& block : blocks_)
    if (block && block->left > 0) discard(*block);
}

// In memory while the budget lasts.
void PointBins::keep(std::unique_ptr<BinnedPoint[]> points, std::size_t n, Block& block) {
  block.bytes = n * sizeof(BinnedPoint);
  block.left = static_cast<std::uint32_t>(n);
  if (pager_->claim(block.bytes)) {
    block.points = std::move(points);
    return;
  }
  block.where = pager_->spill().reserve(block.bytes);
  pager_->spill().write(block.where.offset, {reinterpret_cast<const std::uint8_t*>(points.get()), block.bytes});
}

void PointBins::discard(Block& block) {
  if (block.points) {
    block.points.reset();
    pager_->release(block.bytes);
  } else {
    pager_->spill().discard(block.where);
  }
  block.left = 0;
}

std::span<const PointBins::Piece> PointBins::pieces(std::size_t k) const {
  const std::size_t end = k + 1 < first_piece_.size() ? first_piece_[k + 1] : pieces_.size();
  return std::span(pieces_).subspan(first_piece_[k], end - first_piece_[k]);
}

std::uint64_t PointBins::points_in(std::size_t k) const {
  std::uint64_t sum = 0;
  for (const Piece& piece : pieces(k)) sum += piece.size;
  return sum;
}

PointBins::Bin PointBins::load(std::size_t k, Scratch& s) const {
  std::size_t spilled = 0;
  for (const Piece& piece : pieces(k))
    if (!blocks_[piece.block]->points) spilled += piece.size;
  if (s.spilled.size() < spilled) s.spilled.resize(spilled);
  s.runs.clear();
  BinnedPoint* to = s.spilled.data();
  std::uint64_t size = 0;
  for (const Piece& piece : pieces(k)) {
    const Block& block = *blocks_[piece.block];
    size += piece.size;
    if (block.points) {
      s.runs.push_back({block.points.get() + piece.first, piece.size});
      continue;
    }
    pager_->spill().read(block.where.offset + piece.first * sizeof(BinnedPoint),
                         {reinterpret_cast<std::uint8_t*>(to), piece.size * sizeof(BinnedPoint)});
    s.runs.push_back({to, piece.size});
    to += piece.size;
  }
  return {id(k), size, s.runs};
}

void PointBins::let_go(std::size_t k) {
  for (const Piece& piece : pieces(k)) {
    Block& block = *blocks_[piece.block];
    if (block.left.fetch_sub(piece.size) == piece.size) discard(block);
  }
}

void PointBins::drop(std::span<const BinId> bins) {
  if (bins.empty()) return;
  const auto dropped = [&](BinId id) { return std::binary_search(bins.begin(), bins.end(), id); };
  for (std::size_t k = 0; k < size(); ++k) {
    if (!dropped(id(k))) continue;
    counts_.points -= points_in(k);
    let_go(k);
  }
  std::erase_if(pieces_, [&](const Piece& piece) { return dropped(piece.bin); });
  group();
}

void PointBins::append(Bytes& out, const Bin& bin) {
  for (const Run& run : bin.runs) {
    const RunHeader header{bin.id, run.size, 0};
    const std::size_t at = out.size(), points_bytes = run.size * sizeof(BinnedPoint);
    out.resize(at + sizeof header + points_bytes);
    std::memcpy(out.data() + at, &header, sizeof header);
    std::memcpy(out.data() + at + sizeof header, run.points, points_bytes);
  }
}

// What a rank sent becomes one block.
void PointBins::receive(const std::vector<Bytes>& in, Received& received) {
  for (const Bytes& bytes : in) {
    if (bytes.empty()) continue;
    auto points = std::make_unique_for_overwrite<BinnedPoint[]>(bytes.size() / sizeof(BinnedPoint));
    std::size_t n = 0;
    for (std::size_t at = 0; at < bytes.size();) {
      RunHeader header;
      std::memcpy(&header, bytes.data() + at, sizeof header);
      at += sizeof header;
      std::memcpy(points.get() + n, bytes.data() + at, header.size * sizeof(BinnedPoint));
      at += header.size * sizeof(BinnedPoint);
      received.pieces.push_back(
          {header.bin, static_cast<std::uint32_t>(received.blocks.size()), static_cast<std::uint32_t>(n), header.size});
      n += header.size;
    }
    received.blocks.push_back(std::make_unique<Block>());
    keep(std::move(points), n, *received.blocks.back());
  }
}

void PointBins::group() {
  std::sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) {
    return a.bin != b.bin ? a.bin < b.bin : std::tie(a.block, a.first) < std::tie(b.block, b.first);
  });
  first_piece_.clear();
  for (std::size_t i = 0; i < pieces_.size(); ++i)
    if (i == 0 || pieces_[i].bin != pieces_[i - 1].bin) first_piece_.push_back(i);
}

}  // namespace btms
