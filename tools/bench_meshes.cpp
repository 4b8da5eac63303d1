// SPDX-License-Identifier: BSD-3-Clause
#include "bench_meshes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <tuple>
#include <utility>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fmt/format.h>

#include "contenders/contender.h"

namespace fcl_fibers::tools {
namespace {

using benchmarks::Manager;
using benchmarks::MovingFibers;
using benchmarks::Object;

/// A segment by its number among all segments, and a mesh.
using MeshPair = std::pair<std::size_t, std::size_t>;
using MeshPairs = std::vector<MeshPair>;

std::shared_ptr<fcl::BVHModel<fcl::OBBRSSd>> makeModel(const MeshFile& mesh) {
  std::vector<fcl::Vector3d> points;
  std::vector<fcl::Triangle> triangles;
  for (const Point& p : mesh.points) points.emplace_back(p[0], p[1], p[2]);
  const auto corner = [&](std::size_t i) { return static_cast<std::size_t>(mesh.triangles[i]); };
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    triangles.emplace_back(corner(i), corner(i + 1), corner(i + 2));
  }
  auto model = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  model->beginModel();
  model->addSubModel(points, triangles);
  model->endModel();
  return model;
}

/// What all finders share.
struct Scene {
  const FiberPolylines& fibers;
  const MovingFibers& moving;
  const std::vector<MeshFile>& meshes;
  std::vector<std::int32_t> roots;               ///< by fiber
  std::vector<char> is_root;                     ///< by segment
  std::vector<std::unique_ptr<Object>> objects;  ///< of the meshes

  Scene(const FiberPolylines& scene, const MovingFibers& moving_fibers,
        const std::vector<MeshFile>& all, const MeshOptions& options)
      : fibers(scene), moving(moving_fibers), meshes(all), roots(options.roots(scene)) {
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      const std::size_t points = scene.point_begin[f + 1] - scene.point_begin[f];
      for (std::size_t s = 0; s + 1 < points; ++s) {
        is_root.push_back(s < static_cast<std::size_t>(roots[f]) ? 1 : 0);
      }
    }
    for (const MeshFile& mesh : all) objects.push_back(std::make_unique<Object>(makeModel(mesh)));
  }

  /// The mesh of an object; their number if it is a segment.
  std::size_t meshOf(const Object* object) const {
    std::size_t m = 0;
    while (m < objects.size() && objects[m].get() != object) ++m;
    return m;
  }
};

/// A callback that notes pairs of a segment and a mesh.
struct Noted {
  const Scene& scene;
  MeshPairs& found;
  std::size_t candidates = 0;

  void note(const Object* a, const Object* b) {
    if (scene.meshOf(a) < scene.meshes.size()) std::swap(a, b);
    const std::size_t mesh = scene.meshOf(b);
    if (mesh == scene.meshes.size() || scene.meshOf(a) < scene.meshes.size()) return;
    found.emplace_back(MovingFibers::index(a), mesh);
  }
  static bool all(Object* a, Object* b, void* data) {
    static_cast<Noted*>(data)->note(a, b);
    return false;
  }
  static bool colliding(Object* a, Object* b, void* data) {
    auto& self = *static_cast<Noted*>(data);
    ++self.candidates;
    fcl::CollisionResultd result;
    fcl::collide(a, b, fcl::CollisionRequestd(), result);
    if (result.isCollision()) self.note(a, b);
    return false;
  }
};

struct Finder {
  std::string name;
  bool ours;
  std::function<void()> set_up;
  /// Fills `found`, and returns the number of candidates if it can be told.
  std::function<std::optional<std::size_t>(MeshPairs& found)> find;
};

Finder byArrays(const Scene& scene) {
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  const auto tree = std::make_shared<FiberTree>(options);
  return {"FiberTree, arrays", true,
          [=, &scene] {
            FiberArrays<double> arrays = fiberArrays(scene.fibers);
            arrays.root_segments = scene.roots.data();
            tree->build(arrays);
          },
          [=, &scene](MeshPairs& found) -> std::optional<std::size_t> {
            std::vector<std::int32_t> segments;
            for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
              tree->findTouching(scene.meshes[m].mesh, segments);
              for (const std::int32_t point : segments) {
                found.emplace_back(
                    static_cast<std::size_t>(point) - tree->fiberSegment(point).fiber, m);
              }
            }
            return std::nullopt;
          }};
}

/// Fibers are of one group, so they meet the meshes only.
Finder byOurManager(const Scene& scene) {
  using OurManager = LayeredAABBTreeCollisionManagerd;
  const auto manager = std::make_shared<std::unique_ptr<OurManager>>();
  return {"LayeredAABBTree, capsules", true,
          [=, &scene] {
            FiberManagerOptions options;
            options.report = Report::kCapsules;
            *manager = std::make_unique<OurManager>(options);
            for (const MovingFibers::Fiber& fiber : scene.moving.fibers()) {
              FiberObstacles obstacles;
              for (const Object* object : fiber.objects) {
                obstacles.root_segments += scene.is_root[MovingFibers::index(object)];
              }
              (*manager)->registerFiber(fiber.objects, fiber.ends, FiberGroup{1}, obstacles);
            }
            for (const auto& object : scene.objects) (*manager)->registerObstacle(object.get());
            (*manager)->setup();
          },
          [=, &scene](MeshPairs& found) -> std::optional<std::size_t> {
            Noted noted{scene, found};
            (*manager)->collide(&noted, Noted::all);
            return std::nullopt;
          }};
}

/// FCL's tree over the segments, asked for those near each mesh, and fcl::collide on each of them.
Finder byFcl(const Scene& scene) {
  const auto trees = benchmarks::fclManagers(benchmarks::Boxes::kTight);
  const auto tree = std::find_if(trees.begin(), trees.end(), [](const auto& contender) {
    return contender.manager == "DynamicAABBTree";
  });
  const auto manager = std::make_shared<std::unique_ptr<Manager>>();
  return {tree->title() + " and fcl::collide", false,
          [=, &scene, contender = *tree] {
            std::vector<Object*> objects;
            for (Object* const object : scene.moving.objects()) {
              if (!scene.is_root[MovingFibers::index(object)]) objects.push_back(object);
            }
            *manager = contender.setUp(objects);
          },
          [=, &scene](MeshPairs& found) -> std::optional<std::size_t> {
            Noted noted{scene, found};
            for (const auto& object : scene.objects) {
              (*manager)->collide(object.get(), &noted, Noted::colliding);
            }
            return noted.candidates;
          }};
}

/// The distance of a segment and a mesh, over all triangles.
double distanceOf(const Scene& scene, const MeshPair& pair) {
  const FiberPolylines& fibers = scene.fibers;
  std::size_t fiber = 0;
  while (pair.first >= fibers.point_begin[fiber + 1] - fiber - 1) ++fiber;
  const auto point = static_cast<std::int32_t>(pair.first + fiber);
  const TriangleMesh& mesh = scene.meshes[pair.second].mesh;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < mesh.triangleCount(); ++t) {
    const TrianglePair one = {point, static_cast<std::int32_t>(t)};
    least = std::min(least, meshContact(fiberArrays(fibers), mesh, one).distance);
  }
  return least;
}

/// Judges what a finder found by what ours found first, and both by brute force where they differ.
/// Returns whether the first is right.
bool judge(const Scene& scene, const MeshPairs& first, const MeshPairs& found,
           MeshFinderResult& result) {
  constexpr double kUndecided = 1e-9;
  MeshPairs differing;
  std::set_symmetric_difference(first.begin(), first.end(), found.begin(), found.end(),
                                std::back_inserter(differing));
  bool first_is_right = true;
  for (const MeshPair& pair : differing) {
    const double distance = distanceOf(scene, pair);
    const bool is_found = std::binary_search(found.begin(), found.end(), pair);
    if (std::abs(distance) < kUndecided) {
      ++result.undecided;
    } else if ((distance < 0) != is_found) {
      ++(is_found ? result.extra : result.missed);
    } else {
      first_is_right = false;
    }
  }
  return first_is_right;
}

double median(std::vector<double>& seconds) {
  std::sort(seconds.begin(), seconds.end());
  return seconds[seconds.size() / 2];
}

/// Ends early if the finder is so slow that it takes longer than the limit.
void time(const Finder& finder, const BenchRequest& request, MeshFinderResult& result) {
  std::vector<double> set_up, query;
  for (int i = 0; i < request.repetitions; ++i) {
    progress(fmt::format("timing {} of {}: {}", i + 1, request.repetitions, finder.name));
    MeshPairs found;
    set_up.push_back(benchmarks::seconds(finder.set_up));
    query.push_back(benchmarks::seconds([&] { finder.find(found); }));
    if (set_up.back() + query.back() > request.limit) break;
  }
  result.set_up_seconds = median(set_up);
  result.query_seconds = median(query);
}

}  // namespace

std::vector<MeshFinderResult> benchMeshes(const FiberPolylines& scene, MovingFibers& fibers,
                                          const std::vector<MeshFile>& meshes,
                                          const BenchRequest& request) {
  fibers.bringTo(0, benchmarks::Boxes::kTight);
  const Scene shared(scene, fibers, meshes, request.meshes);
  const Finder finders[] = {byArrays(shared), byOurManager(shared), byFcl(shared)};
  std::vector<MeshFinderResult> results;
  MeshPairs first;
  for (const Finder& finder : finders) {
    progress("checking " + finder.name);
    MeshPairs found;
    finder.set_up();
    MeshFinderResult result{finder.name, finder.ours, finder.find(found)};
    std::sort(found.begin(), found.end());
    if (results.empty()) first = found;
    result.touching = found.size();
    if (!judge(shared, first, found, result)) results.front().missed += 1;
    results.push_back(result);
  }
  for (std::size_t i = 0; i < results.size(); ++i) {
    time(finders[i], request, results[i]);
  }
  return results;
}

}  // namespace fcl_fibers::tools
