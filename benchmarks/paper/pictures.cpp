// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/scenes/paper_scenes.h>

#include "parts.h"
#include "progress.h"
#include "tree/fiber_tree.h"
#include "tree_scene.h"

namespace fcl_fibers::benchmarks {
namespace {

using Object = fcl::CollisionObjectd;

/// Of Fig. 6, and of the loop when it is nearly closed.
constexpr int kStrandFibers = 500;
constexpr int kLoopStep = 85;

std::ofstream openForWriting(const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  file.exceptions(std::ios::badbit | std::ios::failbit);
  return file;
}

struct Touching {
  std::vector<char> segments;  ///< by object: 1 if it touches another but its neighbours
  std::size_t pairs = 0;

  static bool callback(Object* a, Object* b, void* data) {
    auto& touching = *static_cast<Touching*>(data);
    for (const Object* object : {a, b}) {
      touching.segments[reinterpret_cast<std::size_t>(object->getUserData())] = 1;
    }
    ++touching.pairs;
    return false;
  }
};

Touching findTouching(const scenes::FiberScene& scene) {
  const auto objects = scenes::makeObjects<double>(scene);
  FiberManagerOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 1;
  LayeredAABBTreeCollisionManagerd manager(options);
  std::vector<Object*> fiber;
  std::size_t next = 0;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    fiber.clear();
    for (std::size_t i = scene.point_begin[f] + 1; i < scene.point_begin[f + 1]; ++i, ++next) {
      objects[next]->setUserData(reinterpret_cast<void*>(next));
      fiber.push_back(objects[next].get());
    }
    manager.registerFiber(fiber);
  }
  Touching touching{std::vector<char>(objects.size()), 0};
  manager.collide(&touching, Touching::callback);
  return touching;
}

/// NAME.points (floats x y z), NAME.begin (32-bit first points of fibers, and their number),
/// NAME.touching (a byte a segment), and NAME.csv with the counts, last, as the sign that all are
/// there.
void writePicture(const std::string& dir, const std::string& name,
                  const scenes::FiberScene& scene) {
  showProgress("pictures: " + name);
  const Touching touching = findTouching(scene);
  const std::string path = dir + "/" + name;

  std::vector<float> coordinates;
  coordinates.reserve(3 * scene.points.size());
  for (const scenes::Point& point : scene.points) {
    for (const double x : point) coordinates.push_back(static_cast<float>(x));
  }
  openForWriting(path + ".points")
      .write(reinterpret_cast<const char*>(coordinates.data()),
             static_cast<std::streamsize>(sizeof(float) * coordinates.size()));

  std::vector<std::int32_t> begin;
  std::transform(scene.point_begin.begin(), scene.point_begin.end(), std::back_inserter(begin),
                 [](std::size_t i) { return static_cast<std::int32_t>(i); });
  openForWriting(path + ".begin")
      .write(reinterpret_cast<const char*>(begin.data()),
             static_cast<std::streamsize>(sizeof(std::int32_t) * begin.size()));

  openForWriting(path + ".touching")
      .write(touching.segments.data(), static_cast<std::streamsize>(touching.segments.size()));

  openForWriting(path + ".csv") << "fibers,segments,radius,touching_pairs,touching_segments\n"
                                << scene.fiberCount() << ',' << scene.segmentCount() << ','
                                << scene.radius << ',' << touching.pairs << ','
                                << std::count(touching.segments.begin(), touching.segments.end(), 1)
                                << '\n';
}

scenes::FiberScene firstFiber(const scenes::FiberScene& scene) {
  scenes::FiberScene fiber;
  fiber.radius = scene.radius;
  fiber.points.assign(scene.points.begin(),
                      scene.points.begin() + static_cast<std::ptrdiff_t>(scene.point_begin[1]));
  fiber.point_begin.push_back(fiber.points.size());
  return fiber;
}

/// Calls visit(depth, parent, node) for each inner node, parents first.
template <typename Tree, typename Visit>
void forEachNode(const Tree& tree, const Visit& visit, std::int32_t node = 0,
                 std::int32_t parent = -1, int depth = 0) {
  visit(depth, parent, node);
  for (int lane = 0; lane < tree.node(node).child_count; ++lane) {
    const tree::Link child = tree.node(node).children[static_cast<std::size_t>(lane)];
    if (!child.isLeaf()) forEachNode(tree, visit, child.node(), node, depth + 1);
  }
}

/// Both hierarchies of one fiber; boxes as low and high corner, spheres as centre and radius.
void writeVolumes(const std::string& dir, const std::string& name,
                  const scenes::FiberScene& fiber) {
  showProgress("pictures: " + name);
  const std::vector<geometry::Segment> segments = treeSegments(fiber);
  const tree::Fibers fibers = treeFibers(fiber);
  tree::WrappedSphereTree<2> spheres(tree::superThread(fibers));
  spheres.refit(segments, 0);
  tree::LayeredBoxTree<2> boxes(tree::superThread(fibers));
  boxes.refit(segments, 0);

  {
    std::ofstream points = openForWriting(dir + "/" + name + "_fiber.csv");
    points << "x,y,z\n";
    for (const auto& p : fiber.points) points << p[0] << ',' << p[1] << ',' << p[2] << '\n';
  }
  std::ofstream file = openForWriting(dir + "/" + name + ".csv");
  file << "kind,depth,node,parent,a,b,c,d,e,f\n";
  forEachNode(boxes, [&](int depth, std::int32_t parent, std::int32_t node) {
    const geometry::Box box = boxes.pack(node).unite();
    file << "box," << depth << ',' << node << ',' << parent;
    for (const float x : box.low) file << ',' << x;
    for (const float x : box.high) file << ',' << x;
    file << '\n';
  });
  forEachNode(spheres, [&](int depth, std::int32_t parent, std::int32_t node) {
    const geometry::Ball& ball = spheres.hierarchy().cage(static_cast<std::size_t>(node)).ball;
    file << "sphere," << depth << ',' << node << ',' << parent << ',' << ball.center.x << ','
         << ball.center.y << ',' << ball.center.z << ',' << ball.radius << ",0,0\n";
  });
}

}  // namespace

void writePictures(const PartRequest& request) {
  if (request.out_dir.empty()) throw std::invalid_argument("--part=pictures: give --out_dir");
  scenes::DynamicAssemblyParameters parameters;
  parameters.seed = request.scene.seed;
  const scenes::DynamicAssembly assembly(parameters);
  const scenes::FiberScene loop = assembly.scene(std::min(kLoopStep, assembly.steps() - 1));
  writeVolumes(request.out_dir, "volumes", firstFiber(loop));
  writePicture(request.out_dir, "loop", loop);

  PaperSceneRequest scene = request.scene;
  scene.name = "strand";
  scene.fibers = kStrandFibers;
  writePicture(request.out_dir, "strand", makePaperScene(scene, 0));
  scene = request.scene;
  scene.name = "half_scalp";
  writePicture(request.out_dir, "half_scalp", makePaperScene(scene, 0));
}

}  // namespace fcl_fibers::benchmarks
