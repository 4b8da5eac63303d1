// SPDX-License-Identifier: BSD-3-Clause
#include "bench_meshes.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <iterator>
#include <memory>
#include <tuple>
#include <utility>

#include <fcl/narrowphase/collision.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fmt/format.h>

#include "contenders/contender.h"
#include "contenders/mesh_model.h"

namespace fcl_fibers::tools {
namespace {

using benchmarks::Manager;
using benchmarks::MovingFibers;
using benchmarks::Object;

/// A segment by its number among all segments, and a mesh.
using MeshPair = std::pair<std::size_t, std::size_t>;
using MeshPairs = std::vector<MeshPair>;

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
    for (const MeshFile& mesh : all)
      objects.push_back(std::make_unique<Object>(benchmarks::modelOf(mesh.points, mesh.triangles)));
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

/// Judges what a finder found by what ours found first, and both by all triangles where they
/// differ. Returns whether the first is right.
bool judge(const Scene& scene, const MeshPairs& first, const MeshPairs& found,
           MeshFinderResult& result) {
  using benchmarks::Contact;
  MeshPairs differing;
  std::set_symmetric_difference(first.begin(), first.end(), found.begin(), found.end(),
                                std::back_inserter(differing));
  if (differing.empty()) return true;
  const std::vector<benchmarks::Capsule> capsules = scene.moving.capsules();
  std::vector<std::vector<benchmarks::Corners>> corners;
  for (const MeshFile& mesh : scene.meshes) {
    corners.push_back(
        benchmarks::cornersOf(mesh.points, mesh.triangles, fcl::Transform3d::Identity()));
  }
  bool first_is_right = true;
  for (const auto& [segment, mesh] : differing) {
    const Contact contact = benchmarks::contact(capsules[segment], corners[mesh]);
    const bool is_found = std::binary_search(found.begin(), found.end(), MeshPair{segment, mesh});
    if (contact == Contact::kBoundary) {
      ++result.undecided;
    } else if ((contact == Contact::kTouching) != is_found) {
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

/// Times all finders in turn. Those that take longer than the limit are timed once.
template <std::size_t N>
void timeInTurn(const Finder (&finders)[N], const BenchRequest& request,
                std::vector<MeshFinderResult>& results) {
  std::vector<double> set_up[N], query[N];
  for (int i = 0; i < request.repetitions; ++i) {
    for (std::size_t k = 0; k < N; ++k) {
      if (i > 0 && set_up[k].back() + query[k].back() > request.limit) continue;
      progress(fmt::format("timing {} of {}: {}", i + 1, request.repetitions, finders[k].name));
      MeshPairs found;
      set_up[k].push_back(benchmarks::seconds(finders[k].set_up));
      query[k].push_back(benchmarks::seconds([&] { finders[k].find(found); }));
    }
  }
  for (std::size_t k = 0; k < N; ++k) {
    results[k].set_up_seconds = median(set_up[k]);
    results[k].query_seconds = median(query[k]);
  }
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
  timeInTurn(finders, request, results);
  return results;
}

}  // namespace fcl_fibers::tools
