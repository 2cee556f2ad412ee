#include "apps/btms/coordinates.h"

#include <spdlog/fmt/fmt.h>

#include <charconv>
#include <cmath>

#include "engine/error.h"

namespace btms {

Place parse_place(std::string_view text, std::string_view what) {
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  const auto skip = [&](std::string_view characters) {
    while (at != end && characters.find(*at) != std::string_view::npos) ++at;
  };
  const auto number = [&](double& value) {
    const auto [next, error] = std::from_chars(at, end, value);
    at = next;
    return error == std::errc{} && std::isfinite(value);
  };
  Place place;
  skip(" \t");
  bool good = number(place.x_m);
  const char* const gap = at;
  skip(" \t,;");
  good = good && at != gap && number(place.y_m);
  skip(" \t\r");
  if (!good || at != end)
    throw Error(ErrorCode::kUsage, fmt::format("{}: found `{}`, expected two numbers in metres, X,Y", what, text));
  return place;
}

}  // namespace btms
