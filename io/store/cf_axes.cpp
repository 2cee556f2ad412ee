#include "io/store/cf_axes.h"

#include <hdf5_hl.h>

#include <cstddef>

namespace btms {
namespace {

hobj_ref_t reference_to(hid_t dataset) {
  hobj_ref_t reference{};
  hdf5_check(H5Rcreate(&reference, dataset, ".", H5R_OBJECT, -1), "refer to an object");
  return reference;
}

}  // namespace

CfAxis::CfAxis(Hdf5Dataset&& axis, const char* name) : dataset_(std::move(axis)) {
  hdf5_check(H5DSset_scale(dataset_.get(), name), "make an axis");
}

void CfAxis::close() {
  if (!uses_.empty()) {
    const Hdf5Type type(H5Tcreate(H5T_COMPOUND, sizeof(Use)), "create a type");
    hdf5_check(H5Tinsert(type.get(), "dataset", offsetof(Use, layer), H5T_STD_REF_OBJ), "create a type");
    hdf5_check(H5Tinsert(type.get(), "dimension", offsetof(Use, dimension), H5T_NATIVE_INT), "create a type");
    const hsize_t extent = uses_.size();
    const Hdf5Space space(H5Screate_simple(1, &extent, nullptr), "create a space");
    // The in-memory type has padding; the stored one must not, or its bytes would not be the same every time.
    Hdf5Type packed(H5Tcopy(type.get()), "create a type");
    hdf5_check(H5Tpack(packed.get()), "pack a type");
    Hdf5Attribute list(
        H5Acreate2(dataset_.get(), "REFERENCE_LIST", packed.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
        "create an attribute");
    hdf5_check(H5Awrite(list.get(), type.get(), uses_.data()), "write an attribute");
    list.close();
  }
  dataset_.close();
}

void attach_axes(hid_t layer, std::span<CfAxis* const> axes) {
  const Hdf5Type type(H5Tvlen_create(H5T_STD_REF_OBJ), "create a type");
  const hsize_t extent = axes.size();
  const Hdf5Space space(H5Screate_simple(1, &extent, nullptr), "create a space");
  const hobj_ref_t own = reference_to(layer);
  std::vector<hobj_ref_t> references;
  references.reserve(axes.size());
  std::vector<hvl_t> lists;
  for (std::size_t d = 0; d < axes.size(); ++d) {
    references.push_back(reference_to(axes[d]->dataset_.get()));
    lists.push_back({1, &references.back()});
    axes[d]->uses_.push_back({own, static_cast<int>(d)});
  }
  Hdf5Attribute list(H5Acreate2(layer, "DIMENSION_LIST", type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
                     "create an attribute");
  hdf5_check(H5Awrite(list.get(), type.get(), lists.data()), "write an attribute");
  list.close();
}

}  // namespace btms
