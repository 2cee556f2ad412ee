// The LZF decoder against one that does a byte at a time, and parts of its output against the whole.
#include "io/points/lzf.h"

#include <algorithm>

#include "tests/fuzz/fuzz.h"
#include "tests/io/points/lzf_bytes.h"

namespace btms::fuzz {
namespace {

// The format as its text has it: whole instructions while each fits.
LzfStep slow_decode(Bytes in, std::vector<std::uint8_t>& out, std::size_t limit) {
  LzfStep step;
  const std::size_t start = out.size();
  for (std::size_t at = 0; at < in.size(); step.consumed = at) {
    const std::size_t control = in[at++];
    std::size_t length = control + 1, back = 0;
    if (control >= 32) {
      length = control / 32;
      if (length == 7) {
        if (at == in.size()) break;
        length += in[at++];
      }
      length += 2;
      if (at == in.size()) break;
      back = control % 32 * 256 + in[at++] + 1;
    } else if (in.size() - at < length) {
      break;
    }
    if (limit - out.size() < length) break;
    if (back > out.size()) {
      step.bad_reference = true;
      break;
    }
    for (std::size_t i = 0; i < length; ++i) out.push_back(back == 0 ? in[at++] : out[out.size() - back]);
  }
  step.produced = out.size() - start;
  return step;
}

void decode(Bytes packed, std::size_t history, std::size_t room) {
  std::vector<std::uint8_t> slow(history), fast(history + room);
  for (std::size_t i = 0; i < history; ++i) slow[i] = fast[i] = static_cast<std::uint8_t>(i);
  const LzfStep expected = slow_decode(packed, slow, history + room), found = lzf_decode(packed, fast, history);
  require(found.consumed == expected.consumed && found.produced == expected.produced &&
              found.bad_reference == expected.bad_reference,
          "both decoders come equally far");
  require(std::equal(slow.begin(), slow.end(), fast.begin()), "both decoders make the same bytes");
  require(std::all_of(fast.begin() + static_cast<std::ptrdiff_t>(slow.size()), fast.end(),
                      [](std::uint8_t b) { return b == 0; }),
          "nothing is written behind what was produced");
}

// Decoded from a file: the whole, and a part of it from the middle.
void read_range(Bytes packed, std::size_t from, std::size_t count) {
  std::vector<std::uint8_t> whole;
  if (const LzfStep step = slow_decode(packed, whole, SIZE_MAX); step.consumed != packed.size()) whole.resize(from);
  const InputFile file(file_of(packed, ".lzf"));
  accepted([&] {
    std::vector<std::uint8_t> seen;
    const LzfRange range(file, 0, packed.size(), whole.size(), [&](std::uint64_t at, Bytes part) {
      require(at == seen.size(), "the output comes in order");
      seen.insert(seen.end(), part.begin(), part.end());
    });
    require(seen == whole, "the sink sees all of the output");
    from = std::min(from, whole.size());
    std::vector<std::uint8_t> part(std::min(count, whole.size() - from)), scratch;
    range.read(file, file.open(), from, part, scratch);
    require(std::equal(part.begin(), part.end(), whole.begin() + static_cast<std::ptrdiff_t>(from)),
            "a part is what it is in the whole");
  });
}

}  // namespace

void lzf(Bytes bytes) {
  Front front(bytes);
  const std::uint8_t mode = front.byte();
  const std::size_t a = front.word(), b = front.word();
  switch (mode % 3) {
    case 0:
      return decode(front.rest(), a % 9000, b);
    case 1:
      return read_range(front.rest(), a, b);
    default: {  // what the test's compressor makes, of the bytes many times over
      std::vector<std::uint8_t> values;
      for (std::size_t i = 0; i <= a % 64; ++i) values.insert(values.end(), front.rest().begin(), front.rest().end());
      const std::vector<std::uint8_t> packed = test::lzf_compress(values);
      std::vector<std::uint8_t> back(values.size());
      const LzfStep step = lzf_decode(packed, back, 0);
      require(step.consumed == packed.size() && back == values, "compressed bytes come back");
      return read_range(packed, a * values.size() / 65536, b);
    }
  }
}

}  // namespace btms::fuzz
