#include "io/client/server_url.h"

#include <algorithm>
#include <charconv>
#include <cstdint>

#include "engine/error.h"

namespace btms {
namespace {

[[noreturn]] void bad(std::string_view url, const char* why) {
  throw Error(ErrorCode::kUsage,
              "'" + std::string(url.substr(0, 200)) + "' is no server's URL: " + why + "; expected http://host[:port]");
}

bool plain(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '.' || c == '_';
}

}  // namespace

std::string ServerUrl::authority() const {
  return (host.find(':') == std::string::npos ? host : "[" + host + "]") + ":" + port;
}

ServerUrl parse_server_url(std::string_view url) {
  constexpr std::string_view kScheme = "http://";
  if (url.starts_with("https://")) bad(url, "TLS is left to a proxy on this machine");
  if (!url.starts_with(kScheme)) bad(url, "it does not begin with http://");
  std::string_view rest = url.substr(kScheme.size());
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  std::string_view authority = rest.substr(0, slash), prefix = rest.substr(slash);
  while (prefix.ends_with('/')) prefix.remove_suffix(1);
  if (!std::all_of(prefix.begin(), prefix.end(), [](char c) { return plain(c) || c == '/' || c == '%' || c == '~'; }))
    bad(url, "its path has letters that do not belong there");
  ServerUrl out;
  out.prefix = prefix;
  if (authority.starts_with('[')) {
    const std::size_t end = authority.find(']');
    if (end == authority.npos) bad(url, "a bracket is not closed");
    out.host = authority.substr(1, end - 1);
    authority.remove_prefix(end + 1);
    if (!std::all_of(out.host.begin(), out.host.end(), [](char c) { return plain(c) || c == ':'; }))
      bad(url, "its address is none");
  } else {
    const std::size_t end = std::min(authority.find(':'), authority.size());
    out.host = authority.substr(0, end);
    authority.remove_prefix(end);
    if (!std::all_of(out.host.begin(), out.host.end(), plain)) bad(url, "its host is none");
  }
  if (out.host.empty()) bad(url, "its host is missing");
  out.port = "80";
  if (!authority.empty()) {
    out.port = authority.substr(1);
    std::uint16_t number = 0;
    const auto [end, error] = std::from_chars(out.port.data(), out.port.data() + out.port.size(), number);
    if (authority.front() != ':' || error != std::errc() || end != out.port.data() + out.port.size() || number == 0)
      bad(url, "its port is none");
  }
  return out;
}

}  // namespace btms
