#include "apps/btms/number_range.h"

#include <cmath>

namespace btms {

CLI::Validator number_range(double low, double high) {
  const CLI::Range range(low, high);
  return {[range](std::string& text) {
            const std::string wrong = range(text);
            double value = NAN;
            if (wrong.empty() && (!CLI::detail::lexical_cast(text, value) || std::isnan(value)))
              return "Value " + text + " is no number";
            return wrong;
          },
          range.get_description(), "NUMBER"};
}

}  // namespace btms
