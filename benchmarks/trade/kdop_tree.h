// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "geometry/segment.h"
#include "tree/topology.h"

namespace fcl_fibers::benchmarks {

/// A bundle whose volumes are k-DOPs (Klosowski, Held, Mitchell, Sowizral and Zikan, Efficient
/// collision detection using bounding volume hierarchies of k-DOPs, 1998), searched as the
/// library's trees are, by the best instruction set of this machine.
class KDopTree {
 public:
  using Segments = std::vector<geometry::Segment>;

  virtual ~KDopTree() = default;
  KDopTree(const KDopTree&) = delete;
  KDopTree& operator=(const KDopTree&) = delete;

  /// Before all else.
  virtual void refit(const Segments& segments) = 0;
  /// Pairs whose volumes overlap.
  virtual std::size_t countPairs() const = 0;
  /// Those of them whose capsules touch, of the segments of the last refit.
  virtual std::size_t countTouching(const Segments& segments) const = 0;
  /// Volumes tested against a volume, see tree::Search.
  virtual std::size_t countVolumeTests() const = 0;
  virtual std::size_t memoryUsage() const = 0;

 protected:
  KDopTree() = default;
};

/// What the bounds are rounded outward to.
enum class Bounds { kFloat, kDouble };

/// @param directions  6 (a box), 14 (and its corners), 18 (and its edges) or 26 (and both); 6
///                    where bounds are double
std::unique_ptr<KDopTree> makeKDopTree(int directions, Bounds bounds, tree::Topology<8> topology);

}  // namespace fcl_fibers::benchmarks
