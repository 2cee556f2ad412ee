// A small LZF compressor, so that the tests can make compressed files.
#pragma once

#include <algorithm>
#include <map>

#include "tests/io/points/files.h"

namespace btms::test {

inline Bytes lzf_compress(const Bytes& in) {
  Bytes out;
  std::size_t literals = 0;  // not yet written, ending at `at`
  std::map<std::array<std::uint8_t, 3>, std::size_t> seen;
  const auto flush = [&](std::size_t at) {
    for (std::size_t from = at - literals; from < at;) {
      const std::size_t n = std::min<std::size_t>(32, at - from);
      out.push_back(static_cast<std::uint8_t>(n - 1));
      out.insert(out.end(), in.begin() + static_cast<std::ptrdiff_t>(from),
                 in.begin() + static_cast<std::ptrdiff_t>(from + n));
      from += n;
    }
    literals = 0;
  };
  std::size_t at = 0;
  while (at < in.size()) {
    std::size_t length = 0, back = 0;
    if (at + 3 <= in.size()) {
      const std::array<std::uint8_t, 3> key = {in[at], in[at + 1], in[at + 2]};
      const auto it = seen.find(key);
      if (it != seen.end() && at - it->second <= 8192) {
        back = at - it->second;
        while (length < 264 && at + length < in.size() && in[at + length] == in[at + length - back]) ++length;
      }
      seen[key] = at;
    }
    if (length < 3) {
      ++literals;
      ++at;
      continue;
    }
    flush(at);
    const std::size_t l = length - 2, o = back - 1;
    if (l < 7)
      out.push_back(static_cast<std::uint8_t>((l << 5) + (o >> 8)));
    else {
      out.push_back(static_cast<std::uint8_t>((7 << 5) + (o >> 8)));
      out.push_back(static_cast<std::uint8_t>(l - 7));
    }
    out.push_back(static_cast<std::uint8_t>(o & 0xFF));
    at += length;
  }
  flush(at);
  return out;
}

}  // namespace btms::test
