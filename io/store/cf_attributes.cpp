#include "io/store/cf_attributes.h"

namespace btms {

void write_text(hid_t object, const char* name, const std::string& text) {
  const Hdf5Type type(H5Tcopy(H5T_C_S1), "create a string type");
  hdf5_check(H5Tset_size(type.get(), text.size() + 1), "size a string type");
  const Hdf5Space space(H5Screate(H5S_SCALAR), "create a space");
  Hdf5Attribute attribute(H5Acreate2(object, name, type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
                          "create an attribute");
  hdf5_check(H5Awrite(attribute.get(), type.get(), text.c_str()), "write an attribute");
  attribute.close();
}

void write_numbers(hid_t object, const char* name, hid_t type, const void* values, std::size_t n) {
  const hsize_t extent = n;
  const Hdf5Space space(H5Screate_simple(1, &extent, nullptr), "create a space");
  Hdf5Attribute attribute(H5Acreate2(object, name, type, space.get(), H5P_DEFAULT, H5P_DEFAULT), "create an attribute");
  hdf5_check(H5Awrite(attribute.get(), type, values), "write an attribute");
  attribute.close();
}

void write_number(hid_t object, const char* name, double value) { write_numbers(object, name, H5T_IEEE_F64LE, &value); }

}  // namespace btms
