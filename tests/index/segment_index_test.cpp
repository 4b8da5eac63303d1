// SPDX-License-Identifier: BSD-3-Clause
#include "index/segment_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "geometry/touch.h"
#include "support/random.h"
#include "support/segments.h"
#include "support/touch_oracle.h"

namespace fcl_fibers::index {
namespace {

using geometry::Frame;
using geometry::fromEigen;
using geometry::Segment;
using geometry::Vec3d;
using test::Random;
using test::Real;
using tree::Fibers;
using tree::Group;
using tree::kNoGroup;
using tree::Pair;
using tree::Visit;
using PairList = std::vector<std::pair<SegmentId, SegmentId>>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct BadSegment : std::invalid_argument {
  explicit BadSegment(SegmentId segment) : std::invalid_argument("bad segment"), id(segment) {}
  SegmentId id;
};

/// Segments in the world, some ids of which have gone.
struct World : SegmentSource {
  std::vector<Segment> segments;
  std::vector<bool> present;
  Fibers fibers;
  Frame frame{{0.3, -0.2, 0.1}, 8};
  std::set<SegmentId> bad;
  bool is_faster_in_order = false;

  SegmentId count() const { return static_cast<SegmentId>(segments.size()); }
  bool isThere(SegmentId id) const { return present[static_cast<std::size_t>(id)]; }
  Segment at(SegmentId id, const Frame& in) const {
    const Segment& s = segments[static_cast<std::size_t>(id)];
    return {in.fromWorld(s.a), in.fromWorld(s.b), s.isBox() ? s.radius : in.scale * s.radius};
  }
  Segment at(SegmentId id) const { return at(id, frame); }

  bool read(const SegmentId* ids, int count, int ahead, const Frame& in, SegmentBlock& out,
            BlockMask& is_present) const override {
    EXPECT_GT(count, 0);
    EXPECT_LE(count, SegmentBlock::kCapacity);
    EXPECT_GE(ahead, 0);
    is_present = 0;
    for (int i = 0; i < count + ahead; ++i) {
      EXPECT_TRUE(0 <= ids[i] && ids[i] < this->count()) << ids[i];
    }
    for (int i = 0; i < count; ++i) {
      if (bad.count(ids[i]) != 0) return false;
      if (!isThere(ids[i])) continue;
      out.set(i, at(ids[i], in));
      is_present |= BlockMask{1} << i;
    }
    return true;
  }
  bool staysFiniteIn(const geometry::Frame&) const override { return true; }
  bool isFasterInOrder() const override { return is_faster_in_order; }
  [[noreturn]] void refuse(SegmentId id, const Frame&) const override { throw BadSegment(id); }

  /// What there is of the fibers from one id to another.
  Fibers fibersOf(SegmentId begin, SegmentId end) const {
    Fibers found;
    for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
      for (auto i = fibers.begin[f]; i < fibers.begin[f + 1]; ++i) {
        const SegmentId id = fibers.ids[static_cast<std::size_t>(i)];
        if (isThere(id) && begin <= id && id < end) found.ids.push_back(id);
      }
      if (static_cast<std::int32_t>(found.ids.size()) > found.begin.back()) found.endFiber();
    }
    return found;
  }

  void build(SegmentIndex& index, SegmentId begin, SegmentId end) const {
    index.build(*this, frame, begin, end, fibersOf(begin, end));
  }
  void build(SegmentIndex& index) const { build(index, 0, count()); }
  bool refit(SegmentIndex& index) const { return index.refit(*this, frame); }
  bool refitSome(SegmentIndex& index, const std::vector<SegmentId>& ids) const {
    std::vector<Segment> moved;
    for (const SegmentId id : ids) moved.push_back(at(id, index.frame()));
    return index.refitSome(ids, moved);
  }

  void addFiber(Random& random, int length, double step, double radius) {
    Vec3d p = fromEigen(random.inCube(0.7)), direction = fromEigen(random.direction());
    for (int i = 0; i < length; ++i) {
      direction = direction + 0.6 * fromEigen(random.direction()) - 0.3 * p;
      direction = (1 / geometry::norm(direction)) * direction;
      const Vec3d q = p + step * direction;
      add({p, q, radius});
      p = q;
    }
    fibers.endFiber();
  }
  void add(const Segment& segment) {
    fibers.ids.push_back(count());
    segments.push_back(segment);
    present.push_back(true);
  }
  void move(SegmentId id, Random& random, double size) {
    Segment& s = segments[static_cast<std::size_t>(id)];
    const Vec3d by = fromEigen(random.inCube(size));
    s = {s.a + by, s.b + by + fromEigen(random.inCube(0.1 * size)), s.radius};
  }
};

/// More segments than a task reads.
World largeWorld() {
  Random random(41);
  World world;
  for (int f = 0; f < 52; ++f) world.addFiber(random, 200 + f, 0.03, 0.01);
  for (std::size_t id = 5; id < world.segments.size(); id += 97) world.present[id] = false;
  return world;
}
World smallWorld(std::uint64_t seed = 42) {
  Random random(seed);
  World world;
  for (int f = 0; f < 20; ++f) world.addFiber(random, 30, 0.08, f % 4 == 0 ? 0.05 : 0.02);
  for (std::size_t id = 5; id < world.segments.size(); id += 31) world.present[id] = false;
  return world;
}
Segment slab() { return Segment::box({-kInfinity, -kInfinity, -0.1}, {kInfinity, kInfinity, 0.1}); }

class CollectAll final : public PairSink {
 public:
  Visit take(const PairRun& run) override {
    for (std::size_t i = 0; i < run.count; ++i) {
      found.emplace_back(run.pairs[i].a, run.pairs[i].b);
    }
    return Visit::kContinue;
  }
  PairList found;
};

/// Lowers no limit.
class CollectNear final : public NearestSink {
 public:
  CollectNear(double limit, const SegmentSource& source) : limit_(limit), source_(source) {}
  double limit() const override { return limit_; }
  const SegmentSource* source() const override { return &source_; }
  Visit visit(SegmentId a, SegmentId b, double& /*limit*/) override {
    found.emplace_back(a, b);
    return Visit::kContinue;
  }
  PairList found;

 private:
  double limit_;
  const SegmentSource& source_;
};

geometry::MovingSegment resting(const Segment& segment) { return {segment, segment}; }

template <class... What>
PairList pairsOf(const SegmentIndex& index, const What&... what) {
  CollectAll sink;
  EXPECT_EQ(index.search(what..., sink), Visit::kContinue);
  return sink.found;
}
/// Nearer than this, in the index' frame.
template <class... What>
PairList nearOf(const World& world, const SegmentIndex& index, double limit, const What&... what) {
  CollectNear sink(limit, world);
  EXPECT_EQ(index.search(what..., sink), Visit::kContinue);
  return sink.found;
}
PairList sorted(PairList pairs) {
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}
PairList asSet(PairList pairs) {
  for (auto& pair : pairs) {
    if (pair.first > pair.second) std::swap(pair.first, pair.second);
  }
  return sorted(std::move(pairs));
}
bool hasDuplicates(const PairList& set) {
  return std::adjacent_find(set.begin(), set.end()) != set.end();
}

class SegmentIndexTest : public testing::TestWithParam<IndexOptions> {
 protected:
  IndexOptions options(int threads = 1, double margin = 0.002) const {
    IndexOptions options = GetParam();
    options.threads = threads;
    options.margin = margin;
    return options;
  }
};

std::string nameOf(const IndexOptions& options) {
  return std::string(options.wrapped_spheres ? "Spheres" : "Boxes") +
         (options.super_thread ? "SuperThread" : "Bundle") +
         (options.capsules ? "Capsules" : "Volumes");
}
std::vector<IndexOptions> allKinds() {
  std::vector<IndexOptions> kinds;
  for (const bool wrapped_spheres : {false, true}) {
    for (const bool super_thread : {false, true}) {
      for (const bool capsules : {false, true}) {
        kinds.push_back({wrapped_spheres, super_thread, capsules, 0, 1});
      }
    }
  }
  return kinds;
}
INSTANTIATE_TEST_SUITE_P(, SegmentIndexTest, testing::ValuesIn(allKinds()),
                         [](const auto& info) { return nameOf(info.param); });

// A callback that asks the index again, while other threads search for the next one, would wait for
// itself or mix up the pairs.
TEST_P(SegmentIndexTest, PairsMayBeAskedForWhilePairsAreHandedOn) {
  class Nested final : public PairSink {
   public:
    explicit Nested(const SegmentIndex& index) : index_(index) {}
    Visit take(const PairRun& run) override {
      if (runs_++ % 50 == 0) inner.push_back(pairsOf(index_));
      return outer.take(run);
    }
    CollectAll outer;
    std::vector<PairList> inner;

   private:
    const SegmentIndex& index_;
    int runs_ = 0;
  };
  SegmentIndex index(options(3));
  smallWorld().build(index);
  const PairList expected = pairsOf(index);
  Nested nested(index);
  index.search(nested);
  EXPECT_TRUE(nested.outer.found == expected);
  EXPECT_GE(nested.inner.size(), 1u);
  for (const PairList& inner : nested.inner) EXPECT_TRUE(inner == expected);
}

/// Calls visit(volume, volume of the other) for all volumes of two trees of one shape.
template <class F>
void forEachVolume(const SegmentIndex::Tree& first, const SegmentIndex::Tree& second, F&& visit) {
  std::visit(
      [&](const auto& tree) {
        const auto& other = std::get<std::decay_t<decltype(tree)>>(second);
        ASSERT_EQ(tree.nodes().size(), other.nodes().size());
        for (std::size_t i = 0; i < tree.nodes().size(); ++i) {
          const auto node = static_cast<std::int32_t>(i);
          for (int lane = 0; lane < tree.node(node).child_count; ++lane) {
            visit(tree.pack(node).get(lane), other.pack(node).get(lane));
          }
        }
      },
      first);
}

// Volumes would be refitted, or grow, where nothing has moved.
TEST_P(SegmentIndexTest, ARefitWithoutMotionChangesNothing) {
  World world = largeWorld();
  world.segments[10000] = slab();
  for (const int threads : {1, 2, 8}) {
    SCOPED_TRACE(threads);
    SegmentIndex index(options(threads));
    world.build(index);
    const PairList pairs = pairsOf(index);
    const SegmentIndex::Tree before = index.tree();
    EXPECT_TRUE(world.refit(index));
    EXPECT_TRUE(world.refitSome(index, {0, 1, 2, 2, 0, 10000}));
    EXPECT_TRUE(world.refit(index));
    forEachVolume(before, index.tree(), [](const auto& then, const auto& now) {
      ASSERT_EQ(std::memcmp(&now, &then, sizeof(now)), 0);
    });
    std::visit(
        [](const auto& tree) {
          using Volume = typename std::decay_t<decltype(tree)>::Volume;
          if constexpr (std::is_same_v<Volume, geometry::Sphere>) {
            EXPECT_EQ(tree.hierarchy().cagesRecomputed(), 0u);
          }
        },
        index.tree());
    EXPECT_TRUE(pairsOf(index) == pairs);
  }
}

// Managers and trees of arrays would give different answers.
TEST_P(SegmentIndexTest, TheOrderOfReadingDoesNotMatter) {
  World by_tree = largeWorld();
  World in_order = by_tree;
  in_order.is_faster_in_order = true;
  for (const int threads : {1, 2}) {
    SCOPED_TRACE(threads);
    SegmentIndex index(options(threads)), other(options(threads));
    const auto expectSame = [&] {
      EXPECT_TRUE(pairsOf(index) == pairsOf(other));
      forEachVolume(index.tree(), other.tree(), [](const auto& one, const auto& two) {
        ASSERT_EQ(std::memcmp(&one, &two, sizeof(one)), 0);
      });
    };
    by_tree.build(index);
    in_order.build(other);
    expectSame();
    Random random(49);
    for (SegmentId id = 0; id < by_tree.count(); ++id) by_tree.move(id, random, 0.01);
    in_order.segments = by_tree.segments;
    by_tree.refit(index);
    in_order.refit(other);
    expectSame();
    by_tree.move(77, random, 0.3);
    in_order.segments = by_tree.segments;
    by_tree.refitSome(index, {77});
    in_order.refit(other);
    expectSame();
  }
}

/// The segments that are no further apart than the margin.
PairList touching(const World& world, double margin) {
  std::vector<test::GivenCapsule> capsules;
  std::vector<SegmentId> ids;
  for (SegmentId id = 0; id < world.count(); ++id) {
    if (!world.isThere(id)) continue;
    const Segment& s = world.segments[static_cast<std::size_t>(id)];
    capsules.push_back({{s.a.x, s.a.y, s.a.z}, {s.b.x, s.b.y, s.b.z}, s.radius});
    ids.push_back(id);
  }
  PairList pairs;
  test::TouchOracle(std::move(capsules))
      .visitNearPairs(margin, [&](std::size_t i, std::size_t j, const auto& verdict) {
        if (verdict.touching) pairs.emplace_back(ids[i], ids[j]);
      });
  return pairs;
}

// Bounds would become loose where fibers move far, or what stands still be fitted again.
TEST_P(SegmentIndexTest, TheFrameStaysAsLongAsItIsGood) {
  World world = smallWorld();
  for (const bool in_order : {false, true}) {
    world.is_faster_in_order = in_order;
    SegmentIndex index(options());
    const auto frameAfter = [&](double scale, double shift) {
      World moved = world;
      for (Segment& s : moved.segments) {
        s = {scale * s.a + Vec3d{shift, 0, 0}, scale * s.b + Vec3d{shift, 0, 0}, scale * s.radius};
      }
      index.refit(moved);
      const PairList found = asSet(pairsOf(index)), due = touching(moved, options().margin);
      EXPECT_FALSE(due.empty());
      EXPECT_TRUE(std::includes(found.begin(), found.end(), due.begin(), due.end()));
      if (options().capsules) {
        EXPECT_EQ(found.size(), due.size());
      } else {
        SegmentIndex fresh(options());
        moved.frame = frameFor(moved, moved.fibers.ids);
        moved.build(fresh);
        // Volumes are rounded in another frame there, and some barely overlap.
        EXPECT_NEAR(static_cast<double>(found.size()), static_cast<double>(pairsOf(fresh).size()),
                    2);
      }
      return index.frame();
    };
    index.build(world, frameFor(world, world.fibers.ids), 0, world.count(),
                world.fibersOf(0, world.count()));
    const Frame first = index.frame();
    const auto isFirst = [&first](const Frame& frame) {
      return frame.origin == first.origin && frame.scale == first.scale;
    };
    EXPECT_TRUE(isFirst(frameAfter(1, 0)));
    EXPECT_TRUE(isFirst(frameAfter(1.05, 0.01)));
    EXPECT_TRUE(isFirst(frameAfter(0.95, -0.01)));
    const Frame far = frameAfter(1, 1e6);
    EXPECT_NEAR(far.origin.x, 1e6, 2);
    // Scenes of one place and size have one frame.
    EXPECT_TRUE(isFirst(frameAfter(1, 0)));
    EXPECT_GT(frameAfter(1e-6, 0).scale, 1e4 * first.scale);
    EXPECT_LT(frameAfter(1e6, 0).scale, 1e-4 * first.scale);
  }
}

// All pairs with another index would be found, although few touch.
TEST_P(SegmentIndexTest, TheFrameOfFewFollowsThemWhereverOthersAre) {
  const auto moved = [](World world, std::size_t from, std::size_t to, double x) {
    for (std::size_t i = from; i < to; ++i) {
      Segment& s = world.segments[i];
      s = {s.a + Vec3d{x, 0, 0}, s.b + Vec3d{x, 0, 0}, s.radius};
    }
    return world;
  };
  Random random(43);
  World world;
  for (int f = 0; f < 10; ++f) world.addFiber(random, 1, 0.08, 0.02);
  SegmentIndex index(options());
  const auto build = [&](const World& start) {
    index.build(start, frameFor(start, start.fibers.ids), 0, start.count(),
                start.fibersOf(0, start.count()));
  };
  build(world);
  const Frame first = index.frame();
  index.refit(moved(world, 4, 10, 1e17));
  EXPECT_GT(index.frame().origin.x, 1e16);
  index.refit(world);
  EXPECT_TRUE(index.frame() == first) << "all have returned";

  if (!options().capsules) return;  // which are reread
  const World apart = moved(world, 7, 10, 1e9);
  build(apart);
  EXPECT_LT(std::fabs(index.frame().origin.x), 1);
  const World far = moved(apart, 0, 7, 1e6);
  EXPECT_FALSE(index.reread(far));
  index.refit(far);
  EXPECT_GT(index.frame().origin.x, 9e5) << "most have moved, between others";
}

// The message would name another object with every run; or an object that cannot be read end the
// program.
TEST_P(SegmentIndexTest, OfSegmentsThatCannotBeReadTheLeastIsRefused) {
  struct Waiting final : World {
    explicit Waiting(const World& world) : World(world) {}
    bool read(const SegmentId* ids, int count, int ahead, const Frame& in, SegmentBlock& out,
              BlockMask& is_present) const override {
      // Lets another thread be the first to find one, if there is one that comes to it.
      for (int ms = 0; ids[0] == 0 && waits && !found && ms < 100; ++ms) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      const bool is_read = World::read(ids, count, ahead, in, out, is_present);
      if (!is_read) found = true;
      return is_read;
    }
    bool waits = false;
    mutable std::atomic<bool> found{false};
  };
  const World world = largeWorld();
  Waiting source(world);
  SegmentIndex first(options());
  world.build(first);
  const PairList pairs = pairsOf(first);
  for (const int threads : {1, 2}) {
    SCOPED_TRACE(threads);
    SegmentIndex index(options(threads));
    source.waits = threads > 1;
    for (const std::set<SegmentId>& bad :
         {std::set<SegmentId>{4096}, {11000, 9000, 3000}, {9001, 8999}, {11725}}) {
      source.bad = bad;
      const auto expectLeast = [&](auto&& call) {
        source.found = false;
        try {
          call();
          ADD_FAILURE() << "nothing was thrown";
        } catch (const BadSegment& error) {
          EXPECT_EQ(error.id, *bad.begin());
        }
      };
      expectLeast([&] { source.build(index); });
      world.build(index);
      expectLeast([&] { source.refit(index); });
    }
    world.build(index);
    EXPECT_TRUE(pairsOf(index) == pairs);
  }
}

// Memory would double under volumes; capsules be tested where they are no more.
TEST_P(SegmentIndexTest, SegmentsAreKeptOnlyForCapsules) {
  World world = largeWorld();
  SegmentIndex index(options(2));
  const std::size_t bytes = world.segments.size() * sizeof(Segment);
  const bool kept = GetParam().capsules;
  EXPECT_EQ(index.keepsSegments(), kept);
  const auto expectKept = [&] {
    const std::size_t in_tree =
        std::visit([](const auto& tree) { return tree.memoryUsage(); }, index.tree());
    EXPECT_GE(index.memoryUsage(), in_tree + (kept ? bytes : 0));
    EXPECT_LT(index.memoryUsage(), in_tree + (kept ? 2 * bytes : bytes / 2));
    EXPECT_TRUE(index.isFitted(world));
    for (const SegmentId id : {0, 1, 4711, 9999, 10000, world.count() - 1}) {
      ASSERT_TRUE(world.isThere(id));
      World moved = world;
      Segment& segment = moved.segments[static_cast<std::size_t>(id)];
      segment.a.z += 0.1;
      // The sphere around what is open is the same wherever that is.
      const bool may_move = !isBounded(segment) && GetParam().wrapped_spheres && !kept;
      EXPECT_EQ(index.isFitted(moved), may_move) << id;
      moved.bad = {id};
      EXPECT_FALSE(index.isFitted(moved)) << id;
    }
  };
  world.build(index);
  expectKept();
  EXPECT_TRUE(world.refit(index));
  expectKept();

  // What is open to a side is in the tree like the others.
  const Segment before = world.segments[10000];
  world.segments[10000] = slab();
  EXPECT_TRUE(world.refit(index));
  expectKept();
  world.build(index);
  expectKept();
  EXPECT_TRUE(world.refitSome(index, {9999, 10000}));
  expectKept();
  world.segments[10000] = before;
  EXPECT_TRUE(world.refitSome(index, {10000}));
  expectKept();
}

/// A world and what brute force says of each of its pairs.
struct Judged {
  struct Gap {
    SegmentId a, b;
    Real gap;      ///< of the two, where one is a box of that box
    Real box_gap;  ///< of the boxes around both
    bool boxed;    ///< whether one is a box
  };

  explicit Judged(World judged) : world(std::move(judged)) {
    for (SegmentId i = 0; i < world.count(); ++i) {
      for (SegmentId j = i + 1; j < world.count(); ++j) {
        if (!world.isThere(i) || !world.isThere(j)) continue;
        const Segment p = world.at(i), q = world.at(j);
        const bool boxed = p.isBox() || q.isBox();
        const test::ExactCapsule a{toPoint(p.a), toPoint(p.b), p.thickness()},
            b{toPoint(q.a), toPoint(q.b), q.thickness()};
        const Real axes =
            boxed ? test::segmentBoxDistance(p.isBox() ? b.a : a.a, p.isBox() ? b.b : a.b,
                                             p.isBox() ? boxOf(a) : boxOf(b))
                  : test::segmentDistance(a.a, a.b, b.a, b.b);
        gaps.push_back({i, j, axes - a.radius - b.radius,
                        boxed ? test::boxGap(boxOf(a), boxOf(b)) : Real(0), boxed});
      }
    }
  }

  World world;
  std::vector<Gap> gaps;
};

/// A world with shapes that are no capsules, and the same after all have moved.
const std::array<Judged, 2>& judgedSteps() {
  static const std::array<Judged, 2> steps = [] {
    World world = smallWorld();
    world.add({{0, 0, 0}, {0, 0, 0}, 0.1});  // a sphere
    world.add(Segment::box({-0.2, -0.2, -0.2}, {0.1, 0.1, 0.1}));
    world.fibers.endFiber();
    World moved = world;
    Random random(44);
    for (SegmentId i = 0; i < world.count(); ++i) moved.move(i, random, 0.03);
    return std::array{Judged(std::move(world)), Judged(std::move(moved))};
  }();
  return steps;
}

// Queries would report capsules that are apart, or none that are close, or volumes instead.
TEST_P(SegmentIndexTest, PairsAreThoseThatBruteForceFinds) {
  for (const double margin : {0.0, 0.01}) {
    for (const int threads : {1, 3}) {
      SegmentIndex index(options(threads, margin));
      for (const Judged& step : judgedSteps()) {
        const World& world = step.world;
        const bool is_first = &step == &judgedSteps()[0];
        SCOPED_TRACE("margin " + std::to_string(margin) + (is_first ? "" : ", moved"));
        if (is_first) {
          world.build(index);
        } else {
          EXPECT_TRUE(world.refit(index));
        }
        const PairList found = asSet(pairsOf(index));
        EXPECT_FALSE(hasDuplicates(found));
        const double limit = 0.2;
        const PairList near = asSet(nearOf(world, index, limit));
        EXPECT_FALSE(hasDuplicates(near));
        if (GetParam().capsules) {
          EXPECT_GT(near.size(), found.size());
        }
        SegmentId touching = 0;
        for (const auto& [i, j, gap, box_gap, boxed] : step.gaps) {
          const std::pair<SegmentId, SegmentId> pair(i, j);
          const bool is_near = std::binary_search(near.begin(), near.end(), pair);
          if (gap < limit) {
            EXPECT_TRUE(is_near) << i << ", " << j;
          } else if (GetParam().capsules && !boxed && gap > limit + 1e-12) {
            EXPECT_FALSE(is_near) << i << ", " << j;
          }
          // Both touch and distance err by a few ulp of coordinates below eight.
          const Real excess = gap - Real(index.margin());
          if (std::fabs(excess) < 1e-12L) continue;
          const bool expected = excess < 0;
          // What is no capsule counts by its box, and so does its partner where leaves are boxes.
          if (boxed && !expected && box_gap <= Real(index.margin())) continue;
          touching += expected;
          if (expected || GetParam().capsules) {
            EXPECT_EQ(std::binary_search(found.begin(), found.end(), pair), expected)
                << i << ", " << j;
          }
        }
        EXPECT_GT(touching, world.count() / 2);
      }
    }
  }
}

// A query of one object would report others than the manager does of it.
TEST_P(SegmentIndexTest, PairsWithOneSegmentAreThoseOfItsOwn) {
  const World world = smallWorld();
  SegmentIndex index(options());
  world.build(index);
  const PairList all = pairsOf(index);
  for (SegmentId id = 0; id < world.count(); id += 5) {
    if (!world.isThere(id)) continue;
    // Whoever asks says how the segment is called.
    const SegmentId second = id % 2 == 0 ? id : 100000 + id;
    const PairList pairs = pairsOf(index, resting(world.at(id)), 0.0, kNoGroup, second);
    std::set<SegmentId> found, expected{id};
    for (const auto& [a, b] : pairs) {
      EXPECT_EQ(b, second);
      found.insert(a);
    }
    EXPECT_EQ(found.size(), pairs.size());
    for (const auto& [a, b] : all) {
      if (a == id) expected.insert(b);
      if (b == id) expected.insert(a);
    }
    EXPECT_EQ(found, expected);

    const double limit = 2 * index.margin();
    std::set<SegmentId> near, expected_near{id};
    for (const auto& [a, b] :
         nearOf(world, index, limit, resting(world.at(id)), 0.0, kNoGroup, second)) {
      EXPECT_EQ(b, second);
      EXPECT_TRUE(near.insert(a).second);
    }
    for (const auto& [a, b] : nearOf(world, index, limit)) {
      if (a == id) expected_near.insert(b);
      if (b == id) expected_near.insert(a);
    }
    if (GetParam().capsules) {
      EXPECT_EQ(near, expected_near);
    }
    for (SegmentId i = 0; i < world.count(); ++i) {
      if (!world.isThere(i) || !touch(world.at(i), world.at(id), 0.999 * limit, 0)) continue;
      EXPECT_EQ(near.count(i), 1u) << i;
    }
  }
}

// Capsules would be decided with a bound of their errors that is too small.
TEST_P(SegmentIndexTest, NoSegmentReachesFartherThanTheRoot) {
  World world = smallWorld();
  SegmentIndex index(options());
  const auto expectInside = [&](const char* when) {
    const double reach =
        std::visit([](const auto& tree) { return tree::reachOf(tree); }, index.tree());
    for (const SegmentId id : index.leaves()) {
      if (!world.isThere(id)) continue;
      const Segment s = world.at(id, index.frame());
      ASSERT_LE(std::max(maxNorm(s.a), maxNorm(s.b)), reach) << when << ' ' << id;
    }
  };
  world.build(index);
  expectInside("built");
  for (Segment& s : world.segments) s = {1.1 * s.b, 0.9 * s.a, s.radius};
  world.refit(index);
  expectInside("refitted");
  for (const std::size_t id : {3u, 40u, 77u}) {
    Segment& s = world.segments[id];
    s = {s.a + Vec3d{7, 0, -3}, s.b + Vec3d{7, 0, -3}, s.radius};
  }
  world.refitSome(index, {3, 40, 77});
  expectInside("refitted in part");
}

// What is near would not be visited, or all be for what is near nothing.
TEST_P(SegmentIndexTest, VisitsWhatIsNearDuringTheWholeStep) {
  World world = smallWorld();
  world.add(Segment::box({-0.5, -0.5, -0.5}, {0.5, -0.4, 0.1}));
  world.fibers.endFiber();
  world.add(slab());
  world.fibers.endFiber();
  Random random(61);
  SegmentIndex index(options());
  const auto none = [](const geometry::Box&) { return true; };
  EXPECT_EQ(index.visitNear(/*of_step=*/true, none, [](SegmentId) { return Visit::kStop; }),
            Visit::kContinue)
      << "it is empty";
  world.build(index);
  const World before = world;
  for (SegmentId id = 0; id < world.count() - 2; id += 3) world.move(id, random, 0.3);
  ASSERT_TRUE(index.tryRefit(world, index.frame()));
  ASSERT_TRUE(index.fitStart(before));
  std::size_t visited = 0, tested = 0;
  for (int round = 0; round < 20; ++round) {
    const Vec3d middle = world.frame.scale * fromEigen(random.inCube(0.7));
    const double half = world.frame.scale * random.between(0, 0.3);
    const auto isNear = [&](const Vec3d& low, const Vec3d& high) {
      return maxNorm(max(max(low - middle, middle - high), {0, 0, 0})) <= half;
    };
    const auto near = [&](const geometry::Box& box) {
      ++tested;
      return isNear({box.low[0], box.low[1], box.low[2]}, {box.high[0], box.high[1], box.high[2]});
    };
    for (const bool moves : {false, true}) {
      std::set<SegmentId> found;
      EXPECT_EQ(index.visitNear(moves, near,
                                [&](SegmentId id) {
                                  EXPECT_TRUE(found.insert(id).second) << id;
                                  return Visit::kContinue;
                                }),
                Visit::kContinue);
      for (const SegmentId id : index.leaves()) {
        if (!world.isThere(id)) continue;
        const Segment now = boxAround(world.at(id), 0), then = boxAround(before.at(id), 0);
        const bool is_near =
            moves ? isNear(min(now.a, then.a), max(now.b, then.b)) : isNear(now.a, now.b);
        if (is_near) {
          EXPECT_TRUE(found.count(id)) << id;
        }
        // Spheres have larger boxes.
        const double more = GetParam().wrapped_spheres ? 2 * maxNorm(now.b - now.a) + 1 : 0.125;
        const Vec3d around{more, more, more};
        if (now.isBox() && GetParam().wrapped_spheres) continue;
        if (!isNear(min(now.a, then.a) - around, max(now.b, then.b) + around)) {
          EXPECT_FALSE(found.count(id)) << id;
        }
      }
      visited += found.size();
      if (found.empty()) continue;
      EXPECT_EQ(index.visitNear(moves, near, [](SegmentId) { return Visit::kStop; }), Visit::kStop);
    }
  }
  EXPECT_GT(visited, 200u);
  EXPECT_LT(tested, 40 * static_cast<std::size_t>(world.count()));
}

// One dense query would cost its memory for good.
TEST_P(SegmentIndexTest, QueriesLeaveAQuarterOfItsSizeAtMost) {
  Random random(17);
  World world;
  for (int f = 0; f < 40; ++f) world.addFiber(random, 50, 1e-4, 0.5);  // everything touches
  for (const int threads : {1, 2, 3}) {
    SegmentIndex index(options(threads));
    world.build(index);
    const std::size_t before = index.memoryUsage();
    EXPECT_GT(pairsOf(index).size(), 1000000u);
    EXPECT_LE(4 * index.memoryUsage(), 5 * before) << threads;
  }
}

// Fibers that were registered again would be searched in the old tree.
TEST_P(SegmentIndexTest, AClearedIndexIsEmpty) {
  SegmentIndex index(options(2));
  EXPECT_TRUE(pairsOf(index).empty());
  const World world = smallWorld();
  world.build(index);
  EXPECT_FALSE(pairsOf(index).empty());
  index.clear();
  EXPECT_EQ(index.memoryUsage(), 0u);
  EXPECT_EQ(index.end(), index.begin());
  EXPECT_TRUE(pairsOf(index).empty());
  World none;
  none.build(index);
  EXPECT_TRUE(none.refit(index));
  EXPECT_TRUE(pairsOf(index).empty());
  EXPECT_TRUE(pairsOf(index, resting(world.at(0)), 0.0, kNoGroup, 0).empty());
  world.build(index);
  EXPECT_FALSE(pairsOf(index).empty());
}

// --- Boxes that are open to a side ---

/// In turn a slab, a half-space, a half-open box, a column and all of space, at some place.
Segment openBox(int kind, const Vec3d& p) {
  const double inf = kInfinity;
  switch (kind % 5) {
    case 0:
      return Segment::box({-inf, -inf, p.z}, {inf, inf, p.z + 0.05});
    case 1:
      return Segment::box({-inf, -inf, -inf}, {p.x - 0.4, inf, inf});
    case 2:
      return Segment::box({p.x, p.y, p.z}, {p.x + 0.1, p.y + 0.1, inf});
    case 3:
      return Segment::box({p.x, -inf, p.z}, {p.x + 0.1, inf, p.z + 0.1});
    default:
      return Segment::box({-inf, -inf, -inf}, {inf, inf, inf});
  }
}

/// Pairs of a world with open boxes, against touch() of every two. Between others they are those of
/// a new index that does not have the open ones.
void expectPairsOfOpenBoxes(const SegmentIndex& index, const World& world) {
  const auto isOpen = [&](SegmentId id) {
    return !isBounded(world.segments[static_cast<std::size_t>(id)]);
  };
  const PairList found = asSet(pairsOf(index));
  EXPECT_FALSE(hasDuplicates(found));
  const double margin = index.margin();
  std::size_t open = 0;
  for (SegmentId i = 0; i < world.count(); ++i) {
    for (SegmentId j = i + 1; j < world.count(); ++j) {
      if (!world.isThere(i) || !world.isThere(j) || !(isOpen(i) || isOpen(j))) continue;
      ++open;
      const Segment p = world.at(i), q = world.at(j);
      const bool expected = touch(p, q, margin, endPointError(p) + endPointError(q));
      const bool is_found = std::binary_search(found.begin(), found.end(), std::pair(i, j));
      if (expected || index.options().capsules) {
        EXPECT_EQ(is_found, expected) << i << ", " << j;
      } else if (!index.options().wrapped_spheres) {
        // Boxes of floats are rounded outward.
        EXPECT_LE(is_found, boxesTouch(p, q, margin + 1e-5)) << i << ", " << j;
      }
    }
  }
  World others = world;
  for (SegmentId id = 0; id < world.count(); ++id) {
    if (isOpen(id)) others.present[static_cast<std::size_t>(id)] = false;
  }
  EXPECT_EQ(open == 0, others.present == world.present);
  SegmentIndex fresh(index.options());
  others.build(fresh);
  PairList among_others;
  std::copy_if(found.begin(), found.end(), std::back_inserter(among_others),
               [&](const auto& pair) { return !isOpen(pair.first) && !isOpen(pair.second); });
  EXPECT_TRUE(among_others == asSet(pairsOf(fresh)));
}

// Half-spaces and planes would be missed, cost the others their pairs, or need a new tree.
TEST_P(SegmentIndexTest, BoxesMayOpenAndCloseByRefits) {
  Random random(46);
  World world = smallWorld();
  for (int i = 0; i < 12; ++i) {
    const Vec3d p = fromEigen(random.inCube(0.5));
    world.add(Segment::box(p, p + Vec3d{0.1, 0.1, 0.1}));
    world.fibers.endFiber();
  }
  const std::vector<Segment> bounded = world.segments;
  const SegmentId first = world.count() - 12;
  for (const int threads : {1, 3}) {
    SegmentIndex index(options(threads, 0.01));
    world.segments = bounded;
    world.build(index);
    const SegmentIndex::Tree before = index.tree();
    const auto open = [&](SegmentId id) {
      Segment& s = world.segments[static_cast<std::size_t>(id)];
      s = openBox(id - first, s.a);
      return id;
    };
    const auto close = [&](SegmentId id) {
      world.segments[static_cast<std::size_t>(id)] = bounded[static_cast<std::size_t>(id)];
      return id;
    };
    const auto expectPairs = [&](const char* what) {
      SCOPED_TRACE(what);
      expectPairsOfOpenBoxes(index, world);
      for (SegmentId id = first; id < world.count(); id += 3) {
        const Segment segment = world.at(id);
        std::set<SegmentId> expected{id}, found;
        for (const auto& [a, b] : pairsOf(index)) {
          if (a == id) expected.insert(b);
          if (b == id) expected.insert(a);
        }
        for (const auto& [a, b] : pairsOf(index, resting(segment), 0.0, kNoGroup, 0))
          found.insert(a);
        EXPECT_EQ(found, expected) << "with " << id;
      }
    };
    expectPairs("all closed");
    for (const SegmentId id : {first, first + 1, first + 2}) open(id);
    EXPECT_TRUE(world.refit(index));
    expectPairs("opened by a refit");
    EXPECT_TRUE(world.refitSome(index, {open(first + 3), open(first + 5), close(first)}));
    expectPairs("opened and closed by a refit of some");
    open(first + 4);
    EXPECT_TRUE(world.refit(index));
    expectPairs("all of space among them");
    for (const SegmentId id : {first + 1, first + 4}) close(id);
    EXPECT_TRUE(world.refit(index));
    expectPairs("closed by a refit");
    // A capsule may become a box, as an object may get another shape.
    world.segments[40] = slab();
    EXPECT_TRUE(world.refitSome(index, {40}));
    expectPairs("a capsule that opens");
    EXPECT_TRUE(
        world.refitSome(index, {close(40), close(first + 2), close(first + 3), close(first + 5)}));
    expectPairs("all closed again");
    // Nothing is left of what was infinite.
    forEachVolume(before, index.tree(), [](const auto& then, const auto& now) {
      if constexpr (std::is_same_v<decltype(now), const geometry::Box&>) {
        ASSERT_EQ(std::memcmp(&now, &then, sizeof(now)), 0);
      } else {
        ASSERT_NEAR(now.radius, then.radius, 1e-5 * then.radius);
      }
    });

    for (SegmentId id = first; id < world.count(); ++id) open(id);
    world.build(index);
    expectPairs("built with open ones");
    for (SegmentId id = first; id < world.count(); ++id) close(id);
    world.refit(index);
    expectPairs("closed after a build");
  }
}

// A manager of half-spaces only would find nothing, or compare what is not a number.
TEST_P(SegmentIndexTest, AllMayBeOpen) {
  World world;
  for (int kind = 0; kind < 40; ++kind) {
    world.add(openBox(kind, {0.01 * kind, 0.3 - 0.02 * kind, 0.015 * kind}));
    world.fibers.endFiber();
  }
  SegmentIndex index(options());
  world.build(index);
  expectPairsOfOpenBoxes(index, world);
  EXPECT_TRUE(world.refit(index));
  EXPECT_TRUE(world.refitSome(index, {3, 17}));
  expectPairsOfOpenBoxes(index, world);
  // Of those that overlap the distance is zero.
  const PairList near = asSet(nearOf(world, index, 1e-3));
  for (const auto& pair : asSet(pairsOf(index))) {
    if (!boxesTouch(world.at(pair.first), world.at(pair.second), 0)) continue;
    EXPECT_TRUE(std::binary_search(near.begin(), near.end(), pair));
  }
}

// --- Indexes over some of the ids, and pairs with another index ---

// Objects registered late would have other pairs than if they were alone.
TEST_P(SegmentIndexTest, IdsMayStartAnywhere) {
  World late = smallWorld(), early;
  late.segments[200] = slab();
  const SegmentId begin = 90, end = 540;  // of whole fibers
  early.fibers = late.fibersOf(begin, end);
  for (SegmentId& id : early.fibers.ids) id -= begin;
  early.segments.assign(late.segments.begin() + begin, late.segments.begin() + end);
  early.present.assign(late.present.begin() + begin, late.present.begin() + end);
  const auto shifted = [&](PairList pairs, SegmentId by_second) {
    for (auto& [a, b] : pairs) a += begin, b += by_second;
    return pairs;
  };
  World partner = smallWorld(47);
  for (const int threads : {1, 2}) {
    SegmentIndex index(options(threads)), from_zero(options(threads)), other(options());
    late.build(index, begin, end);
    early.build(from_zero);
    partner.build(other);
    EXPECT_EQ(index.begin(), begin);
    EXPECT_EQ(index.end(), end);
    const auto expectAlike = [&](const char* what) {
      SCOPED_TRACE(what);
      EXPECT_FALSE(pairsOf(from_zero).empty());
      EXPECT_TRUE(pairsOf(index) == shifted(pairsOf(from_zero), begin));
      EXPECT_TRUE(nearOf(late, index, 0.1) == shifted(nearOf(early, from_zero, 0.1), begin));
      const Segment one = late.at(100);
      EXPECT_TRUE(pairsOf(index, resting(one), 0.0, kNoGroup, 7) ==
                  shifted(pairsOf(from_zero, resting(one), 0.0, kNoGroup, 7), 0));
      const SegmentSource* none = nullptr;
      EXPECT_TRUE(pairsOf(index, other, none) == shifted(pairsOf(from_zero, other, none), 0));
      const SegmentSource* source = &partner;
      EXPECT_TRUE(nearOf(late, index, 0.1, other, source) ==
                  shifted(nearOf(early, from_zero, 0.1, other, source), 0));
      EXPECT_TRUE(index.isFitted(late));
    };
    expectAlike("built");
    Random random(48);
    for (SegmentId id = 0; id < early.count(); ++id) {
      if (!isBounded(early.segments[static_cast<std::size_t>(id)])) continue;
      early.move(id, random, 0.03);
      late.segments[static_cast<std::size_t>(begin + id)] =
          early.segments[static_cast<std::size_t>(id)];
    }
    EXPECT_TRUE(late.refit(index));
    EXPECT_TRUE(early.refit(from_zero));
    expectAlike("refitted");
    for (const SegmentId id : {0, 20, 449}) {
      early.move(id, random, 0.1);
      late.segments[static_cast<std::size_t>(begin + id)] =
          early.segments[static_cast<std::size_t>(id)];
    }
    EXPECT_TRUE(late.refitSome(index, {begin, begin + 20, begin + 449}));
    EXPECT_TRUE(early.refitSome(from_zero, {0, 20, 449}));
    expectAlike("some refitted");
  }
}

World inFrame(World world, const Frame& frame) {
  world.frame = frame;
  return world;
}

// A manager of boxes would find other contacts with one of spheres than with its own kind.
TEST_P(SegmentIndexTest, PairsWithAnIndexOfAnotherKindAreTheSame) {
  World world = smallWorld(), partner = inFrame(smallWorld(47), {{-20, 5, 0.1}, 0.25});
  world.segments[100] = slab();
  partner.segments[200] = openBox(1, {0, 0, 0});
  for (const double margin : {0.0, 0.01}) {
    SegmentIndex index(options(1, margin));
    world.build(index);
    PairList touching;
    for (SegmentId i = 0; i < world.count(); ++i) {
      for (SegmentId j = 0; j < partner.count(); ++j) {
        if (!world.isThere(i) || !partner.isThere(j)) continue;
        if (touch(world.at(i), partner.at(j, world.frame), index.margin(), 1e-14)) {
          touching.emplace_back(i, j);
        }
      }
    }
    ASSERT_GT(touching.size(), 500u);
    const double limit = 3 * index.margin() + 0.01;
    PairList near;
    for (const IndexOptions& kind : allKinds()) {
      SCOPED_TRACE("with " + nameOf(kind));
      SegmentIndex other(kind);
      partner.build(other);
      const PairList found = sorted(pairsOf(index, other, &partner));
      EXPECT_FALSE(hasDuplicates(found));
      EXPECT_TRUE(std::includes(found.begin(), found.end(), touching.begin(), touching.end()));
      const PairList found_near = sorted(nearOf(world, index, limit, other, &partner));
      EXPECT_FALSE(hasDuplicates(found_near));
      EXPECT_TRUE(
          std::includes(found_near.begin(), found_near.end(), touching.begin(), touching.end()));
      if (!GetParam().capsules) continue;
      EXPECT_TRUE(found == touching) << found.size() << " instead of " << touching.size();
      if (near.empty()) near = found_near;
      EXPECT_TRUE(found_near == near);
    }
  }
}

// Capsules in exact contact would be missed where the other index is far from its origin.
TEST_P(SegmentIndexTest, ContactsSurviveAnotherFrame) {
  Random random(49);
  World world = inFrame({}, {}), partner = inFrame({}, {{3e5, -2e5, 1e5}, 1});
  world.add({{0, 0, 0}, {0, 0, 0}, 0.25});
  world.fibers.endFiber();
  for (int i = 0; i < 200; ++i) {
    const Vec3d at = 0.5 * fromEigen(random.direction());
    partner.add({at, at, norm(at) - 0.25});
    partner.fibers.endFiber();
  }
  SegmentIndex index(options(1, 0));
  world.build(index);
  for (const IndexOptions& kind : allKinds()) {
    SCOPED_TRACE("with " + nameOf(kind));
    SegmentIndex other(kind);
    partner.build(other);
    EXPECT_EQ(pairsOf(index, other, &partner).size(), 200u);
    EXPECT_EQ(nearOf(world, index, 1e-300, other, &partner).size(), 200u);
  }
}

// Pairs of two managers would depend on which options the other one has.
TEST_P(SegmentIndexTest, OfTheOtherIndexASourceIsReadOnlyWhereItIsNeeded) {
  struct Counting final : World {
    explicit Counting(const World& world) : World(world) {}
    bool read(const SegmentId* ids, int count, int ahead, const Frame& in, SegmentBlock& out,
              BlockMask& is_present) const override {
      ++reads;
      return World::read(ids, count, ahead, in, out, is_present);
    }
    mutable std::size_t reads = 0;
  };
  const World world = smallWorld();
  Counting partner(smallWorld(47));
  SegmentIndex index(options());
  world.build(index);
  for (const IndexOptions& kind : allKinds()) {
    SCOPED_TRACE("with " + nameOf(kind));
    SegmentIndex other(kind);
    partner.bad.clear();
    partner.build(other);
    partner.reads = 0;
    const PairList found = pairsOf(index, other, &partner);
    const bool is_needed = !kind.capsules && (index.options().capsules || !index.matches(other));
    EXPECT_EQ(partner.reads > 0, is_needed);
    if (!is_needed) {
      EXPECT_TRUE(pairsOf(index, other, static_cast<const SegmentSource*>(nullptr)) == found);
      continue;
    }
    partner.bad = {77, 133};
    CollectAll sink;
    EXPECT_THROW(index.search(other, &partner, sink), BadSegment);
  }
}

}  // namespace
}  // namespace fcl_fibers::index
