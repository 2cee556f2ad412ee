// Finds the variable length records of a LAS file.
#pragma once

#include "io/points/las_header.h"

namespace btms {

// Appends the VLRs between the header and the points.
void find_vlrs(const InputFile& file, const InputFile::Session& session, std::uint32_t count, LasHeader& header);
// Appends the extended records (LAS 1.4), and returns where they end.
std::uint64_t find_evlrs(const InputFile& file, const InputFile::Session& session, std::uint64_t start,
                         std::uint32_t count, LasHeader& header);

}  // namespace btms
