// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The tests of packs for the instruction set that the including file is compiled for.
#include "geometry/overlap-inl.h"

namespace fcl_fibers::geometry {
using HWY_NAMESPACE::nearer;
using HWY_NAMESPACE::overlaps;
}  // namespace fcl_fibers::geometry
