#include "io/points/npy.h"

#include <charconv>
#include <cstring>
#include <string_view>

#include "io/points/little_endian.h"
#include "io/points/metres.h"
#include "io/points/records.h"

namespace btms {
namespace {

constexpr std::uint64_t kMostHeader = 64 * 1024;  // bytes; NumPy's own are of 64 to 128
constexpr std::uint64_t kMostColumns = 65'536;

struct NpyHeader {
  NumberType type = NumberType::kFloat64;
  bool big_endian = false;
  std::uint64_t rows = 0, columns = 0, data_offset = 0;
};

// The header is a Python literal: {'descr': '<f8', 'fortran_order': False, 'shape': (5, 3), }, keys in any order.
class Parser {
 public:
  Parser(const InputFile& file, std::string_view text, std::uint64_t offset)
      : file_(file), text_(text), offset_(offset) {}

  NpyHeader parse() {
    bool descr = false, order = false, shape = false;
    expect('{');
    while (!take('}')) {
      const std::string_view key = quoted();
      expect(':');
      if (key == "descr" && !descr)
        descr = (read_type(), true);
      else if (key == "fortran_order" && !order)
        order = (read_order(), true);
      else if (key == "shape" && !shape)
        shape = (read_shape(), true);
      else
        refuse("the key \"" + std::string(key.substr(0, 40)) + "\", expected descr, fortran_order and shape once each");
      if (take(',')) continue;
      expect('}');
      break;
    }
    skip_blanks();
    if (at_ != text_.size()) refuse("something behind the header's }");
    if (!(descr && order && shape)) refuse("descr, fortran_order or shape is missing");
    return header_;
  }

 private:
  [[noreturn]] void refuse(const std::string& found) const {
    file_.refuse("NPY header: found " + found, offset_ + at_);
  }
  void skip_blanks() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n')) ++at_;
  }
  bool take(char c) {
    skip_blanks();
    if (at_ == text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  void expect(char c) {
    if (!take(c)) refuse(std::string("something else where a ") + c + " belongs");
  }
  std::string_view quoted() {
    skip_blanks();
    const char quote = at_ < text_.size() ? text_[at_] : ' ';
    const std::size_t end = quote == '\'' || quote == '"' ? text_.find(quote, at_ + 1) : text_.npos;
    if (end == text_.npos) refuse("no text in quotes; expected an array of plain numbers");
    const std::string_view word = text_.substr(at_ + 1, end - at_ - 1);
    at_ = end + 1;
    return word;
  }
  void read_type() {
    const std::string_view type = quoted();
    if (type.size() != 3 || (type[0] != '<' && type[0] != '>') || (type.substr(1) != "f4" && type.substr(1) != "f8"))
      refuse("type " + std::string(type.substr(0, 40)) + ", expected float32 or float64 (<f4, <f8, >f4, >f8)");
    header_.big_endian = type[0] == '>';
    header_.type = float_of(type[2] == '4' ? 4 : 8);
  }
  void read_order() {
    skip_blanks();
    if (text_.substr(at_).starts_with("True"))
      refuse("an array in Fortran order, expected C order; save numpy.ascontiguousarray(a)");
    if (!text_.substr(at_).starts_with("False")) refuse("neither True nor False");
    at_ += 5;
  }
  void read_shape() {
    std::uint64_t shape[2];
    expect('(');
    for (std::uint64_t& n : shape) {
      skip_blanks();
      const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), n);
      if (error != std::errc()) refuse("no whole number in the shape; expected (N, 3) or (N, more)");
      at_ = static_cast<std::size_t>(end - text_.data());
      const bool comma = take(',');
      if (&n == &shape[0] && !comma) refuse("one number in the shape, expected (N, 3) or (N, more)");
    }
    expect(')');
    if (shape[1] < 3 || shape[1] > kMostColumns)
      refuse("rows of " + std::to_string(shape[1]) + " numbers, expected 3 to " + std::to_string(kMostColumns));
    header_.rows = shape[0];
    header_.columns = shape[1];
  }

  const InputFile& file_;
  std::string_view text_;
  std::uint64_t offset_;
  std::size_t at_ = 0;
  NpyHeader header_;
};

NpyHeader read_npy_header(const InputFile& file) {
  std::uint8_t start[12] = {};
  const InputFile::Session session = file.open();
  if (file.size() < sizeof start)
    file.refuse("the file has " + std::to_string(file.size()) + " bytes, shorter than an NPY header");
  session.read(0, start);
  if (std::memcmp(start, "\x93NUMPY", 6) != 0)
    file.refuse("not an NPY file: expected it to start with \"\\x93NUMPY\"", 0);
  const unsigned version = start[6];
  if (version < 1 || version > 3 || start[7] != 0)
    file.refuse("NPY version " + std::to_string(version) + "." + std::to_string(start[7]) + ", expected 1.0 to 3.0", 6);
  const std::uint64_t length = version == 1 ? load<std::uint16_t>(start + 8) : load<std::uint32_t>(start + 8);
  const std::uint64_t offset = version == 1 ? 10 : 12;
  if (length > kMostHeader || length > file.size() - offset)
    file.refuse("header of " + std::to_string(length) + " bytes, expected at most " +
                    std::to_string(std::min(kMostHeader, file.size() - offset)),
                8);
  std::string text(length, '\0');
  session.read(offset, {reinterpret_cast<std::uint8_t*>(text.data()), text.size()});
  session.finish();
  NpyHeader header = Parser(file, text, offset).parse();
  header.data_offset = offset + length;
  return header;
}

class NpyFile final : public PointFile {
 public:
  explicit NpyFile(const std::filesystem::path& path) : PointFile(path), header_(read_npy_header(file_)) {
    layout_ = {header_.data_offset, header_.columns * bytes_of(header_.type)};
    const std::uint64_t room = file_.size() - header_.data_offset;
    if (header_.rows > room / layout_.stride) {
      file_.refuse("header declares " + std::to_string(header_.rows) + " points of " + std::to_string(layout_.stride) +
                       " bytes, found " + std::to_string(room / layout_.stride) +
                       " whole records; the file is truncated",
                   header_.data_offset);
    }
    info_.format = std::string("NPY array, ") + (header_.type == NumberType::kFloat32 ? "float32" : "float64") + ", " +
                   std::to_string(header_.columns) + " columns";
    info_.points = header_.rows;
    if (info_.points == 0) info_.warnings.emplace_back("the file has no points");
    const std::uint64_t trailing = room - header_.rows * layout_.stride;
    if (trailing != 0) info_.warnings.push_back(std::to_string(trailing) + " bytes behind the last point: ignored");
    if (header_.type == NumberType::kFloat32) warn_of_coarse_floats(*this, info_.warnings);
  }

 private:
  void do_read(std::uint64_t first, std::size_t count, PointBlock& block) const override {
    read_records(file_, layout_, first, count, block, [&](const std::uint8_t* records, std::size_t n, std::size_t at) {
      Metres chunk;
      for (std::size_t axis = 0; axis < 3; ++axis)
        chunk.unpack(axis, records + axis * bytes_of(header_.type), layout_.stride, header_.type, n,
                     header_.big_endian);
      chunk.round(n, block, at);
    });
  }

  NpyHeader header_;
  RecordLayout layout_{};
};

}  // namespace

std::unique_ptr<PointFile> open_npy(const std::filesystem::path& path) { return std::make_unique<NpyFile>(path); }

}  // namespace btms
