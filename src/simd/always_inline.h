// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// For the few lines that run at every step of a traversal. GCC stops inlining when a file with
/// many instantiations has grown by 40 %; it then calls even one-line functions, and a traversal
/// takes twice as long. The presets of the sanitizers define this as `inline`, because clang takes
/// four times as long to instrument code that is copied to so many places (77 s instead of 17 for
/// tree/search.cpp).
#ifndef FCL_FIBERS_ALWAYS_INLINE
#define FCL_FIBERS_ALWAYS_INLINE __attribute__((always_inline)) inline
#endif
