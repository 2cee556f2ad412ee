#include "io/store/cf_file.h"

#include <hdf5_hl.h>

#include <cmath>
#include <cstddef>

namespace btms {
namespace {

// Attributes in the forms netCDF expects: a fixed-length, null-terminated string in a scalar space,
void write_text(hid_t object, const char* name, const std::string& text) {
  const Hdf5Type type(H5Tcopy(H5T_C_S1), "create a string type");
  hdf5_check(H5Tset_size(type.get(), text.size() + 1), "size a string type");
  const Hdf5Space space(H5Screate(H5S_SCALAR), "create a space");
  Hdf5Attribute attribute(H5Acreate2(object, name, type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
                          "create an attribute");
  hdf5_check(H5Awrite(attribute.get(), type.get(), text.c_str()), "write an attribute");
  attribute.close();
}

// and numbers in one dimension, also for a single value.
void write_numbers(hid_t object, const char* name, hid_t type, const void* values, std::size_t n = 1) {
  const hsize_t extent = n;
  const Hdf5Space space(H5Screate_simple(1, &extent, nullptr), "create a space");
  Hdf5Attribute attribute(H5Acreate2(object, name, type, space.get(), H5P_DEFAULT, H5P_DEFAULT), "create an attribute");
  hdf5_check(H5Awrite(attribute.get(), type, values), "write an attribute");
  attribute.close();
}

void write_number(hid_t object, const char* name, double value) { write_numbers(object, name, H5T_IEEE_F64LE, &value); }

hobj_ref_t reference_to(hid_t dataset) {
  hobj_ref_t reference{};
  hdf5_check(H5Rcreate(&reference, dataset, ".", H5R_OBJECT, -1), "refer to an object");
  return reference;
}

constexpr unsigned kOrder = H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED;

Hdf5Properties dataset_properties() {
  Hdf5Properties p(H5Pcreate(H5P_DATASET_CREATE), "create dataset properties");
  hdf5_check(H5Pset_attr_creation_order(p.get(), kOrder), "set attribute order");
  hdf5_check(H5Pset_obj_track_times(p.get(), false), "set times");
  return p;
}

hid_t file_type(Element e) {
  switch (e) {
    case Element::kF32:
      return H5T_IEEE_F32LE;
    case Element::kI32:
      return H5T_STD_I32LE;
    case Element::kI16:
      return H5T_STD_I16LE;
    case Element::kU16:
      return H5T_STD_U16LE;
    default:
      return H5T_STD_U8LE;
  }
}

// As UDUNITS has it; nullptr for what is none of these: crs_wkt says it then.
const char* unit_name(double unit_m) {
  constexpr double kUsSurveyFoot_m = 1200.0 / 3937.0;
  if (unit_m == 1) return "m";
  if (unit_m == 0.3048) return "foot";
  return std::abs(unit_m - kUsSurveyFoot_m) < 1e-12 ? "US_survey_foot" : nullptr;
}

void describe_states(hid_t layer) {
  constexpr std::uint8_t kValues[] = {0, 1, 2, 3, 4};
  write_numbers(layer, "flag_values", H5T_STD_U8LE, kValues, 5);
  write_text(layer, "flag_meanings", "unknown observed predicted obstacle filled");
}

void describe_kinds(hid_t layer) {
  constexpr std::uint8_t kValues[] = {static_cast<std::uint8_t>(UpperKind::kReachable),
                                      static_cast<std::uint8_t>(UpperKind::kDetached)};
  write_numbers(layer, "flag_values", H5T_STD_U8LE, kValues, 2);
  write_text(layer, "flag_meanings", "reachable detached");
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

void CfAxis::attach(hid_t layer, std::span<CfAxis* const> axes) {
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

Hdf5Space layer_space(const LayerInfo& layer, const LayerShape& s) {
  const hsize_t extent[] = {s.planes, s.rows, s.cols};
  const int rank = dimensions(layer.raster);
  return {H5Screate_simple(rank, extent + (3 - rank), nullptr), "create a space"};
}

CfFile::CfFile(const CellBox& box, std::size_t upper, std::int32_t resolution_mm, const std::optional<Crs>& crs)
    : box_(box), upper_count_(upper), crs_(crs) {
  write_text(image_.file(), "Conventions", "CF-1.8");
  write_text(image_.file(), "title", "B-TMS terrain map");
  const std::int32_t version = kSchemaVersion;
  write_numbers(image_.file(), "schema_version", H5T_STD_I32LE, &version);
  const Hdf5Properties group(H5Pcreate(H5P_GROUP_CREATE), "create group properties");
  hdf5_check(H5Pset_link_creation_order(group.get(), kOrder), "set link order");
  hdf5_check(H5Pset_attr_creation_order(group.get(), kOrder), "set attribute order");
  hdf5_check(H5Pset_obj_track_times(group.get(), false), "set times");
  if (crs_) add_crs();
  tgf_ = Hdf5Group(H5Gcreate2(image_.file(), "tgf", H5P_DEFAULT, group.get(), H5P_DEFAULT), "create a group");
  add_axes(box, resolution_mm);
}

void CfFile::add_crs() {
  const Hdf5Space space(H5Screate(H5S_SCALAR), "create a space");
  const Hdf5Properties p = dataset_properties();
  Hdf5Dataset crs(H5Dcreate2(image_.file(), "crs", H5T_STD_I32LE, space.get(), H5P_DEFAULT, p.get(), H5P_DEFAULT),
                  "create crs");
  if (!crs_->grid_mapping_name.empty()) write_text(crs.get(), "grid_mapping_name", crs_->grid_mapping_name);
  for (const auto& [name, value] : crs_->parameters) write_number(crs.get(), name.c_str(), value);
  write_text(crs.get(), "crs_wkt", crs_->wkt);
  const std::int32_t nothing = 0;
  hdf5_check(H5Dwrite(crs.get(), H5T_STD_I32LE, H5S_ALL, H5S_ALL, H5P_DEFAULT, &nothing), "write crs");
  crs.close();
}

CfAxis CfFile::add_axis(hid_t place, const char* name, bool north_south, const std::vector<double>& values) {
  const hsize_t extent = values.size();
  const Hdf5Space space(H5Screate_simple(1, &extent, nullptr), "create a space");
  const Hdf5Properties p = dataset_properties();
  Hdf5Dataset axis(H5Dcreate2(place, name, H5T_IEEE_F64LE, space.get(), H5P_DEFAULT, p.get(), H5P_DEFAULT),
                   "create an axis");
  hdf5_check(H5Dwrite(axis.get(), H5T_IEEE_F64LE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), "write an axis");
  const bool degrees = crs_ && crs_->is_geographic;
  const double unit_m = crs_ ? crs_->linear_unit_m : 1;
  write_text(axis.get(), "standard_name",
             degrees ? (north_south ? "latitude" : "longitude")
                     : (north_south ? "projection_y_coordinate" : "projection_x_coordinate"));
  const char* unit = degrees ? (north_south ? "degrees_north" : "degrees_east") : unit_name(unit_m);
  if (unit) write_text(axis.get(), "units", unit);
  write_text(axis.get(), "axis", north_south ? "Y" : "X");
  write_text(axis.get(), "long_name", north_south ? "northing" : "easting");
  return {std::move(axis), name};
}

std::vector<CfAxisValues> cf_axes(const CellBox& box, std::int32_t resolution_mm, const std::optional<Crs>& crs) {
  // Coordinates of cells first + i * step (+ half a cell), in units of the coordinate reference system.
  const double unit_mm = 1000 * (crs ? crs->linear_unit_m : 1);
  const auto steps = [&](std::int64_t first, int step, std::int64_t n, std::int32_t shift_mm) {
    std::vector<double> v(static_cast<std::size_t>(n));
    for (std::int64_t i = 0; i < n; ++i)
      v[static_cast<std::size_t>(i)] = static_cast<double>((first + i * step) * resolution_mm + shift_mm) / unit_mm;
    return v;
  };
  const std::int32_t half_mm = resolution_mm / 2;
  return {{"y", steps(std::int64_t{box.row1} - 1, -1, box.rows(), half_mm)},
          {"x", steps(box.col0, 1, box.cols(), half_mm)},
          {"tgf/y_corner", steps(box.row1, -1, box.rows() + 1, 0)},
          {"tgf/x_corner", steps(box.col0, 1, box.cols() + 1, 0)}};
}

void CfFile::add_axes(const CellBox& box, std::int32_t resolution_mm) {
  const std::vector<CfAxisValues> axes = cf_axes(box, resolution_mm, crs_);
  const hid_t root = image_.file(), tgf = tgf_.get();
  y_ = add_axis(root, "y", true, axes[0].values);
  x_ = add_axis(root, "x", false, axes[1].values);
  y_corner_ = add_axis(tgf, "y_corner", true, axes[2].values);
  x_corner_ = add_axis(tgf, "x_corner", false, axes[3].values);

  const hsize_t triangles = kTriangles;
  const Hdf5Space space(H5Screate_simple(1, &triangles, nullptr), "create a space");
  const Hdf5Properties p = dataset_properties();
  Hdf5Dataset tri(H5Dcreate2(tgf, "tri", H5T_STD_U8LE, space.get(), H5P_DEFAULT, p.get(), H5P_DEFAULT),
                  "create an axis");
  constexpr std::uint8_t kValues[] = {kEast, kNorth, kWest, kSouth};
  hdf5_check(H5Dwrite(tri.get(), H5T_STD_U8LE, H5S_ALL, H5S_ALL, H5P_DEFAULT, kValues), "write an axis");
  write_text(tri.get(), "long_name", "triangle of the square");
  write_numbers(tri.get(), "flag_values", H5T_STD_U8LE, kValues, kTriangles);
  write_text(tri.get(), "flag_meanings", "east north west south");
  tri_ = CfAxis(std::move(tri), "tri");
}

Hdf5Dataset CfFile::add_layer(const LayerInfo& layer, const std::function<void(hid_t)>& storage) {
  const Hdf5Properties p = dataset_properties();
  const std::vector<std::uint8_t> fill = fill_value(layer);
  const hid_t type = file_type(layer.element);
  hdf5_check(H5Pset_fill_value(p.get(), type, fill.data()), "set a fill value");
  storage(p.get());
  const Hdf5Space space = layer_space(layer, layer_shape(layer, box_, upper_count_));
  Hdf5Dataset data(H5Dcreate2(layer.in_tgf ? tgf_.get() : image_.file(), layer.name, type, space.get(), H5P_DEFAULT,
                              p.get(), H5P_DEFAULT),
                   "create a layer");
  if (layer.marks_missing) write_numbers(data.get(), "_FillValue", type, fill.data());
  write_text(data.get(), "long_name", layer.long_name);
  if (layer.units) write_text(data.get(), "units", layer.units);
  if (layer.scale != 0) {
    write_number(data.get(), "scale_factor", layer.scale);
    write_number(data.get(), "add_offset", 0);
  }
  if (layer.id == LayerId::kClass || layer.id == LayerId::kState) describe_states(data.get());
  if (layer.id == LayerId::kUpperKind) describe_kinds(data.get());
  if (layer.id == LayerId::kUpper) {
    // CF 8.2: the list is the coordinate of its own dimension and says what its indices count.
    write_text(data.get(), "compress", "tri y x");
    upper_ = CfAxis({H5Dopen2(tgf_.get(), layer.name, H5P_DEFAULT), "open a list"}, layer.name);
    return data;
  }
  if (layer.id == LayerId::kElevation) {
    if (crs_ && !crs_->height_standard_name.empty())
      write_text(data.get(), "standard_name", crs_->height_standard_name);
    write_text(data.get(), "ancillary_variables", "elevation_sd class");
  }
  if (crs_) write_text(data.get(), "grid_mapping", "crs");

  if (layer.raster == Raster::kPerUpper) {
    CfAxis* const list[] = {&upper_};
    CfAxis::attach(data.get(), list);
    return data;
  }
  const bool corners = layer.raster == Raster::kPerCorner;
  CfAxis* const axes[] = {&tri_, corners ? &y_corner_ : &y_, corners ? &x_corner_ : &x_};
  CfAxis::attach(data.get(), layer.raster == Raster::kPerTriangle ? std::span(axes) : std::span(axes).subspan(1));
  return data;
}

std::vector<std::uint8_t> CfFile::finish() {
  for (CfAxis* axis : {&x_, &y_, &tri_, &x_corner_, &y_corner_, &upper_}) axis->close();
  tgf_.close();
  return image_.finish();
}

}  // namespace btms
