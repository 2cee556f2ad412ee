// Where along a line something begins.
#pragma once

namespace btms {

// Where `in` begins to hold, between a place where it doesn't and one where it does, to their distance / 2^halvings.
template <int halvings, typename In>
double entry(double out_m, double in_m, In in) {
  for (int k = 0; k < halvings; ++k) {
    const double middle = (out_m + in_m) / 2;
    (in(middle) ? in_m : out_m) = middle;
  }
  return in_m;
}

}  // namespace btms
