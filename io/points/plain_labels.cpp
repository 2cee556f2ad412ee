#include "io/points/plain_labels.h"

#include <algorithm>
#include <array>
#include <atomic>

#include "engine/error.h"
#include "io/files/atomic_file.h"
#include "io/points/input_file.h"
#include "io/points/little_endian.h"

namespace btms {
namespace {

// Written value by label: dropped, terrain, obstacle, below.
template <typename Number>
using Values = std::array<Number, 4>;
constexpr Values<std::uint32_t> kKittiValues = {0, 40, 99, 99};
constexpr Values<std::uint8_t> kByteValues = {0, 1, 0, 0};

template <typename Number>
class PlainLabels final : public LabelWriter {
 public:
  PlainLabels(std::uint64_t points, const std::filesystem::path& path, const Values<Number>& values)
      : points_(points), values_(values), output_(path) {
    output_.reserve(points * sizeof(Number));
  }

  const std::filesystem::path& path() const override { return output_.path(); }

  void write(std::uint64_t first, std::span<const Label> labels) override {
    constexpr std::size_t kBlock = 4096;
    std::array<std::uint8_t, kBlock * sizeof(Number)> bytes;
    for (std::size_t done = 0; done < labels.size();) {
      const std::size_t n = std::min(kBlock, labels.size() - done);
      for (std::size_t i = 0; i < n; ++i)
        store(&bytes[i * sizeof(Number)], values_[static_cast<std::size_t>(labels[done + i]) & 3]);
      output_.write((first + done) * sizeof(Number), std::span(bytes).first(n * sizeof(Number)));
      done += n;
    }
    labelled_ += labels.size();
  }
  void write(std::uint64_t first, std::span<const Label> labels, PointBlock& /*block*/) override {
    write(first, labels);
  }

  void commit() override {
    if (labelled_ != points_) {
      throw Error(ErrorCode::kFailed,
                  "labels of " + std::to_string(labelled_) + " points, expected " + std::to_string(points_),
                  path().string());
    }
    output_.commit();
  }

 private:
  const std::uint64_t points_;
  const Values<Number> values_;
  AtomicFile output_;
  std::atomic<std::uint64_t> labelled_ = 0;
};

template <typename Number>
std::vector<std::uint32_t> read_numbers(const std::filesystem::path& path, std::uint32_t mask) {
  const InputFile file(path);
  if (file.size() % sizeof(Number) != 0) {
    file.refuse("the file has " + std::to_string(file.size()) + " bytes, expected a multiple of " +
                std::to_string(sizeof(Number)));
  }
  std::vector<std::uint8_t> bytes(file.size());
  const InputFile::Session session = file.open();
  session.read(0, bytes);
  session.finish();
  std::vector<std::uint32_t> classes(bytes.size() / sizeof(Number));
  for (std::size_t i = 0; i < classes.size(); ++i) classes[i] = load<Number>(&bytes[i * sizeof(Number)]) & mask;
  return classes;
}

}  // namespace

std::unique_ptr<LabelWriter> create_kitti_labels(const PointFile& input, const std::filesystem::path& path) {
  return std::make_unique<PlainLabels<std::uint32_t>>(input.size(), path, kKittiValues);
}

std::unique_ptr<LabelWriter> create_byte_labels(const PointFile& input, const std::filesystem::path& path) {
  return std::make_unique<PlainLabels<std::uint8_t>>(input.size(), path, kByteValues);
}

std::vector<std::uint32_t> read_kitti_classes(const std::filesystem::path& path) {
  return read_numbers<std::uint32_t>(path, 0xFFFF);
}

std::vector<std::uint32_t> read_byte_classes(const std::filesystem::path& path) {
  return read_numbers<std::uint8_t>(path, 0xFF);
}

}  // namespace btms
