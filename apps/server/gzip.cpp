#include "apps/server/gzip.h"

#include <zlib.h>

#include <algorithm>
#include <string_view>

namespace btms {
namespace {

constexpr std::size_t kLeast_bytes = 1024;
constexpr std::string_view kEnding = "-gzip\"";
constexpr int kGzip = 15 + 16;  // window bits, with gzip's header

bool is_text(std::string_view type) {
  return type.starts_with("text/") || type.find("json") != type.npos || type.find("yaml") != type.npos ||
         type.find("svg") != type.npos;
}

// "gzip" among the codings, not with q=0.
bool accepts_gzip(std::string_view accepted) {
  for (std::size_t at = 0; at < accepted.size();) {
    const std::size_t end = std::min(accepted.find(',', at), accepted.size());
    std::string_view coding = accepted.substr(at, end - at);
    at = end + 1;
    while (coding.starts_with(' ')) coding.remove_prefix(1);
    const std::string_view name = coding.substr(0, coding.find_first_of("; "));
    if (name != "gzip" && name != "*") continue;
    const std::size_t q = coding.find("q=");
    return q == coding.npos || coding.substr(q + 2).find_first_of("123456789") != std::string_view::npos;
  }
  return false;
}

// Nothing when zlib can't.
Body compressed(const std::vector<std::uint8_t>& bytes) {
  z_stream stream{};
  if (deflateInit2(&stream, 1, Z_DEFLATED, kGzip, 8, Z_DEFAULT_STRATEGY) != Z_OK) return nullptr;
  std::vector<std::uint8_t> out(deflateBound(&stream, bytes.size()));
  stream.next_in = const_cast<Bytef*>(bytes.data());  // it does not write there
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(out.size());
  const int status = deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  if (status != Z_STREAM_END || out.size() >= bytes.size()) return nullptr;
  return std::make_shared<const std::vector<std::uint8_t>>(std::move(out));
}

void mark(Response& response) {
  for (auto& [name, value] : response.headers)
    if (name == "ETag" && value.ends_with('"')) value.replace(value.size() - 1, 1, kEnding);
}

}  // namespace

bool undo_gzip_validators(Request& request) {
  const auto header = request.headers.find("if-none-match");
  if (header == request.headers.end()) return false;
  bool found = false;
  for (std::size_t at; (at = header->second.find(kEnding)) != std::string::npos; found = true)
    header->second.erase(at, kEnding.size() - 1);
  return found;
}

void gzip_for(const Request& request, bool had_gzip_validator, Response& response) {
  if (response.status == 304 && had_gzip_validator) mark(response);
  if (!response.body || response.events || !is_text(response.content_type) || response.body->size() < kLeast_bytes)
    return;
  response.set("Vary", "Accept-Encoding");
  if (response.status != 200 || !accepts_gzip(request.header("accept-encoding"))) return;
  Body body = compressed(*response.body);
  if (!body) return;
  response.body = std::move(body);
  response.set("Content-Encoding", "gzip");
  mark(response);
}

}  // namespace btms
