// Places as people type them.
#pragma once

#include <string_view>

namespace btms {

struct Place {
  double x_m = 0, y_m = 0;
};

// Reads "X,Y" or "X Y" in metres. Throws Error(kUsage) naming `what` and the text.
Place parse_place(std::string_view text, std::string_view what);

}  // namespace btms
