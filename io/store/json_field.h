// Checked reading of JSON members: a missing member, a wrong type or a number out of range is Error(kBadInput), never a
// default.
#pragma once

#include <nlohmann/json.hpp>

#include <cstdint>
#include <span>
#include <string>

#include "engine/model/digest.h"

namespace btms {

using Json = nlohmann::json;

// Throws Error(kBadInput) for malformed text and for nesting deeper than any manifest has.
Json parse_json(std::span<const std::uint8_t> text);

const Json& member(const Json& object, const char* name);
const Json& array_member(const Json& object, const char* name);
std::string text_member(const Json& object, const char* name);
std::int64_t integer(const Json& value, const char* name, std::int64_t min, std::int64_t max);
std::int64_t integer_member(const Json& object, const char* name, std::int64_t min, std::int64_t max);
// Of lower-case digits, at most 16; `name` is for the message.
std::uint64_t hex_value(const std::string& digits, const char* name);
std::uint64_t hash_member(const Json& object, const char* name);
Digest digest_member(const Json& object, const char* name);

// One line of JSON; bytes that are not UTF-8 (file names) are replaced.
std::string json_line(const Json& value);

}  // namespace btms
