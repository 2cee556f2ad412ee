// Ties layers to their axes the way H5DSattach_scale does (DIMENSION_LIST, REFERENCE_LIST), but writes each attribute
// once: H5DSattach_scale rewrites an axis' list for every layer, which cost a third of a shard's HDF5 time.
#pragma once

#include <span>
#include <vector>

#include "io/store/hdf5_handle.h"

namespace btms {

// An axis and the layers that use it.
class CfAxis {
 public:
  CfAxis() = default;
  // Makes `axis`, a one-dimensional dataset, a dimension scale.
  CfAxis(Hdf5Dataset&& axis, const char* name);

  // Writes the list of layers and closes the dataset.
  void close();

 private:
  friend void attach_axes(hid_t layer, std::span<CfAxis* const> axes);
  struct Use {
    hobj_ref_t layer;
    int dimension;
  };
  Hdf5Dataset dataset_;
  std::vector<Use> uses_;
};

// One axis a dimension, slowest first.
void attach_axes(hid_t layer, std::span<CfAxis* const> axes);

}  // namespace btms
