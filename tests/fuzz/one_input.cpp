// What libFuzzer calls. BTMS_FUZZ_TARGET is the target's function.
#include "tests/fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  btms::fuzz::BTMS_FUZZ_TARGET({data, size});
  return 0;
}
