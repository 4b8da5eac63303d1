// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "harness/runs.h"
#include "measures.h"
#include "measures/paper/bounding_volumes.h"
#include "measures/paper/chain_tree.h"
#include "measures/paper/tree_scene.h"
#include "measures/paper/welzl.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

using geometry::Ball;
using geometry::EnclosingSphere;
using geometry::Vec3d;

/// A leaf that leaves its cage by less than this part of the radius has not escaped.
constexpr double kEscape = 0x1p-30;
/// Of radii, far above the rounding of either algorithm.
constexpr double kTolerance = 1e-6;
/// So many segments are searched for pairs after the motion.
constexpr std::size_t kMostSearched = 100000;

/// When a cage stays from one step to the next.
enum class Kept {
  kNever,       ///< all are made anew
  kWhereItWas,  ///< while no leaf leaves it: it does not move with the fibers
  kByBasis,     ///< while no leaf leaves the sphere through its basis (Guibas et al., 2002)
  kWhileLeast,  ///< and while that sphere is the least around its basis, as in the library
};

/// How escaped leaves are looked for.
enum class Verified {
  kByLeaves,  ///< each leaf below a cage, as the paper writes
  kByCages,   ///< below a cage that is inside, all leaves are
};

/// What updates do, by cages.
struct CascadeCounts {
  double anew = 0, verified = 0, tests = 0;
};

/// Spheres of the paper's tree, and what verifies them.
class Cages {
 public:
  using Enclose = std::function<EnclosingSphere(const Ball*, int, const geometry::Basis&)>;

  Cages(const BinaryTree& tree, Kept kept, Verified verified, Enclose enclose)
      : tree_(tree),
        kept_(kept),
        verified_(verified),
        enclose_(std::move(enclose)),
        cages_(tree.size()) {}

  /// Fits all cages to the balls, which are by leaf.
  void update(const std::vector<Ball>& balls) {
    balls_ = balls.data();
    for (std::size_t i = tree_.size(); i-- > 0;) {
      const BinaryTree::Node& node = tree_[static_cast<std::int32_t>(i)];
      EnclosingSphere& cage = cages_[i];
      if (node.isLeaf()) {
        cage.ball = balls_[node.begin];
        continue;
      }
      counts.verified += 1;
      if (cage.basis.size > 0 && keeps(static_cast<std::int32_t>(i), cage)) continue;
      counts.anew += 1;
      cage = enclose_(balls_ + node.begin, node.end - node.begin, cage.basis);
    }
  }

  /// How many times as large as the least ones its spheres are: mean of the inner nodes, and most.
  /// Throws std::logic_error if a sphere does not enclose its leaves, or is not the least and has
  /// to be.
  std::pair<double, double> looseness() const {
    double sum = 0, most = 0, count = 0;
    for (std::size_t i = 0; i < tree_.size(); ++i) {
      const BinaryTree::Node& node = tree_[static_cast<std::int32_t>(i)];
      if (node.isLeaf()) continue;
      const Ball& ball = cages_[i].ball;
      for (std::int32_t leaf = node.begin; leaf < node.end; ++leaf) {
        const double reach = norm(balls_[leaf].center - ball.center) + balls_[leaf].radius;
        if (reach > ball.radius * (1 + kTolerance)) throw std::logic_error("a leaf sticks out");
      }
      const Ball least = enclosingSphere(balls_ + node.begin, node.end - node.begin).ball;
      const double ratio = ball.radius / least.radius;
      const bool has_to_be_least = kept_ == Kept::kNever || kept_ == Kept::kWhileLeast;
      if (ratio < 1 - kTolerance || (has_to_be_least && ratio > 1 + kTolerance)) {
        throw std::logic_error("a sphere is not the least");
      }
      sum += ratio;
      most = std::max(most, ratio);
      count += 1;
    }
    return {sum / count, most};
  }

  std::size_t volumeTests() const {
    std::vector<BallVolume> volumes;
    for (const EnclosingSphere& cage : cages_) volumes.push_back({cage.ball});
    return queryItself(tree_, volumes, [](std::int32_t, std::int32_t) {});
  }

  CascadeCounts counts;

 private:
  bool keeps(std::int32_t index, EnclosingSphere& cage) {
    Ball ball = cage.ball;
    if (kept_ == Kept::kNever) return false;
    if (kept_ != Kept::kWhereItWas) {
      const Ball* members[4] = {};
      const Ball* const first = balls_ + tree_[index].begin;
      for (std::size_t k = 0; k < 4; ++k) members[k] = first + cage.basis.ball[k];
      const auto support = geometry::supportSphere(members, cage.basis.size);
      if (!support || (kept_ == Kept::kWhileLeast && !support->isLeast())) return false;
      ball = support->ball;
    }
    double reach = ball.radius;
    if (!encloses(index, ball, reach)) return false;
    cage.ball = {ball.center, reach};
    return true;
  }

  /// Raises `reach` to the farthest leaf of those that are in the ball, up to rounding.
  bool encloses(std::int32_t index, const Ball& ball, double& reach) {
    const double limit = ball.radius * (1 + kEscape);
    const BinaryTree::Node& node = tree_[index];
    if (verified_ == Verified::kByLeaves) {
      for (std::int32_t leaf = node.begin; leaf < node.end; ++leaf) {
        if (!isInside(balls_[leaf], ball.center, limit, reach)) return false;
      }
      return true;
    }
    for (const std::int32_t child : {index + 1, node.right}) {
      const Ball& below = cages_[static_cast<std::size_t>(child)].ball;
      if (isInside(below, ball.center, limit, reach)) continue;
      if (tree_[child].isLeaf() || !encloses(child, ball, reach)) return false;
    }
    return true;
  }

  bool isInside(const Ball& below, const Vec3d& center, double limit, double& reach) {
    counts.tests += 1;
    const double far_side = norm(below.center - center) + below.radius;
    if (far_side <= limit) reach = std::max(reach, far_side);
    return far_side <= limit;
  }

  const BinaryTree& tree_;
  Kept kept_;
  Verified verified_;
  Enclose enclose_;
  std::vector<EnclosingSphere> cages_;  ///< by node
  const Ball* balls_ = nullptr;
};

/// Cascade verification of boxes: each keeps the leaf that determines each of its sides. A side
/// moves along with its leaf, and the box is made anew where a child reaches beyond.
class BoxCages {
 public:
  struct Cage {
    AxisBox box;
    std::int32_t leaf[6];  ///< of low and high sides
  };

  explicit BoxCages(const BinaryTree& tree) : tree_(tree), cages_(tree.size()) {}

  /// @param boxes  by leaf
  void update(const std::vector<AxisBox>& boxes) {
    for (std::size_t i = tree_.size(); i-- > 0;) {
      const BinaryTree::Node& node = tree_[static_cast<std::int32_t>(i)];
      Cage& cage = cages_[i];
      if (node.isLeaf()) {
        cage.box = boxes[static_cast<std::size_t>(node.begin)];
        std::fill(std::begin(cage.leaf), std::end(cage.leaf), node.begin);
        continue;
      }
      const Cage& a = cages_[i + 1];
      const Cage& b = cages_[static_cast<std::size_t>(node.right)];
      counts.verified += 1;
      if (is_made_ && keeps(cage, a, b, boxes)) continue;
      counts.anew += 1;
      for (std::size_t k = 0; k < 3; ++k) {
        const bool a_is_low = a.box.low[k] <= b.box.low[k];
        const bool a_is_high = a.box.high[k] >= b.box.high[k];
        cage.box.low[k] = (a_is_low ? a : b).box.low[k];
        cage.box.high[k] = (a_is_high ? a : b).box.high[k];
        cage.leaf[k] = (a_is_low ? a : b).leaf[k];
        cage.leaf[k + 3] = (a_is_high ? a : b).leaf[k + 3];
      }
    }
    is_made_ = true;
  }

  const std::vector<Cage>& cages() const { return cages_; }
  CascadeCounts counts;

 private:
  bool keeps(Cage& cage, const Cage& a, const Cage& b, const std::vector<AxisBox>& boxes) {
    AxisBox box;
    for (std::size_t k = 0; k < 3; ++k) {
      box.low[k] = boxes[static_cast<std::size_t>(cage.leaf[k])].low[k];
      box.high[k] = boxes[static_cast<std::size_t>(cage.leaf[k + 3])].high[k];
    }
    counts.tests += 2;
    for (const Cage* child : {&a, &b}) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (child->box.low[k] < box.low[k] || child->box.high[k] > box.high[k]) return false;
      }
    }
    cage.box = box;
    return true;
  }

  const BinaryTree& tree_;
  std::vector<Cage> cages_;  ///< by node
  bool is_made_ = false;
};

/// The frames of a scene, by leaf of the paper's tree.
struct Steps {
  explicit Steps(const SceneRequest& request) {
    const tools::SceneSource source = openScene(request.text, request.radius);
    std::vector<int> frames = source.asked;
    if (frames.size() == 1) frames.push_back(frames[0] + 1);
    for (const int frame : frames) {
      tools::progress("cascade: frame " + std::to_string(frame));
      const FiberPolylines fibers = source.make(frame);
      const TreeScene scene(MovingFibers("", fibers, fibers));
      const auto topology = superThread(scene.fibers);
      if (tree == nullptr) tree = std::make_unique<BinaryTree>(topology);
      std::vector<Ball> of_frame;
      std::vector<AxisBox> boxes_of_frame;
      for (const tree::SegmentId id : topology.leaves) {
        const geometry::Segment& s = scene.segments[static_cast<std::size_t>(id)];
        const Capsule capsule{{s.a.x, s.a.y, s.a.z}, {s.b.x, s.b.y, s.b.z}, s.radius};
        of_frame.push_back(ballAround(capsule));
        boxes_of_frame.push_back(AxisBox::around(capsule));
      }
      // The paper's segments are of equal length, and Welzl's algorithm needs equal radii.
      double largest = 0;
      for (const Ball& ball : of_frame) largest = std::max(largest, ball.radius);
      for (Ball& ball : of_frame) ball.radius = largest;
      balls.push_back(std::move(of_frame));
      boxes.push_back(std::move(boxes_of_frame));
    }
  }

  std::unique_ptr<BinaryTree> tree;
  std::vector<std::vector<Ball>> balls;     ///< by frame and leaf
  std::vector<std::vector<AxisBox>> boxes;  ///< by frame and leaf
};

/// Seconds of the first frame, and of all others together; the worst share of cages made anew.
template <class Tree, class Volumes>
void replay(Tree& tree, const std::vector<Volumes>& frames, Numbers& numbers) {
  numbers["build"] = seconds([&] { tree.update(frames[0]); });
  const auto steps = static_cast<double>(frames.size() - 1);
  double update = 0, worst = 0;
  CascadeCounts all;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    tree.counts = {};
    update += seconds([&] { tree.update(frames[i]); });
    worst = std::max(worst, tree.counts.anew / tree.counts.verified);
    all.anew += tree.counts.anew;
    all.tests += tree.counts.tests;
    all.verified += tree.counts.verified;
  }
  numbers["update"] = update / steps;
  numbers["tests"] = all.tests / steps;
  numbers["anew"] = all.anew / all.verified;
  numbers["worst"] = worst;
}

double replaySpheres(const Steps& steps, Kept kept, Verified verified,
                     const Cages::Enclose& enclose, Numbers& numbers) {
  Cages cages(*steps.tree, kept, verified, enclose);
  replay(cages, steps.balls, numbers);
  numbers["segments"] = static_cast<double>(steps.balls[0].size());
  std::tie(numbers["loose"], numbers["loosest"]) = cages.looseness();
  if (steps.balls[0].size() <= kMostSearched) {
    numbers["volume_tests"] = static_cast<double>(cages.volumeTests());
  }
  numbers["bytes"] = sizeof(EnclosingSphere);
  return numbers["update"];
}

double replayBoxes(const Steps& steps, bool cascades, Numbers& numbers) {
  numbers["segments"] = static_cast<double>(steps.boxes[0].size());
  std::vector<AxisBox> least(steps.tree->size());
  struct Union {
    const BinaryTree& tree;
    std::vector<AxisBox>& volumes;
    CascadeCounts counts;
    void update(const std::vector<AxisBox>& leaves) {
      for (std::size_t i = tree.size(); i-- > 0;) {
        const BinaryTree::Node& node = tree[static_cast<std::int32_t>(i)];
        volumes[i] = node.isLeaf() ? leaves[static_cast<std::size_t>(node.begin)]
                                   : AxisBox::around(volumes[i + 1],
                                                     volumes[static_cast<std::size_t>(node.right)]);
      }
      counts.verified = counts.anew = 1;
    }
  };
  Union united{*steps.tree, least, {}};
  numbers["bytes"] = sizeof(AxisBox);
  if (!cascades) {
    replay(united, steps.boxes, numbers);
    return numbers["update"];
  }
  BoxCages cages(*steps.tree);
  replay(cages, steps.boxes, numbers);
  united.update(steps.boxes.back());
  for (std::size_t i = 0; i < least.size(); ++i) {
    const AxisBox& kept = cages.cages()[i].box;
    if (kept.low != least[i].low || kept.high != least[i].high) {
      throw std::logic_error("cascade: a box is not the least around its segments");
    }
  }
  numbers["bytes"] = sizeof(BoxCages::Cage);
  return numbers["update"];
}

/// Who makes a cage anew: the library, from the basis that the cage had, or Welzl's algorithm.
enum class Solver { kExact, kWelzl, kWelzlInOrder };

double replayWith(Solver solver, const Steps& steps, Kept kept, Verified verified,
                  std::uint64_t seed, Numbers& numbers) {
  if (solver == Solver::kExact) {
    const auto exact = [](const Ball* balls, int count, const geometry::Basis& start) {
      return enclosingSphere(balls, count, start);
    };
    return replaySpheres(steps, kept, verified, exact, numbers);
  }
  Welzl welzl(solver == Solver::kWelzl, seed);
  const auto enclose = [&](const Ball* balls, int count, const geometry::Basis&) {
    return welzl.around(balls, count);
  };
  const double taken = replaySpheres(steps, kept, verified, enclose, numbers);
  numbers["ball_tests"] =
      static_cast<double>(welzl.tests) / static_cast<double>(steps.balls.size());
  return taken;
}

bool measureCascade(const Request& request) {
  const Steps steps(request.scene);
  const std::pair<const char*, Solver> kSolvers[] = {{"exact", Solver::kExact},
                                                     {"welzl", Solver::kWelzl},
                                                     {"welzl_in_order", Solver::kWelzlInOrder}};
  const std::tuple<const char*, Kept, Verified> kPolicies[] = {
      {"anew", Kept::kNever, Verified::kByCages},
      {"where_it_was", Kept::kWhereItWas, Verified::kByLeaves},
      {"basis_by_leaves", Kept::kByBasis, Verified::kByLeaves},
      {"basis", Kept::kByBasis, Verified::kByCages},
      {"least", Kept::kWhileLeast, Verified::kByCages}};
  for (const auto& [name, solver] : kSolvers) {
    for (const auto& [policy, kept, verified] : kPolicies) {
      // How the leaves are verified does not depend on who makes a cage.
      if (solver != Solver::kExact && verified == Verified::kByCages && kept != Kept::kNever) break;
      registerRuns(std::string("Cascade/") + policy + "/" + name, request.runs,
                   [&, kept = kept, verified = verified, solver = solver,
                    seed = std::uint64_t{0}](Numbers& numbers) mutable {
                     return replayWith(solver, steps, kept, verified, ++seed, numbers);
                   });
    }
  }
  for (const bool cascades : {false, true}) {
    registerRuns(std::string("Cascade/boxes/") + (cascades ? "basis" : "union"), request.runs,
                 [&, cascades](Numbers& numbers) { return replayBoxes(steps, cascades, numbers); });
  }
  return runRegistered();
}

const AddMeasure kMeasure("cascade", measureCascade);

}  // namespace

}  // namespace fcl_fibers::benchmarks
