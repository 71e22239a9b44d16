// SPDX-License-Identifier: MIT
// Loops that the compiler translates for wide registers as well.
#pragma once

// A function with this is compiled twice; which one runs is chosen when the program starts. The
// thread sanitizer can not be called that early. No fused multiply-add, so both do the same.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__SANITIZE_THREAD__)
#define MINESCAN_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define MINESCAN_WIDE
#endif
