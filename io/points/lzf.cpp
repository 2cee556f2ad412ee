#include "io/points/lzf.h"

#include <algorithm>
#include <cstring>
#include <string>

namespace btms {
namespace {

constexpr std::size_t kHistory = 8192;     // the farthest a copy reaches back
constexpr std::size_t kLongestCopy = 264;  // bytes out of one instruction
constexpr std::size_t kSpacing = std::size_t{1} << 17;
constexpr std::size_t kInputBlock = std::size_t{1} << 16;

}  // namespace

LzfStep lzf_decode(std::span<const std::uint8_t> input, std::span<std::uint8_t> output, std::size_t history) {
  LzfStep step;
  std::size_t in = 0, out = history;
  while (in < input.size()) {
    const std::size_t control = input[in], left = input.size() - in;
    if (control < 32) {  // control + 1 literal bytes
      const std::size_t length = control + 1;
      if (left < 1 + length || output.size() - out < length) break;
      std::memcpy(&output[out], &input[in + 1], length);
      in += 1 + length;
      out += length;
      continue;
    }
    // LLLooooo oooooooo, or 111ooooo LLLLLLLL oooooooo: copy length + 2 bytes from offset + 1 back.
    const bool is_long = (control >> 5) == 7;
    const std::size_t head = is_long ? 3 : 2;
    if (left < head) break;
    const std::size_t length = (is_long ? 7 + std::size_t{input[in + 1]} : control >> 5) + 2;
    const std::size_t back = ((control & 31) << 8) + input[in + head - 1] + 1;
    if (output.size() - out < length) break;
    if (back > out) {
      step.bad_reference = true;
      break;
    }
    std::uint8_t* to = &output[out];
    const std::uint8_t* from = to - back;
    if (back >= length) {
      std::memcpy(to, from, length);
    } else {  // a copy that overlaps itself repeats, so byte by byte
      for (std::size_t i = 0; i < length; ++i) to[i] = from[i];
    }
    in += head;
    out += length;
  }
  step.consumed = in;
  step.produced = out - history;
  return step;
}

LzfRange::LzfRange(const InputFile& file, std::uint64_t offset, std::uint64_t input_bytes, std::uint64_t output_bytes,
                   const Sink& sink) {
  const InputFile::Session session = file.open();
  const std::uint64_t end = offset + input_bytes;
  std::vector<std::uint8_t> input(kInputBlock), output(kHistory + kSpacing + kLongestCopy);
  std::size_t history = 0;  // bytes of output kept in front
  std::uint64_t at = offset, produced = 0;
  marks_.push_back({at, 0, {}});
  while (at < end) {
    const std::size_t n = std::min<std::uint64_t>(kInputBlock, end - at);
    session.read(at, std::span(input).first(n));
    // Never past the next mark by more than an instruction.
    const std::uint64_t next_mark = marks_.back().output + kSpacing;
    const std::size_t room = std::min<std::uint64_t>(next_mark - produced + kLongestCopy, output_bytes - produced);
    const LzfStep step = lzf_decode(std::span(input).first(n), std::span(output).first(history + room), history);
    if (sink) sink(produced, std::span(output).subspan(history, step.produced));
    at += step.consumed;
    produced += step.produced;
    if (step.bad_reference) file.refuse("compressed data refer to bytes before their start", at);
    if (step.consumed == 0) {
      file.refuse("compressed data are damaged: found " + std::to_string(produced) + " bytes, expected " +
                      std::to_string(output_bytes),
                  at);
    }
    const std::size_t filled = history + step.produced, keep = std::min(filled, kHistory);
    std::memmove(output.data(), output.data() + filled - keep, keep);
    history = keep;
    if (produced >= next_mark || at == end)
      marks_.push_back({at, produced, {output.begin(), output.begin() + static_cast<std::ptrdiff_t>(keep)}});
  }
  session.finish();
  if (produced != output_bytes) {
    file.refuse("compressed data hold " + std::to_string(produced) + " bytes, expected " + std::to_string(output_bytes),
                at);
  }
}

void LzfRange::read(const InputFile& file, const InputFile::Session& session, std::uint64_t from,
                    std::span<std::uint8_t> to, std::vector<std::uint8_t>& scratch) const {
  auto mark = std::upper_bound(marks_.begin(), marks_.end(), from,
                               [](std::uint64_t v, const Mark& m) { return v < m.output; }) -
              1;
  for (; !to.empty(); ++mark) {
    const Mark& next = *(mark + 1);
    const std::size_t in = next.input - mark->input, out = next.output - mark->output, history = mark->history.size();
    if (scratch.size() < in + history + out) scratch.resize(in + history + out);
    const std::span<std::uint8_t> input(scratch.data(), in), output(scratch.data() + in, history + out);
    session.read(mark->input, input);
    std::copy(mark->history.begin(), mark->history.end(), output.begin());
    if (lzf_decode(input, output, history).produced != out) file.refuse("changed while read", mark->input);
    const std::size_t skip = from - mark->output, n = std::min(to.size(), out - skip);
    std::memcpy(to.data(), output.data() + history + skip, n);
    to = to.subspan(n);
    from += n;
  }
}

}  // namespace btms
