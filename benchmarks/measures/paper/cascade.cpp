// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
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
  kByBasis,     ///< while no leaf leaves the least sphere around its basis (Guibas et al., 2002)
  /// As kByBasis, but a cage is also made anew if a ball of its basis no longer counts. Leaves
  /// below a cage that is inside are not tested.
  kAsLibrary,
};

/// Counts of an update, over all inner nodes.
struct CascadeCounts {
  double anew = 0, verified = 0, tests = 0;
};

/// Spheres of the paper's tree, and what verifies them.
class Cages {
 public:
  using Enclose = std::function<EnclosingSphere(const Ball*, int, const geometry::Basis&)>;

  Cages(const BinaryTree& tree, Kept kept, Enclose enclose)
      : tree_(tree), kept_(kept), enclose_(std::move(enclose)), cages_(tree.size()) {}

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
      if (kept_ == Kept::kNever) cage.basis = {};
      if (cage.basis.size > 0 && keeps(static_cast<std::int32_t>(i), cage)) continue;
      counts.anew += 1;
      cage = enclose_(balls_ + node.begin, node.end - node.begin, cage.basis);
    }
  }

  /// Throws std::logic_error unless every sphere encloses all leaves below it.
  void check() const {
    forEachInner([&](std::size_t i, const BinaryTree::Node& node) {
      const Ball& ball = cages_[i].ball;
      for (std::int32_t leaf = node.begin; leaf < node.end; ++leaf) {
        const double reach = norm(balls_[leaf].center - ball.center) + balls_[leaf].radius;
        if (reach > ball.radius * (1 + kTolerance)) {
          throw std::logic_error("cascade: a leaf sticks out of its cage");
        }
      }
    });
  }

  /// How many times as large as the least ones its spheres are, in the mean of the inner nodes.
  /// Throws std::logic_error if a sphere is smaller, or is larger and has to be the least.
  double looseness() const {
    double sum = 0, count = 0;
    forEachInner([&](std::size_t i, const BinaryTree::Node& node) {
      const Ball least = enclosingSphere(balls_ + node.begin, node.end - node.begin).ball;
      const double ratio = cages_[i].ball.radius / least.radius;
      if (ratio < 1 - kTolerance || (kept_ != Kept::kWhereItWas && ratio > 1 + kTolerance)) {
        throw std::logic_error("cascade: a sphere is not the least");
      }
      sum += ratio;
      count += 1;
    });
    return sum / count;
  }

  /// Volume tests of a query, and the pairs of leaves that it finds.
  std::pair<double, double> query() const {
    std::vector<BallVolume> volumes;
    for (const EnclosingSphere& cage : cages_) volumes.push_back({cage.ball});
    double pairs = 0;
    const std::size_t tests =
        queryItself(tree_, volumes, [&](std::int32_t, std::int32_t) { ++pairs; });
    return {static_cast<double>(tests), pairs};
  }

  CascadeCounts counts;

 private:
  template <class F>
  void forEachInner(F&& visit) const {
    for (std::size_t i = 0; i < tree_.size(); ++i) {
      const BinaryTree::Node& node = tree_[static_cast<std::int32_t>(i)];
      if (!node.isLeaf()) visit(i, node);
    }
  }

  bool keeps(std::int32_t index, EnclosingSphere& cage) {
    const std::optional<Ball> ball =
        kept_ == Kept::kWhereItWas ? cage.ball : ofBasis(balls_ + tree_[index].begin, cage.basis);
    if (!ball) return false;
    double reach = ball->radius;
    if (!encloses(index, *ball, reach)) return false;
    cage.ball = {ball->center, reach};
    return true;
  }

  /// The least sphere around a basis, or nothing where the library makes a cage anew.
  std::optional<Ball> ofBasis(const Ball* leaves, const geometry::Basis& basis) const {
    const Ball* members[4] = {};
    Ball copies[4];
    for (std::size_t k = 0; k < static_cast<std::size_t>(basis.size); ++k) {
      members[k] = leaves + basis.ball[k];
      copies[k] = *members[k];
    }
    const auto support = geometry::supportSphere(members, basis.size);
    if (support && support->isLeast()) return support->ball;
    if (kept_ == Kept::kAsLibrary) return {};
    return enclosingSphere(copies, basis.size).ball;
  }

  /// Raises `reach` to the farthest leaf of those that are in the ball, up to rounding.
  bool encloses(std::int32_t index, const Ball& ball, double& reach) {
    const double limit = ball.radius * (1 + kEscape);
    const BinaryTree::Node& node = tree_[index];
    if (kept_ != Kept::kAsLibrary) {
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
  Enclose enclose_;
  std::vector<EnclosingSphere> cages_;  ///< by node
  const Ball* balls_ = nullptr;
};

/// Boxes united bottom up.
struct United {
  explicit United(const BinaryTree& all) : tree(all), boxes(all.size()) {}

  /// @param leaves  boxes by leaf
  void update(const std::vector<AxisBox>& leaves) {
    for (std::size_t i = tree.size(); i-- > 0;) {
      const BinaryTree::Node& node = tree[static_cast<std::int32_t>(i)];
      boxes[i] = node.isLeaf()
                     ? leaves[static_cast<std::size_t>(node.begin)]
                     : AxisBox::around(boxes[i + 1], boxes[static_cast<std::size_t>(node.right)]);
    }
    counts = {1, 1, 0};
  }
  void check() const {}

  const BinaryTree& tree;
  std::vector<AxisBox> boxes;  ///< by node
  CascadeCounts counts;
};

/// Cascade verification of boxes: each keeps the leaf that determines each of its sides. A side
/// moves along with its leaf, and the box is made anew where a child reaches beyond.
class BoxCages {
 public:
  struct Cage {
    AxisBox box;
    std::int32_t leaf[6];  ///< of low and high sides; -1 where there was no box yet
  };

  explicit BoxCages(const BinaryTree& tree) : tree_(tree), united_(tree), cages_(tree.size()) {
    for (std::size_t i = 0; i < tree.size(); ++i) {
      const BinaryTree::Node& node = tree[static_cast<std::int32_t>(i)];
      std::fill(std::begin(cages_[i].leaf), std::end(cages_[i].leaf),
                node.isLeaf() ? node.begin : -1);
    }
  }

  /// @param boxes  by leaf
  void update(const std::vector<AxisBox>& boxes) {
    boxes_ = &boxes;
    for (std::size_t i = tree_.size(); i-- > 0;) {
      const BinaryTree::Node& node = tree_[static_cast<std::int32_t>(i)];
      Cage& cage = cages_[i];
      if (node.isLeaf()) {
        cage.box = boxes[static_cast<std::size_t>(node.begin)];
        continue;
      }
      const Cage& a = cages_[i + 1];
      const Cage& b = cages_[static_cast<std::size_t>(node.right)];
      counts.verified += 1;
      if (cage.leaf[0] >= 0 && keeps(cage, a, b)) continue;
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
  }

  /// Throws std::logic_error unless every box is the least around its leaves.
  void check() {
    united_.update(*boxes_);
    for (std::size_t i = 0; i < cages_.size(); ++i) {
      const AxisBox &kept = cages_[i].box, &least = united_.boxes[i];
      if (kept.low != least.low || kept.high != least.high) {
        throw std::logic_error("cascade: a box is not the least around its segments");
      }
    }
  }

  CascadeCounts counts;

 private:
  bool keeps(Cage& cage, const Cage& a, const Cage& b) {
    AxisBox box;
    for (std::size_t k = 0; k < 3; ++k) {
      box.low[k] = (*boxes_)[static_cast<std::size_t>(cage.leaf[k])].low[k];
      box.high[k] = (*boxes_)[static_cast<std::size_t>(cage.leaf[k + 3])].high[k];
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
  United united_;            ///< for check()
  std::vector<Cage> cages_;  ///< by node
  const std::vector<AxisBox>* boxes_ = nullptr;
};

/// The frames of a scene, by leaf of the paper's tree.
struct Steps {
  explicit Steps(const SceneRequest& request) {
    const tools::SceneSource source = openScene(request.text, request.radius);
    std::vector<int> frames = source.asked;
    if (frames.size() == 1 && frames[0] + 1 < source.frame_count) frames.push_back(frames[0] + 1);
    if (frames.size() == 1) frames.insert(frames.begin(), frames[0] - 1);
    for (const int frame : frames) {
      tools::progress("cascade: frame " + std::to_string(frame));
      const FiberPolylines fibers = source.make(frame);
      const TreeScene scene(MovingFibers("", fibers, fibers));
      const auto topology = superThread(scene.fibers);
      if (tree == nullptr) tree = std::make_unique<BinaryTree>(topology);
      std::vector<Ball>& of_balls = balls.emplace_back();
      std::vector<AxisBox>& of_boxes = boxes.emplace_back();
      double largest = 0;
      for (const tree::SegmentId id : topology.leaves) {
        const geometry::Segment& s = scene.segments[static_cast<std::size_t>(id)];
        const Capsule capsule{{s.a.x, s.a.y, s.a.z}, {s.b.x, s.b.y, s.b.z}, s.radius};
        of_balls.push_back(ballAround(capsule));
        of_boxes.push_back(AxisBox::around(capsule));
        largest = std::max(largest, of_balls.back().radius);
      }
      // The paper's segments are of equal length, and Welzl's algorithm needs equal radii.
      for (Ball& ball : of_balls) ball.radius = largest;
    }
  }

  double segments() const { return static_cast<double>(balls[0].size()); }

  std::unique_ptr<BinaryTree> tree;
  std::vector<std::vector<Ball>> balls;     ///< by frame and leaf
  std::vector<std::vector<AxisBox>> boxes;  ///< by frame and leaf
  double pairs = -1;                        ///< of overlapping leaves in the last frame, once known
};

/// Returns the mean seconds of an update: of all frames after the first.
template <class Tree, class Volumes>
double replay(Tree& tree, const std::vector<Volumes>& frames, Numbers& numbers) {
  numbers["build"] = seconds([&] { tree.update(frames[0]); });
  const auto steps = static_cast<double>(frames.size() - 1);
  double update = 0;
  CascadeCounts all;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    tree.counts = {};
    update += seconds([&] { tree.update(frames[i]); });
    tree.check();
    all.anew += tree.counts.anew;
    all.tests += tree.counts.tests;
    all.verified += tree.counts.verified;
  }
  numbers["tests"] = all.tests / steps;
  numbers["anew"] = all.anew / all.verified;
  return numbers["update"] = update / steps;
}

double replaySpheres(Steps& steps, Kept kept, const Cages::Enclose& enclose, Numbers& numbers) {
  Cages cages(*steps.tree, kept, enclose);
  const double update = replay(cages, steps.balls, numbers);
  numbers["segments"] = steps.segments();
  numbers["loose"] = cages.looseness();
  if (steps.segments() <= kMostSearched) {
    const auto [tests, pairs] = cages.query();
    numbers["volume_tests"] = tests;
    if (steps.pairs < 0) steps.pairs = pairs;
    if (pairs != steps.pairs) throw std::logic_error("cascade: cages find other pairs");
  }
  return update;
}

double replayBoxes(const Steps& steps, bool cascades, Numbers& numbers) {
  numbers["segments"] = steps.segments();
  numbers["bytes"] = cascades ? sizeof(BoxCages::Cage) : sizeof(AxisBox);
  United united(*steps.tree);
  BoxCages cages(*steps.tree);
  return cascades ? replay(cages, steps.boxes, numbers) : replay(united, steps.boxes, numbers);
}

/// Section 2.3: one sphere around all segments.
void registerRoot(const char* solver, Welzl::Order order, int runs, const Steps& steps) {
  registerRuns(std::string("Root/") + solver, runs,
               [&steps, order, seed = std::uint64_t{0}](Numbers& numbers) mutable {
                 Welzl welzl(order, ++seed);
                 const std::vector<Ball>& balls = steps.balls.back();
                 const double taken = tools::seconds(
                     [&] { welzl.around(balls.data(), static_cast<int>(balls.size())); });
                 numbers = {{"segments", steps.segments()},
                            {"ball_tests", static_cast<double>(welzl.tests)}};
                 return taken;
               });
}

bool measureCascade(const Request& request) {
  Steps steps(request.scene);
  // Who makes a cage anew: the library, from the basis that the cage had, or Welzl's algorithm.
  const std::pair<const char*, std::optional<Welzl::Order>> kSolvers[] = {
      {"exact", {}}, {"welzl", Welzl::Order::kRandom}, {"welzl_to_front", Welzl::Order::kToFront}};
  const std::pair<const char*, Kept> kPolicies[] = {{"anew", Kept::kNever},
                                                    {"where_it_was", Kept::kWhereItWas},
                                                    {"basis", Kept::kByBasis},
                                                    {"library", Kept::kAsLibrary}};
  for (const auto& [solver, order] : kSolvers) {
    if (order) registerRoot(solver, *order, request.runs, steps);
    for (const auto& [policy, kept] : kPolicies) {
      // By their bases, too few cages are made anew to tell solvers apart.
      if (order && kept != Kept::kNever && kept != Kept::kWhereItWas) break;
      registerRuns(
          std::string("Cascade/") + policy + "/" + solver, request.runs,
          [&steps, order = order, kept = kept, seed = std::uint64_t{0}](Numbers& numbers) mutable {
            Welzl welzl(order.value_or(Welzl::Order::kRandom), ++seed);
            const auto enclose = [&](const Ball* balls, int count, const geometry::Basis& start) {
              return order ? welzl.around(balls, count) : enclosingSphere(balls, count, start);
            };
            const double update = replaySpheres(steps, kept, enclose, numbers);
            numbers["ball_tests"] =
                static_cast<double>(welzl.tests) / static_cast<double>(steps.balls.size());
            return update;
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
