#include "io/store/json_field.h"

#include "engine/error.h"
#include "io/store/hash.h"

namespace btms {
namespace {

constexpr int kMaxDepth = 8;

[[noreturn]] void bad(const std::string& why) { throw Error(ErrorCode::kBadInput, why); }

// By a scan over the bytes: the parser's callback could tell the depth, too, but takes time with the square of an
// array's length.
void check_depth(std::span<const std::uint8_t> text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::uint8_t c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      in_string = c != '"';
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kMaxDepth) bad("nested too deeply");
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
}

}  // namespace

std::uint64_t hex_value(const std::string& digits, const char* name) {
  std::uint64_t value = 0;
  for (const char c : digits) {
    const int digit = c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
    if (digit < 0) bad(std::string("\"") + name + "\" is no hexadecimal number");
    value = value << 4 | static_cast<std::uint64_t>(digit);
  }
  return value;
}

Json parse_json(std::span<const std::uint8_t> text) {
  check_depth(text);
  try {
    return Json::parse(text.begin(), text.end());
  } catch (const Json::parse_error& e) {
    bad("not JSON from byte " + std::to_string(e.byte) + " on: damaged, or cut off");
  } catch (const Json::exception&) {
    bad("a number in its JSON is out of range");
  }
}

const Json& member(const Json& object, const char* name) {
  if (!object.is_object()) bad(std::string("expected an object with \"") + name + "\"");
  const auto it = object.find(name);
  if (it == object.end()) bad(std::string("\"") + name + "\" is missing");
  return *it;
}

const Json& array_member(const Json& object, const char* name) {
  const Json& value = member(object, name);
  if (!value.is_array()) bad(std::string("\"") + name + "\" is no array");
  return value;
}

std::string text_member(const Json& object, const char* name) {
  const Json& value = member(object, name);
  if (!value.is_string()) bad(std::string("\"") + name + "\" is no text");
  return value.get<std::string>();
}

std::int64_t integer(const Json& value, const char* name, std::int64_t min, std::int64_t max) {
  const bool fits =
      value.is_number_unsigned()
          ? value.get<std::uint64_t>() <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())
          : value.is_number_integer();
  const std::int64_t n = fits ? value.get<std::int64_t>() : 0;
  if (!fits || n < min || n > max)
    bad(std::string("\"") + name + "\" is no whole number in " + std::to_string(min) + ".." + std::to_string(max));
  return n;
}

std::int64_t integer_member(const Json& object, const char* name, std::int64_t min, std::int64_t max) {
  return integer(member(object, name), name, min, max);
}

std::uint64_t hash_member(const Json& object, const char* name) {
  const std::string digits = text_member(object, name);
  if (digits.size() != 16) bad(std::string("\"") + name + "\" has not 16 hexadecimal digits");
  return hex_value(digits, name);
}

Digest digest_member(const Json& object, const char* name) {
  const std::string digits = text_member(object, name);
  if (digits.size() != 32) bad(std::string("\"") + name + "\" has not 32 hexadecimal digits");
  return {hex_value(digits.substr(16), name), hex_value(digits.substr(0, 16), name)};
}

std::string json_line(const Json& value) { return value.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace btms
