// The program that decompresses LAZ, as a child process that is not trusted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace btms {

// What to run. The records are expected on its standard output, what is wrong on its standard error.
struct LazDecoder {
  std::vector<std::string> command;  // program (a path) and arguments
  int patience_s = 60;               // without a byte from it

  // node, and the decoder that was built with the program (../share/btms/laz). Throws Error(kFailed) saying what to
  // install when one is missing; `path` is the file that wants it.
  static LazDecoder built(const std::filesystem::path& path, std::uint64_t points, std::uint16_t record_bytes);
};

// Runs it with `path` as standard input and gives its output to `sink` piece by piece. The child has no other file, no
// environment, may write none, and dies with this thread. Thread-safe. Throws Error(kBadInput) about `path` when it
// fails, hangs, or says more or less than `bytes`; what `sink` throws; Error(kFailed) where it can't be started. No
// child is left then.
void run_laz_decoder(const LazDecoder& decoder, const std::filesystem::path& path, std::uint64_t bytes,
                     const std::function<void(std::span<const std::uint8_t>)>& sink);

}  // namespace btms
