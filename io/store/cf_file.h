// A CF/NetCDF-4 file, built with HDF5 itself: title, axes, coordinate reference system and layers over one box of
// squares. docs/store_format.md says what each attribute is for and who breaks without it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/lattice/tiles.h"
#include "io/crs/crs.h"
#include "io/store/hdf5.h"
#include "io/store/layers.h"

namespace btms {

inline constexpr int kSchemaVersion = 2;

// An axis and the layers that use it. Ties them the way H5DSattach_scale does (DIMENSION_LIST, REFERENCE_LIST), but
// writes each attribute once: H5DSattach_scale rewrites an axis' list for every layer, which cost a third of a shard's
// HDF5 time.
class CfAxis {
 public:
  CfAxis() = default;
  // Makes `axis`, a one-dimensional dataset, a dimension scale.
  CfAxis(Hdf5Dataset&& axis, const char* name);

  // One axis a dimension, slowest first.
  static void attach(hid_t layer, std::span<CfAxis* const> axes);

  // Writes the list of layers and closes the dataset.
  void close();

 private:
  struct Use {
    hobj_ref_t layer;
    int dimension;
  };
  Hdf5Dataset dataset_;
  std::vector<Use> uses_;
};

// The coordinates along an axis, in units of the reference system.
struct CfAxisValues {
  std::string dataset;  // "y", "x", "tgf/y_corner" or "tgf/x_corner"
  std::vector<double> values;
};
// In this order.
std::vector<CfAxisValues> cf_axes(const CellBox& box, std::int32_t resolution_mm, const std::optional<Crs>& crs);

class CfFile {
 public:
  // Creates axes, the group tgf and, where one is given, the crs variable. `upper`: entries of the lists of further
  // surfaces. Throws Error(kFailed), like all of it.
  CfFile(const CellBox& box, std::size_t upper, std::int32_t resolution_mm, const std::optional<Crs>& crs);

  // Adds a layer; LayerId::kUpper, the lists' own axis, before the other lists. `storage` completes its dataset
  // creation properties (chunks and filters, or virtual sources).
  Hdf5Dataset add_layer(const LayerInfo& layer, const std::function<void(hid_t properties)>& storage);

  // Closes everything and returns the file's bytes. Every dataset handle must have been closed.
  std::vector<std::uint8_t> finish();

 private:
  void add_axes(const CellBox& box, std::int32_t resolution_mm);
  void add_crs();
  CfAxis add_axis(hid_t place, const char* name, bool north_south, const std::vector<double>& values);

  CellBox box_;
  std::size_t upper_count_;
  std::optional<Crs> crs_;
  QuietHdf5 quiet_;
  Hdf5Image image_;
  Hdf5Group tgf_;
  CfAxis x_, y_, tri_, x_corner_, y_corner_, upper_;
};

// Dataspace of a layer.
Hdf5Space layer_space(const LayerInfo& layer, const LayerShape& shape);

}  // namespace btms
