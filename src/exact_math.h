// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Included before the first line of every source of the libraries, see CMakeLists.txt here. NaN
// marks empty lanes, and rounding is bounded term by term, so that these flags lose pairs in
// silence. Of the last two clang says nothing unless -ffast-math is beside them.
#if defined(__FAST_MATH__) || __FINITE_MATH_ONLY__ || defined(__ASSOCIATIVE_MATH__) || \
    defined(__RECIPROCAL_MATH__)
#error \
    "remove -ffast-math, -Ofast, -ffinite-math-only and -funsafe-math-optimizations from the flags of fcl_fibers: it would miss pairs; a program that uses it may keep them"
#endif
