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

using Object = fcl::CollisionObjectd;

inline std::map<const Object*, std::int32_t> numbersOf(const std::vector<Object*>& objects) {
  std::map<const Object*, std::int32_t> numbers;
  for (const Object* object : objects) {
    numbers.emplace(object, static_cast<std::int32_t>(numbers.size()));
  }
  return numbers;
}

/// The objects with FCL's boxes as they are now, because a specimen sets radii later.
inline std::vector<Object*> withBoxes(const Specimen<double>& specimen) {
  std::vector<Object*> objects = specimen.objects();
  for (Object* object : objects) {
    std::const_pointer_cast<fcl::CollisionGeometryd>(object->collisionGeometry())
        ->computeLocalAABB();
    object->computeAABB();
  }
  return objects;
}

/// Contenders of the scoreboard that were found when it was built: their names, and what touches.
std::vector<
    std::pair<std::string, std::function<std::vector<NumberPair>(const Specimen<double>&, double)>>>
peers();

/// What the page tells of them, and of those that were not found.
std::vector<std::string> peerTexts();

}  // namespace fcl_fibers::test
