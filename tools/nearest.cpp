// SPDX-License-Identifier: BSD-3-Clause
#include "nearest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <utility>
#include <vector>

#include "along_fibers.h"

namespace fcl_fibers::tools {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Segments of one fiber, or of several.
struct Node {
  static constexpr std::size_t kSeveral = std::numeric_limits<std::size_t>::max();

  Point low, high;  ///< of the box around the axes
  double radius;    ///< the largest
  std::size_t fiber = kSeveral;
  SegmentRange segments{};     ///< of the one fiber
  const Node* left = nullptr;  ///< child
  const Node* right = nullptr;
};

/// A binary tree over the segments of a scene: fibers are cut into halves, and joined by place.
class Tree {
 public:
  explicit Tree(const FiberPolylines& scene) : scene_(scene) {
    std::vector<const Node*> fibers;
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
      if (end - begin >= 2) fibers.push_back(cut(f, {begin, end - 2}));
    }
    if (!fibers.empty()) root_ = join(fibers.data(), fibers.data() + fibers.size());
  }

  /// Null if there is no segment.
  const Node* root() const { return root_; }

 private:
  const Node* cut(std::size_t fiber, SegmentRange segments) {
    constexpr std::size_t kSegmentsOfLeaf = 4;
    const std::size_t count = segments.last - segments.first + 1;
    if (count > kSegmentsOfLeaf) {
      const std::size_t middle = segments.first + count / 2;
      const Node* const left = cut(fiber, {segments.first, middle - 1});
      Node node = parent(left, cut(fiber, {middle, segments.last}));
      node.fiber = fiber;
      node.segments = segments;
      return add(node);
    }
    Node leaf{scene_.points[segments.first], scene_.points[segments.first], 0, fiber, segments};
    for (std::size_t i = segments.first; i <= segments.last; ++i) {
      leaf.radius = std::max(leaf.radius, scene_.radiusAt(i));
      for (std::size_t k = 0; k < 3; ++k) {
        leaf.low[k] = std::min(leaf.low[k], scene_.points[i + 1][k]);
        leaf.high[k] = std::max(leaf.high[k], scene_.points[i + 1][k]);
      }
    }
    return add(leaf);
  }

  const Node* join(const Node** begin, const Node** end) {
    if (end - begin == 1) return *begin;
    const auto center = [](const Node* node, std::size_t k) {
      return node->low[k] / 2 + node->high[k] / 2;
    };
    std::size_t widest = 0;
    double width = -1;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [least, most] = std::minmax_element(
          begin, end, [&](const Node* a, const Node* b) { return center(a, k) < center(b, k); });
      if (center(*most, k) - center(*least, k) <= width) continue;
      width = center(*most, k) - center(*least, k);
      widest = k;
    }
    const Node** const middle = begin + (end - begin) / 2;
    std::nth_element(begin, middle, end, [&](const Node* a, const Node* b) {
      return std::pair(center(a, widest), a->fiber) < std::pair(center(b, widest), b->fiber);
    });
    const Node* const left = join(begin, middle);
    return add(parent(left, join(middle, end)));
  }

  static Node parent(const Node* left, const Node* right) {
    Node node = {left->low, left->high, std::max(left->radius, right->radius)};
    node.left = left;
    node.right = right;
    for (std::size_t k = 0; k < 3; ++k) {
      node.low[k] = std::min(node.low[k], right->low[k]);
      node.high[k] = std::max(node.high[k], right->high[k]);
    }
    return node;
  }

  const Node* add(const Node& node) { return &nodes_.emplace_back(node); }

  const FiberPolylines& scene_;
  std::deque<Node> nodes_;
  const Node* root_ = nullptr;
};

/// What the distance of two axes inside the boxes is at least, rounded down.
double boxDistance(const Node& a, const Node& b) {
  std::array<double, 3> gap;
  for (std::size_t k = 0; k < 3; ++k) {
    gap[k] = std::max({0.0, a.low[k] - b.high[k], b.low[k] - a.high[k]});
  }
  return std::hypot(gap[0], gap[1], gap[2]) * (1 - 8 * std::numeric_limits<double>::epsilon());
}

/// Goes down both trees, or one twice, and nearer nodes first.
class Search {
 public:
  Search(const FiberPolylines& scene, const FiberPolylines* other, const FiberOptions& neighbors)
      : scene_(scene),
        other_(other == nullptr ? scene : *other),
        is_self_(other == nullptr),
        neighbors_(neighbors),
        along_(scene) {}

  std::optional<Contact> run() {
    const Tree tree(scene_);
    std::optional<Tree> other_tree;
    if (!is_self_) other_tree.emplace(other_);
    const Node* const with = is_self_ ? tree.root() : other_tree->root();
    if (tree.root() == nullptr || with == nullptr) return std::nullopt;
    push(*tree.root(), *with);
    while (!pairs_.empty()) {
      const NodePair pair = pairs_.back();
      pairs_.pop_back();
      if (pair.least < least_) open(*pair.a, *pair.b);
    }
    if (!nearest_) return std::nullopt;
    return is_self_ ? capsuleContact(fiberArrays(scene_), *nearest_)
                    : capsuleContact(fiberArrays(scene_), fiberArrays(other_), *nearest_);
  }

 private:
  struct NodePair {
    const Node *a, *b;
    double least;  ///< that the distance of surfaces is at least
  };

  void push(const Node& a, const Node& b) {
    const double axes = boxDistance(a, b);
    const double least = axes - a.radius - b.radius;
    if (least < least_ && !leavesOut(a, b, axes)) pairs_.push_back({&a, &b, least});
  }

  void open(const Node& a, const Node& b) {
    const std::size_t before = pairs_.size();
    if (&a == &b && a.left != nullptr) {
      push(*a.left, *a.left);
      push(*a.right, *a.right);
      push(*a.left, *a.right);
    } else if (a.left == nullptr && b.left == nullptr) {
      measure(a, b);
    } else if (b.left == nullptr || (a.left != nullptr && size(a) >= size(b))) {
      push(*a.left, b);
      push(*a.right, b);
    } else {
      push(a, *b.left);
      push(a, *b.right);
    }
    std::sort(pairs_.begin() + static_cast<std::ptrdiff_t>(before), pairs_.end(),
              [](const NodePair& p, const NodePair& q) { return p.least > q.least; });
  }

  static double size(const Node& node) {
    double size = 0;
    for (std::size_t k = 0; k < 3; ++k) size = std::max(size, node.high[k] - node.low[k]);
    return size;
  }

  /// Whether no two segments of the nodes count, because of how near they are along a fiber.
  /// @param axes  that the distance of their axes is at least
  bool leavesOut(const Node& a, const Node& b, double axes) const {
    if (!is_self_ || a.fiber == Node::kSeveral || a.fiber != b.fiber) return false;
    const bool ascends = a.segments.first <= b.segments.first;
    const SegmentRange first = ascends ? a.segments : b.segments;
    const SegmentRange last = ascends ? b.segments : a.segments;
    const NearAlong most = along_.mostApart(a.fiber, first, last);
    const double half_circle = std::acos(-1.0) / 2 * axes;
    return most.numbers_apart <= static_cast<std::size_t>(neighbors_.ignored_neighbors) ||
           most.length_between <= std::max(half_circle, neighbors_.ignored_arc_length);
  }

  /// Whether two segments do not count, because of how near they are across a branch.
  bool isAcross(SegmentPair pair, double axes) const {
    if (!is_self_ || !along_.hasBranches()) return false;
    const double half_circle = std::acos(-1.0) / 2 * axes;
    return along_
        .nearAcross(pair, std::max(half_circle, neighbors_.ignored_arc_length),
                    static_cast<std::size_t>(neighbors_.ignored_neighbors))
        .has_value();
  }

  void measure(const Node& a, const Node& b) {
    for (std::size_t i = a.segments.first; i <= a.segments.last; ++i) {
      for (std::size_t j = &a == &b ? i + 1 : b.segments.first; j <= b.segments.last; ++j) {
        measure(i, a.fiber, j, b.fiber);
      }
    }
  }

  void measure(std::size_t i, std::size_t fiber_a, std::size_t j, std::size_t fiber_b) {
    SegmentPair pair{static_cast<std::int32_t>(i), static_cast<std::int32_t>(j)};
    if (is_self_ && pair.a > pair.b) std::swap(pair.a, pair.b);
    // Of axes, as a depth does not tell how far they are apart.
    const double axes = capsuleContact(axesOf(scene_), axesOf(other_), pair).distance;
    const bool tapers = scene_.hasRadiiOfPoints() || other_.hasRadiiOfPoints();
    const double distance =
        tapers ? capsuleContact(fiberArrays(scene_), fiberArrays(other_), pair).distance
               : axes - scene_.radiusAt(i) - other_.radiusAt(j);
    if (distance >= least_) return;
    const Node a{{}, {}, 0, fiber_a, {i, i}}, b{{}, {}, 0, fiber_b, {j, j}};
    if (leavesOut(a, b, axes) || isAcross(pair, axes)) return;
    least_ = distance;
    nearest_ = pair;
  }

  static FiberArrays<double> axesOf(const FiberPolylines& scene) {
    static constexpr double kNone = 0;
    FiberArrays<double> axes = fiberArrays(scene);
    axes.radii = &kNone;
    axes.radii_are = FiberArrays<double>::Radii::kOne;
    return axes;
  }

  const FiberPolylines &scene_, &other_;
  const bool is_self_;
  const FiberOptions& neighbors_;
  const AlongFibers along_;
  std::vector<NodePair> pairs_;  ///< that are still to be looked at
  double least_ = kInfinity;     ///< distance so far
  std::optional<SegmentPair> nearest_;
};

}  // namespace

std::optional<Contact> findNearest(const FiberPolylines& scene, const FiberPolylines* other,
                                   const FiberOptions& neighbors) {
  return Search(scene, other, neighbors).run();
}

}  // namespace fcl_fibers::tools
