#include "engine/tiling/scan_segmenter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "engine/lattice/divider.h"
#include "engine/lattice/wide.h"
#include "engine/terrain/model_nodes.h"
#include "engine/terrain/moments.h"
#include "engine/tiling/block_source.h"
#include "engine/tiling/millimetres.h"
#include "engine/tiling/segment.h"
#include "engine/tiling/tile_components.h"
#include "engine/tiling/tile_steps.h"

namespace btms {
namespace {

constexpr std::uint64_t kMostNodes = 1 << 20;  // in the box around a scan; wider ones take the way of large maps
constexpr std::size_t kParts = 4;              // of a scan, counted side by side: neighbouring points share a node

struct Interval {
  std::int64_t low = INT64_MAX, high = INT64_MIN;
};

// Of the points that take part.
Interval bounds(const std::vector<std::int64_t>& at, const PointBlock& points) {
  Interval all;
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (points.x_mm[i] == PointBlock::kDroppedX) continue;
    all.low = std::min(all.low, at[i]);
    all.high = std::max(all.high, at[i]);
  }
  return all;
}

// Rounds as round_into() does where all values lie within `limit`, below 2^31; false where one doesn't.
BTMS_WIDE bool round_near(const float* from, std::size_t n, double limit, std::int32_t* to, Interval& all) {
  std::int32_t low = INT32_MAX, high = INT32_MIN, far = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double v = static_cast<double>(from[i]) * 1000;  // exact, so there is one rounding
    const auto mm = static_cast<std::int32_t>(nearest(v));
    to[i] = mm;
    low = mm < low ? mm : low;
    high = mm > high ? mm : high;
    far |= !(std::abs(v) <= limit);
  }
  all.low = std::min<std::int64_t>(all.low, low);
  all.high = std::max<std::int64_t>(all.high, high);
  return far == 0;
}

// Eq 14 over a node's final plane: terrain where z - (a x + b y) is at most `terrain`, far below where it is less than
// `below`; x, y from the square's centre and z from its height there, millimetres, measured vertically.
struct LabelPlane {
  float a = 0, b = 0;
  float terrain = -INFINITY, below = -INFINITY;  // without a final plane nothing is terrain and nothing below
  std::int32_t centre_mm = 0;
};

}  // namespace

class ScanSegmenter::Impl {
  static constexpr std::int32_t kDropped = INT32_MIN;

 public:
  explicit Impl(const Parameters& parameters)
      : parameters_((check(parameters), parameters)),
        r_(resolution_mm(parameters)),
        model_(parameters),
        convexity_(parameters),
        completion_(parameters),
        fit_(parameters) {}

  std::span<const Label> segment(const ScanPoints& scan) {
    if (is_fixed() && read_near(scan) && locate()) return segment_located();
    read_all(scan);
    return segment_block();
  }
  std::span<const Label> segment(const PointSource& scan) {
    scan.read(0, static_cast<std::size_t>(scan.size()), block_);
    return segment_block();
  }

  LabelCounts counts_;

 private:
  std::span<const Label> segment_block() {
    counts_ = {};
    if (block_.size() == 0) return {};
    const bool compact = take_block();
    if (is_fixed() && compact && locate()) return segment_located();
    return segment_as_map(compact && nodes_around() <= kMostNodes);
  }
  std::span<const Label> segment_located() {
    counts_ = {};
    sort();
    model();
    link();
    complete();
    fit();
    label();
    return labels_;
  }

  // Floats to millimetres; false where a point has to be dropped or lies far away.
  bool read_near(const ScanPoints& scan);
  // The same for any points, into block_.
  void read_all(const ScanPoints& scan);
  // From block_; false where the points lie too far apart, or there is none.
  bool take_block();
  // Which node every point falls into; false where there are too many.
  bool locate();
  void sort();
  void model();
  void link();
  void complete();
  void fit();
  void label();
  // Through tiles; `compact`: through one.
  std::span<const Label> segment_as_map(bool compact);

  bool is_fixed() const { return parameters_.method == Method::kFixed; }
  // Of the finest level, in the box of coarsest cells around the scan.
  double nodes_around() const {
    const double edge = static_cast<double>(r_) * (1 << (level_count(parameters_) - 1));
    const auto cells = [&](const Interval& reach) { return static_cast<double>(reach.high - reach.low) / edge + 4; };
    return cells(reach_x_) * cells(reach_y_) * (edge / r_) * (edge / r_) * kTriangles;
  }

  std::size_t node_count() const { return static_cast<std::size_t>(box_.cells()) * kTriangles; }
  NodePoints points_of(std::size_t node) const {
    const std::uint32_t begin = end_[node * kParts];
    return {sorted_x_.data() + begin, sorted_y_.data() + begin, sorted_z_.data() + begin,
            end_[(node + 1) * kParts] - begin};
  }

  Parameters parameters_;
  std::int32_t r_;
  NodeModelRules model_;
  ConvexityRules convexity_;
  CompletionRules completion_;
  FitRules fit_;

  PointBlock block_;
  std::vector<std::int32_t> at_x_, at_y_, z_;  // of every point, mm; x and y from the origin
  std::int64_t origin_x_ = 0, origin_y_ = 0;   // mm, multiples of r
  Interval reach_x_, reach_y_;                 // of the points, from the origin
  std::size_t dropped_ = 0;                    // points whose x is kDropped

  std::vector<Label> labels_;
  CellBox box_;                      // of the points
  std::vector<std::uint32_t> node_;  // of every point, row by row in box_; node_count() where dropped
  std::vector<std::int16_t> x_, y_;  // of every point, from its square's centre
  std::vector<std::uint32_t> end_;   // per node and part: where its points begin, and end once sorted
  std::vector<std::int16_t> sorted_x_, sorted_y_;
  std::vector<std::int32_t> sorted_z_;
  ModelNodesScratch model_scratch_;
  TileField<Node> nodes_;  // box_ and what predictions from it reach
  LinkScratch link_;
  TileComponents components_;
  std::vector<NodeClass> verdict_;
  std::vector<std::uint8_t> asked_;
  CompleteScratch complete_scratch_;
  CornerHeights heights_;
  std::vector<LabelPlane> planes_;
};

namespace {

// x, y, z and one more float a point, the layout of most sensors: a stride the compiler knows.
BTMS_WIDE void unpack_fours(const float* from, std::size_t n, float* x, float* y, float* z) {
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = from[4 * i];
    y[i] = from[4 * i + 1];
    z[i] = from[4 * i + 2];
  }
}

// Calls fn(x, y, z, first, number) on runs of the scan's coordinates until it returns false.
template <class Fn>
void for_each_chunk(const ScanPoints& scan, const Fn& fn) {
  std::array<float, kMmChunk> x, y, z;
  const auto read = [&](const float* first, std::size_t i) {
    float v;
    std::memcpy(&v, reinterpret_cast<const char*>(first) + i * scan.stride_bytes, sizeof v);
    return v;
  };
  const bool fours = scan.y_m == scan.x_m + 1 && scan.z_m == scan.x_m + 2 && scan.stride_bytes == 4 * sizeof(float);
  for (std::size_t at = 0; at < scan.size; at += kMmChunk) {
    const std::size_t n = std::min(kMmChunk, scan.size - at);
    if (fours) unpack_fours(scan.x_m + 4 * at, n, x.data(), y.data(), z.data());
    for (std::size_t i = fours ? n : 0; i < n; ++i) {
      x[i] = read(scan.x_m, at + i);
      y[i] = read(scan.y_m, at + i);
      z[i] = read(scan.z_m, at + i);
    }
    if (!fn(x.data(), y.data(), z.data(), at, n)) return;
  }
}

// Positions to nodes, row by row of a box whose corner is (x0, y0), and to offsets from their squares' centres.
BTMS_WIDE void locate_points(const std::int32_t* x, const std::int32_t* y, std::size_t n, std::int32_t x0,
                             std::int32_t y0, std::uint32_t r, std::uint32_t cols, std::uint32_t* node,
                             std::int16_t* dx, std::int16_t* dy) {
  const Divider divide(r);
  const auto half = static_cast<std::int32_t>(r / 2);
  for (std::size_t i = 0; i < n; ++i) {
    // Unsigned: dropped points wrap to nonsense that is replaced afterwards.
    const std::uint32_t u = static_cast<std::uint32_t>(x[i]) - static_cast<std::uint32_t>(x0);
    const std::uint32_t v = static_cast<std::uint32_t>(y[i]) - static_cast<std::uint32_t>(y0);
    const std::uint32_t col = divide(u), row = divide(v);
    const std::int32_t a = static_cast<std::int32_t>(u - col * r) - half,
                       b = static_cast<std::int32_t>(v - row * r) - half;
    dx[i] = static_cast<std::int16_t>(a);
    dy[i] = static_cast<std::int16_t>(b);
    node[i] = (row * cols + col) * kTriangles + triangle_of(a, b);
  }
}

}  // namespace

bool ScanSegmenter::Impl::read_near(const ScanPoints& scan) {
  at_x_.resize(scan.size);
  at_y_.resize(scan.size);
  z_.resize(scan.size);
  origin_x_ = origin_y_ = 0;
  dropped_ = 0;
  reach_x_ = reach_y_ = {};
  Interval reach_z;
  constexpr double kNear_mm = 1 << 30, kVertical_mm = kMaxVertical_mm;
  bool near = scan.size > 0;
  for_each_chunk(scan, [&](const float* x, const float* y, const float* z, std::size_t at, std::size_t n) {
    near = near && round_near(x, n, kNear_mm, &at_x_[at], reach_x_) &&
           round_near(y, n, kNear_mm, &at_y_[at], reach_y_) && round_near(z, n, kVertical_mm, &z_[at], reach_z);
    return near;
  });
  return near;
}

void ScanSegmenter::Impl::read_all(const ScanPoints& scan) {
  block_.reset(scan.size);
  for_each_chunk(scan, [&](const float* x, const float* y, const float* z, std::size_t at, std::size_t n) {
    round_into<float>({{x, 1000, 0}, {y, 1000, 0}, {z, 1000, 0}}, n, block_, at);
    return true;
  });
}

bool ScanSegmenter::Impl::take_block() {
  const std::size_t n = block_.size();
  const Interval x = bounds(block_.x_mm, block_), y = bounds(block_.y_mm, block_);
  if (x.low > x.high || x.high - x.low > Divider::kMaxOffset || y.high - y.low > Divider::kMaxOffset) return false;
  origin_x_ = floor_div(x.low, r_) * r_;
  origin_y_ = floor_div(y.low, r_) * r_;
  reach_x_ = {x.low - origin_x_, x.high - origin_x_};
  reach_y_ = {y.low - origin_y_, y.high - origin_y_};
  dropped_ = block_.dropped();
  at_x_.resize(n);
  at_y_.resize(n);
  z_.assign(block_.z_mm.begin(), block_.z_mm.end());
  for (std::size_t i = 0; i < n; ++i) {
    const bool dropped = block_.x_mm[i] == PointBlock::kDroppedX;
    at_x_[i] = dropped ? kDropped : static_cast<std::int32_t>(block_.x_mm[i] - origin_x_);
    at_y_[i] = dropped ? 0 : static_cast<std::int32_t>(block_.y_mm[i] - origin_y_);
  }
  return true;
}

bool ScanSegmenter::Impl::locate() {
  const std::size_t n = at_x_.size();
  if (n > kMaxNodePoints) return false;
  const std::int64_t x0 = floor_div(reach_x_.low, r_) * r_, y0 = floor_div(reach_y_.low, r_) * r_;
  if (reach_x_.high - x0 > Divider::kMaxOffset || reach_y_.high - y0 > Divider::kMaxOffset) return false;
  const auto cell = [&](std::int64_t mm) { return static_cast<std::int32_t>(floor_div(mm, r_)); };
  box_ = {cell(origin_x_ + reach_x_.low), cell(origin_y_ + reach_y_.low), cell(origin_x_ + reach_x_.high) + 1,
          cell(origin_y_ + reach_y_.high) + 1};
  if (static_cast<std::uint64_t>(box_.grown(completion_.halo() + 1).cells()) * kTriangles > kMostNodes) return false;

  node_.resize(n);
  x_.resize(n);
  y_.resize(n);
  locate_points(at_x_.data(), at_y_.data(), n, static_cast<std::int32_t>(x0), static_cast<std::int32_t>(y0),
                static_cast<std::uint32_t>(r_), static_cast<std::uint32_t>(box_.cols()), node_.data(), x_.data(),
                y_.data());
  if (dropped_ > 0)
    for (std::size_t i = 0; i < n; ++i)
      if (at_x_[i] == kDropped) node_[i] = static_cast<std::uint32_t>(node_count());
  return true;
}

// A counting sort. The scan is cut into parts that count for themselves and are gone through side by side.
void ScanSegmenter::Impl::sort() {
  const std::size_t n = at_x_.size(), part = n / kParts, nodes = node_count() + 1;  // the last one: dropped points
  end_.assign((nodes + 1) * kParts, 0);
  std::uint32_t* end = end_.data();
  const std::uint32_t* node = node_.data();
  const auto each = [&](auto&& visit) {
    for (std::size_t i = 0; i < part; ++i)
      for (std::size_t k = 0; k < kParts; ++k) visit(k * part + i, k);
    for (std::size_t i = kParts * part; i < n; ++i) visit(i, kParts - 1);
  };
  each([&](std::size_t i, std::size_t k) { ++end[node[i] * kParts + k]; });
  std::uint32_t sum = 0;
  for (std::size_t k = 0; k < nodes * kParts; ++k) {
    const std::uint32_t count = end[k];
    end[k] = sum;
    sum += count;
  }
  sorted_x_.resize(n);
  sorted_y_.resize(n);
  sorted_z_.resize(n);
  std::int16_t *x = sorted_x_.data(), *y = sorted_y_.data();
  std::int32_t* z = sorted_z_.data();
  each([&](std::size_t i, std::size_t k) {
    const std::uint32_t to = end[node[i] * kParts + k]++;
    x[to] = x_[i];
    y[to] = y_[i];
    z[to] = z_[i];
  });
  // Where parts ended, the next ones began: shifted by one, ends are beginnings again.
  std::copy_backward(end_.begin(), end_.end() - 1, end_.end());
  end_[0] = 0;
}

void ScanSegmenter::Impl::model() {
  nodes_.reset(box_.grown(completion_.halo()), 1);  // beyond there is nothing
  const auto cols = static_cast<std::size_t>(box_.cols()) * kTriangles;
  Node* const first = nodes_.cell({box_.col0, box_.row0});
  const std::size_t row = nodes_.offset({0, 1}) - nodes_.offset({0, 0});
  model_nodes(
      node_count(), [&](std::size_t k) { return points_of(k); }, model_, model_scratch_,
      [&](std::size_t k, const Node& node) { first[k / cols * row + k % cols] = node; });
}

void ScanSegmenter::Impl::link() {
  components_.find(nodes_, convexity_, r_, link_);
  verdict_.clear();
  for (const TileComponents::Component& c : components_.components())
    verdict_.push_back(c.nodes >= static_cast<std::uint32_t>(parameters_.keep_nodes) ? NodeClass::kTerrain
                                                                                     : NodeClass::kRejected);
  judge(components_, verdict_, nodes_);
}

// Only predictions that touch a corner of a square with points have a say.
void ScanSegmenter::Impl::complete() {
  const CellBox& held = nodes_.held();
  const auto cols = static_cast<std::size_t>(held.cols());
  asked_.assign(static_cast<std::size_t>(held.cells()), 0);
  std::size_t k = 0;
  for (std::int32_t row = box_.row0; row < box_.row1; ++row)
    for (std::int32_t col = box_.col0; col < box_.col1; ++col, k += kTriangles) {
      if (end_[k * kParts] == end_[(k + kTriangles) * kParts]) continue;
      const std::size_t square = nodes_.offset({col - 1, row - 1}) / kTriangles;
      for (std::size_t i = 0; i < 3; ++i) std::memset(&asked_[square + i * cols], 1, 3);
    }
  complete_tile(nodes_, completion_, parameters_.kernel_radius, true, asked_, complete_scratch_);
}

// Corners, and the final planes (Eq 12-13) of nodes with points.
void ScanSegmenter::Impl::fit() {
  fit_corners(nodes_, fit_, heights_);
  const CellBox& all = nodes_.interior();
  const auto cols = static_cast<std::size_t>(all.cols());
  const auto r = static_cast<float>(r_);
  const auto eps3 = static_cast<float>(parameters_.terrain_distance_m * 1000);
  const auto below = static_cast<float>(-parameters_.below_m * 1000);
  planes_.assign(node_count() + 1, {});
  std::size_t k = 0;
  for (std::int32_t row = box_.row0; row < box_.row1; ++row)
    for (std::int32_t col = box_.col0; col < box_.col1; ++col)
      for (std::uint8_t t = 0; t < kTriangles; ++t, ++k) {
        const std::uint32_t points = end_[(k + 1) * kParts] - end_[k * kParts];
        if (points == 0) continue;
        const auto x = static_cast<std::size_t>(col - all.col0), y = static_cast<std::size_t>(row - all.row0);
        const auto corner = triangle_corners(t);
        const auto height = [&](int i) {
          return heights_.corner_mm[(y + static_cast<std::size_t>(corner[i].y / 2)) * (cols + 1) + x +
                                    static_cast<std::size_t>(corner[i].x / 2)];
        };
        const std::array<std::int32_t, 3> corners = {heights_.centre_mm[y * cols + x], height(1), height(2)};
        const bool known = std::find(corners.begin(), corners.end(), kUnknownHeight_mm) == corners.end();
        const FinalPlane plane = known ? FinalPlane::through(t, corners) : FinalPlane{};
        if (!known || plane.rise2_mm2() > fit_.steepest_rise2_mm2) {
          counts_.outside += points;
          continue;
        }
        const float a = static_cast<float>(plane.rise_x_mm) / r, b = static_cast<float>(plane.rise_y_mm) / r;
        const float secant = std::sqrt(1 + a * a + b * b);  // p . s + d = vertical distance / secant
        planes_[k] = {a, b, eps3 * secant, below * secant, corners[0]};
      }
}

void ScanSegmenter::Impl::label() {
  const std::size_t n = at_x_.size();
  const LabelPlane* const planes = planes_.data();
  labels_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const LabelPlane& plane = planes[node_[i]];
    const auto dz = static_cast<float>(z_[i] - plane.centre_mm);
    const float above = dz - (plane.a * static_cast<float>(x_[i]) + plane.b * static_cast<float>(y_[i]));
    // Without branches: what is far below is also at most `terrain`.
    static_assert(static_cast<int>(Label::kTerrain) == 1 && static_cast<int>(Label::kObstacle) == 2 &&
                  static_cast<int>(Label::kBelow) == 3);
    labels_[i] = static_cast<Label>(2 - (above <= plane.terrain) + 2 * (above < plane.below));
  }
  if (dropped_ > 0)
    for (std::size_t i = 0; i < n; ++i)
      if (at_x_[i] == kDropped) labels_[i] = Label::kDropped;
  const auto count = [&](Label label) {
    return static_cast<std::uint64_t>(std::count(labels_.begin(), labels_.end(), label));
  };
  counts_.dropped = dropped_;
  counts_.terrain = count(Label::kTerrain);
  counts_.below = count(Label::kBelow);
  counts_.obstacle = n - counts_.dropped - counts_.terrain - counts_.below;
}

std::span<const Label> ScanSegmenter::Impl::segment_as_map(bool compact) {
  SegmentedScan scan = segment_scan(BlockSource(block_, "scan"), parameters_, compact && !is_fixed());
  labels_ = std::move(scan.labels);
  counts_ = scan.counts;
  return labels_;
}

ScanSegmenter::ScanSegmenter(const Parameters& parameters) : impl_(std::make_unique<Impl>(parameters)) {}
ScanSegmenter::~ScanSegmenter() = default;
ScanSegmenter::ScanSegmenter(ScanSegmenter&&) noexcept = default;
ScanSegmenter& ScanSegmenter::operator=(ScanSegmenter&&) noexcept = default;
const LabelCounts& ScanSegmenter::counts() const { return impl_->counts_; }

std::span<const Label> ScanSegmenter::segment(const ScanPoints& scan) { return impl_->segment(scan); }
std::span<const Label> ScanSegmenter::segment(const PointSource& scan) { return impl_->segment(scan); }

}  // namespace btms
