#include "io/store/hdf5_handle.h"

namespace btms {

std::string hdf5_message() {
  std::string text;
  const auto keep_innermost = [](unsigned, const H5E_error2_t* e, void* out) -> herr_t {
    auto& t = *static_cast<std::string*>(out);
    if (t.empty() && e->desc) t = e->desc;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_innermost, &text);
  H5Eclear2(H5E_DEFAULT);
  return text.empty() ? "unknown reason" : text;
}

}  // namespace btms
