#include "apps/server/message.h"

#include "apps/server/problem.h"

namespace btms {
namespace {

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  throw Problem("bad_target", "a % without two hexadecimal digits");
}

std::string decoded(std::string_view text, bool plus_is_space) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      if (text.size() - i < 3) throw Problem("bad_target", "a % without two hexadecimal digits");
      c = static_cast<char>(hex_digit(text[i + 1]) * 16 + hex_digit(text[i + 2]));
      i += 2;
    } else if (c == '+' && plus_is_space) {
      c = ' ';
    }
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) throw Problem("bad_target", "a control character");
    out.push_back(c);
  }
  return out;
}

}  // namespace

void parse_target(std::string_view target, Request& request) {
  if (target.empty() || target.front() != '/') throw Problem("bad_target", "it must begin with /");
  const std::size_t question = target.find('?');
  std::string_view path = target.substr(1, question == target.npos ? target.npos : question - 1);
  while (!path.empty()) {
    const std::size_t end = std::min(path.find('/'), path.size());
    request.path.push_back(decoded(path.substr(0, end), false));
    path.remove_prefix(std::min(end + 1, path.size()));
  }
  std::string_view query = question == target.npos ? std::string_view() : target.substr(question + 1);
  while (!query.empty()) {
    const std::size_t end = std::min(query.find('&'), query.size());
    const std::string_view pair = query.substr(0, end);
    const std::size_t equals = std::min(pair.find('='), pair.size());
    const std::string name = decoded(pair.substr(0, equals), true);
    const std::string value = decoded(pair.substr(std::min(equals + 1, pair.size())), true);
    if (!name.empty() && !request.query.emplace(name, value).second)
      throw Problem("bad_parameter", "it is given twice", name);
    query.remove_prefix(std::min(end + 1, query.size()));
  }
}

Body body_of(std::string_view text) {
  return std::make_shared<const std::vector<std::uint8_t>>(text.begin(), text.end());
}

}  // namespace btms
