// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::benchmarks {

enum class Chain {
  kStraight,  ///< all points on a line
  kRandom,    ///< a random path that visits every point of the cube's lattice once
  kSnake,     ///< row after row and layer after layer, every other one backward
};

/// straight, random or snake; throws std::invalid_argument if it is none of them.
Chain chainOfName(const std::string& name);

/// One fiber through the edge^3 points of a cubic lattice, or as many on a line; segments of length
/// 1 and radius 0.2. Well-behaved in the paper's sense, as no two points are nearer than 1. Turned
/// as the paper's assemblies are: by pi/4 about y, then about x.
///
/// The snake is as bad as such a chain can be: each of its n^(2/3) rows has a box, or a sphere,
/// that a fixed part of all others reach, which makes n^(4/3) pairs.
///
/// @param edge  even, at least 2; throws std::invalid_argument where it is not
FiberPolylines makeChain(Chain chain, int edge);

}  // namespace fcl_fibers::benchmarks
