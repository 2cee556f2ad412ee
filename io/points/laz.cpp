#include "io/points/laz.h"

#include <fcntl.h>

#include <array>
#include <cerrno>
#include <mutex>
#include <utility>

#include "engine/error.h"
#include "io/files/descriptor.h"
#include "io/points/input_file.h"
#include "io/points/las.h"
#include "io/points/laz_child.h"
#include "io/points/laz_layout.h"

namespace btms {
namespace {

namespace fs = std::filesystem;

// A LAS file without a name, which vanishes with this object; its path works in this process.
class NamelessLas {
 public:
  // Everything but the points, which are a hole in it.
  NamelessLas(const fs::path& laz, const LazLayout& layout) : laz_(laz), points_at_(layout.head.size()) {
    std::error_code error;
    fs::path folder = fs::temp_directory_path(error);
    if (error) folder = "/tmp";
    fd_ = Descriptor(::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
    if (fd_.get() < 0) fail("cannot make a temporary file in " + folder.string());
    if (::ftruncate(fd_.get(), static_cast<off_t>(layout.las_bytes())) != 0)
      fail("no room for its points in " + folder.string());
    write(0, layout.head);
    write(layout.las_bytes() - layout.tail.size(), layout.tail);
  }

  fs::path path() const { return fs::path("/proc/self/fd") / std::to_string(fd_.get()); }

  void write_points(std::uint64_t at, std::span<const std::uint8_t> bytes) const { write(points_at_ + at, bytes); }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::kFailed, what + " (TMPDIR chooses another place): " + system_reason(errno), laz_.string());
  }
  void write(std::uint64_t at, std::span<const std::uint8_t> bytes) const {
    while (!bytes.empty()) {
      const ssize_t n = ::pwrite(fd_.get(), bytes.data(), bytes.size(), static_cast<off_t>(at));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) fail("cannot write its points to a temporary file");
      at += static_cast<std::uint64_t>(n);
      bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
  }

  const fs::path laz_;
  std::uint64_t points_at_;
  Descriptor fd_;
};

// Errors are about the file that was given.
template <typename Call>
auto in_the_name_of(const fs::path& laz, Call&& call) {
  try {
    return call();
  } catch (const Error& error) {
    if (error.file() == laz.string()) throw;
    std::string text = error.what();
    if (text.starts_with(error.file() + ":")) text.erase(0, text.find(": ") + 2);
    throw Error(error.code(), text, laz.string());
  }
}

struct Decoded {
  NamelessLas file;
  std::unique_ptr<PointFile> las;
};

std::shared_ptr<const Decoded> decode(const fs::path& laz, const std::string& crs = {}) {
  return in_the_name_of(laz, [&] {
    const LazLayout layout = read_laz_layout(InputFile(laz));
    auto decoded = std::make_shared<Decoded>(NamelessLas(laz, layout), nullptr);
    const std::uint64_t bytes = layout.points * layout.record_bytes;
    std::uint64_t done = 0;
    if (bytes != 0)
      run_laz_decoder(LazDecoder::built(laz, layout.points, layout.record_bytes), laz, bytes,
                      [&](std::span<const std::uint8_t> piece) {
                        decoded->file.write_points(done, piece);
                        done += piece.size();
                      });
    decoded->las = open_las(decoded->file.path(), crs);
    return std::shared_ptr<const Decoded>(std::move(decoded));
  });
}

// Keeps the last few alive: files are read piece by piece, by several threads, and mostly one after the other.
void keep(std::shared_ptr<const Decoded> decoded) {
  constexpr std::size_t kKept = 8;
  static std::mutex mutex;
  static std::array<std::shared_ptr<const Decoded>, kKept> kept;
  static std::size_t next = 0;
  const std::lock_guard lock(mutex);
  kept[next++ % kKept].swap(decoded);
}

class LazFile final : public PointFile {
 public:
  LazFile(const fs::path& path, std::string crs) : PointFile(path), crs_(std::move(crs)) {
    info_ = in_the_name_of(path, [&] {
      const LazLayout layout = read_laz_layout(file_);
      return open_las(NamelessLas(path, layout).path(), crs_)->info();
    });
    info_.label_bytes = std::exchange(info_.bytes, file_.size());
    info_.format[2] = 'Z';  // "LAS 1.2, ..."
  }

  // Who comes meanwhile waits: it wants the same.
  std::shared_ptr<const Decoded> decoded() const {
    const std::lock_guard lock(mutex_);
    file_.open().finish();  // notices that the file changed
    std::shared_ptr<const Decoded> decoded = decoded_.lock();
    if (decoded) return decoded;
    decoded = decode(path(), crs_);
    file_.open().finish();
    if (decoded->las->size() != size()) file_.refuse("changed while read: another number of points");
    decoded_ = decoded;
    keep(decoded);
    return decoded;
  }

 private:
  void do_read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    const auto all = decoded();
    in_the_name_of(path(), [&] { all->las->read(first, count, block); });
  }

  const std::string crs_;     // wanted
  mutable std::mutex mutex_;  // guards decoded_
  mutable std::weak_ptr<const Decoded> decoded_;
};

class LazLabels final : public LabelWriter {
 public:
  LazLabels(std::shared_ptr<const Decoded> input, const fs::path& path)
      : input_(std::move(input)), labels_(create_las_labels(*input_->las, path)) {}
  void write(std::uint64_t first, std::span<const Label> labels) override { labels_->write(first, labels); }
  void write(std::uint64_t first, std::span<const Label> labels, PointBlock& block) override {
    labels_->write(first, labels, block);
  }
  void commit() override { labels_->commit(); }
  const fs::path& path() const override { return labels_->path(); }

 private:
  std::shared_ptr<const Decoded> input_;
  std::unique_ptr<LabelWriter> labels_;
};

}  // namespace

std::unique_ptr<PointFile> open_laz(const fs::path& path, const std::string& crs) {
  return std::make_unique<LazFile>(path, crs);
}

std::unique_ptr<LabelWriter> create_laz_labels(const PointFile& input, const fs::path& path) {
  return std::make_unique<LazLabels>(dynamic_cast<const LazFile&>(input).decoded(), path);
}

std::vector<std::uint32_t> read_laz_classes(const fs::path& path) {
  const auto decoded = decode(path);
  return in_the_name_of(path, [&] { return read_las_classes(decoded->file.path()); });
}

}  // namespace btms
