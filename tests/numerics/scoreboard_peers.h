// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fcl/narrowphase/collision_object.h>

#include "numerics/specimen.h"

namespace fcl_fibers::test {

template <typename S>
using Objects = std::vector<fcl::CollisionObject<S>*>;

template <typename S>
std::map<const fcl::CollisionObject<S>*, std::int32_t> numbersOf(const Objects<S>& objects) {
  std::map<const fcl::CollisionObject<S>*, std::int32_t> numbers;
  for (const auto* object : objects) {
    numbers.emplace(object, static_cast<std::int32_t>(numbers.size()));
  }
  return numbers;
}

/// The objects with FCL's boxes as they are now, because a specimen sets radii later.
template <typename S>
Objects<S> withBoxes(const Specimen<S>& specimen) {
  Objects<S> objects = specimen.objects();
  for (auto* object : objects) {
    std::const_pointer_cast<fcl::CollisionGeometry<S>>(object->collisionGeometry())
        ->computeLocalAABB();
    object->computeAABB();
  }
  return objects;
}

/// What touches, within a margin where the contender knows one.
template <typename S>
using Ask = std::function<std::vector<NumberPair>(const Specimen<S>&, double margin)>;

/// Contenders of the scoreboard that were found when it was built, with their names. Some are of
/// doubles alone.
template <typename S>
std::vector<std::pair<std::string, Ask<S>>> peers();

/// What the page tells of them, and of those that were not found.
std::vector<std::string> peerTexts();

}  // namespace fcl_fibers::test
