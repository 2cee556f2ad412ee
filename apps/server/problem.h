// What goes wrong with a request: one table from code to status, one form of answer (RFC 7807).
#pragma once

#include <exception>
#include <string>
#include <vector>

#include "apps/server/message.h"

namespace btms {

class Problem : public std::exception {
 public:
  // `code` must be in the table. `field`: which parameter or member; `allowed`: what it could have been.
  explicit Problem(const char* code, std::string detail = {}, std::string field = {},
                   std::vector<std::string> allowed = {})
      : code_(code), detail_(std::move(detail)), field_(std::move(field)), allowed_(std::move(allowed)) {}

  const char* what() const noexcept override { return detail_.c_str(); }
  const char* code() const { return code_; }
  int status() const;
  Response response() const;

 private:
  const char* code_;
  std::string detail_, field_;
  std::vector<std::string> allowed_;
};

}  // namespace btms
