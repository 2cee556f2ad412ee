// Places as people type them.
#pragma once

#include <string_view>

#include "engine/query/place.h"

namespace btms {

// Reads "X,Y" or "X Y" in metres. Throws Error(kUsage) naming `what` and the text.
Place parse_place(std::string_view text, std::string_view what);

}  // namespace btms
