// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <fcl_fibers/fiber_tree.h>

#include "numerics/extreme_rows.h"
#include "numerics/row_copies.h"
#include "numerics/specimen.h"

namespace fcl_fibers::test {

/// The tree that rows are compared by: boxes over the bundle, which report capsules.
inline FiberTreeOptions usualOptions(double margin) { return allKinds(margin).front(); }

/// How many pairs a tree of these fibers of a row finds, or one more than `most`.
template <typename S>
std::size_t countPairs(const ExtremeRow<S>& row, const Assembly<S>& fibers,
                       std::size_t most = SIZE_MAX) {
  const ScopedFloatEnvironment scoped(row.environment);
  FiberTree tree(usualOptions(row.margin));
  tree.build(fibers.view());
  std::size_t count = 0;
  tree.visit(Pairs{}, [&](SegmentPair) { return ++count > most; });
  return count;
}

/// A row as often as makes `wanted` segments, or once if copies would have other pairs: if they
/// are out of range, or would lose the digits that the row is about.
template <typename S>
Assembly<S> repeated(const ExtremeRow<S>& row, std::size_t wanted) {
  const auto segments = static_cast<double>(row.fibers.capsules().size());
  const auto side = static_cast<int>(std::cbrt(static_cast<double>(wanted) / segments) + 0.5);
  Copies<S> copies(row.fibers, row.margin, side);
  if (!copies.is_possible) return row.fibers;
  const auto count = static_cast<std::size_t>(side * side * side);
  const std::size_t pairs = count * countPairs(row, row.fibers);
  return countPairs(row, copies.all, pairs) == pairs ? copies.all : row.fibers;
}

/// An ordinary scene of so many segments or a few more: locks of hair side by side.
template <typename S>
Assembly<S> ordinary(std::size_t segments) {
  const ExtremeRow<S>& lock = extremeRows<S>().front();
  constexpr std::size_t kOfLock = 300, kOfFiber = 15;
  const auto locks = static_cast<double>(segments) / kOfLock;
  Assembly<S> all =
      Copies<S>(lock.fibers, lock.margin, static_cast<int>(std::ceil(std::cbrt(locks)))).all;
  const std::size_t fibers = (segments + kOfFiber - 1) / kOfFiber;
  all.point_begin.resize(std::min(all.fiberCount(), fibers) + 1);
  all.points.resize(3 * all.pointCount());
  all.radii.resize(all.pointCount());
  return all;
}

}  // namespace fcl_fibers::test
