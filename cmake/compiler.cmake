# Flags every target shares. The determinism flags are a contract, see docs/architecture.md, "Bits".
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")

add_library(btms_flags INTERFACE)
# Programs that use the installed libraries get what keeps the bits of code in headers, but not what is ours to choose.
target_compile_options(btms_flags INTERFACE
  $<BUILD_INTERFACE:-march=x86-64-v2>  # SSE4.2 everywhere; no FMA, whose single rounding changes bits
  -ffp-contract=off                    # a*b+c is two roundings, on every CPU
  "$<BUILD_INTERFACE:-fno-trapping-math;-fno-math-errno;-Wall;-Wextra;-Wconversion;-Wshadow;-Wno-sign-conversion;-fstack-protector-strong>")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC's SLP vectoriser fuses into vfmaddsub even with contraction off.
  target_compile_options(btms_flags INTERFACE -fno-tree-slp-vectorize)
endif()
target_compile_options(btms_flags INTERFACE "$<BUILD_INTERFACE:$<$<CONFIG:Release>:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=2>>")
target_link_options(btms_flags INTERFACE "$<BUILD_INTERFACE:-Wl,-z,relro,-z,now>")
target_compile_features(btms_flags INTERFACE cxx_std_20)
target_include_directories(btms_flags INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/btms>)

option(BTMS_WIDE "Compile hot loops for AVX2, too" ON)  # OFF: what CPUs without it run (tests/portable.sh)
if(NOT BTMS_WIDE)
  target_compile_definitions(btms_flags INTERFACE BTMS_NOT_WIDE)
endif()

set(BTMS_SANITIZE "" CACHE STRING "Sanitizers for every target, e.g. address,undefined")
if(BTMS_SANITIZE)
  target_compile_options(btms_flags INTERFACE -fsanitize=${BTMS_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(btms_flags INTERFACE -fsanitize=${BTMS_SANITIZE})
endif()
