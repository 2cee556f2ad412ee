// Temporary folders, bytes on disk, and what a refused file must say.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include "engine/error.h"
#include "io/points/little_endian.h"
#include "io/points/point_file.h"

namespace btms::test {

using Bytes = std::vector<std::uint8_t>;

// Removed with everything in it at the end of the scope.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "btms-test-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

  std::filesystem::path write(const std::string& name, std::span<const std::uint8_t> bytes) const {
    std::ofstream out(path_ / name, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return path_ / name;
  }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    return write(name, Bytes(text.begin(), text.end()));
  }

 private:
  std::filesystem::path path_;
};

inline Bytes read_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline std::size_t files_in(const std::filesystem::path& folder) {
  std::size_t n = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++n;
  return n;
}

inline PointBlock read_all(const PointFile& file) {
  PointBlock block;
  file.read(0, file.size(), block);
  return block;
}

// The error has this code, names the file, and its text holds every fragment.
inline void expect_error(ErrorCode code, const std::filesystem::path& file, const std::vector<std::string>& fragments,
                         const std::function<void()>& call) {
  try {
    call();
    ADD_FAILURE() << "accepted " << file << "; expected an error with \"" << fragments.front() << '"';
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_EQ(error.file(), file.string()) << error.what();
    for (const std::string& fragment : fragments)
      EXPECT_NE(std::string(error.what()).find(fragment), std::string::npos)
          << "no \"" << fragment << "\" in: " << error.what();
  }
}

inline void expect_warning(const PointFileInfo& info, const std::string& fragment) {
  for (const std::string& warning : info.warnings)
    if (warning.find(fragment) != std::string::npos) return;
  ADD_FAILURE() << "no warning with \"" << fragment << "\" among " << info.warnings.size()
                << (info.warnings.empty() ? "" : ", the first is: " + info.warnings.front());
}

}  // namespace btms::test
