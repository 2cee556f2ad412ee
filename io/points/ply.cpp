#include "io/points/ply.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "io/points/ply_header.h"
#include "io/points/records.h"

namespace btms {
namespace {

// Walks elements with lists: their length is known only from their content.
class Walker {
 public:
  Walker(const InputFile& file, const PlyHeader& header)
      : file_(file), session_(file.open()), big_endian_(header.data == PlyData::kBigEndian) {}

  // Where `element`, which starts at `at`, ends.
  std::uint64_t end_of(const PlyElement& element, std::uint64_t at) {
    if (element.has_lists() && element.count > file_.size() - at) refuse(element, at);  // a list has a byte or more
    if (!element.has_lists()) {
      std::uint64_t bytes = 0;
      if (__builtin_mul_overflow(element.count, element.stride(), &bytes) || bytes > file_.size() - at)
        refuse(element, at);
      return at + bytes;
    }
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const PlyProperty& property : element.properties) {
        std::uint64_t bytes = bytes_of(property.type);
        if (property.list_count) {
          bytes *= length(element, at, *property.list_count);
          at += bytes_of(*property.list_count);
        }
        if (bytes > file_.size() - at) refuse(element, at);
        at += bytes;
      }
    }
    return at;
  }

 private:
  [[noreturn]] void refuse(const PlyElement& element, std::uint64_t at) const {
    file_.refuse("header declares " + std::to_string(element.count) + " of \"" + element.name.substr(0, 40) +
                     "\", the file ends before; it is truncated",
                 at);
  }

  std::uint64_t length(const PlyElement& element, std::uint64_t at, NumberType type) {
    const std::size_t bytes = bytes_of(type);
    if (bytes > file_.size() - at) refuse(element, at);
    if (at < window_at_ || at + bytes > window_at_ + window_.size()) {
      constexpr std::uint64_t kWindow = 1 << 18;
      window_.resize(std::min(kWindow, file_.size() - at));
      session_.read(window_at_ = at, window_);
    }
    Metres number;
    number.unpack(0, &window_[at - window_at_], bytes, type, 1, big_endian_);
    if (number.axis[0][0] < 0) file_.refuse("a list of negative length in \"" + element.name.substr(0, 40) + "\"", at);
    return static_cast<std::uint64_t>(number.axis[0][0]);
  }

  const InputFile& file_;
  InputFile::Session session_;
  bool big_endian_;
  std::uint64_t window_at_ = 0;
  std::vector<std::uint8_t> window_;
};

class PlyFile final : public PointFile {
 public:
  explicit PlyFile(const std::filesystem::path& path) : PointFile(path), header_(read_ply_header(file_)) {
    constexpr const char* kDataNames[] = {"ascii", "binary, little-endian", "binary, big-endian"};
    info_.format = std::string("PLY ") + kDataNames[static_cast<int>(header_.data)];
    info_.points = header_.points().count;
    if (info_.points == 0) info_.warnings.emplace_back("the file has no points");
    const bool more = header_.vertex + 1 < header_.elements.size();  // nobody follows what comes behind the points
    if (header_.data == PlyData::kAscii) {
      open_ascii();
      if (lines_->trailing() && !more) info_.warnings.emplace_back("there are lines behind the last point: ignored");
      return;
    }
    const std::uint64_t trailing = open_binary();
    if (trailing > 0 && !more)
      info_.warnings.push_back(std::to_string(trailing) + " bytes behind the last point: ignored");
    if (header_.xyz[0].type == NumberType::kFloat32 || header_.xyz[1].type == NumberType::kFloat32)
      warn_of_coarse_floats(*this, info_.warnings);
  }

 private:
  void do_read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    if (lines_) return read_lines(*lines_, file_, first, count, block);
    read_records(file_, layout_, first, count, block,
                 [&](const std::uint8_t* records, std::size_t n, std::size_t at) { unpack(records, n, block, at); });
  }

  void open_ascii() {
    LineLayout layout;
    layout.offset = header_.data_offset;
    layout.line = header_.lines + 1;
    for (std::size_t i = 0; i < header_.vertex; ++i) {
      const PlyElement& element = header_.elements[i];
      if (!element.properties.empty() && __builtin_add_overflow(layout.skip, element.count, &layout.skip))
        file_.refuse("the counts of the elements overflow");
    }
    layout.points = info_.points;
    layout.columns = header_.points().properties.size();
    for (std::size_t axis = 0; axis < 3; ++axis) layout.xyz[axis] = header_.xyz[axis].column;
    lines_.emplace(file_, layout);
  }

  // Returns how many bytes lie behind the points.
  std::uint64_t open_binary() {
    layout_ = {header_.data_offset, header_.points().stride()};
    Walker walker(file_, header_);
    for (std::size_t i = 0; i < header_.vertex; ++i)
      layout_.offset = walker.end_of(header_.elements[i], layout_.offset);
    const std::uint64_t room = file_.size() - layout_.offset;
    if (info_.points > room / layout_.stride) {
      file_.refuse("header declares " + std::to_string(info_.points) + " points of " + std::to_string(layout_.stride) +
                       " bytes, found " + std::to_string(room / layout_.stride) +
                       " whole records; the file is truncated",
                   layout_.offset);
    }
    return room - info_.points * layout_.stride;
  }

  void unpack(const std::uint8_t* records, std::size_t n, PointBlock& block, std::size_t at) const {
    Metres chunk;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const PlyHeader::Axis& from = header_.xyz[axis];
      chunk.unpack(axis, records + from.offset, layout_.stride, from.type, n, header_.data == PlyData::kBigEndian);
    }
    chunk.round(n, block, at);
  }

  PlyHeader header_;
  std::optional<PointLines> lines_;  // ascii only
  RecordLayout layout_{};            // binary only
};

}  // namespace

std::unique_ptr<PointFile> open_ply(const std::filesystem::path& path) { return std::make_unique<PlyFile>(path); }

}  // namespace btms
