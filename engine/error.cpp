#include "engine/error.h"

namespace btms {
namespace {

struct Row {
  ErrorCode code;
  const char* name;
  int exit_status;
};

constexpr Row kTable[] = {
    {ErrorCode::kFailed, "failed", 1},         {ErrorCode::kUsage, "usage", 2},
    {ErrorCode::kBadInput, "bad_input", 3},    {ErrorCode::kVerification, "verification", 4},
    {ErrorCode::kCancelled, "cancelled", 130},
};

const Row& row(ErrorCode code) {
  for (const Row& r : kTable)
    if (r.code == code) return r;
  return kTable[0];
}

std::string compose(const std::string& message, const std::string& file, std::optional<std::uint64_t> offset) {
  std::string text = file;
  if (offset) text += ':' + std::to_string(*offset);
  return text.empty() ? message : text + ": " + message;
}

}  // namespace

int exit_status(ErrorCode code) { return row(code).exit_status; }
const char* error_name(ErrorCode code) { return row(code).name; }

Error::Error(ErrorCode code, const std::string& message, const std::string& file, std::optional<std::uint64_t> offset)
    : std::runtime_error(compose(message, file, offset)), code_(code), file_(file), offset_(offset) {}

}  // namespace btms
