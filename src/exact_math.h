// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// CMakeLists.txt here includes this before the first line of every source of the libraries. NaN
// marks empty lanes, and rounding is bounded term by term, so these flags would lose pairs
// silently. clang defines the last two macros only under -ffast-math.
#if defined(__FAST_MATH__) || __FINITE_MATH_ONLY__ || defined(__ASSOCIATIVE_MATH__) || \
    defined(__RECIPROCAL_MATH__)
#error \
    "remove -ffast-math, -Ofast, -ffinite-math-only and -funsafe-math-optimizations from the flags of fcl_fibers, which would miss pairs; a program that uses fcl_fibers may keep them"
#endif
