// SPDX-License-Identifier: BSD-3-Clause
#include "nearest.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

#include "tools/along_fibers.h"

namespace fcl_fibers::tools {
namespace {

using Object = fcl::CollisionObject<double>;

double largestRadius(const FiberPolylines& scene) {
  return scene.radii.empty() ? scene.radius
                             : *std::max_element(scene.radii.begin(), scene.radii.end());
}

std::int32_t firstPoint(const Object* object) {
  return static_cast<std::int32_t>(reinterpret_cast<std::intptr_t>(object->getUserData()));
}

/// The axes of a scene. A manager's distance ends at 0 where objects overlap, and axes hardly do.
class Axes {
 public:
  Axes(FiberPolylines scene, const FiberManagerOptions& options) : manager_(options) {
    scene.radii.clear();
    scene.radius = 0;
    objects_ = makeObjects<double>(scene);
    std::size_t next = 0;
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      for (std::size_t i = scene.point_begin[f]; i + 1 < scene.point_begin[f + 1]; ++i) {
        objects_[next++]->setUserData(reinterpret_cast<void*>(static_cast<std::intptr_t>(i)));
      }
    }
    for (const auto& fiber : objectsByFiber(scene, objects_)) {
      manager_.registerFiber(fiber.objects, fiber.ends);
    }
    manager_.setup();
  }

  LayeredAABBTreeCollisionManager<double>& manager() { return manager_; }

 private:
  std::vector<std::unique_ptr<Object>> objects_;
  LayeredAABBTreeCollisionManager<double> manager_;
};

struct Search {
  const FiberPolylines& scene;
  const FiberPolylines* other;
  AlongFibers along;
  double largest_radii;  ///< of a segment of either side, summed
  std::size_t pairs_left;
  std::optional<Contact> nearest{};

  static bool callback(Object* a, Object* b, void* data, double& bound) {
    return static_cast<Search*>(data)->look({firstPoint(a), firstPoint(b)}, bound);
  }

  /// @param bound  of the distance of axes that may still be better
  bool look(SegmentPair pair, double& bound) {
    if (pairs_left-- == 0) {
      nearest.reset();
      return true;
    }
    const Contact contact = other == nullptr
                                ? capsuleContact(fiberArrays(scene), pair)
                                : capsuleContact(fiberArrays(scene), fiberArrays(*other), pair);
    if (other == nullptr && contact.a.fiber == contact.b.fiber) {
      const double radii = scene.radiusAt(static_cast<std::size_t>(pair.a)) +
                           scene.radiusAt(static_cast<std::size_t>(pair.b));
      const double half_circle = std::acos(-1.0) / 2 * (contact.distance + radii);
      if (along.between(contact.a.fiber, pair) <= half_circle) return false;
    }
    if (nearest && nearest->distance <= contact.distance) return false;
    nearest = contact;
    bound = contact.distance + largest_radii;
    return false;
  }
};

}  // namespace

std::optional<Contact> findNearest(const FiberPolylines& scene, const FiberPolylines* other,
                                   const FiberOptions& neighbors, std::size_t most_pairs) {
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = neighbors.ignored_neighbors;
  options.ignored_arc_length = neighbors.ignored_arc_length;
  Axes axes(scene, options);
  Search search{scene, other, AlongFibers(scene),
                largestRadius(scene) + largestRadius(other == nullptr ? scene : *other),
                most_pairs};
  if (other == nullptr) {
    axes.manager().distance(&search, Search::callback);
  } else {
    Axes other_axes(*other, options);
    axes.manager().distance(&other_axes.manager(), &search, Search::callback);
  }
  return search.nearest;
}

}  // namespace fcl_fibers::tools
