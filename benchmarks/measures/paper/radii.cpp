// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "geometry/enclosing_sphere.h"
#include "harness/runs.h"
#include "measures.h"
#include "measures/paper/chain_scenes.h"
#include "measures/paper/tree_scene.h"

namespace fcl_fibers::benchmarks {
namespace {

using geometry::Ball;

/// Layered spheres by node: the minimum enclosing sphere of the two spheres below.
struct LayeredSpheres {
  explicit LayeredSpheres(const tree::WrappedSphereTree<2>& tree)
      : balls(tree.nodes().size()), heights(balls.size()) {
    for (std::size_t i = balls.size(); i-- > 0;) fit(tree, i);
  }

  void fit(const tree::WrappedSphereTree<2>& tree, std::size_t index) {
    const auto& node = tree.nodes()[index];
    auto leaf = static_cast<std::size_t>(node.leaf_begin);
    std::vector<Ball> below;
    for (int lane = 0; lane < node.child_count; ++lane) {
      const tree::Link child = node.children[static_cast<std::size_t>(lane)];
      if (child.isLeaf()) {
        below.push_back(tree.hierarchy().leafBalls()[leaf++]);
        continue;
      }
      const auto i = static_cast<std::size_t>(child.node());
      below.push_back(balls[i]);
      heights[index] = std::max(heights[index], heights[i]);
      leaf = static_cast<std::size_t>(tree.nodes()[i].leaf_end);
    }
    ++heights[index];
    balls[index] = enclosingSphere(below.data(), static_cast<int>(below.size())).ball;
  }

  std::vector<Ball> balls;
  std::vector<int> heights;
};

using Spheres = tree::WrappedSphereTree<2>;

/// How many of the cages below other cages stick out of these, though no segment does.
double countStickingOut(const Spheres& spheres) {
  constexpr double kRounding = 1e-9;
  double count = 0;
  for (std::size_t i = 0; i < spheres.nodes().size(); ++i) {
    const Ball& cage = spheres.hierarchy().cage(i).ball;
    const auto& node = spheres.nodes()[i];
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(node.child_count); ++lane) {
      if (node.children[lane].isLeaf()) continue;
      const auto below = static_cast<std::size_t>(node.children[lane].node());
      const Ball& child = spheres.hierarchy().cage(below).ball;
      const double reach = norm(child.center - cage.center) + child.radius;
      if (reach > cage.radius * (1 + kRounding)) ++count;
    }
  }
  return count;
}

/// What the two hierarchies make of one chain. The height is that of the balanced binary tree over
/// all segments; the bound of a node's ratio of radii is sqrt(h + 1) with the node's height h.
void compare(TreeScene scene, Numbers& numbers) {
  const auto rootsOf = [&](const Spheres& spheres, const LayeredSpheres& layered) {
    return std::pair(layered.balls[0].radius, spheres.hierarchy().cage(0).ball.radius);
  };
  Spheres spheres(tree::superThread(scene.fibers));
  spheres.refit(scene.segments, 0);
  const LayeredSpheres layered(spheres);
  const auto [layered_root, wrapped_root] = rootsOf(spheres, layered);

  double largest_of_bound = 0;
  for (std::size_t i = 0; i < spheres.nodes().size(); ++i) {
    const double ratio = layered.balls[i].radius / spheres.hierarchy().cage(i).ball.radius;
    largest_of_bound = std::max(largest_of_bound, ratio / std::sqrt(layered.heights[i] + 1.0));
  }
  numbers = {{"height", layered.heights[0]},
             {"layered", layered_root},
             {"wrapped", wrapped_root},
             {"largest_of_bound", largest_of_bound},
             {"cages", static_cast<double>(spheres.nodes().size() - 1)},
             {"sticking_out", countStickingOut(spheres)}};

  // The same beads in other orders: how much smaller and larger the root's spheres become.
  constexpr int kOrders = 10;
  std::mt19937_64 random(1);
  for (int i = 0; i < kOrders; ++i) {
    std::shuffle(scene.fibers.ids.begin(), scene.fibers.ids.end(), random);
    Spheres shuffled(tree::superThread(scene.fibers));
    shuffled.refit(scene.segments, 0);
    const auto [l, w] = rootsOf(shuffled, LayeredSpheres(shuffled));
    const auto note = [&](const char* what, double change) {
      numbers[what] = std::max(numbers[what], change);
    };
    note("layered_by_order", std::abs(l / layered_root - 1));
    note("wrapped_by_order", std::abs(w / wrapped_root - 1));
  }
}

void registerComparison(const std::string& name,
                        const std::function<FiberPolylines()>& make_scene) {
  registerRuns("Radii/" + name, 1, [make_scene](Numbers& numbers) {
    const FiberPolylines scene = make_scene();
    compare(TreeScene(MovingFibers("", scene, scene)), numbers);
    return 0.0;
  });
}

void registerScene(const std::string& name, int fibers) {
  const std::string count = std::to_string(fibers);
  registerComparison(name + "/fibers:" + count,
                     [=] { return openScene(name + ":fibers=" + count, {}).scene(); });
}

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

const AddMeasure kMeasure("radii", measureRadii);

}  // namespace

}  // namespace fcl_fibers::benchmarks
