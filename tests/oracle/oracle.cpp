#include "tests/oracle/oracle.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace btms::oracle {
namespace {

using Real = long double;
using Vec3 = std::array<Real, 3>;
using Mat3 = std::array<Vec3, 3>;

const Real kPi = std::acos(Real{-1});

Real dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Real length(const Vec3& a) { return std::sqrt(dot(a, a)); }
Vec3 scaled(const Vec3& a, Real f) { return {a[0] * f, a[1] * f, a[2] * f}; }
Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

std::int64_t floor_quotient(std::int64_t a, std::int64_t b) {
  std::int64_t q = a / b;
  while (q * b > a) --q;
  while ((q + 1) * b <= a) ++q;
  return q;
}

std::int64_t whole_mm(double metres) { return std::llround(metres * 1000); }

// Eigenvalues, descending, and the unit eigenvector of the smallest. Cyclic Jacobi rotations.
struct Eigen3 {
  Vec3 values;
  Vec3 smallest;
};
Eigen3 eigen(Mat3 a) {
  Mat3 v{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (int sweep = 0; sweep < 60; ++sweep)
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (a[p][q] == 0) continue;
        const Real tau = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const Real t = (tau >= 0 ? 1 : -1) / (std::fabs(tau) + std::sqrt(1 + tau * tau));
        const Real c = 1 / std::sqrt(1 + t * t);
        const Real s = t * c;
        for (int k = 0; k < 3; ++k) {  // columns
          const Real akp = a[k][p], akq = a[k][q];
          a[k][p] = c * akp - s * akq;
          a[k][q] = s * akp + c * akq;
        }
        for (int k = 0; k < 3; ++k) {  // rows
          const Real apk = a[p][k], aqk = a[q][k];
          a[p][k] = c * apk - s * aqk;
          a[q][k] = s * apk + c * aqk;
        }
        a[p][q] = a[q][p] = 0;
        for (int k = 0; k < 3; ++k) {
          const Real vkp = v[k][p], vkq = v[k][q];
          v[k][p] = c * vkp - s * vkq;
          v[k][q] = s * vkp + c * vkq;
        }
      }
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(), [&](int i, int j) { return a[i][i] > a[j][j]; });
  const int last = order[2];
  const Vec3 smallest{v[0][last], v[1][last], v[2][last]};
  return {{a[order[0]][order[0]], a[order[1]][order[1]], a[last][last]}, scaled(smallest, 1 / length(smallest))};
}

// x of a x = b, by elimination with pivots. False when a is singular.
bool solve(Mat3 a, Vec3 b, Vec3& x) {
  for (int col = 0; col < 3; ++col) {
    int pivot = col;
    for (int row = col + 1; row < 3; ++row)
      if (std::fabs(a[row][col]) > std::fabs(a[pivot][col])) pivot = row;
    if (a[pivot][col] == 0) return false;
    std::swap(a[col], a[pivot]);
    std::swap(b[col], b[pivot]);
    for (int row = col + 1; row < 3; ++row) {
      const Real f = a[row][col] / a[col][col];
      for (int k = col; k < 3; ++k) a[row][k] -= f * a[col][k];
      b[row] -= f * b[col];
    }
  }
  for (int row = 2; row >= 0; --row) {
    x[row] = b[row];
    for (int k = row + 1; k < 3; ++k) x[row] -= a[row][k] * x[k];
    x[row] /= a[row][row];
  }
  return true;
}

// ---- Node model -----------------------------------------------------------------------------------------------------

// A point relative to its square's centre (x, y) and, in the robust fit, to the seed height (z). Whole millimetres.
struct Local {
  std::int64_t x, y, z;
};

// z = a x + b y + c through the selected points; a and b in units of 2^-12, c in 2^-12 mm.
struct RoundedPlane {
  std::int64_t a, b, c;
};
std::int64_t to_4096ths(Real v) { return static_cast<std::int64_t>(std::floor(v * 4096 + Real{0.5})); }

bool least_squares(const std::vector<Local>& points, const std::vector<bool>& selected, RoundedPlane& plane) {
  Real n = 0, mx = 0, my = 0, mz = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (selected[i]) {
      n += 1;
      mx += static_cast<Real>(points[i].x);
      my += static_cast<Real>(points[i].y);
      mz += static_cast<Real>(points[i].z);
    }
  if (n < 3) return false;
  mx /= n;
  my /= n;
  mz /= n;

  Real cxx = 0, cxy = 0, cyy = 0, cxz = 0, cyz = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (selected[i]) {
      const Real x = static_cast<Real>(points[i].x) - mx;
      const Real y = static_cast<Real>(points[i].y) - my;
      const Real z = static_cast<Real>(points[i].z) - mz;
      cxx += x * x;
      cxy += x * y;
      cyy += y * y;
      cxz += x * z;
      cyz += y * z;
    }
  const Real det = cxx * cyy - cxy * cxy;
  if (det <= Real{1e-6} * cxx * cyy) return false;

  // Slopes clamped to what the selection can hold; the offset is the best one for the slopes kept.
  const Real steepest{7.9L};
  const Real a = std::clamp((cxz * cyy - cyz * cxy) / det, -steepest, steepest);
  const Real b = std::clamp((cyz * cxx - cxz * cxy) / det, -steepest, steepest);
  const Real c = mz - a * mx - b * my;
  plane.a = to_4096ths(a);
  plane.b = to_4096ths(b);
  plane.c = to_4096ths(c);
  return true;
}

// The points of the node that its plane is fitted to. Empty when there can't be a plane.
std::vector<Local> select_points(std::vector<Local> points, const Parameters& p) {
  if (p.node_model == NodeModel::kPca) return points;

  std::vector<std::int64_t> heights;
  for (const Local& q : points) heights.push_back(q.z);
  const std::int64_t seed = seed_height_mm(heights);
  for (Local& q : points) q.z -= seed;

  std::vector<bool> selected;
  for (const Local& q : points) selected.push_back(q.z <= whole_mm(p.seed_height_m));

  for (int refit = 0; refit < 3; ++refit) {
    RoundedPlane plane{};
    if (!least_squares(points, selected, plane)) return {};
    const std::int64_t reach = 4096 * whole_mm(p.refit_distance_m);
    std::vector<bool> next;
    for (const Local& q : points) next.push_back(4096 * q.z - plane.a * q.x - plane.b * q.y <= plane.c + reach);
    if (next == selected) break;
    selected = next;
  }

  std::vector<Local> result;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (selected[i]) result.push_back({points[i].x, points[i].y, points[i].z + seed});
  return result;
}

// Eq 2 and 3. `centre_x`, `centre_y`: the square's centre in metres.
void fit_plane(const std::vector<Local>& points, Real centre_x, Real centre_y, Node& node) {
  if (points.size() < 3) return;
  const Real n = static_cast<Real>(points.size());

  Vec3 mean{};
  for (const Local& q : points) {
    mean[0] += static_cast<Real>(q.x) / 1000;
    mean[1] += static_cast<Real>(q.y) / 1000;
    mean[2] += static_cast<Real>(q.z) / 1000;
  }
  mean = scaled(mean, 1 / n);

  Mat3 covariance{};
  for (const Local& q : points) {
    const Vec3 e =
        minus({static_cast<Real>(q.x) / 1000, static_cast<Real>(q.y) / 1000, static_cast<Real>(q.z) / 1000}, mean);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) covariance[i][j] += e[i] * e[j] / n;
  }

  const Eigen3 pca = eigen(covariance);
  node.l1 = pca.values[0];
  node.l2 = pca.values[1];
  node.l3 = std::max(Real{0}, pca.values[2]);
  if (node.l1 < Real{1e-12L}) return;
  if (std::fabs(node.l2 - Real{1e-6L}) < Real{1e-12L}) node.close_call = true;
  if (node.l2 <= Real{1e-6L}) return;  // a line, to the rounding of the coordinates

  node.has_plane = true;
  node.mean = {centre_x + mean[0], centre_y + mean[1], mean[2]};
  node.normal = pca.smallest[2] < 0 ? scaled(pca.smallest, -1) : pca.smallest;

  // Eq 3
  node.weight = (1 - node.l3 / node.l1) * ((node.l2 - node.l3) / node.l1);
}

// ---- Decisions ------------------------------------------------------------------------------------------------------

// How near to a threshold the engine's rounding may turn a decision.
constexpr Real kCloseNormal = 2e-4L;  // products of normals kept in steps of 2^-15
constexpr Real kCloseHeight = 2e-3L;  // metres; heights and means kept in millimetres
constexpr Real kCloseSupport = 2e-3L;
constexpr Real kCloseWeight = 1e-4L;

// Eq 6. The displacement is three-dimensional.
bool lcc(const Node& i, const Node& j, const Parameters& p, bool& close) {
  const Vec3 d = minus(j.mean, i.mean);
  const Real distance = length(d);
  const Real similar = 1 - std::sin(std::min(distance * static_cast<Real>(p.normal_similarity), kPi / 2));
  const Real flat = distance * std::sin(std::min(static_cast<Real>(p.plane_distance), kPi / 2));

  const Real a = dot(i.normal, j.normal) - similar;
  const Real b = flat - std::fabs(dot(j.normal, d));
  const Real c = flat - std::fabs(dot(i.normal, d));
  const bool surely_not = a < -kCloseNormal || b < -kCloseHeight || c < -kCloseHeight;
  const bool surely = a > kCloseNormal && b > kCloseHeight && c > kCloseHeight;
  close = !surely && !surely_not;
  return a >= 0 && b >= 0 && c >= 0;
}

// B-TGS. Marks the candidates whose component has at least keep_nodes nodes.
void search_terrain(std::map<NodeKeyTuple, Node>& nodes, const Parameters& p) {
  std::set<NodeKeyTuple> seen;
  for (const auto& [start, first] : nodes) {
    if (!first.candidate || seen.count(start)) continue;
    std::vector<NodeKeyTuple> component{start};
    seen.insert(start);
    for (std::size_t next = 0; next < component.size(); ++next) {
      const NodeKeyTuple key = component[next];
      Node& node = nodes.at(key);
      for (const NodeKeyTuple& other_key : neighbours_of(key)) {
        const auto other = nodes.find(other_key);
        if (other == nodes.end() || !other->second.candidate) continue;
        bool close = false;
        const bool linked = lcc(node, other->second, p, close);
        if (close) node.close_call = other->second.close_call = true;
        if (linked && seen.insert(other_key).second) component.push_back(other_key);
      }
    }
    if (static_cast<std::int64_t>(component.size()) >= p.keep_nodes)
      for (const NodeKeyTuple& key : component) nodes.at(key).terrain = true;
  }
}

// ---- Completion -----------------------------------------------------------------------------------------------------

struct Influence {
  const Node* node;
  Real k;
};

Real height_mean(const std::vector<Influence>& around, Real sum_k) {  // Eq 8
  Real sum = 0;
  for (const Influence& i : around) sum += i.k * i.node->mean[2];
  return sum / sum_k;
}

// Eq 9 and 10. False when the sum vanishes.
bool normal_mean(const std::vector<Influence>& around, Real sum_k, const Vec3& m_j, Vec3& s_j) {
  Vec3 sum{};
  for (const Influence& i : around) {
    const Vec3 delta = minus(m_j, i.node->mean);
    const Real flat = std::sqrt(delta[0] * delta[0] + delta[1] * delta[1]);
    Vec3 s = i.node->normal;
    if (flat > 0)
      s = scaled({-delta[0] * delta[2] / flat, -delta[1] * delta[2] / flat, flat}, 1 / length(delta));  // Eq 9
    for (int axis = 0; axis < 3; ++axis) sum[axis] += i.k * s[axis] / sum_k;                            // Eq 10
  }
  if (length(sum) < Real{1e-9L}) return false;
  s_j = scaled(sum, 1 / length(sum));
  return true;
}

// Instead of Eq 8-10: height a and gradient g that minimise
//   sum k_i (z_i - a - g . D_i)^2 + rho sum k_i |g - g_i|^2,   D_i = (m_i - x_j)_xy,   rho = (r/2)^2.
bool plane_mean(const std::vector<Influence>& around, Real r, Vec3& m_j, Vec3& s_j) {
  const Real rho = (r / 2) * (r / 2);
  Mat3 left{};
  Vec3 right{};
  for (const Influence& i : around) {
    const Vec3& s = i.node->normal;
    const Vec3& m = i.node->mean;
    const Vec3 row{1, m[0] - m_j[0], m[1] - m_j[1]};  // derivative of a + g . D by (a, g_x, g_y)
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) left[p][q] += i.k * row[p] * row[q];
      right[p] += i.k * row[p] * m[2];
    }
    for (int axis = 0; axis < 2; ++axis) {
      left[axis + 1][axis + 1] += rho * i.k;
      right[axis + 1] += rho * i.k * (-s[axis] / s[2]);
    }
  }
  Vec3 x{};
  if (!solve(left, right, x)) return false;
  m_j[2] = x[0];
  const Vec3 up{-x[1], -x[2], 1};
  s_j = scaled(up, 1 / length(up));
  return true;
}

Real weight_mean(const std::vector<Influence>& around, Real sum_k, const Vec3& s_j) {  // Eq 11
  Real sum = 0;
  for (const Influence& i : around) sum += i.k * i.node->weight * dot(i.node->normal, s_j);
  return std::clamp(sum / sum_k, Real{0}, Real{1});
}

// Predicts one node that isn't terrain from the terrain nodes (never from predictions).
void complete(Node& node, const NodeKeyTuple& key, const std::vector<const Node*>& terrain, const Parameters& p,
              std::int64_t r_mm) {
  const Real r = static_cast<Real>(r_mm) / 1000;
  const Real l = static_cast<Real>(p.kernel_radius) * r;
  const auto [x_j, y_j] = centroid_of(key, r_mm);

  std::vector<Influence> around;
  Real sum_k = 0;
  for (const Node* i : terrain) {
    const Real dx = i->mean[0] - x_j, dy = i->mean[1] - y_j;
    const Real d = std::sqrt(dx * dx + dy * dy);
    if (!(d < l)) continue;
    around.push_back({i, kernel(d, l)});
    sum_k += around.back().k;
  }
  node.support = sum_k;
  if (std::fabs(sum_k - static_cast<Real>(p.min_support)) < kCloseSupport) node.close_call = true;
  if (!(sum_k > static_cast<Real>(p.min_support)) || !(sum_k > Real{1e-6L})) return;

  Vec3 m_j{x_j, y_j, height_mean(around, sum_k)};
  Vec3 s_j{};
  const bool made = p.completion_normals == CompletionNormals::kFaithful ? normal_mean(around, sum_k, m_j, s_j)
                                                                         : plane_mean(around, r, m_j, s_j);
  if (!made) return;
  const Real w_j = weight_mean(around, sum_k, s_j);

  const Real steepness = s_j[2] - std::cos(static_cast<Real>(p.slope_max_deg) * kPi / 180);
  if (std::fabs(steepness) < kCloseNormal || w_j < kCloseWeight) node.close_call = true;
  if (steepness < 0 || !(w_j > 0)) return;

  node.predicted = true;
  node.mean = m_j;
  node.normal = s_j;
  node.weight = w_j;
}

// ---- Corners and final planes ---------------------------------------------------------------------------------------

Vec3 corner_position(const CornerKey& c, std::int64_t r_mm, Real z) {
  return {static_cast<Real>(c.first) * static_cast<Real>(r_mm) / 2000,
          static_cast<Real>(c.second) * static_cast<Real>(r_mm) / 2000, z};
}

// Height of the node's plane at x, y: Eq 2 solved for z.
Real plane_height(const Node& n, Real x, Real y) {
  return n.mean[2] - (n.normal[0] * (x - n.mean[0]) + n.normal[1] * (y - n.mean[1])) / n.normal[2];
}

Real corner_height(const CornerKey& corner, const std::vector<const Node*>& incident, std::int64_t r_mm) {
  const Vec3 at = corner_position(corner, r_mm, 0);
  Real sum_w = 0, sum_wz = 0, sum_z = 0;
  for (const Node* n : incident) {
    const Real dx = at[0] - n->mean[0], dy = at[1] - n->mean[1];
    const Real w = n->weight / std::max(std::sqrt(dx * dx + dy * dy), Real{0.001L});
    const Real z = plane_height(*n, at[0], at[1]);
    sum_w += w;
    sum_wz += w * z;
    sum_z += z;
  }
  return sum_w > 0 ? sum_wz / sum_w : sum_z / static_cast<Real>(incident.size());
}

// Eq 12 and 13, with the cross product normalised and turned upward.
void fit_final_plane(const NodeKeyTuple& key, Node& node, const Parameters& p, std::int64_t r_mm) {
  for (const Real z : node.corner_z)
    if (std::isnan(z)) return;
  const std::array<CornerKey, 3> corners = corners_of(key);
  const Vec3 c1 = corner_position(corners[0], r_mm, node.corner_z[0]);
  const Vec3 c2 = corner_position(corners[1], r_mm, node.corner_z[1]);
  const Vec3 c3 = corner_position(corners[2], r_mm, node.corner_z[2]);
  const Vec3 mean{(c1[0] + c2[0] + c3[0]) / 3, (c1[1] + c2[1] + c3[1]) / 3, (c1[2] + c2[2] + c3[2]) / 3};
  Vec3 s = cross(minus(c2, c1), minus(c3, c1));
  s = scaled(s, 1 / length(s));
  if (s[2] < 0) s = scaled(s, -1);

  node.final_normal = s;
  node.final_d = -dot(s, mean);
  const Real steepness = s[2] - std::cos(static_cast<Real>(p.slope_max_deg) * kPi / 180);
  node.close_final = std::fabs(steepness) < Real{2e-3L};  // corners 3 mm apart from the engine's, over half an r
  node.has_final = steepness >= 0;
}

}  // namespace

// ---- Lattice --------------------------------------------------------------------------------------------------------

NodeKeyTuple locate(std::int64_t x_mm, std::int64_t y_mm, std::int64_t r_mm) {
  const std::int64_t col = floor_quotient(x_mm, r_mm), row = floor_quotient(y_mm, r_mm);
  const std::int64_t u = x_mm - (col * r_mm + r_mm / 2), v = y_mm - (row * r_mm + r_mm / 2);
  const bool p = u + v < 0, q = u - v < 0;
  if (!p && !q) return {row, col, 0};  // east:  v > -u or on it, u > v or on it
  if (!p && q) return {row, col, 1};   // north
  if (p && q) return {row, col, 2};    // west
  return {row, col, 3};                // south
}

std::array<CornerKey, 3> corners_of(const NodeKeyTuple& node) {
  const auto [row, col, triangle] = node;
  const CornerKey a{2 * col, 2 * row}, b{2 * col + 2, 2 * row}, c{2 * col + 2, 2 * row + 2}, d{2 * col, 2 * row + 2};
  const CornerKey m{2 * col + 1, 2 * row + 1};
  if (triangle == 0) return {m, b, c};
  if (triangle == 1) return {m, c, d};
  if (triangle == 2) return {m, d, a};
  return {m, a, b};
}

std::vector<NodeKeyTuple> neighbours_of(const NodeKeyTuple& node) {
  const auto [row, col, triangle] = node;
  const std::array<CornerKey, 3> own = corners_of(node);
  std::vector<NodeKeyTuple> result;
  for (std::int64_t other_row = row - 2; other_row <= row + 2; ++other_row)
    for (std::int64_t other_col = col - 2; other_col <= col + 2; ++other_col)
      for (int t = 0; t < 4; ++t) {
        const NodeKeyTuple other{other_row, other_col, t};
        if (other == node) continue;
        bool shared = false;
        for (const CornerKey& p : own)
          for (const CornerKey& q : corners_of(other)) shared = shared || p == q;
        if (shared) result.push_back(other);
      }
  return result;
}

std::array<long double, 2> centroid_of(const NodeKeyTuple& node, std::int64_t r_mm) {
  std::array<Real, 2> sum{};
  for (const CornerKey& c : corners_of(node)) {
    const Vec3 at = corner_position(c, r_mm, 0);
    sum[0] += at[0];
    sum[1] += at[1];
  }
  return {sum[0] / 3, sum[1] / 3};
}

// Whole 32 mm buckets from the lowest point upward until k points are in; their mean, floored.
std::int64_t seed_height_mm(const std::vector<std::int64_t>& z_mm) {
  const std::int64_t lowest = *std::min_element(z_mm.begin(), z_mm.end());
  const std::int64_t n = static_cast<std::int64_t>(z_mm.size());
  const std::int64_t k = std::clamp<std::int64_t>(n / 4, 1, 20);
  std::int64_t taken = 0, sum = 0;
  for (int bucket = 0; bucket < 64 && taken < k; ++bucket)
    for (const std::int64_t z : z_mm)
      if ((z - lowest) / 32 == bucket) {
        ++taken;
        sum += z;
      }
  return floor_quotient(sum, taken);
}

long double kernel(long double d, long double l) {
  const Real x = d / l;
  if (!(x < 1)) return 0;
  if (x > Real{0.95L}) {
    // Near d = l the terms of Eq 7 cancel; with t = 2 pi (1 - d/l) it is
    //   (t (2 + cos t) / 3 - sin t) / (2 pi) = sum over m >= 2 of (-1)^m t^(2m+1) (1/(3 (2m)!) - 1/(2m+1)!) / (2 pi).
    const Real t = 2 * kPi * (1 - x);
    Real sum = 0, power = t, even = 1;  // t^(2m+1), (2m)!
    for (int m = 0; m <= 12; ++m) {
      if (m >= 2) sum += (m % 2 ? -1 : 1) * power * (1 / (3 * even) - 1 / (even * (2 * m + 1)));
      power *= t * t;
      even *= (2 * m + 1) * (2 * m + 2);
    }
    return sum / (2 * kPi);
  }
  return (2 + std::cos(2 * kPi * x)) * (1 - x) / 3 + std::sin(2 * kPi * x) / (2 * kPi);
}

// ---- The whole method -----------------------------------------------------------------------------------------------

Result run(const std::vector<Point>& points, const Parameters& p) {
  Result result;
  std::map<NodeKeyTuple, Node>& nodes = result.nodes;
  const std::int64_t r_mm = whole_mm(p.resolution_m);
  const Real steepest = std::cos(static_cast<Real>(p.slope_max_deg) * kPi / 180);

  // Eq 1: points into nodes, relative to the square's centre.
  std::map<NodeKeyTuple, std::vector<Local>> points_of;
  for (const Point& q : points) {
    const NodeKeyTuple key = locate(q.x_mm, q.y_mm, r_mm);
    const auto [row, col, triangle] = key;
    points_of[key].push_back({q.x_mm - (col * r_mm + r_mm / 2), q.y_mm - (row * r_mm + r_mm / 2), q.z_mm});
  }

  // Eq 2-5: planes, weights, candidates.
  for (const auto& [key, own] : points_of) {
    const auto [row, col, triangle] = key;
    Node& node = nodes[key];
    node.count = static_cast<int>(own.size());
    fit_plane(select_points(own, p), static_cast<Real>(col * r_mm + r_mm / 2) / 1000,
              static_cast<Real>(row * r_mm + r_mm / 2) / 1000, node);
    if (!node.has_plane) continue;
    if (std::fabs(node.normal[2] - steepest) < kCloseNormal) node.close_call = true;
    node.candidate = node.normal[2] >= steepest && node.count >= p.min_points;  // Eq 5
  }

  // Eq 6 and B-TGS.
  search_terrain(nodes, p);

  // Eq 7-11: every node near terrain that isn't terrain itself, all from the same terrain.
  std::vector<const Node*> terrain;
  std::set<NodeKeyTuple> near_terrain;
  const std::int64_t reach = static_cast<std::int64_t>(std::ceil(p.kernel_radius)) + 1;
  for (const auto& [key, node] : nodes) {
    if (!node.terrain) continue;
    terrain.push_back(&node);
    const auto [row, col, triangle] = key;
    for (std::int64_t dr = -reach; dr <= reach; ++dr)
      for (std::int64_t dc = -reach; dc <= reach; ++dc)
        for (int t = 0; t < 4; ++t) near_terrain.insert({row + dr, col + dc, t});
  }
  for (const NodeKeyTuple& key : near_terrain) {
    const auto known = nodes.find(key);
    if (known != nodes.end() && known->second.terrain) continue;
    Node node = known == nodes.end() ? Node{} : known->second;
    complete(node, key, terrain, p, r_mm);
    if (node.count > 0 || node.support > 0) nodes[key] = node;  // std::map: pointers in `terrain` stay valid
  }

  // Corners: from every incident node that is terrain, observed or predicted.
  std::map<CornerKey, std::vector<const Node*>> incident;
  for (const auto& [key, node] : nodes)
    if (node.terrain || node.predicted)
      for (const CornerKey& c : corners_of(key)) incident[c].push_back(&node);
  for (const auto& [corner, around] : incident) result.corners[corner] = corner_height(corner, around, r_mm);

  // Eq 12 and 13: every node with a known corner, whether it has points or not.
  for (const auto& [corner, z] : result.corners)
    for (std::int64_t row = floor_quotient(corner.second, 2) - 1; row <= floor_quotient(corner.second, 2); ++row)
      for (std::int64_t col = floor_quotient(corner.first, 2) - 1; col <= floor_quotient(corner.first, 2); ++col)
        for (int t = 0; t < 4; ++t) {
          const NodeKeyTuple key{row, col, t};
          const std::array<CornerKey, 3> own = corners_of(key);
          for (int i = 0; i < 3; ++i)
            if (own[i] == corner) nodes[key].corner_z[i] = z;
        }
  for (auto& [key, node] : nodes) fit_final_plane(key, node, p, r_mm);

  // Eq 14.
  for (const Point& q : points) {
    const Node& node = nodes.at(locate(q.x_mm, q.y_mm, r_mm));
    if (!node.has_final) {
      result.labels.push_back(Label::kObstacle);
      result.distances.push_back(kUnknown);
      continue;
    }
    const Vec3 at{static_cast<Real>(q.x_mm) / 1000, static_cast<Real>(q.y_mm) / 1000, static_cast<Real>(q.z_mm) / 1000};
    const Real distance = dot(at, node.final_normal) + node.final_d;
    result.distances.push_back(distance);
    if (distance < -static_cast<Real>(p.below_m))
      result.labels.push_back(Label::kBelow);
    else if (distance <= static_cast<Real>(p.terrain_distance_m))
      result.labels.push_back(Label::kTerrain);
    else
      result.labels.push_back(Label::kObstacle);
  }
  return result;
}

}  // namespace btms::oracle
