// Attributes in the forms netCDF expects.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/store/hdf5_handle.h"

namespace btms {

// Fixed-length, null-terminated string in a scalar space.
void write_text(hid_t object, const char* name, const std::string& text);
// One-dimensional, also for a single value.
void write_numbers(hid_t object, const char* name, hid_t type, const void* values, std::size_t n = 1);
void write_number(hid_t object, const char* name, double value);

}  // namespace btms
