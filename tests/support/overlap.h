// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Operations on packs, for the instruction set that the including file is compiled for.
#include "geometry/volume-inl.h"

namespace fcl_fibers::geometry {
using HWY_NAMESPACE::nearer;
using HWY_NAMESPACE::overlaps;
using HWY_NAMESPACE::replaceAll;
using HWY_NAMESPACE::unite;
}  // namespace fcl_fibers::geometry
