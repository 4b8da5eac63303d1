// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/generations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "support/exact_geometry.h"
#include "support/random.h"
#include "support/segments.h"

// The boxes that are kept, as they come, move and begin new steps, against brute force over all.

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::fromEigen;
using geometry::MovingSegment;
using geometry::Segment;
using geometry::toPoint;
using geometry::Vec3d;
using test::ExactBox;
using test::Random;
using test::Real;
using tree::Visit;
using Place = SegmentId;
using PlacePair = std::pair<Place, Place>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

ExactBox exact(const Segment& box) { return {toPoint(box.a), toPoint(box.b)}; }

/// The segment at a time; where it does not move it stays as it is, also if it is infinite.
Segment atTime(const MovingSegment& s, double time) {
  const auto between = [&](const Vec3d& p, const Vec3d& q) {
    const auto one = [&](double x, double y) { return x == y ? x : (1 - time) * x + time * y; };
    return Vec3d{one(p.x, q.x), one(p.y, q.y), one(p.z, q.z)};
  };
  return {between(s.start.a, s.end.a), between(s.start.b, s.end.b), s.end.radius};
}

/// The largest of the gaps along the axes. A capsule counts by its box.
Real gap(const Segment& p, const Segment& q) {
  const auto boxOf = [](const Segment& s) -> ExactBox {
    const Real radius = s.isBox() ? 0 : Real(s.radius);
    const test::Point a = toPoint(s.a), b = toPoint(s.b);
    return {a.cwiseMin(b).array() - radius, a.cwiseMax(b).array() + radius};
  };
  return test::boxGap(boxOf(p), boxOf(q));
}

Real distance(const Segment& box, const Segment& s) {
  if (s.isBox()) return test::boxDistance(exact(box), exact(s));
  return test::segmentBoxDistance(toPoint(s.a), toPoint(s.b), exact(box)) - Real(s.radius);
}

/// The most that a side moves.
double way(const MovingSegment& s) {
  double most = 0;
  for (const auto& [p, q] : {std::pair(s.start.a, s.end.a), std::pair(s.start.b, s.end.b)}) {
    for (const auto& [x, y] : {std::pair(p.x, q.x), std::pair(p.y, q.y), std::pair(p.z, q.z)}) {
      if (x != y) most = std::max(most, std::fabs(y - x));
    }
  }
  return most;
}

/// Gets pairs, each once.
struct Collect final : index::PairSink {
  Visit take(const index::PairRun& run) override {
    for (std::size_t i = 0; i < run.count; ++i) {
      const bool is_new = found.insert(std::minmax(run.pairs[i].a, run.pairs[i].b)).second;
      if (!is_new) repeated = true;
      if (found.size() == stop_at) return Visit::kStop;
    }
    return Visit::kContinue;
  }
  std::set<PlacePair> found;
  std::size_t stop_at = 0;
  bool repeated = false;
};

/// The boxes at one end of a step.
struct Boxes final : index::SegmentSource {
  Boxes(const std::vector<MovingSegment>& all, Segment MovingSegment::*end)
      : all_(all), end_(end) {}
  bool read(const Place* ids, int count, int, const Frame&, index::SegmentBlock& out,
            index::BlockMask& present) const override {
    for (int i = 0; i < count; ++i) out.set(i, all_.at(static_cast<std::size_t>(ids[i])).*end_);
    present = geometry::firstOfBlock(count);
    return true;
  }
  bool staysFiniteIn(const Frame&) const override { return true; }
  bool isFasterInOrder() const override { return false; }
  [[noreturn]] void refuse(Place, const Frame&) const override {
    throw std::logic_error("refused");
  }

 private:
  const std::vector<MovingSegment>& all_;
  Segment MovingSegment::*const end_;
};

index::IndexOptions optionsOf(double margin) {
  index::IndexOptions options;
  options.capsules = true;
  options.margin = margin;
  return options;
}

tree::Fibers oneEach(Place begin, Place end) {
  tree::Fibers fibers;
  for (Place place = begin; place < end; ++place) {
    fibers.ids.push_back(place);
    fibers.endFiber();
  }
  return fibers;
}

/// Looks for the least distance.
template <class Distance>
struct Nearest final : index::NearestSink {
  explicit Nearest(Distance d) : distanceOf(std::move(d)) {}
  double limit() const override { return std::numeric_limits<double>::max(); }
  const index::SegmentSource* source() const override { return &none_is_read; }
  Visit visit(Place a, Place b, double& limit) override {
    ++visits;
    least = std::min(least, distanceOf(a, b));
    limit = std::min(limit, static_cast<double>(least));
    return Visit::kContinue;
  }
  // All boxes are kept, so none is read again.
  std::vector<MovingSegment> none;
  Boxes none_is_read{none, &MovingSegment::end};
  Distance distanceOf;
  Real least = std::numeric_limits<Real>::infinity();
  std::size_t visits = 0;
};

class World {
 public:
  World(std::uint64_t seed, double margin, bool moves)
      : random_(seed), margin_(margin), moves_(moves), boxes_(optionsOf(margin), moves) {}

  Place count() const { return static_cast<Place>(known_.size()); }

  void add() {
    MovingSegment box;
    box.start = box.end = anyBox();
    known_.push_back(box);
  }
  void move(Place place, double by) {
    MovingSegment& box = known_[static_cast<std::size_t>(place)];
    const Vec3d shift = fromEigen(random_.inCube(by)), growth = fromEigen(random_.inCube(0.05));
    box.end.a = box.end.a + shift - growth;
    box.end.b = box.end.b + shift + growth;
    box.end.a = min(box.end.a, box.end.b);
    box.end.b = max(box.end.a, box.end.b);
  }
  void readAll(const Frame& frame) {
    reach_ = margin_ * frame.scale;
    finish(frame, boxes_.end() == count() && boxes_.refit(source(), frame));
  }
  void readNew() {
    const Place young = boxes_.youngBegin();
    const bool are_few =
        static_cast<std::size_t>(count() - young) <= Generations::mostYoung(known_.size());
    finish(boxes_.frame(),
           are_few && boxes_.buildYoung(source(), count(), oneEach(young, count())));
  }
  void moveSome(std::size_t most) {
    std::set<Place> some;
    for (std::size_t i = 0; i < most; ++i)
      some.insert(static_cast<Place>(random_.below(known_.size())));
    std::vector<Segment> moved;
    for (const Place place : some) {
      move(place, 0.4);
      moved.push_back(known_[static_cast<std::size_t>(place)].end);
    }
    finish(boxes_.frame(), boxes_.refitSome({some.begin(), some.end()}, moved));
  }
  void beginStep() {
    for (MovingSegment& box : known_) box.start = box.end;
    boxes_.endStep();
  }
  void clear() {
    known_.clear();
    boxes_.clear();
  }

  void expectAnswers() {
    Collect pairs;
    EXPECT_EQ(boxes_.search(pairs), Visit::kContinue);
    EXPECT_FALSE(pairs.repeated);
    std::size_t least = 0;
    for (Place a = 0; a < count(); ++a) {
      for (Place b = a + 1; b < count(); ++b) {
        least += expectPair(moving(a), moving(b), pairs.found.count({a, b}) > 0) ? 1 : 0;
      }
    }
    found += least;
    if (pairs.found.size() > 1) {
      Collect first;
      first.stop_at = 1;
      EXPECT_EQ(boxes_.search(first), Visit::kStop);
      EXPECT_EQ(first.found.size(), 1u);
    }
    const auto ends = [&](Place a, Place b) { return distance(moving(a).end, moving(b).end); };
    Real nearest = std::numeric_limits<Real>::infinity();
    for (Place a = 0; a < count(); ++a) {
      for (Place b = a + 1; b < count(); ++b) nearest = std::min(nearest, ends(a, b));
    }
    Nearest search(ends);
    boxes_.search(search);
    if (nearest > 0) {
      EXPECT_EQ(search.least, nearest);
    } else {
      EXPECT_LE(search.least, 0);
    }

    for (int i = 0; i < 6; ++i) expectAnswersWith(anyQuery(i));
  }

  std::size_t found = 0;   ///< pairs so far
  std::size_t passed = 0;  ///< of them those that do not touch at the end

 private:
  MovingSegment moving(Place place) const {
    const MovingSegment& box = known_[static_cast<std::size_t>(place)];
    return moves_ ? box : MovingSegment{box.end, box.end};
  }
  Boxes source() const { return {known_, &MovingSegment::end}; }
  void finish(Frame frame, bool are_fitted) {
    if (!are_fitted) {
      boxes_.clear();
      boxes_.build(source(), frame, count(), oneEach(0, count()));
    }
    if (moves_) boxes_.fitStart(Boxes(known_, &MovingSegment::start));
  }
  Segment anyBox() {
    const Vec3d low = fromEigen(random_.inCube(1.25));
    Segment box = Segment::box(low, low + fromEigen((random_.inCube(0.3).array() + 0.3).matrix()));
    // Some are those of planes and half-spaces.
    if (random_.below(12) == 0) (random_.below(2) == 0 ? box.a.x : box.a.z) = -kInfinity;
    if (random_.below(12) == 0) (random_.below(2) == 0 ? box.b.x : box.b.y) = kInfinity;
    return box;
  }
  MovingSegment anyQuery(int kind) {
    MovingSegment query;
    query.start = query.end = anyBox();
    if (kind % 2 == 0) {
      const Vec3d from = fromEigen(random_.inCube(1.25));
      query.start = query.end = {from, from + fromEigen(random_.inCube(0.7)), 0.125};
    }
    if (moves_ && kind >= 2) {
      const Vec3d shift = fromEigen(random_.inCube(1));
      query.end.a = query.end.a + shift;
      query.end.b = query.end.b + shift;
    }
    return query;
  }

  void expectAnswersWith(const MovingSegment& query) {
    Collect pairs;
    EXPECT_EQ(boxes_.search(query, 0, tree::kNoGroup, 0, pairs), Visit::kContinue);
    EXPECT_FALSE(pairs.repeated);
    // The query has the id 0.
    for (Place a = 0; a < count(); ++a) {
      const bool is_found = pairs.found.count(std::minmax<Place>(a, 0)) > 0;
      found += expectPair(moving(a), query, is_found) ? 1 : 0;
    }
    const auto to_query = [&](Place a, Place /*second*/) {
      return distance(moving(a).end, query.end);
    };
    Real nearest = std::numeric_limits<Real>::infinity();
    for (Place a = 0; a < count(); ++a) nearest = std::min(nearest, to_query(a, 0));
    Nearest search(to_query);
    boxes_.search(query, 0, tree::kNoGroup, 0, search);
    if (nearest > 0) {
      EXPECT_EQ(search.least, nearest);
    } else {
      EXPECT_LE(search.least, 0);
    }
  }

  /// Returns whether the pair must be found.
  bool expectPair(const MovingSegment& p, const MovingSegment& q, bool is_found) {
    Real least = std::min(gap(p.start, q.start), gap(p.end, q.end));
    const Real at_end = gap(p.end, q.end);
    constexpr int kSamples = 64;
    const double moved = way(p) + way(q);
    for (int k = 1; k < kSamples && moved > 0; ++k) {
      const double time = static_cast<double>(k) / kSamples;
      least = std::min(least, gap(atTime(p, time), atTime(q, time)));
    }
    const bool must = least <= reach_ - 1e-12L;
    passed += must && at_end > reach_ ? 1 : 0;
    if (must) {
      EXPECT_TRUE(is_found) << "missing, " << static_cast<double>(least);
    } else if (least > reach_ + Real(moved) / kSamples + 1e-12L) {
      EXPECT_FALSE(is_found) << "extra, " << static_cast<double>(least);
    }
    return must;
  }

  Random random_;
  const double margin_;
  Real reach_ = 0;  ///< the margin in the frame, which has the boxes
  const bool moves_;
  std::vector<MovingSegment> known_;
  Generations boxes_;
};

struct Case {
  double margin;
  bool moves;
};
constexpr Case kCases[] = {{0, false}, {0.25, false}, {0, true}, {0.25, true}};

// A box that is new, or has moved, or rests since a step began would be lost, or be where it was.
TEST(BoxGenerations, AnswersAreThoseOfAllBoxesInAnyOrderOfCalls) {
  const Frame frames[] = {{}, {{0.25, -0.5, 0.125}, 8}};
  for (const Case& one : kCases) {
    std::size_t found = 0, passed = 0;
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
      SCOPED_TRACE("margin " + std::to_string(one.margin) + (one.moves ? ", moving" : "") +
                   ", seed " + std::to_string(seed));
      World world(960 + seed, one.margin, one.moves);
      Random random(970 + seed);
      for (std::size_t i = 0; i < 1 + 6 * seed; ++i) world.add();
      world.readAll(frames[seed % 2]);
      world.expectAnswers();
      for (int round = 0; round < 14 && !testing::Test::HasFailure(); ++round) {
        const std::size_t what = random.below(8);
        SCOPED_TRACE("round " + std::to_string(round) + ", call " + std::to_string(what));
        if (what == 0) {
          for (Place place = 0; place < world.count(); ++place) world.move(place, 0.4);
          world.readAll(frames[random.below(8) == 0 ? 1 - seed % 2 : seed % 2]);
        } else if (what < 3) {
          world.beginStep();
        } else if (what < 6) {
          world.moveSome(1 + random.below(what == 3 ? 1 : 5));
        } else {
          for (std::size_t i = 0; i <= random.below(3); ++i) world.add();
          world.readNew();
        }
        world.expectAnswers();
      }
      found += world.found;
      passed += world.passed;
    }
    EXPECT_GT(found, 400u);
    EXPECT_EQ(passed > 50, one.moves) << passed;
  }
}

// One by one they are few beside many, and must not be forgotten when they become many.
TEST(BoxGenerations, ManyMayComeOneByOne) {
  for (const Case& one : kCases) {
    SCOPED_TRACE("margin " + std::to_string(one.margin) + (one.moves ? ", moving" : ""));
    World world(981, one.margin, one.moves);
    world.add();
    world.readAll({});
    for (int i = 0; i < 60 && !testing::Test::HasFailure(); ++i) {
      world.add();
      world.readNew();
      if (i % 7 == 3) world.moveSome(3);
      if (i % 20 == 9) world.beginStep();
      world.expectAnswers();
    }
  }
}

// Those of before would still be found.
TEST(BoxGenerations, AreNoneAfterTheyWereCleared) {
  for (const Case& one : kCases) {
    World world(982, one.margin, one.moves);
    for (int i = 0; i < 30; ++i) world.add();
    world.readAll({});
    world.moveSome(2);
    world.add();
    world.readNew();
    world.clear();
    world.expectAnswers();
    EXPECT_EQ(world.found, 0u);
    world.readAll({});
    world.expectAnswers();
    for (int i = 0; i < 30; ++i) world.add();
    world.readAll({{1, 2, 3}, 0.5});
    world.expectAnswers();
    EXPECT_GT(world.found, 0u);
  }
}

}  // namespace
}  // namespace fcl_fibers::broadphase
