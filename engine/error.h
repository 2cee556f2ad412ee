// The one exception type of the program.
//
// The maths never throws: it returns a state. Readers, the store, the configuration and the loop throw Error when the
// work must stop. Apps map `code` to an exit status (and the server to an HTTP status) from the table in error.cpp.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

namespace btms {

enum class ErrorCode {
  kFailed,        // the system said no: disk full, no permission, a rank died           -> exit 1
  kUsage,         // a parameter or option outside its range                              -> exit 2
  kBadInput,      // a file that is not what it claims to be                              -> exit 3
  kVerification,  // stored bytes differ from their hashes                                -> exit 4
  kUnfinished,    // nothing is wrong, but others have to do their part first                 -> exit 5
  kCancelled,     // stopped by the user                                                  -> exit 130
};

// The process exit status for a code.
int exit_status(ErrorCode code);
// Short lower-case name for reports ("bad_input").
const char* error_name(ErrorCode code);

// Why a system call failed, from its errno, and where there is a remedy, what to do: "No space left on device; free
// some space, or choose another folder".
std::string system_reason(int error);

// What is said where std::bad_alloc ends the work.
inline constexpr char kOutOfMemory[] =
    "out of memory; close other programs, allow more (ulimit -v), or use less (--memory)";

class Error : public std::runtime_error {
 public:
  // what(): "file:offset: message" with the parts that are known. The message says what was found, what was expected
  // and, where there is a remedy, what to do.
  Error(ErrorCode code, const std::string& message, const std::string& file = {},
        std::optional<std::uint64_t> offset = {});

  ErrorCode code() const { return code_; }
  const std::string& file() const { return file_; }
  std::optional<std::uint64_t> offset() const { return offset_; }

 private:
  ErrorCode code_;
  std::string file_;
  std::optional<std::uint64_t> offset_;
};

}  // namespace btms
