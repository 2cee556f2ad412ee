#include "apps/server/representation.h"

#include <charconv>

#include "apps/server/problem.h"
#include "io/files/deflate.h"

namespace btms {
namespace {

constexpr std::size_t kSmall_bytes = 1024;                  // fits a packet with its head: nothing to gain
constexpr std::size_t kLarge_bytes = std::size_t{1} << 30;  // the compressor counts in 32 bits
constexpr std::string_view kSuffix = "-gzip\"";

// Formats that are not compressed already. Heights shrink to a quarter, JSON to a fifth.
bool shrinks(const std::string& type) {
  return !type.starts_with("image/png") && !type.starts_with("image/tiff") && !type.starts_with("application/zip") &&
         !type.starts_with("font/");
}

std::string_view trimmed(std::string_view text) {
  const std::size_t from = text.find_first_not_of(" \t");
  return from == text.npos ? std::string_view() : text.substr(from, text.find_last_not_of(" \t") - from + 1);
}

// Whether a weight like ;q=0.000 refuses what it stands behind.
bool refused(std::string_view weight) {
  const std::size_t at = weight.find_first_of("qQ");
  if (at == weight.npos) return false;
  const std::string_view value = trimmed(weight.substr(at + 1));
  return value.starts_with("=") && trimmed(value.substr(1)).find_first_not_of("0.") == value.npos;
}

bool takes_gzip(const Request& request) {
  const std::string said = request.header("accept-encoding");
  bool any = false;
  for (std::string_view rest = said; !rest.empty();) {
    const std::size_t end = std::min(rest.find(','), rest.size());
    const std::string_view entry = rest.substr(0, end), coding = trimmed(entry.substr(0, entry.find(';')));
    const bool taken = !refused(entry.substr(std::min(entry.find(';'), entry.size())));
    if (coding == "gzip" || coding == "x-gzip") return taken;
    if (coding == "*") any = taken;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return any;
}

std::string compressed_tag(const std::string& etag) { return etag.substr(0, etag.size() - 1) + std::string(kSuffix); }

// nullptr when it would not get smaller.
Body gzip(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> out(bytes.size());
  const auto size = Deflater(Wrapper::kGzip).deflate(bytes, out);
  if (!size) return nullptr;
  out.resize(*size);
  out.shrink_to_fit();
  return std::make_shared<const std::vector<std::uint8_t>>(std::move(out));
}

std::string* find_header(Response& response, std::string_view name) {
  for (auto& [key, value] : response.headers)
    if (key == name) return &value;
  return nullptr;
}

struct Range {
  std::size_t first, last;  // both are in it
};

// One range of bytes that the body has; nothing when the header is none of the kind that is served (several ranges,
// other units, malformed), so that the whole is sent. Throws Problem("range") when the body has no such bytes.
std::optional<Range> range_of(std::string_view said, std::size_t size) {
  if (!said.starts_with("bytes=")) return {};
  said = trimmed(said.substr(6));
  const std::size_t dash = said.find('-');
  if (dash == said.npos) return {};
  const auto number = [](std::string_view text) -> std::optional<std::uint64_t> {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || end != text.data() + text.size()) return {};
    return error == std::errc::result_out_of_range ? std::optional(~std::uint64_t{0}) : std::optional(value);
  };
  const auto first = number(said.substr(0, dash)), last = number(said.substr(dash + 1));
  const bool has_first = dash > 0, has_last = dash + 1 < said.size();
  if ((has_first && !first) || (has_last && !last) || (!has_first && !has_last)) return {};
  if (!has_first) {
    if (*last == 0) throw Problem("range");
    return Range{*last < size ? size - *last : 0, size - 1};
  }
  if (has_last && *last < *first) return {};
  if (*first >= size) throw Problem("range");
  return Range{*first, has_last && *last < size ? *last : size - 1};
}

}  // namespace

std::optional<std::string> held_validator(const Request& request, const std::string& etag) {
  const std::string held = request.header("if-none-match");
  if (trimmed(held) == "*") return etag;
  for (const std::string& tag : {compressed_tag(etag), etag})
    if (held.find(tag) != held.npos) return tag;
  return {};
}

bool represent(const Request& request, const std::string& scope, BodyCache& bodies, bool at_once, Response& response) {
  std::string* etag = find_header(response, "ETag");
  if (response.status == 304) response.set("Vary", "Accept-Encoding");
  if (response.status != 200 || !response.body || response.events) return true;

  if (etag && request.method == "GET" && request.headers.contains("range")) {
    const std::string when = request.header("if-range");
    if (when.empty() || when == *etag) {
      const std::size_t size = response.body->size();
      try {
        if (const auto range = range_of(request.header("range"), size)) {
          const auto begin = response.body->begin();
          response.set("Content-Range", "bytes " + std::to_string(range->first) + "-" + std::to_string(range->last) +
                                            "/" + std::to_string(size));
          response.set("Vary", "Accept-Encoding");
          response.body = std::make_shared<const std::vector<std::uint8_t>>(
              begin + static_cast<std::ptrdiff_t>(range->first), begin + static_cast<std::ptrdiff_t>(range->last) + 1);
          response.status = 206;
          return true;
        }
      } catch (const Problem& problem) {
        response = problem.response();
        response.set("Content-Range", "bytes */" + std::to_string(size));
        return true;
      }
    }
  }

  const bool worth =
      shrinks(response.content_type) && response.body->size() >= kSmall_bytes && response.body->size() <= kLarge_bytes;
  if (worth && takes_gzip(request)) {
    const std::string key = etag ? scope + compressed_tag(*etag) : std::string();
    Body small = etag ? bodies.find(key) : nullptr;
    if (!small && at_once) return false;
    if (!small) small = gzip(*response.body);
    if (small) {
      if (etag) {
        bodies.keep(key, small);
        *etag = compressed_tag(*etag);
      }
      response.body = std::move(small);
      response.set("Content-Encoding", "gzip");
      response.set("Vary", "Accept-Encoding");
      return true;
    }
  }
  if (worth || etag) response.set("Vary", "Accept-Encoding");
  if (etag) response.set("Accept-Ranges", "bytes");
  return true;
}

}  // namespace btms
