// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The traversal for the instruction set that this file is compiled for. For speed use search.h.
#include "geometry/overlap.h"
#include "tree/traversal-inl.h"

namespace fcl_fibers::tree {
using HWY_NAMESPACE::OverlapAdmission;
using HWY_NAMESPACE::visitLeaves;
using HWY_NAMESPACE::visitPairs;
}  // namespace fcl_fibers::tree
