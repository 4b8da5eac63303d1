// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "geometry/enclosing_sphere.h"
#include "geometry/segment.h"
#include "harness/runs.h"
#include "measures.h"
#include "measures/paper/chain_scenes.h"
#include "tree/fiber_tree.h"
#include "tree/topology.h"

namespace fcl_fibers::benchmarks {
namespace {

using geometry::Ball;

// A scene as the trees read it, in its own frame, without FCL's objects in between.

std::vector<geometry::Segment> treeSegments(const scenes::FiberScene& scene) {
  const auto point = [&](std::size_t i) {
    const scenes::Point& p = scene.points[i];
    return geometry::Vec3d{p[0], p[1], p[2]};
  };
  std::vector<geometry::Segment> segments;
  segments.reserve(scene.segmentCount());
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f] + 1; i < scene.point_begin[f + 1]; ++i) {
      segments.push_back({point(i - 1), point(i), scene.radiusAt(i - 1)});
    }
  }
  return segments;
}

tree::Fibers treeFibers(const scenes::FiberScene& scene) {
  tree::Fibers fibers;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f] + 1; i < scene.point_begin[f + 1]; ++i) {
      fibers.ids.push_back(static_cast<tree::SegmentId>(fibers.ids.size()));
    }
    fibers.endFiber();
  }
  return fibers;
}

/// What the two hierarchies make of one chain.
struct Comparison {
  int height = 0;      ///< of the balanced binary tree over all segments
  double layered = 0;  ///< radii of the roots
  double wrapped = 0;
  double largest_ratio = 0;     ///< layered to wrapped, of all nodes
  double largest_of_bound = 0;  ///< the same, divided by sqrt(h + 1) of the node
  std::size_t box_bytes = 0;
  std::size_t sphere_bytes = 0;
};

/// Layered spheres by node: the minimum enclosing sphere of the two spheres below.
class LayeredSpheres {
 public:
  explicit LayeredSpheres(const tree::WrappedSphereTree<2>& tree)
      : balls_(tree.topology().nodes.size()), heights_(balls_.size()) {
    for (std::size_t i = balls_.size(); i-- > 0;) fit(tree, i);
  }

  const Ball& ball(std::size_t node) const { return balls_[node]; }
  int height(std::size_t node) const { return heights_[node]; }

 private:
  void fit(const tree::WrappedSphereTree<2>& tree, std::size_t index) {
    const auto& node = tree.topology().nodes[index];
    auto leaf = static_cast<std::size_t>(node.leaf_begin);
    std::vector<Ball> below;
    for (int lane = 0; lane < node.child_count; ++lane) {
      const tree::Link child = node.children[static_cast<std::size_t>(lane)];
      if (child.isLeaf()) {
        below.push_back(tree.hierarchy().leafBalls()[leaf++]);
        continue;
      }
      const auto i = static_cast<std::size_t>(child.node());
      below.push_back(balls_[i]);
      heights_[index] = std::max(heights_[index], heights_[i]);
      leaf = static_cast<std::size_t>(tree.topology().nodes[i].leaf_end);
    }
    ++heights_[index];
    balls_[index] = enclosingSphere(below.data(), static_cast<int>(below.size())).ball;
  }

  std::vector<Ball> balls_;
  std::vector<int> heights_;
};

Comparison compare(const scenes::FiberScene& scene) {
  const std::vector<geometry::Segment> segments = treeSegments(scene);
  const tree::Fibers fibers = treeFibers(scene);
  tree::WrappedSphereTree<2> spheres(tree::superThread(fibers));
  spheres.refit(segments, 0);
  tree::LayeredBoxTree<2> boxes(tree::superThread(fibers));
  boxes.refit(segments, 0);
  const LayeredSpheres layered(spheres);

  Comparison result;
  result.height = layered.height(0);
  result.layered = layered.ball(0).radius;
  result.wrapped = spheres.hierarchy().cage(0).ball.radius;
  for (std::size_t i = 0; i < spheres.topology().nodes.size(); ++i) {
    const double ratio = layered.ball(i).radius / spheres.hierarchy().cage(i).ball.radius;
    result.largest_ratio = std::max(result.largest_ratio, ratio);
    result.largest_of_bound =
        std::max(result.largest_of_bound, ratio / std::sqrt(layered.height(i) + 1.0));
  }
  result.box_bytes = boxes.memoryUsage();
  result.sphere_bytes = spheres.memoryUsage();
  return result;
}

void registerComparison(const std::string& name,
                        const std::function<scenes::FiberScene()>& make_scene) {
  registerRuns("Radii/" + name, 1, [make_scene](Numbers& numbers) {
    const scenes::FiberScene scene = make_scene();
    const Comparison result = compare(scene);
    const auto segments = static_cast<double>(scene.segmentCount());
    numbers["segments"] = segments;
    numbers["height"] = result.height;
    numbers["layered"] = result.layered;
    numbers["wrapped"] = result.wrapped;
    numbers["largest_ratio"] = result.largest_ratio;
    numbers["largest_of_bound"] = result.largest_of_bound;
    numbers["box_bytes_per_segment"] = static_cast<double>(result.box_bytes) / segments;
    numbers["sphere_bytes_per_segment"] = static_cast<double>(result.sphere_bytes) / segments;
    return 0.0;
  });
}

void registerScene(const std::string& name, int fibers) {
  const std::string count = std::to_string(fibers);
  registerComparison(name + "/fibers:" + count,
                     [=] { return tools::openScene(name + ":fibers=" + count, {}).scene(); });
}

}  // namespace

bool measureRadii(const Request&) {
  for (const char* chain : {"straight", "random", "snake"}) {
    for (const int edge : {2, 4, 6, 8, 12, 16, 24, 32}) {
      registerComparison(std::string(chain) + "/edge:" + std::to_string(edge),
                         [=] { return makeChain(chainOfName(chain), edge); });
    }
  }
  for (const int fibers : {1, 10, 100, 1000}) registerScene("paper-static", fibers);
  for (const int fibers : {1, 10, 100}) registerScene("paper-strand", fibers);
  return runRegistered();
}

}  // namespace fcl_fibers::benchmarks
