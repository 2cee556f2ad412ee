#include "io/export/cloud_geotiff.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <vector>

#include "engine/error.h"
#include "io/files/atomic_file.h"
#include "io/files/descriptor.h"

namespace btms {

namespace fs = std::filesystem;

void write_cloud_geotiff(const fs::path& plain, const fs::path& file) {
  const fs::path from = fs::absolute(plain), to = fs::absolute(file);
  fs::path partial = to;
  partial += ".part" + std::to_string(::getpid());
  std::vector<std::string> words = {"gdal_translate", "-q", "-of", "COG", "--config", "GDAL_CACHEMAX", "256"};
  for (const char* option :
       {"COMPRESS=DEFLATE", "PREDICTOR=YES", "OVERVIEW_RESAMPLING=NEAREST", "BIGTIFF=IF_SAFER", "NUM_THREADS=2"})
    words.insert(words.end(), {"-co", option});
  words.insert(words.end(), {from.string(), partial.string()});
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  if (const int error = ::posix_spawnp(&child, arguments[0], nullptr, nullptr, arguments.data(), environ); error != 0)
    throw Error(
        ErrorCode::kFailed,
        error == ENOENT ? "there is no gdal_translate: install gdal-bin" : "gdal_translate could not be started",
        file.string());
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  std::error_code failed;
  const bool made = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  if (made) {
    const Descriptor fd(::open(partial.c_str(), O_RDONLY | O_CLOEXEC));
    if (fd.get() < 0 || ::fsync(fd.get()) != 0) failed = std::error_code(errno, std::generic_category());
    if (!failed) fs::rename(partial, to, failed);
  }
  if (!made || failed) {
    std::error_code ignored;
    fs::remove(partial, ignored);
    fs::remove(partial.string() + ".aux.xml", ignored);
    throw Error(ErrorCode::kFailed, "gdal_translate could not write it" + (failed ? ": " + failed.message() : ""),
                file.string());
  }
  sync_folder(to.parent_path());
}

}  // namespace btms
