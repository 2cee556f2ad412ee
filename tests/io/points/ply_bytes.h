// PLY files made by hand.
#pragma once

#include "tests/io/points/las_bytes.h"
#include "tests/io/points/pcd_bytes.h"

namespace btms::test {

inline std::string ply_header(const std::string& format, std::size_t points,
                              const std::string& properties = "property float x\nproperty float y\nproperty float z\n",
                              const std::string& before = "", const std::string& after = "") {
  return "ply\nformat " + format + " 1.0\ncomment made by hand\n" + before + "element vertex " +
         std::to_string(points) + "\n" + properties + after + "end_header\n";
}

}  // namespace btms::test
