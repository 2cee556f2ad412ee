// Labels as the class of a LAS file: every other byte stays as it is.
#include <algorithm>
#include <array>
#include <atomic>
#include <utility>

#include "engine/error.h"
#include "io/files/atomic_file.h"
#include "io/points/buffer_pool.h"
#include "io/points/las.h"
#include "io/points/las_header.h"

namespace btms {
namespace {

constexpr std::size_t kBlockBytes = 1 << 19;  // records per pread and pwrite, within the second-level cache

// ASPRS classes; the entry of a dropped point is not used.
constexpr std::array<std::uint8_t, 4> kClassOf = {0, 2, 1, 7};
static_assert(static_cast<int>(Label::kTerrain) == 1 && static_cast<int>(Label::kObstacle) == 2 &&
              static_cast<int>(Label::kBelow) == 3);

class LasLabels final : public LabelWriter {
 public:
  LasLabels(const PointFile& input, const std::filesystem::path& path)
      : input_(input.path()), header_(read_las_header(input_)), output_(path) {
    if (header_.points != input.size()) input_.refuse("changed since it was opened: another number of points");
    output_.reserve(input_.size());
    copy(0, header_.points_offset);
    copy(header_.points_end(), input_.size());
  }

  const std::filesystem::path& path() const override { return output_.path(); }

  void write(std::uint64_t first, std::span<const Label> labels) override {
    const std::size_t stride = header_.record_bytes, most = kBlockBytes / stride;
    const InputFile::Session session = input_.open();
    BufferPool::Lease buffer = pool_.take(kBlockBytes);
    for (std::size_t done = 0; done < labels.size();) {
      const std::size_t n = std::min(most, labels.size() - done);
      const std::span<std::uint8_t> records = buffer.bytes().first(n * stride);
      session.read(header_.points_offset + (first + done) * stride, records);
      put(first + done, labels.subspan(done, n), records);
      done += n;
    }
  }

  void write(std::uint64_t first, std::span<const Label> labels, PointBlock& block) override {
    const std::size_t bytes = labels.size() * header_.record_bytes;
    if (!block.keep_records || block.bytes.size() < bytes)
      throw Error(ErrorCode::kFailed, "labels without the records they belong to", path().string());
    put(first, labels, std::span(block.bytes).first(bytes));
  }

  void commit() override {
    if (labelled_ != header_.points) {
      throw Error(ErrorCode::kFailed,
                  "labels of " + std::to_string(labelled_) + " points, expected " + std::to_string(header_.points),
                  path().string());
    }
    input_.open().finish();
    output_.commit();
  }

 private:
  void put(std::uint64_t first, std::span<const Label> labels, std::span<std::uint8_t> records) {
    classify(labels, records);
    const std::uint64_t at = header_.points_offset + first * header_.record_bytes;
    output_.write(at, records);
    output_.start_writing(at, records.size());
    labelled_ += labels.size();
  }

  void classify(std::span<const Label> labels, std::span<std::uint8_t> records) const {
    const auto [offset, mask] = las_class_byte(header_.format);
    const std::size_t stride = header_.record_bytes;
    std::uint8_t* byte = records.data() + offset;
    for (const Label label : labels) {
      const auto wanted = static_cast<std::uint8_t>((*byte & ~mask) | kClassOf[static_cast<std::uint8_t>(label) & 3]);
      *byte = label == Label::kDropped ? *byte : wanted;
      byte += stride;
    }
  }

  // Header and records, and what lies behind the points.
  void copy(std::uint64_t from, std::uint64_t to) {
    const InputFile::Session session = input_.open();
    BufferPool::Lease buffer = pool_.take(kBlockBytes);
    while (from < to) {
      const std::span<std::uint8_t> bytes = buffer.bytes().first(std::min<std::uint64_t>(kBlockBytes, to - from));
      session.read(from, bytes);
      output_.write(from, bytes);
      from += bytes.size();
    }
  }

  InputFile input_;
  LasHeader header_;
  AtomicFile output_;
  BufferPool pool_;
  std::atomic<std::uint64_t> labelled_ = 0;
};

}  // namespace

std::unique_ptr<LabelWriter> create_las_labels(const PointFile& input, const std::filesystem::path& path) {
  return std::make_unique<LasLabels>(input, path);
}

std::vector<std::uint32_t> read_las_classes(const std::filesystem::path& path) {
  const InputFile file(path);
  const LasHeader header = read_las_header(file);
  const auto [offset, mask] = las_class_byte(header.format);
  const std::size_t stride = header.record_bytes, most = kBlockBytes / stride;
  const InputFile::Session session = file.open();
  std::vector<std::uint8_t> records(most * stride);
  std::vector<std::uint32_t> classes(header.points);
  for (std::size_t done = 0; done < classes.size();) {
    const std::size_t n = std::min(most, classes.size() - done);
    session.read(header.points_offset + done * stride, std::span(records).first(n * stride));
    for (std::size_t i = 0; i < n; ++i) classes[done + i] = records[i * stride + offset] & mask;
    done += n;
  }
  session.finish();
  return classes;
}

}  // namespace btms
