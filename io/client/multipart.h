// multipart/mixed as a tile server writes it: parts with a length each.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/client/http_client.h"

namespace btms {

struct Part {
  HttpHeaders headers;
  std::span<const std::uint8_t> body;  // of the answer's bytes
};

// Throws Error(kBadInput) for anything else, and for more parts than `most`.
std::vector<Part> parse_multipart(const std::string& content_type, std::span<const std::uint8_t> bytes,
                                  std::size_t most);

}  // namespace btms
