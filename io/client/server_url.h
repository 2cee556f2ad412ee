// Where a server is: http://host[:port][/prefix].
#pragma once

#include <string>
#include <string_view>

namespace btms {

struct ServerUrl {
  std::string host;    // without the brackets of an IPv6 address
  std::string port;    // digits
  std::string prefix;  // empty, or /a/b without a / at its end

  std::string authority() const;  // for the header Host
};

// Throws Error(kUsage) for anything else, user names and queries among it.
ServerUrl parse_server_url(std::string_view url);

}  // namespace btms
