#include "io/store/upper_layers.h"

#include <algorithm>
#include <cstring>

#include "engine/error.h"

namespace btms {
namespace {

bool before(const UpperNode& a, const UpperNode& b) { return a.node != b.node ? a.node < b.node : a.z_mm < b.z_mm; }

// Calls fn with the field of an UpperNode that a layer holds.
template <class Fn>
void with_field(LayerId id, Fn&& fn) {
  switch (id) {
    case LayerId::kUpper:
      return fn(&UpperNode::node);
    case LayerId::kUpperHeight:
      return fn(&UpperNode::z_mm);
    case LayerId::kUpperSlopeX:
      return fn(&UpperNode::slope_x);
    case LayerId::kUpperSlopeY:
      return fn(&UpperNode::slope_y);
    case LayerId::kUpperSd:
      return fn(&UpperNode::sd_mm);
    case LayerId::kUpperCount:
      return fn(&UpperNode::count);
    case LayerId::kUpperKind:
      return fn(&UpperNode::kind);
    default:
      return;
  }
}

template <class PlaceAt>
bool ascend_in(const CellBox& box, std::size_t count, PlaceAt&& at) {
  const std::int64_t nodes = box.cells() * kTriangles;
  for (std::size_t i = 0; i < count; ++i) {
    if (at(i) >= nodes || (i > 0 && at(i) < at(i - 1))) return false;
    if (i >= kMaxUpperPerNode && at(i) == at(i - kMaxUpperPerNode)) return false;
  }
  return true;
}

}  // namespace

bool is_sound_list(std::span<const UpperNode> upper, const CellBox& box) {
  if (!ascend_in(box, upper.size(), [&](std::size_t i) { return upper[i].node; })) return false;
  for (std::size_t i = 0; i < upper.size(); ++i) {
    if (i > 0 && before(upper[i], upper[i - 1])) return false;
    if (upper[i].kind != UpperKind::kReachable && upper[i].kind != UpperKind::kDetached) return false;
  }
  return true;
}

bool are_sound_places(std::span<const std::uint8_t> values, const CellBox& box) {
  return ascend_in(box, values.size() / sizeof(UpperNode::node), [&](std::size_t i) {
    std::uint32_t place;
    std::memcpy(&place, values.data() + i * sizeof place, sizeof place);
    return place;
  });
}

std::vector<ListedUpper> list_upper(const TerrainTile& tile) {
  const auto rows = static_cast<std::uint32_t>(tile.box.rows()), cols = static_cast<std::uint32_t>(tile.box.cols());
  std::vector<ListedUpper> listed = tile.upper;
  for (ListedUpper& u : listed) {
    const std::uint32_t cell = u.node / kTriangles, row = cell / cols, col = cell % cols;
    u.node = (u.node % kTriangles * rows + (rows - 1 - row)) * cols + col;
  }
  std::stable_sort(listed.begin(), listed.end(), before);
  return listed;
}

std::vector<UpperNode> unlist_upper(std::vector<ListedUpper>&& listed, const CellBox& box) {
  if (!is_sound_list(listed, box))
    throw Error(ErrorCode::kVerification, "the lists of further surfaces hold what no map has");
  const auto rows = static_cast<std::uint32_t>(box.rows()), cols = static_cast<std::uint32_t>(box.cols());
  for (UpperNode& u : listed) {
    const std::uint32_t col = u.node % cols, line = u.node / cols, row = rows - 1 - line % rows;
    u.node = (row * cols + col) * kTriangles + line / rows;
  }
  std::stable_sort(listed.begin(), listed.end(), before);
  return std::move(listed);
}

std::vector<std::uint8_t> gather_upper(const LayerInfo& layer, std::span<const ListedUpper> listed) {
  std::vector<std::uint8_t> out;
  with_field(layer.id, [&](auto field) {
    const std::size_t size = sizeof(listed[0].*field);
    out.resize(listed.size() * size);
    for (std::size_t i = 0; i < listed.size(); ++i) std::memcpy(out.data() + i * size, &(listed[i].*field), size);
  });
  return out;
}

void scatter_upper(const LayerInfo& layer, std::span<const std::uint8_t> values, std::span<ListedUpper> listed) {
  with_field(layer.id, [&](auto field) {
    const std::size_t size = sizeof(listed[0].*field);
    for (std::size_t i = 0; i < listed.size(); ++i) std::memcpy(&(listed[i].*field), values.data() + i * size, size);
  });
}

}  // namespace btms
