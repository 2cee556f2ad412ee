#include "io/files/content_print.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <vector>

#include "engine/error.h"
#include "engine/model/digest.h"
#include "io/files/descriptor.h"

namespace btms {

ContentPrint content_print(const std::filesystem::path& file) {
  constexpr std::uint64_t kBlock_bytes = 64 << 10, kBlocks = 64;
  const auto fail = [&](const char* doing) {
    throw Error(ErrorCode::kFailed, std::string("cannot ") + doing + " it: " + system_reason(errno), file.string());
  };
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (fd.get() < 0) fail("open");
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0) fail("stat");
  const auto size = static_cast<std::uint64_t>(info.st_size);
  std::vector<std::uint8_t> sample(sizeof size);
  std::copy_n(reinterpret_cast<const std::uint8_t*>(&size), sizeof size, sample.begin());
  const std::uint64_t blocks = std::min(kBlocks, (size + kBlock_bytes - 1) / kBlock_bytes);
  for (std::uint64_t k = 0; k < blocks; ++k) {
    // The first block at the beginning, the last at the end.
    const std::uint64_t begin = blocks < kBlocks ? k * kBlock_bytes
                                                 : (size - kBlock_bytes) / (kBlocks - 1) * k +
                                                       (k == kBlocks - 1 ? (size - kBlock_bytes) % (kBlocks - 1) : 0);
    std::size_t at = sample.size();
    sample.resize(at + std::min(kBlock_bytes, size - begin));
    for (std::uint64_t from = begin; at < sample.size();) {
      const ssize_t got = ::pread(fd.get(), sample.data() + at, sample.size() - at, static_cast<off_t>(from));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) fail("read");
      if (got == 0) throw Error(ErrorCode::kBadInput, "changed while read", file.string());
      at += static_cast<std::size_t>(got);
      from += static_cast<std::uint64_t>(got);
    }
  }
  const XXH128_hash_t hash = XXH3_128bits(sample.data(), sample.size());
  return {Digest{hash.low64, hash.high64}.hex(),
          std::int64_t{info.st_mtim.tv_sec} * 1'000'000'000 + info.st_mtim.tv_nsec};
}

}  // namespace btms
