// SPDX-License-Identifier: BSD-3-Clause
#include "live/coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "geometry/rounding.h"
#include "tree/extent.h"

namespace fcl_fibers::live {
namespace {

using geometry::AffineMap;
using geometry::Box;
using geometry::MovedPoint;
using geometry::roundedDown;
using geometry::roundedUp;
using geometry::Vec3d;

/// Makes up for the rounding of the few operations behind it.
constexpr double kOutward = 1 + 64 * std::numeric_limits<double>::epsilon();

/// Bounds how much nearer a segment of p and one of q have come. NaN counts as infinity.
double approachOf(const BlockTree::Node& p, const BlockTree::Node& q) {
  double squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = std::max(double{p.moved.high[axis]} - double{q.moved.low[axis]},
                              double{q.moved.high[axis]} - double{p.moved.low[axis]});
    squared += d * d;
  }
  const double approach = (std::sqrt(squared) + double{p.growth} + double{q.growth}) * kOutward;
  return approach >= 0 ? approach : std::numeric_limits<double>::infinity();
}

double squaredGap(const Box& p, const Box& q) {
  double squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double gap = std::max({double{p.low[axis]} - double{q.high[axis]},
                                 double{q.low[axis]} - double{p.high[axis]}, 0.0});
    squared += gap * gap;
  }
  return squared;
}
/// A lower bound of how far apart two boxes are.
double gapOf(const Box& p, const Box& q) { return std::sqrt(squaredGap(p, q)) / kOutward; }
/// Whether two nodes are further apart than this. A box that is around everything is not.
bool areFurtherApart(const Box& p, const Box& q, double distance) {
  return squaredGap(p, q) > distance * distance * kOutward;
}

Box grown(Box box, double length) {
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = roundedDown(double{box.low[axis]} - length);
    box.high[axis] = roundedUp(double{box.high[axis]} + length);
  }
  return box;
}

double medianOf(std::vector<double>& numbers) {
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
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

Coverage::Coverage(const Sides& sides, double covered, double margin, std::int64_t most,
                   IsListed isListed)
    : sides_(sides),
      covered_(covered),
      margin_(margin),
      is_listed_(std::move(isListed)),
      left_(most) {
  for (int i = 0; i < sides_.count; ++i) {
    places_[i].assign(static_cast<std::size_t>(sides_.anchors[i]->blockCount()), -1);
  }
}

/// How far apart two segments may be that are so far apart on every axis. Boxes touch if they are
/// within the margin on every axis.
double Coverage::reachOf(double distance) const {
  constexpr double kDiagonal = 1.7320508075688774;  // above the root of 3
  return sides_.have_boxes ? kDiagonal * distance : distance;
}

bool Coverage::covers(const BlockTree::Node& p, const BlockTree::Node& q) {
  --left_;
  const double approach = approachOf(p, q);
  return approach + wanted_ <= covered_ ||
         areFurtherApart(p.where, q.where, reachOf(approach + margin_ + wanted_));
}

bool Coverage::check(Renewals& renewals) {
  const int second = sides_.count - 1;
  return visitUncovered([&](Leaf k, const BlockTree::Node& p, Leaf l, const BlockTree::Node& q) {
    choose(0, k, p, second, l, q, renewals);
  });
}

bool Coverage::findRests(double wanted, const TakeRest& take) {
  wanted_ = wanted;
  return visitUncovered([&](Leaf k, const BlockTree::Node& p, Leaf l, const BlockTree::Node& q) {
    if (is_listed_(k, l)) return;
    const double approach = approachOf(p, q);
    take(k, l,
         std::max(covered_ - approach, gapOf(p.where, q.where) - reachOf(margin_ + approach)));
  });
}

/// Calls take(k, p, l, q) for the pairs of segments k and l, and their nodes p and q, that are not
/// covered.
bool Coverage::visitUncovered(const TakePair& take) {
  const int second = sides_.count - 1;
  if (root(0).level < 0 || root(second).level < 0) return true;
  return visitUncovered(root(0), root(second), take);
}

bool Coverage::visitUncovered(const Place& p, const Place& q, const TakePair& take) {
  const int second = sides_.count - 1;
  if (covers(nodeAt(0, p), nodeAt(second, q))) return true;
  if (left_ < 0) return false;
  if (p.level == 0 && q.level == 0) {
    visitUncoveredOf(p.node, q.node, take);
    return true;
  }
  bool goes_on = true;
  if (p.level > q.level) {
    forChildren(*sides_.anchors[0], p.level, p.node, [&](std::int32_t child) {
      goes_on = goes_on && visitUncovered({p.level - 1, child}, q, take);
    });
  } else if (q.level > p.level) {
    forChildren(*sides_.anchors[second], q.level, q.node, [&](std::int32_t child) {
      goes_on = goes_on && visitUncovered(p, {q.level - 1, child}, take);
    });
  } else {
    const bool is_one = second == 0 && p.node == q.node;
    forChildren(*sides_.anchors[0], p.level, p.node, [&](std::int32_t child) {
      forChildren(*sides_.anchors[second], q.level, q.node, [&](std::int32_t other) {
        if (is_one && other < child) return;
        goes_on = goes_on && visitUncovered({p.level - 1, child}, {q.level - 1, other}, take);
      });
    });
  }
  return goes_on;
}

const BlockTree::BlockNodes& Coverage::nodesOf(int side, std::int32_t block) {
  std::int32_t& place = places_[side][static_cast<std::size_t>(block)];
  if (place < 0) {
    place = static_cast<std::int32_t>(nodes_.size());
    sides_.writeNodes(side, block, nodes_.emplace_back());
  }
  return nodes_[static_cast<std::size_t>(place)];
}

/// Calls take() for those of two blocks.
void Coverage::visitUncoveredOf(std::int32_t i, std::int32_t j, const TakePair& take) {
  const int second = sides_.count - 1;
  const BlockTree &p = *sides_.anchors[0], &q = *sides_.anchors[second];
  nodesOf(0, i);  // may move the others
  const BlockTree::BlockNodes& q_nodes = nodesOf(second, j);
  const BlockTree::BlockNodes& p_nodes = nodesOf(0, i);
  const bool is_one = second == 0 && i == j;
  for (Leaf k = i * BlockTree::kBlock; k < p.blockEnd(i); ++k) {
    const BlockTree::Node& p_node = p_nodes[static_cast<std::size_t>(k % BlockTree::kBlock)];
    if (covers(p_node, q.node(0, j))) continue;
    for (Leaf l = is_one ? k + 1 : j * BlockTree::kBlock; l < q.blockEnd(j); ++l) {
      const BlockTree::Node& q_node = q_nodes[static_cast<std::size_t>(l % BlockTree::kBlock)];
      if (covers(p_node, q_node)) continue;
      take(k, p_node, l, q_node);
    }
  }
}

/// Chooses which of two segments is to be anchored anew.
void Coverage::choose(int p_side, Leaf k, const BlockTree::Node& p, int q_side, Leaf l,
                      const BlockTree::Node& q, Renewals& renewals) const {
  if (p_side == 0 ? is_listed_(k, l) : is_listed_(l, k)) return;
  const auto deviationOf = [this](int side, Leaf leaf, const BlockTree::Node& node) {
    return sides_.anchors[side]->deviationOf(node, leaf / BlockTree::kBlock);
  };
  if (sides_.keeps_second || deviationOf(p_side, k, p) >= deviationOf(q_side, l, q)) {
    renewals[static_cast<std::size_t>(p_side)].push_back({k, tree::centerOfVolume(q.moved)});
  } else {
    renewals[static_cast<std::size_t>(q_side)].push_back({l, tree::centerOfVolume(p.moved)});
  }
}

bool Coverage::checkAround(const Leaves& changed, Renewals& renewals) {
  for (int side = 0; side < sides_.count; ++side) {
    for (const Leaf leaf : changed[static_cast<std::size_t>(side)]) {
      std::int32_t& place = places_[side][static_cast<std::size_t>(leaf / BlockTree::kBlock)];
      if (place < 0) continue;
      sides_.writeNodes(side, leaf / BlockTree::kBlock, nodes_[static_cast<std::size_t>(place)]);
    }
  }
  for (int side = 0; side < sides_.count; ++side) {
    const int other = sides_.count - 1 - side;
    const BlockTree& q = *sides_.anchors[other];
    for (const Leaf k : changed[static_cast<std::size_t>(side)]) {
      const std::int32_t i = k / BlockTree::kBlock;
      const BlockTree::Node p = nodesOf(side, i)[static_cast<std::size_t>(k % BlockTree::kBlock)];
      const auto below = [&](auto& self, const Place& place) -> bool {
        if (covers(p, nodeAt(other, place))) return true;
        if (left_ < 0) return false;
        if (place.level > 0) {
          bool goes_on = true;
          forChildren(q, place.level, place.node, [&](std::int32_t child) {
            goes_on = goes_on && self(self, {place.level - 1, child});
          });
          return goes_on;
        }
        const BlockTree::BlockNodes& nodes = nodesOf(other, place.node);
        for (Leaf l = place.node * BlockTree::kBlock; l < q.blockEnd(place.node); ++l) {
          if (sides_.count == 1 && l == k) continue;
          const BlockTree::Node& q_node = nodes[static_cast<std::size_t>(l % BlockTree::kBlock)];
          if (covers(p, q_node)) continue;
          choose(side, k, p, other, l, q_node, renewals);
        }
        return true;
      };
      if (root(other).level >= 0 && !below(below, root(other))) return false;
    }
  }
  return true;
}

double usualApproach(const Sides& sides, double distance) {
  // A list fails where many blocks have come apart, so it is not the median that counts.
  constexpr std::int32_t kMostBlocks = 1024;
  std::vector<double> approaches;
  for (int i = 0; i < sides.count; ++i) {
    const BlockTree& anchors = *sides.anchors[i];
    const std::int32_t step = anchors.blockCount() / kMostBlocks + 1;
    for (std::int32_t block = 0; block < anchors.blockCount(); block += step) {
      const BlockTree::Node& node = anchors.node(0, block);
      if (!sides.keeps_second) {
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
  return approachOf(p.node(p.levelCount() - 1, 0), q.node(q.levelCount() - 1, 0));
}

}  // namespace fcl_fibers::live
