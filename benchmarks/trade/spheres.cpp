// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "contender.h"
#include "geometry/enclosing_sphere.h"
#include "parts.h"
#include "tree/fiber_tree.h"
#include "tree/topology.h"
#include "tree/traversal.h"

namespace fcl_fibers::benchmarks {
namespace {

using geometry::Ball;
using geometry::Segment;
using geometry::Vec3d;

constexpr int kRuns = 5;

/// The ball about a centre that holds all of these.
Ball ballAbout(const Vec3d& center, const Ball* balls, int count) {
  double reach = 0;
  for (const Ball* ball = balls; ball != balls + count; ++ball) {
    reach = std::max(reach, norm(ball->center - center) + ball->radius);
  }
  return {center, reach * (1 + 16 * std::numeric_limits<double>::epsilon())};
}

/// About the centroid: one pass for it and one for the radius.
struct Centroid {
  static Ball around(const Ball* balls, int count) {
    Vec3d sum{0, 0, 0};
    for (const Ball* ball = balls; ball != balls + count; ++ball) sum = sum + ball->center;
    return ballAbout((1.0 / count) * sum, balls, count);
  }
};

/// Ritter: from two balls far from each other, grown by each that sticks out.
struct Ritter {
  static Ball around(const Ball* balls, int count) {
    const auto farthest = [&](const Vec3d& from) {
      return std::max_element(balls, balls + count, [&](const Ball& p, const Ball& q) {
        return norm(p.center - from) + p.radius < norm(q.center - from) + q.radius;
      });
    };
    const Ball* const first = farthest(balls[0].center);
    Ball ball = *first;
    grow(ball, *farthest(first->center));
    for (const Ball* other = balls; other != balls + count; ++other) grow(ball, *other);
    return ballAbout(ball.center, balls, count);
  }

 private:
  /// To the least ball about both.
  static void grow(Ball& ball, const Ball& other) {
    const double apart = norm(other.center - ball.center);
    if (apart + other.radius <= ball.radius) return;
    if (apart + ball.radius <= other.radius) {
      ball = other;
      return;
    }
    const double radius = (apart + ball.radius + other.radius) / 2;
    ball.center = ball.center + ((radius - ball.radius) / apart) * (other.center - ball.center);
    ball.radius = radius;
  }
};

/// Badoiu and Clarkson: the centre moves towards the farthest ball by 1 / 2, 1 / 3, ... of the way.
template <int Steps>
struct CoreSet {
  static Ball around(const Ball* balls, int count) {
    Vec3d center = balls[0].center;
    for (int step = 1; step <= Steps; ++step) {
      const Ball* const farthest =
          std::max_element(balls, balls + count, [&](const Ball& p, const Ball& q) {
            return norm(p.center - center) + p.radius < norm(q.center - center) + q.radius;
          });
      center = center + (1.0 / (step + 1)) * (farthest->center - center);
    }
    return ballAbout(center, balls, count);
  }
};

/// Cages of all leaves as tree::WrappedSpheres has them, found anew at every refit.
template <class Enclose>
class Cages {
 public:
  using Volume = geometry::Sphere;
  static constexpr int kArity = 8;
  using Pack = Volume::Pack<kArity>;

  static std::int32_t slot(std::int32_t /*node*/, int /*lane*/, std::int32_t leaf) { return leaf; }
  void reserve(const tree::Topology<kArity>& topology) {
    leaves_.resize(topology.leaves.size());
    cages_.resize(topology.nodes.size());
  }
  bool fitLeaf(std::int32_t slot, const Segment& segment, double padding, std::vector<Pack>&) {
    leaves_[static_cast<std::size_t>(slot)] = Ball::around(segment, padding);
    return true;
  }
  void prefetchLeaf(std::int32_t, const std::vector<Pack>&) const {}
  void startRefit() {}
  void keepAll(const tree::Topology<kArity>&) {}
  void fitNode(const tree::Topology<kArity>& topology, std::size_t index,
               std::vector<Pack>& packs) {
    const auto& node = topology.nodes[index];
    auto leaf = static_cast<std::size_t>(node.leaf_begin);
    for (int lane = 0; lane < node.child_count; ++lane) {
      const tree::Link child = node.children[static_cast<std::size_t>(lane)];
      const auto below = static_cast<std::size_t>(child.isLeaf() ? 0 : child.node());
      packs[index].set(lane, Volume::around(child.isLeaf() ? leaves_[leaf] : cages_[below]));
      leaf = child.isLeaf() ? leaf + 1 : static_cast<std::size_t>(topology.nodes[below].leaf_end);
    }
    cages_[index] = Enclose::around(leaves_.data() + node.leaf_begin, node.leafCount());
  }
  Volume nodeVolume(std::size_t index, const std::vector<Pack>&) const {
    return Volume::around(cages_[index]);
  }
  std::size_t memoryUsage() const { return 0; }

  double meanRadius() const {
    double sum = 0;
    for (const Ball& cage : cages_) sum += cage.radius;
    return sum / static_cast<double>(cages_.size());
  }

 private:
  std::vector<Ball> leaves_, cages_;
};

struct Exact {
  static Ball around(const Ball* balls, int count) {
    return geometry::enclosingSphere(balls, count).ball;
  }
};

double meanRadius(const tree::WrappedSphereTree<8>& tree) {
  double sum = 0;
  for (std::size_t i = 0; i < tree.topology().nodes.size(); ++i) {
    sum += tree.hierarchy().cage(i).ball.radius;
  }
  return sum / static_cast<double>(tree.topology().nodes.size());
}
template <class Enclose>
double meanRadius(const tree::FiberTree<Cages<Enclose>>& tree) {
  return tree.hierarchy().meanRadius();
}

struct CountLeafPairs : tree::CountedOverlapAdmission {
  tree::Visit leafPair(tree::SegmentId, tree::SegmentId) {
    ++pairs;
    return tree::Visit::kContinue;
  }
  std::size_t pairs = 0;
};

template <class Tree>
void registerTree(const std::string& name, const Frames& frames) {
  const auto segments = std::make_shared<std::array<std::vector<Segment>, 2>>();
  for (std::size_t f : {0u, 1u}) (*segments)[f] = segmentsOf(frames.frame[f]);
  const auto tree = std::make_shared<Tree>(tree::bundle(fibersOf(frames.frame[0]), (*segments)[0]));
  tree->refit((*segments)[0], 0);
  registerRuns("Spheres/" + name + "/" + frames.name, kRuns, [=](Numbers& numbers) {
    tree->refit((*segments)[0], 0);
    numbers["update"] = seconds([&] { tree->refit((*segments)[1], 0); });
    CountLeafPairs count;
    numbers["detection"] = seconds([&] { tree::visitPairs(*tree, count); });
    numbers["tests"] = static_cast<double>(count.tests);
    numbers["pairs"] = static_cast<double>(count.pairs);
    numbers["mean_radius"] = meanRadius(*tree);
    return numbers["update"] + numbers["detection"];
  });
}

}  // namespace

void registerSpheres(const Frames& frames) {
  registerTree<tree::WrappedSphereTree<8>>("verified", frames);
  registerTree<tree::FiberTree<Cages<Exact>>>("exact", frames);
  registerTree<tree::FiberTree<Cages<CoreSet<20>>>>("core_set_20", frames);
  registerTree<tree::FiberTree<Cages<CoreSet<5>>>>("core_set_5", frames);
  registerTree<tree::FiberTree<Cages<Ritter>>>("Ritter", frames);
  registerTree<tree::FiberTree<Cages<Centroid>>>("centroid", frames);
}

}  // namespace fcl_fibers::benchmarks
