// What a file is, told from a sample of its bytes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace btms {

struct ContentPrint {
  std::string text;             // 32 hex digits: XXH3-128 of the length and the sample
  std::int64_t changed_ns = 0;  // when the file was last written to, since 1970
};

// The sample is all of a small file, and 64 blocks evenly over a large one: files of millions of points that differ do
// so in many places. Throws Error(kFailed) when the file can't be read.
ContentPrint content_print(const std::filesystem::path& file);

}  // namespace btms
