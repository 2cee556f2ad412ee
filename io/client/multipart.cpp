#include "io/client/multipart.h"

#include <charconv>

#include "engine/error.h"

namespace btms {
namespace {

[[noreturn]] void bad(const char* why) {
  throw Error(ErrorCode::kBadInput, std::string("the answer's parts are damaged: ") + why);
}

class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes)
      : bytes_(bytes), left_(reinterpret_cast<const char*>(bytes.data()), bytes.size()) {}

  bool take(std::string_view text) {
    if (!left_.starts_with(text)) return false;
    left_.remove_prefix(text.size());
    return true;
  }
  std::string_view line() {
    const std::size_t end = left_.find("\r\n");
    if (end == left_.npos) bad("a line has no end");
    if (end > 1024) bad("a line is too long");
    const std::string_view out = left_.substr(0, end);
    left_.remove_prefix(end + 2);
    return out;
  }
  std::span<const std::uint8_t> take_bytes(std::size_t size) {
    if (size > left_.size()) bad("a part is longer than the answer");
    const auto out = bytes_.subspan(bytes_.size() - left_.size(), size);
    left_.remove_prefix(size);
    return out;
  }
  bool at_end() const { return left_.empty(); }

 private:
  std::span<const std::uint8_t> bytes_;
  std::string_view left_;
};

HttpHeaders headers_of(Reader& reader) {
  HttpHeaders headers;
  for (std::string_view line = reader.line(); !line.empty(); line = reader.line()) {
    const std::size_t colon = line.find(": ");
    if (colon == line.npos || headers.size() >= 16) bad("a header is none");
    std::string name(line.substr(0, colon));
    for (char& c : name)
      if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    if (!headers.emplace(std::move(name), line.substr(colon + 2)).second) bad("a header is there twice");
  }
  return headers;
}

std::size_t length_of(const HttpHeaders& headers) {
  const auto it = headers.find("content-length");
  if (it == headers.end()) bad("a part has no length");
  std::size_t size = 0;
  const char* end = it->second.data() + it->second.size();
  const auto [at, error] = std::from_chars(it->second.data(), end, size);
  if (error != std::errc() || at != end) bad("a part's length is none");
  return size;
}

}  // namespace

std::vector<Part> parse_multipart(const std::string& content_type, std::span<const std::uint8_t> bytes,
                                  std::size_t most) {
  constexpr std::string_view kType = "multipart/mixed; boundary=";
  if (!content_type.starts_with(kType) || content_type.size() == kType.size() ||
      content_type.size() > kType.size() + 70)
    bad("the answer has another type");
  const std::string boundary = "--" + content_type.substr(kType.size());
  Reader reader(bytes);
  std::vector<Part> parts;
  while (true) {
    if (!reader.take(boundary)) bad("a boundary is missing");
    if (reader.take("--\r\n")) break;
    if (!reader.take("\r\n")) bad("a boundary goes on");
    if (parts.size() >= most) bad("there are too many");
    Part part;
    part.headers = headers_of(reader);
    part.body = reader.take_bytes(length_of(part.headers));
    if (!reader.take("\r\n")) bad("a part does not end where it says");
    parts.push_back(std::move(part));
  }
  if (!reader.at_end()) bad("something follows them");
  return parts;
}

}  // namespace btms
