// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The traversal for the instruction set that the including file is compiled for. search.h is
// faster.
#include "geometry/overlap.h"
#include "tree/traversal-inl.h"

namespace fcl_fibers::tree {
using HWY_NAMESPACE::AllGroups;
using HWY_NAMESPACE::DistanceTest;
using HWY_NAMESPACE::OverlapTest;
using HWY_NAMESPACE::visitLeaves;
using HWY_NAMESPACE::visitPairs;
}  // namespace fcl_fibers::tree
