// File name extensions, whose case says nothing: scanners write .LAS.
#pragma once

#include <filesystem>
#include <string>

namespace btms {

// With the dot; letters of ASCII in lower case.
std::string lower_extension(const std::filesystem::path& path);

}  // namespace btms
