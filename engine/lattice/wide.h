// Loops that gain from wider vectors are compiled twice; the loader picks what the CPU has. The bits are the same:
// without contraction (-ffp-contract=off) every lane does what a scalar would.
#pragma once

#if !defined(BTMS_NOT_WIDE) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_THREAD__)  // its runtime starts after the loader asks
#define BTMS_WIDE [[gnu::target_clones("avx2", "default")]]
#else
#define BTMS_WIDE
#endif
