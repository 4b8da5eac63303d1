// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

namespace fcl_fibers::benchmarks {

/// What a narrow phase finds out about two capsules a and b.
struct NarrowAnswer {
  bool touching = false;
  double depth = 0;
  fcl::Vector3d normal = fcl::Vector3d::Zero();  ///< from a to b
  fcl::Vector3d point = fcl::Vector3d::Zero();   ///< in the middle between the surfaces
};

template <typename S>
using CapsuleObjects = std::vector<std::unique_ptr<fcl::CollisionObject<S>>>;

using IndexPairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// One way to decide pairs of capsules, bound to the objects.
struct NarrowSolver {
  std::string name;   ///< as in the benchmark's name: `libccd_1e-6`
  bool with_contact;  ///< else it finds out whether they touch, and no more
  bool ours;
  /// Answers, one a pair.
  std::function<void(const IndexPairs&, std::vector<NarrowAnswer>&)> answer;
  /// The same work without the list of answers.
  std::function<void(const IndexPairs&)> work;
};

/// FCL's solvers with some tolerances, FCL's closed form of a distance, the closed form of
/// textbooks, on objects and on axes that were read before, and ours. `objects` are borrowed. What
/// a manager reads at its update, and a careful user once in a query, is read here.
///@{
std::vector<NarrowSolver> narrowSolvers(const CapsuleObjects<float>& objects);
std::vector<NarrowSolver> narrowSolvers(const CapsuleObjects<double>& objects);
///@}

}  // namespace fcl_fibers::benchmarks
