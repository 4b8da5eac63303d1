// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Marks what the library fcl_fibers::benchmark exports. Its objects are in programs too, so that
/// CMake's generated header would not do.
#define FCL_FIBERS_BENCHMARK_EXPORT __attribute__((visibility("default")))
