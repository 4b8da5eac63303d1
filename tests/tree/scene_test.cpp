// SPDX-License-Identifier: BSD-3-Clause
#include "tree/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "support/random.h"
#include "support/segments.h"

namespace fcl_fibers::tree {
namespace {

using geometry::Frame;
using geometry::fromEigen;
using geometry::Segment;
using geometry::Vec3d;
using test::Point;
using test::Random;
using test::Real;
using PairList = std::vector<std::pair<SegmentId, SegmentId>>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Segments in the world, some ids of which have gone.
struct World {
  std::vector<Segment> segments;
  std::vector<bool> present;
  Fibers fibers;
  Frame frame{{0.3, -0.2, 0.1}, 8};

  std::size_t count() const { return segments.size(); }
  bool read(SegmentId id, Segment& segment) const {
    if (!present[static_cast<std::size_t>(id)]) return false;
    const Segment& s = segments[static_cast<std::size_t>(id)];
    segment = {frame.fromWorld(s.a), frame.fromWorld(s.b),
               s.isBox() ? s.radius : frame.scale * s.radius};
    return true;
  }
  auto reader() const {
    return [this](SegmentId id, Segment& segment) { return read(id, segment); };
  }
  template <class Admit>
  Fibers fibersOf(Admit&& admit) const {
    Fibers admitted;
    for (std::size_t f = 0; f + 1 < fibers.begin.size(); ++f) {
      for (auto i = fibers.begin[f]; i < fibers.begin[f + 1]; ++i) {
        const SegmentId id = fibers.ids[static_cast<std::size_t>(i)];
        if (present[static_cast<std::size_t>(id)] && admit(id)) admitted.ids.push_back(id);
      }
      if (static_cast<std::int32_t>(admitted.ids.size()) > admitted.begin.back()) {
        admitted.endFiber();
      }
    }
    return admitted;
  }

  void build(Scene& scene) const {
    scene.build(
        frame, count(), [this](auto&& admit) { return fibersOf(admit); }, reader());
  }
  bool update(Scene& scene) const { return scene.update(frame, count(), reader()); }

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
    fibers.ids.push_back(static_cast<SegmentId>(count()));
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
  for (std::size_t id = 5; id < world.count(); id += 97) world.present[id] = false;
  return world;
}
World smallWorld() {
  Random random(42);
  World world;
  for (int f = 0; f < 20; ++f) world.addFiber(random, 30, 0.08, f % 4 == 0 ? 0.05 : 0.02);
  for (std::size_t id = 5; id < world.count(); id += 31) world.present[id] = false;
  return world;
}
Segment slab() { return Segment::box({-kInfinity, -kInfinity, -0.1}, {kInfinity, kInfinity, 0.1}); }

class CollectAll final : public PairSink {
 public:
  Visit take(const Pair* pairs, std::size_t count) override {
    for (std::size_t i = 0; i < count; ++i) found.emplace_back(pairs[i].a, pairs[i].b);
    return Visit::kContinue;
  }
  PairList found;
};

PairList pairsOf(const Scene& scene) {
  CollectAll sink;
  EXPECT_EQ(scene.findPairs(sink), Visit::kContinue);
  return sink.found;
}
PairList asSet(PairList pairs) {
  for (auto& pair : pairs) {
    if (pair.first > pair.second) std::swap(pair.first, pair.second);
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

class SceneTest : public testing::TestWithParam<SceneOptions> {
 protected:
  SceneOptions options(int threads = 1, double margin = 0.002) const {
    SceneOptions options = GetParam();
    options.threads = threads;
    options.margin = margin;
    return options;
  }
};

std::string nameOf(const testing::TestParamInfo<SceneOptions>& info) {
  return std::string(info.param.wrapped_spheres ? "Spheres" : "Boxes") +
         (info.param.super_thread ? "SuperThread" : "Bundle") +
         (info.param.capsules ? "Capsules" : "Volumes");
}
std::vector<SceneOptions> allKinds() {
  std::vector<SceneOptions> kinds;
  for (const bool wrapped_spheres : {false, true}) {
    for (const bool super_thread : {false, true}) {
      for (const bool capsules : {false, true}) {
        kinds.push_back({wrapped_spheres, super_thread, capsules, 0, 1});
      }
    }
  }
  return kinds;
}
INSTANTIATE_TEST_SUITE_P(, SceneTest, testing::ValuesIn(allKinds()), nameOf);

// A callback that asks the scene again, while other threads search for the next one, would wait for
// itself or mix up the pairs.
TEST_P(SceneTest, PairsMayBeAskedForWhilePairsAreHandedOn) {
  class Nested final : public PairSink {
   public:
    explicit Nested(const Scene& scene) : scene_(scene) {}
    Visit take(const Pair* pairs, std::size_t count) override {
      if (runs_++ % 50 == 0) inner.push_back(pairsOf(scene_));
      return outer.take(pairs, count);
    }
    CollectAll outer;
    std::vector<PairList> inner;

   private:
    const Scene& scene_;
    int runs_ = 0;
  };
  Scene scene(options(3));
  smallWorld().build(scene);
  const PairList expected = pairsOf(scene);
  Nested nested(scene);
  scene.findPairs(nested);
  EXPECT_TRUE(nested.outer.found == expected);
  EXPECT_GE(nested.inner.size(), 1u);
  for (const PairList& inner : nested.inner) EXPECT_TRUE(inner == expected);
}

// Volumes would be refitted, or grow, where nothing has moved.
TEST_P(SceneTest, AnUpdateWithoutMotionChangesNothing) {
  const World world = largeWorld();
  for (const int threads : {1, 2, 8}) {
    SCOPED_TRACE(threads);
    Scene scene(options(threads));
    world.build(scene);
    const PairList pairs = pairsOf(scene);
    const Scene::Tree before = scene.tree();
    EXPECT_TRUE(world.update(scene));
    EXPECT_TRUE(scene.updateSome({0, 1, 2, 2, 0}, world.reader()));
    EXPECT_TRUE(world.update(scene));
    std::visit(
        [&](const auto& old_tree) {
          const auto& tree = std::get<std::decay_t<decltype(old_tree)>>(scene.tree());
          using Volume = typename std::decay_t<decltype(old_tree)>::Volume;
          for (std::size_t i = 0; i < tree.topology().nodes.size(); ++i) {
            const auto node = static_cast<std::int32_t>(i);
            for (int lane = 0; lane < tree.node(node).child_count; ++lane) {
              const Volume now = tree.pack(node).get(lane), then = old_tree.pack(node).get(lane);
              ASSERT_EQ(std::memcmp(&now, &then, sizeof(Volume)), 0) << i << ", " << lane;
            }
          }
          if constexpr (std::is_same_v<Volume, geometry::Sphere>) {
            EXPECT_EQ(tree.hierarchy().cagesRecomputed(), 0u);
          }
        },
        before);
    EXPECT_TRUE(pairsOf(scene) == pairs);
  }
}

struct BadSegment : std::runtime_error {
  explicit BadSegment(SegmentId segment) : std::runtime_error("bad segment"), id(segment) {}
  SegmentId id;
};

// The message would name another object with every run; or an object that cannot be read end the
// program.
TEST_P(SceneTest, OfSegmentsThatCannotBeReadTheFirstIsNamed) {
  const World world = largeWorld();
  for (const int threads : {1, 2, 8}) {
    SCOPED_TRACE(threads);
    Scene scene(options(threads));
    for (const std::set<SegmentId>& bad :
         {std::set<SegmentId>{4096}, {11000, 9000, 3000}, {9001, 8999}, {11725}}) {
      std::atomic<bool> thrown{false};
      const auto reader = [&](SegmentId id, Segment& segment) {
        // Lets another thread be the first to throw, if there is one that comes to it.
        for (int ms = 0; id == 0 && threads > 1 && !thrown && ms < 100; ++ms) {
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        if (bad.count(id) != 0) {
          thrown = true;
          throw BadSegment(id);
        }
        return world.read(id, segment);
      };
      const auto expectFirst = [&](auto&& call) {
        try {
          call();
          ADD_FAILURE() << "nothing was thrown";
        } catch (const BadSegment& error) {
          EXPECT_EQ(error.id, *bad.begin());
        }
      };
      const auto fibers = [&](auto&& admit) { return world.fibersOf(admit); };
      expectFirst([&] { scene.build(world.frame, world.count(), fibers, reader); });
      world.build(scene);
      const PairList pairs = pairsOf(scene);
      thrown = false;
      expectFirst([&] { scene.update(world.frame, world.count(), reader); });
      world.build(scene);
      EXPECT_TRUE(pairsOf(scene) == pairs);
    }
  }
}

// Memory would double under volumes; capsules be tested where they are no more.
TEST_P(SceneTest, SegmentsAreKeptWhereTheyAreNeeded) {
  World world = largeWorld();
  Scene scene(options(2));
  const std::size_t bytes = world.count() * sizeof(Segment);
  const auto treeBytes = [&] {
    return std::visit([](const auto& tree) { return tree.memoryUsage(); }, scene.tree());
  };
  const auto expectKept = [&](bool kept) {
    EXPECT_EQ(scene.keepsSegments(), kept);
    EXPECT_EQ(scene.segments().empty(), !kept);
    EXPECT_GE(scene.memoryUsage(), treeBytes() + (kept ? bytes : 0));
    EXPECT_LT(scene.memoryUsage(), treeBytes() + (kept ? 2 * bytes : bytes / 2));
  };
  world.build(scene);
  expectKept(GetParam().capsules);
  EXPECT_TRUE(world.update(scene));
  expectKept(GetParam().capsules);

  // What is open to a side is tested against all.
  const Segment before = world.segments[10000];
  world.segments[10000] = slab();
  EXPECT_FALSE(world.update(scene)) << "the tree is another";
  world.build(scene);
  expectKept(true);
  EXPECT_EQ(scene.unbounded(), std::vector<SegmentId>{10000});
  EXPECT_TRUE(world.update(scene));
  EXPECT_TRUE(scene.updateSome({9999, 10000}, world.reader()));
  expectKept(true);
  for (std::size_t id = 0; id < world.count(); ++id) {
    Segment read;
    if (!world.read(static_cast<SegmentId>(id), read)) continue;
    EXPECT_EQ(std::memcmp(&scene.segment(static_cast<SegmentId>(id)), &read, sizeof(Segment)), 0);
  }

  world.segments[10000] = before;
  EXPECT_FALSE(scene.updateSome({10000}, world.reader()));
  EXPECT_FALSE(world.update(scene));
  world.build(scene);
  expectKept(GetParam().capsules);
  EXPECT_TRUE(scene.unbounded().empty());
}

// Queries would report capsules that are apart, or none that are close, or volumes instead.
TEST_P(SceneTest, PairsAreThoseThatBruteForceFinds) {
  World world = smallWorld();
  world.add({{0, 0, 0}, {0, 0, 0}, 0.1});  // a sphere
  world.add(Segment::box({-0.2, -0.2, -0.2}, {0.1, 0.1, 0.1}));
  world.fibers.endFiber();
  for (const double margin : {0.0, 0.01}) {
    for (const int threads : {1, 3}) {
      Scene scene(options(threads, margin));
      world.build(scene);
      for (int step = 0; step < 2; ++step) {
        SCOPED_TRACE("margin " + std::to_string(margin) + ", step " + std::to_string(step));
        const PairList found = asSet(pairsOf(scene));
        EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
        std::size_t touching = 0;
        const auto size = static_cast<SegmentId>(world.count());
        for (SegmentId i = 0; i < size; ++i) {
          for (SegmentId j = i + 1; j < size; ++j) {
            Segment p, q;
            if (!world.read(i, p) || !world.read(j, q)) continue;
            const bool boxed = p.isBox() || q.isBox();
            const test::ExactCapsule a{toPoint(p.a), toPoint(p.b), p.thickness()},
                b{toPoint(q.a), toPoint(q.b), q.thickness()};
            const Real gap =
                boxed ? test::segmentBoxDistance(p.isBox() ? b.a : a.a, p.isBox() ? b.b : a.b,
                                                 p.isBox() ? boxOf(a) : boxOf(b)) -
                            a.radius - b.radius
                      : test::segmentDistance(a.a, a.b, b.a, b.b) - a.radius - b.radius;
            const std::pair<SegmentId, SegmentId> pair(i, j);
            // Both touch and distance err by a few ulp of coordinates below eight.
            const Real excess = gap - Real(scene.margin());
            if (std::fabs(excess) < 1e-12L) continue;
            const bool expected = excess < 0;
            // What is no capsule counts by its box, and so does its partner where leaves are boxes.
            if (boxed && !expected && test::boxGap(boxOf(a), boxOf(b)) <= Real(scene.margin())) {
              continue;
            }
            touching += expected;
            if (expected || GetParam().capsules) {
              EXPECT_EQ(std::binary_search(found.begin(), found.end(), pair), expected)
                  << i << ", " << j;
            }
          }
        }
        EXPECT_GT(touching, world.count() / 2);
        Random random(44);
        for (SegmentId i = 0; i < size; ++i) world.move(i, random, 0.03);
        EXPECT_TRUE(world.update(scene));
      }
    }
  }
}

// A query of one object would report others than the manager does of it.
TEST_P(SceneTest, PairsWithOneSegmentAreThoseOfItsOwn) {
  const World world = smallWorld();
  Scene scene(options());
  world.build(scene);
  const PairList all = pairsOf(scene);
  for (SegmentId id = 0; id < static_cast<SegmentId>(world.count()); id += 5) {
    Segment segment;
    if (!world.read(id, segment)) continue;
    CollectAll sink;
    scene.findPairs(segment, 0, kNoGroup, sink);
    std::set<SegmentId> found, expected{id};
    for (const auto& [a, b] : sink.found) {
      EXPECT_EQ(b, 0);
      found.insert(a);
    }
    EXPECT_EQ(found.size(), sink.found.size());
    for (const auto& [a, b] : all) {
      if (a == id) expected.insert(b);
      if (b == id) expected.insert(a);
    }
    EXPECT_EQ(found, expected);
  }
}

// Fibers that were registered again would be searched in the old tree.
TEST_P(SceneTest, AClearedSceneIsEmpty) {
  Scene scene(options(2));
  EXPECT_TRUE(pairsOf(scene).empty());
  const World world = smallWorld();
  world.build(scene);
  EXPECT_FALSE(pairsOf(scene).empty());
  scene.clear();
  EXPECT_EQ(scene.memoryUsage(), 0u);
  EXPECT_TRUE(pairsOf(scene).empty());
  EXPECT_TRUE(scene.unbounded().empty());
  World none;
  none.build(scene);
  EXPECT_TRUE(none.update(scene));
  EXPECT_TRUE(pairsOf(scene).empty());
  world.build(scene);
  EXPECT_FALSE(pairsOf(scene).empty());
}

}  // namespace
}  // namespace fcl_fibers::tree
