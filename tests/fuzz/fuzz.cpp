#include "tests/fuzz/fuzz.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <map>

#include "io/files/descriptor.h"

namespace btms::fuzz {
namespace {

class Folder {
 public:
  Folder() {
    const std::filesystem::path memory = "/dev/shm";
    std::string name =
        ((std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path()) / "btms-fuzz-XXXXXX")
            .string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// A memory file behind a link with the right extension.
struct MemoryFile {
  Descriptor fd;
  std::filesystem::path path;

  explicit MemoryFile(const std::string& extension)
      : fd(::memfd_create("input", MFD_CLOEXEC)), path(folder() / ("input" + extension)) {
    std::filesystem::create_symlink("/proc/self/fd/" + std::to_string(fd.get()), path);
  }
  void set(Bytes bytes) const {
    if (::ftruncate(fd.get(), 0) != 0 ||
        ::pwrite(fd.get(), bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
      throw std::runtime_error("cannot write a file in memory");
  }
};

}  // namespace

std::span<const Target> targets() {
  static constexpr std::array kTargets = {
      Target{"las", las},       Target{"pcd", pcd},       Target{"ply", ply},         Target{"npy", npy},
      Target{"xyz", xyz},       Target{"kitti", kitti},   Target{"lzf", lzf},         Target{"poses", poses},
      Target{"config", config}, Target{"crs", crs},       Target{"labels", labels},   Target{"manifest", manifest},
      Target{"chunk", chunk},   Target{"layers", layers}, Target{"journal", journal}, Target{"request", request},
      Target{"rounds", rounds},
  };
  return kTargets;
}

const std::filesystem::path& folder() {
  static const Folder only;
  return only.path();
}

std::filesystem::path file_of(Bytes bytes, const std::string& extension) {
  folder();  // made before, so removed after, the files in it
  static std::map<std::string, MemoryFile> files;
  const auto [at, is_new] = files.try_emplace(extension, extension);
  at->second.set(bytes);
  return at->second.path;
}

std::vector<std::uint8_t> content(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::uint8_t Front::byte() {
  const Bytes one = take(1);
  return one.empty() ? std::uint8_t{0} : one[0];
}

Bytes Front::take(std::size_t n) {
  const Bytes front = rest_.first(std::min(n, rest_.size()));
  rest_ = rest_.subspan(front.size());
  return front;
}

}  // namespace btms::fuzz
