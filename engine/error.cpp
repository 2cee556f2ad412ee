#include "engine/error.h"

#include <cerrno>
#include <system_error>

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
    {ErrorCode::kUnfinished, "unfinished", 5}, {ErrorCode::kCancelled, "cancelled", 130},
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

const char* remedy(int error) {
  switch (error) {
    case ENOSPC:
    case EDQUOT:
      return "free some space, or choose another folder";
    case EIO:
      return "check the disk";
    case EMFILE:
      return "allow more open files (ulimit -n)";
    case ENFILE:
      return "close other programs, or allow more open files (sysctl fs.file-max)";
    case EFBIG:
      return "allow larger files (ulimit -f), or choose another disk";
    case ENOMEM:
      return "close other programs, or allow more memory (ulimit -v)";
    case EROFS:
      return "choose another folder";
    default:
      return nullptr;
  }
}

}  // namespace

std::string system_reason(int error) {
  std::string text = std::generic_category().message(error);
  if (const char* what_to_do = remedy(error)) text.append("; ").append(what_to_do);
  return text;
}

int exit_status(ErrorCode code) { return row(code).exit_status; }
const char* error_name(ErrorCode code) { return row(code).name; }

Error::Error(ErrorCode code, const std::string& message, const std::string& file, std::optional<std::uint64_t> offset)
    : std::runtime_error(compose(message, file, offset)), code_(code), file_(file), offset_(offset) {}

}  // namespace btms
