// SPDX-License-Identifier: BSD-3-Clause
#include "live/coverage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geometry/rounding.h"

namespace fcl_fibers::live {
namespace {

using geometry::AffineMap;
using geometry::Box;
using geometry::MovedPoint;
using geometry::roundedDown;
using geometry::roundedUp;
using geometry::Vec3d;
using simd::LaneMask;

/// Makes up for the rounding of the few operations behind it.
constexpr double kOutward = 1 + 64 * std::numeric_limits<double>::epsilon();

/// Bounds how much nearer a segment of p and one of q have come. NaN counts as infinity.
double approachOf(const Node& p, const Node& q) {
  double squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = std::max(double{p.moved.high[axis]} - double{q.moved.low[axis]},
                              double{q.moved.high[axis]} - double{p.moved.low[axis]});
    squared += d * d;
  }
  const double approach = (std::sqrt(squared) + double{p.growth} + double{q.growth}) * kOutward;
  return approach >= 0 ? approach : std::numeric_limits<double>::infinity();
}

Box grown(Box box, double length) {
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = roundedDown(double{box.low[axis]} - length);
    box.high[axis] = roundedUp(double{box.high[axis]} + length);
  }
  return box;
}

/// Calls visit(lane) for the lanes of a mask, until it returns false. Returns whether it never did.
template <class Visit>
bool forLanes(LaneMask mask, const Visit& visit) {
  for (; mask != 0; mask &= mask - 1) {
    if (!visit(__builtin_ctz(mask))) return false;
  }
  return true;
}

double medianOf(std::vector<double>& numbers) {
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
}

/// One visitUncovered().
class Coverage {
 public:
  Coverage(const Sides& sides, double covered, double margin, std::int64_t& left,
           const std::function<void(Leaf p, Leaf q)>& take)
      : sides_(sides),
        second_(sides.count - 1),
        p_(*sides.anchors[0]),
        q_(*sides.anchors[second_]),
        cover_{roundedDown(covered), roundedUp(margin), sides.have_boxes ? kDiagonal : 1},
        take_(take),
        left_(left) {
    for (int i = 0; i < sides_.count; ++i) {
      places_[i].assign(static_cast<std::size_t>(sides_.anchors[i]->blockCount()), -1);
    }
  }

  bool visit() {
    const Place p{p_.levelCount() - 1, 0}, q{q_.levelCount() - 1, 0};
    if (p.level < 0 || q.level < 0) return true;
    const bool is_covered = uncoveredOfOne(p_.pack(p.level, 0), 0, q_.pack(q.level, 0), 1) == 0;
    return is_covered || visit(p, q);
  }

 private:
  /// Boxes touch if they are within the margin on every axis.
  static constexpr float kDiagonal = 1.7320509F;  // above the root of 3
  static constexpr int kArity = BlockTree::kArity;

  struct Place {
    int level;
    std::int32_t node;
  };
  using Columns = std::array<LaneMask, static_cast<std::size_t>(kArity)>;

  /// The nodes of q that are not covered with each node of p.
  Columns uncovered(const NodePack& p, LaneMask rows, const NodePack& q, LaneMask columns) {
    left_ -= __builtin_popcount(rows);
    Columns found{};
    findUncovered(p, rows, q, cover_, found.data());
    for (LaneMask& mask : found) mask &= columns;
    return found;
  }
  LaneMask uncoveredOfOne(const NodePack& p, int row, const NodePack& q, LaneMask columns) {
    return uncovered(p, LaneMask{1} << row, q, columns)[static_cast<std::size_t>(row)];
  }

  /// @pre p and q are not covered
  bool visit(const Place& p, const Place& q) {
    if (left_ < 0) return false;
    if (p.level == 0 && q.level == 0) {
      visitLeaves(p.node, q.node);
      return true;
    }
    // One node goes down alone until it is as far above the leaves as the other one.
    if (p.level > q.level) {
      const LaneMask children =
          uncoveredOfOne(q_.pack(q.level, q.node / kArity), q.node % kArity,
                         p_.pack(p.level - 1, p.node), p_.lanes(p.level - 1, p.node));
      return forLanes(children, [&](int lane) {
        return visit({p.level - 1, p.node * kArity + lane}, q);
      });
    }
    if (p.level < q.level) {
      const LaneMask children =
          uncoveredOfOne(p_.pack(p.level, p.node / kArity), p.node % kArity,
                         q_.pack(q.level - 1, q.node), q_.lanes(q.level - 1, q.node));
      return forLanes(children, [&](int lane) {
        return visit(p, {q.level - 1, q.node * kArity + lane});
      });
    }
    const int level = p.level - 1;
    const bool is_one = second_ == 0 && p.node == q.node;
    const LaneMask rows = p_.lanes(level, p.node);
    const Columns columns =
        uncovered(p_.pack(level, p.node), rows, q_.pack(level, q.node), q_.lanes(level, q.node));
    return forLanes(rows, [&](int row) {
      const LaneMask first = is_one ? LaneMask{1} << row : 1;
      return forLanes(columns[static_cast<std::size_t>(row)] & -first, [&](int column) {
        return visit({level, p.node * kArity + row}, {level, q.node * kArity + column});
      });
    });
  }

  /// The nodes of the leaves of a block.
  const BlockTree::BlockNodes& nodesOf(int side, std::int32_t block) {
    std::int32_t& place = places_[side][static_cast<std::size_t>(block)];
    if (place < 0) {
      place = static_cast<std::int32_t>(nodes_.size());
      sides_.writeNodes(side, block, nodes_.emplace_back());
    }
    return nodes_[static_cast<std::size_t>(place)];
  }

  /// Visits the leaves of two blocks.
  void visitLeaves(std::int32_t i, std::int32_t j) {
    nodesOf(0, i);  // may move the others
    const BlockTree::BlockNodes& q_nodes = nodesOf(second_, j);
    const BlockTree::BlockNodes& p_nodes = nodesOf(0, i);
    const bool is_one = second_ == 0 && i == j;
    constexpr int kPacks = BlockTree::kBlock / kArity;
    for (int a = 0; a < kPacks; ++a) {
      const NodePack& p = p_nodes.packs[a];
      const LaneMask rows =
          uncoveredOfOne(q_.pack(0, j / kArity), j % kArity, p, p_.leafLanes(i, a));
      for (int b = is_one ? a : 0; rows != 0 && b < kPacks; ++b) {
        const Columns columns = uncovered(p, rows, q_nodes.packs[b], q_.leafLanes(j, b));
        forLanes(rows, [&](int row) {
          const LaneMask first = is_one && a == b ? LaneMask{2} << row : 1;
          return forLanes(columns[static_cast<std::size_t>(row)] & -first, [&](int column) {
            // To take a pair costs about as much as to compare so many nodes.
            constexpr std::int64_t kPrice = 2;
            left_ -= kPrice;
            take_(i * BlockTree::kBlock + a * kArity + row,
                  j * BlockTree::kBlock + b * kArity + column);
            return true;
          });
        });
      }
    }
  }

  const Sides& sides_;
  const int second_;
  const BlockTree &p_, &q_;
  const Cover cover_;
  const std::function<void(Leaf p, Leaf q)>& take_;
  std::int64_t& left_;
  /// The nodes of leaves of blocks that have been asked about, and where those of a block are.
  std::vector<BlockTree::BlockNodes> nodes_;
  std::vector<std::int32_t> places_[2];
};

/// Calls visit(block) for the blocks whose anchors and radii may be in a box.
template <class Visit>
void visitNear(const BlockTree& anchors, const Box& box, const Visit& visit) {
  const auto overlaps = [&](const Box& where) {
    bool all = true;
    for (int axis = 0; axis < 3; ++axis) {
      all &= where.low[axis] <= box.high[axis] && box.low[axis] <= where.high[axis];
    }
    return all;
  };
  const auto below = [&](auto& self, int level, std::int32_t i) -> void {
    if (!overlaps(anchors.node(level, i).where)) return;
    if (level == 0) return visit(i);
    forLanes(anchors.lanes(level - 1, i), [&](int lane) {
      self(self, level - 1, i * BlockTree::kArity + lane);
      return true;
    });
  };
  if (anchors.levelCount() > 0) below(below, anchors.levelCount() - 1, 0);
}

/// The points, and how far a motion takes each from where it is, apart from what is common to all.
class Rests {
 public:
  explicit Rests(const std::vector<MovedPoint>& points)
      : points_(points), rests_(points.size()), numbers_(points.size()) {}

  /// Returns the median.
  double set(const AffineMap& motion) {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      rests_[i] = points_[i].after - motion(points_[i].before);
    }
    Vec3d usual{0, 0, 0};
    for (double Vec3d::*axis : geometry::kAxes) {
      for (std::size_t i = 0; i < points_.size(); ++i) numbers_[i] = rests_[i].*axis;
      usual.*axis = medianOf(numbers_);
    }
    for (std::size_t i = 0; i < points_.size(); ++i) {
      rests_[i] = rests_[i] - usual;
      numbers_[i] = squaredNorm(rests_[i]);
    }
    median_ = medianOf(numbers_);
    return std::sqrt(median_);
  }
  /// The points that are not further from there than the median.
  std::vector<MovedPoint> nearest() const {
    std::vector<MovedPoint> nearest;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (squaredNorm(rests_[i]) <= median_) nearest.push_back(points_[i]);
    }
    return nearest;
  }

 private:
  const std::vector<MovedPoint>& points_;
  std::vector<Vec3d> rests_;
  std::vector<double> numbers_;
  double median_ = 0;
};

}  // namespace

AffineMap commonMotion(const std::vector<MovedPoint>& points) {
  // To follow a turn costs time for every point, so it has to leave much less of the displacements.
  constexpr double kWorth = 0.7;
  constexpr int kFits = 2;
  if (points.empty()) return {};
  Rests rests(points);
  const double rest = rests.set(AffineMap());
  if (!(rest > 0)) return {};
  AffineMap fit;
  double rest_of_fit = rest;
  for (int i = 0; i < kFits; ++i) {
    // A few points that go their own way must not turn all others.
    fit = rigidFit(rests.nearest());
    rest_of_fit = rests.set(fit);
  }
  return rest_of_fit < kWorth * rest ? fit : AffineMap();
}

bool visitUncovered(const Sides& sides, double covered, double margin, std::int64_t& left,
                    const std::function<void(Leaf p, Leaf q)>& take) {
  return Coverage(sides, covered, margin, left, take).visit();
}

double usualApproach(const Sides& sides, double distance) {
  // A list fails where many blocks have come apart, so it is not the median that counts.
  constexpr std::int32_t kMostBlocks = 1024;
  std::vector<double> approaches;
  for (int i = 0; i < sides.count; ++i) {
    const BlockTree& anchors = *sides.anchors[i];
    const std::int32_t step = anchors.blockCount() / kMostBlocks + 1;
    for (std::int32_t block = 0; block < anchors.blockCount(); block += step) {
      const Node node = anchors.node(0, block);
      if (!sides.is_mesh) {
        approaches.push_back(approachOf(node, node));
      } else if (i == 0) {
        visitNear(*sides.anchors[1], grown(node.where, distance), [&](std::int32_t other) {
          approaches.push_back(approachOf(node, sides.anchors[1]->node(0, other)));
        });
      }
    }
  }
  if (approaches.empty()) return 0;
  const auto place = approaches.begin() + static_cast<std::ptrdiff_t>(approaches.size() * 3 / 4);
  std::nth_element(approaches.begin(), place, approaches.end());
  return *place;
}

double mostApproach(const Sides& sides) {
  const BlockTree &p = *sides.anchors[0], &q = *sides.anchors[sides.count - 1];
  if (p.levelCount() == 0 || q.levelCount() == 0) return 0;
  return approachOf(p.root(), q.root());
}

}  // namespace fcl_fibers::live
