// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "contenders/closed_form.h"
#include "contenders/contender.h"

namespace fcl_fibers::benchmarks {

template <typename S>
using ObjectPairs = std::vector<std::pair<fcl::CollisionObject<S>*, fcl::CollisionObject<S>*>>;

/// Pairs of a self-collision query, or blocks of them that are evenly spread.
template <typename S>
struct PairSample {
  ObjectPairs<S> pairs;
  std::size_t of = 0;  ///< that the query reports
};

/// About `size` of the `reported` pairs, or all. Blocks, for the objects of pairs that follow each
/// other are in the cache.
template <typename S>
PairSample<S> samplePairs(const BasicManager<S>& manager, std::size_t reported, std::size_t size);

/// Every `parts`th block of a sample, from block `first` on; the sample itself if that has all
/// pairs.
template <typename S>
PairSample<S> partOf(const PairSample<S>& sample, std::size_t first, std::size_t parts);

/// Calls fcl::collide on these pairs.
template <typename S>
NarrowPhase collidePairs(const ObjectPairs<S>& pairs);

/// Calls the narrow phase of the manager's library on the sample, and scales to all pairs.
template <typename S>
NarrowPhase collide(const BasicManager<S>& manager, const PairSample<S>& sample);

/// Self-collision with a callback that counts capsulesTouch() of axes that are read once, as a
/// careful user writes it.
/// @param objects  all, each with its place among them as its user data
template <typename S>
std::size_t countTouching(const BasicManager<S>& manager,
                          const std::vector<fcl::CollisionObject<S>*>& objects);

}  // namespace fcl_fibers::benchmarks
