// LZF, the compression of binary_compressed PCD files, with access to the middle of the output.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "io/points/input_file.h"

namespace btms {

// Decoder of a byte range of `file`. Making it decodes everything once, checks it, and keeps the last 8 KiB of output
// every 128 KiB: from there any part is decoded again, so the output is never held as a whole. Immutable, thread-safe.
class LzfRange {
 public:
  // Throws Error(kBadInput) when the range does not decode to exactly `output_bytes`, naming the offset in the file.
  // The output passes through `sink` piece by piece, with the place of each.
  using Sink = std::function<void(std::uint64_t from, std::span<const std::uint8_t> output)>;
  LzfRange(const InputFile& file, std::uint64_t offset, std::uint64_t input_bytes, std::uint64_t output_bytes,
           const Sink& sink = {});

  // Decodes output [from, from + to.size()) into `to`. `scratch` is reused between calls.
  void read(const InputFile& file, const InputFile::Session& session, std::uint64_t from, std::span<std::uint8_t> to,
            std::vector<std::uint8_t>& scratch) const;

 private:
  // A place between two instructions: where the next one is, how much was produced, and the bytes just before.
  struct Mark {
    std::uint64_t input, output;
    std::vector<std::uint8_t> history;
  };
  std::vector<Mark> marks_;  // the last one is the end
};

// Decodes whole instructions from `input` while each fits into `output` as a whole.
struct LzfStep {
  std::size_t consumed = 0, produced = 0;
  bool bad_reference = false;  // at `consumed`: a copy from before the start of the output
};
// output[0, history) holds what came before; decoding appends behind it. `produced` does not count the history.
LzfStep lzf_decode(std::span<const std::uint8_t> input, std::span<std::uint8_t> output, std::size_t history);

}  // namespace btms
