// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/live_pairs.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "arrays/array_fibers.h"
#include "arrays/live_calls.h"
#include "arrays/meshes.h"
#include "arrays/motion.h"
#include "support/exact_geometry.h"
#include "support/least_of_convex.h"
#include "support/random.h"
#include "support/scalars.h"
#include "support/touch_oracle.h"

namespace fcl_fibers::test {
namespace {

using LiveMesh = LivePairs<TriangleMesh>;
using Slots = std::map<Pair, std::int32_t>;

/// Whoever counts on a slot, or on what has begun and ended, counts on what is checked here.
class Follower {
 public:
  /// @param all_end  whether a pair of before may not go on
  void check(const LiveMesh& live, const FiberTree& judge, bool all_end) {
    const std::set<Pair> expected = pairsOf(judge, live.partner());
    Slots now;
    std::set<std::int32_t> used;
    live.visit([&](TrianglePair pair, std::int32_t slot) {
      EXPECT_TRUE(now.emplace(Pair{pair.segment, pair.triangle}, slot).second)
          << "a pair came twice";
      EXPECT_TRUE(used.insert(slot).second) << "two pairs have one slot";
      EXPECT_TRUE(slot >= 0 && slot < live.slotCount());
    });
    std::set<Pair> pairs;
    for (const auto& [pair, slot] : now) pairs.insert(pair);
    if (pairs != expected) {
      // The frame of the tree tells which of two triangles is the nearest to what is inside, if
      // they share the nearest point. Only then may the trees differ.
      ASSERT_EQ(severalOf(pairs), severalOf(expected));
      ASSERT_EQ(pairs, pairsOf(live.tree(), live.partner()));
    }
    EXPECT_EQ(live.count(), expected.size());

    Slots begun, ended;
    for (const auto& [pair, slot] : live.begun()) begun[{pair.segment, pair.triangle}] = slot;
    for (const auto& [pair, slot] : live.ended()) {
      ended[{pair.segment, pair.triangle}] = slot;
      EXPECT_EQ(used.count(slot), 0u) << "a slot was given on before its end was told";
    }
    EXPECT_EQ(begun.size(), live.begun().size());
    EXPECT_EQ(ended.size(), live.ended().size());
    if (all_end) {
      EXPECT_EQ(begun, now);
      EXPECT_EQ(ended, last_);
    } else {
      EXPECT_EQ(begun, without(now, last_));
      EXPECT_EQ(ended, without(last_, now));
      for (const auto& [pair, slot] : now) {
        const auto before = last_.find(pair);
        const bool has_changed = before != last_.end() && before->second != slot;
        EXPECT_FALSE(has_changed) << "the slot of a pair has changed";
      }
    }
    most_ = std::max(most_, now.size() + ended.size());
    EXPECT_LE(static_cast<std::size_t>(live.slotCount()), most_) << "slots are not dense";
    last_ = std::move(now);
  }

  std::size_t most() const { return most_; }
  const Slots& last() const { return last_; }

 private:
  static std::set<Pair> pairsOf(const FiberTree& tree, const TriangleMesh& mesh) {
    std::vector<TrianglePair> found;
    tree.find(Pairs{}, mesh, found);
    std::set<Pair> pairs;
    for (const TrianglePair& pair : found) pairs.emplace(pair.segment, pair.triangle);
    return pairs;
  }
  /// The pairs of segments that have several, and the others with -1.
  static std::set<Pair> severalOf(const std::set<Pair>& pairs) {
    std::map<std::int32_t, int> count;
    for (const Pair& pair : pairs) ++count[pair.first];
    std::set<Pair> several;
    for (const Pair& pair : pairs) {
      several.emplace(pair.first, count[pair.first] > 1 ? pair.second : -1);
    }
    return several;
  }
  static Slots without(const Slots& some, const Slots& others) {
    Slots rest;
    for (const auto& one : some) {
      if (others.count(one.first) == 0) rest.insert(one);
    }
    return rest;
  }

  Slots last_;
  std::size_t most_ = 0;
};

struct Scene {
  std::uint64_t seed;
  TriangleMesh::Kind kind;
  double margin = 0;
  double skin = -1;
  double offset = 0;
  int threads = 1;
  double motion = 0.004;  ///< of a usual step
  bool has_rules = false;
  bool has_cones = false;
};

/// Fibers and a mesh that move as a program might move them, and a tree that lists nothing.
template <typename S>
class Play {
 public:
  explicit Play(const Scene& scene)
      : scene_(scene),
        random_(scene.seed),
        fibers_(curledFibers<S>(scene.seed, 40)),
        shape_(shapeOf(scene)),
        tree_(options()),
        judge_(options()),
        mesh_(shape_.view(), scene.kind),
        live_(tree_, mesh_, {scene.skin}) {
    offset_ = Eigen::Vector3d(scene.offset, -0.5 * scene.offset, 0.25 * scene.offset);
    for (std::size_t i = 0; i < fibers_.pointCount(); ++i) move(i, offset_);
    position_ = offset_;
    for (std::size_t f = 0; f < fibers_.fiberCount(); ++f) {
      roots_.push_back(static_cast<std::int32_t>(f % 3));
      meets_.push_back(f % 4 == 0 ? 0b01 : f % 4 == 1 ? 0b10 : ~0u);
    }
    build();
    pose();
  }

  void run(int steps) {
    for (int i = 0; i < steps && !testing::Test::HasFatalFailure(); ++i) {
      SCOPED_TRACE("seed " + std::to_string(scene_.seed) + ", step " + std::to_string(i));
      step();
    }
  }

  const LiveMesh& live() const { return live_; }
  std::size_t mostPairs() const { return follower_.most(); }

 private:
  static Triangles<S> shapeOf(const Scene& scene) {
    const bool is_solid = scene.kind == TriangleMesh::Kind::kSolid;
    if (!is_solid && scene.seed % 2 == 1) return soup<S>(scene.seed, 200, 0.4);
    if (scene.seed % 4 < 2) return ball<S>(0.3, 8, 12);
    // Few triangles, which are large: where a part moves much, another hardly does.
    const Triangles<double> box = boxMesh({-0.4, -0.05, -0.3}, {0.4, 0.05, 0.3});
    return {{box.points.begin(), box.points.end()}, box.indices};
  }
  FiberTreeOptions options() const {
    FiberTreeOptions options = capsules(1, scene_.margin);
    options.threads = scene_.threads;
    return options;
  }
  FiberArrays<S> view() const {
    FiberArrays<S> view = fibers_.view();
    if (scene_.has_rules) {
      view.root_segments = roots_.data();
      view.meets = meets_.data();
    }
    return view;
  }

  void move(std::size_t point, const Eigen::Vector3d& way) {
    for (std::size_t k = 0; k < 3; ++k) {
      S& x = fibers_.points[3 * point + k];
      x = static_cast<S>(static_cast<double>(x) + way[static_cast<Eigen::Index>(k)]);
    }
  }
  Eigen::Vector3d pointOf(std::size_t i) const {
    const auto p = fibers_.point(i);
    return {p[0], p[1], p[2]};
  }
  template <class WayOf>
  void moveAll(WayOf&& wayOf) {
    for (std::size_t i = 0; i < fibers_.pointCount(); ++i) move(i, wayOf(i));
  }
  void build() {
    tree_.build(view());
    judge_.build(view());
    all_end_ = true;
  }
  void pose() { mesh_.setPose(poseOf(rotation_, position_)); }
  void turnMesh(const Eigen::Matrix3d& turn, const Eigen::Vector3d& way) {
    rotation_ = turn * rotation_;
    position_ = offset_ + turn * (position_ - offset_) + way;
    pose();
  }

  void step() {
    const double size = scene_.motion;
    const auto what = random_.below(100);
    if (what < 70) usualMotion(size);
    if (what < 8) {
      // Some fibers sink into the mesh or come out.
      const double way = random_.between(-0.1, 0.1);
      const std::size_t f = random_.below(fibers_.fiberCount());
      for (std::size_t i = fibers_.point_begin[f]; i < fibers_.point_begin[f + 1]; ++i) {
        move(i, way * (pointOf(i) - position_).normalized());
      }
    } else if (what < 14) {
      const Eigen::Vector3d way = random_.inCube(0.4);
      const std::size_t f = random_.below(fibers_.fiberCount());
      for (std::size_t i = fibers_.point_begin[f]; i < fibers_.point_begin[f + 1]; ++i) {
        move(i, way);
      }
    } else if (what < 20) {
      for (S& radius : fibers_.radii) {
        radius = static_cast<S>(static_cast<double>(radius) * random_.between(0.8, 1.25));
      }
    } else if (what < 26) {
      // A part of the mesh sweeps over fibers.
      const Eigen::Vector3d way = random_.inCube(what < 23 && shape_.count() > 12 ? 0.15 : size);
      const std::size_t first = random_.below(shape_.pointCount());
      const std::size_t count = 1 + random_.below(random_.below(2) == 0 ? 1 : 40);
      for (std::size_t i = first; i < std::min(first + count, shape_.pointCount()); ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
          S& x = shape_.points[3 * i + k];
          x = static_cast<S>(static_cast<double>(x) + way[static_cast<Eigen::Index>(k)]);
        }
      }
      mesh_.update(shape_.view());
    } else if (what < 30) {
      turnMesh(random_.rotation(0.5).toRotationMatrix(), random_.inCube(0.1));
    } else if (what < 33) {
      const Eigen::Vector3d way = random_.inCube(0.3);
      moveAll([&](std::size_t) { return way; });
    } else if (what == 33) {
      build();
    } else if (what == 34) {
      mesh_ = TriangleMesh(shape_.view(), scene_.kind);
      mesh_.setCategories(categories_);
      pose();
      all_end_ = true;
    } else if (what == 35) {
      const TriangleMesh copy = mesh_;
      mesh_ = copy;
    } else if (what < 38) {
      categories_ = random_.below(2) == 0 ? ~0u : 0b01u;
      mesh_.setCategories(categories_);
    } else if (what == 38) {
      // A mesh that was moved from has no triangles.
      const TriangleMesh held = std::move(mesh_);
      all_end_ = true;
      update();
      mesh_ = held;
      all_end_ = true;
    }
    if (what >= 97) return;  // what moves unseen counts at the next update
    update();
  }

  /// What a step of a simulation moves: nothing, either, or both together.
  void usualMotion(double size) {
    const Eigen::Matrix3d turn = random_.rotation(2 * size).toRotationMatrix();
    const Eigen::Vector3d way = random_.inCube(size);
    const auto asOne = [&](std::size_t i) {
      const Eigen::Vector3d p = pointOf(i) - offset_;
      return Eigen::Vector3d(turn * p - p + way);
    };
    switch (random_.below(5)) {
      case 0:
        return;
      case 1:
        return moveAll(asOne);
      case 2:
        return turnMesh(turn, way);
      case 3:
        moveAll(asOne);
        return turnMesh(turn, way);
      default:
        return moveAll([&](std::size_t) { return random_.inCube(size); });
    }
  }

  void update() {
    if (random_.below(8) == 0) {
      tree_.update(view(), view());
      judge_.update(view(), view());
    } else {
      tree_.update(view());
      judge_.update(view());
    }
    live_.update();
    follower_.check(live_, judge_, std::exchange(all_end_, false));
  }

  const Scene scene_;
  Random random_;
  Assembly<S> fibers_;
  Triangles<S> shape_;
  std::vector<std::int32_t> roots_;
  std::vector<std::uint32_t> meets_;
  FiberTree tree_, judge_;
  TriangleMesh mesh_;
  LiveMesh live_;
  Follower follower_;
  Eigen::Vector3d offset_, position_;
  Eigen::Matrix3d rotation_ = Eigen::Matrix3d::Identity();
  std::uint32_t categories_ = ~0u;
  bool all_end_ = true;
};

template <typename S>
class LiveMeshPairsOf : public testing::Test {};
TYPED_TEST_SUITE(LiveMeshPairsOf, Scalars, ScalarName);

// A simulation whose hair goes through the head, or is pushed by it in vain, in some of all steps.
TYPED_TEST(LiveMeshPairsOf, AreThoseOfASearchAtEachStep) {
  using Kind = TriangleMesh::Kind;
  std::size_t pairs = 0, listings = 0, updates = 0, uncovered = 0;
  for (std::uint64_t seed = 0; seed < sceneCount(12); ++seed) {
    Scene scene{seed, seed % 3 == 0 ? Kind::kSurface : Kind::kSolid};
    scene.margin = seed % 4 == 1 ? 0.01 : 0;
    scene.skin = seed % 5 == 1 ? 0 : seed % 5 == 2 ? 0.01 : seed % 5 == 3 ? 0.05 : -1;
    scene.offset = seed % 6 == 5 ? (std::is_same_v<TypeParam, float> ? 8 : 1e6) : 0;
    scene.threads = seed % 2 == 0 ? 1 : 3;
    scene.motion = seed % 7 == 3 ? 0.05 : 0.003;
    scene.has_rules = seed % 4 >= 2;
    Play<TypeParam> play(scene);
    play.run(120);
    if (testing::Test::HasFailure()) return;
    const LivePairsCounters counters = play.live().counters();
    pairs += play.mostPairs();
    listings += static_cast<std::size_t>(counters.listings);
    updates += static_cast<std::size_t>(counters.updates);
    uncovered += static_cast<std::size_t>(counters.uncovered_pairs);
  }
  EXPECT_GT(pairs, 5000u);
  EXPECT_LT(listings, 2 * updates / 3);
  EXPECT_GT(uncovered, 100u);
}

/// A tree of one capsule along x that moves, and its judge. Others are around, so that the middle
/// of all hardly moves.
struct OneCapsule {
  OneCapsule() {
    fibers.addCapsule({-0.1, 0, 0}, {0.1, 0, 0}, 0.05);
    for (int i = 0; i < 8; ++i) {
      const double x = i & 1 ? 3 : -3, y = i & 2 ? 3 : -3, z = i & 4 ? 3 : 2;
      fibers.addBall({x, y, z}, 0.05);
    }
    tree.build(fibers.view());
    judge.build(fibers.view());
  }
  void moveTo(double height) {
    fibers.points[2] = fibers.points[5] = height;
    tree.update(fibers.view());
    judge.update(fibers.view());
  }

  Assembly<double> fibers;
  FiberTree tree{capsules()}, judge{capsules()};
};

// A solver pushes out what has sunk into a table. It would not see a capsule that is below the
// top of the table and touches nothing, or would push one that has come out.
TEST(LiveMeshPairs, ACapsuleSinksIntoASolidAndComesOut) {
  OneCapsule one;
  const TriangleMesh table(boxMesh({-2, -2, -2}, {2, 2, 0}).view(), TriangleMesh::Kind::kSolid);
  LivePairs live(one.tree, table, {/*skin=*/0.4});
  Follower follower;
  const auto pairsAt = [&](double height) {
    one.moveTo(height);
    live.update();
    follower.check(live, one.judge, /*all_end=*/false);
    return live.count();
  };
  EXPECT_EQ(pairsAt(0.2), 0u);
  EXPECT_GT(pairsAt(0.04), 0u);
  EXPECT_EQ(pairsAt(-0.06), 1u) << "wholly inside";
  EXPECT_EQ(pairsAt(-0.1), 1u);
  EXPECT_EQ(pairsAt(0.06), 0u) << "out, without having touched the surface at an update";
  EXPECT_EQ(pairsAt(-0.06), 1u);
  EXPECT_EQ(live.counters().listings, 1) << "a list within the skin tells all of that";
  EXPECT_EQ(pairsAt(-1), 1u) << "deep inside";
  EXPECT_EQ(pairsAt(-1.1), 1u);
  EXPECT_EQ(pairsAt(0.5), 0u);
  EXPECT_EQ(live.slotCount(), static_cast<std::int32_t>(follower.most()));
}

// Friction is kept by slot. It would be lost while a capsule sinks below the triangle it touches.
TEST(LiveMeshPairs, APairKeepsItsSlotWhileItsCapsuleSinks) {
  OneCapsule one;
  const TriangleMesh table(boxMesh({-2, -1, -2}, {3, 2, 0}).view(), TriangleMesh::Kind::kSolid);
  LivePairs live(one.tree, table, {/*skin=*/0.4});
  one.moveTo(0.04);
  live.update();
  ASSERT_EQ(live.count(), 1u);
  const std::int32_t slot = live.begun().at(0).slot;
  for (const double height : {0.0, -0.04, -0.06, -0.2, -0.06, 0.03}) {
    one.moveTo(height);
    live.update();
    live.visit([&](TrianglePair, std::int32_t now) { EXPECT_EQ(now, slot) << height; });
    EXPECT_EQ(live.count(), 1u);
    EXPECT_TRUE(live.begun().empty() && live.ended().empty()) << height;
  }
}

// A character turns its head. If its hair were listed anew in each frame, a list would be of no
// use.
TEST(LiveMeshPairs, HeadAndHairThatMoveAsOneAreListedOnce) {
  Assembly<double> fibers = curledFibers<double>(1, 40);
  TriangleMesh head(ball<double>(0.3, 8, 12).view(), TriangleMesh::Kind::kSolid);
  FiberTree tree(capsules()), judge(capsules());
  tree.build(fibers.view());
  judge.build(fibers.view());
  LivePairs live(tree, head, {/*skin=*/0.02});
  Follower follower;
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(0.03, Eigen::Vector3d(1, 2, 3).normalized()));
  const Eigen::Vector3d way(0.002, 0, 0.001);
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  for (int step = 0; step < 20; ++step) {
    rotation = turn * rotation;
    position = turn * position + way;
    head.setPose(poseOf(rotation, position));
    for (std::size_t i = 0; i < fibers.pointCount(); ++i) {
      Eigen::Map<Eigen::Vector3d> p(&fibers.points[3 * i]);
      p = turn * p + way;
    }
    tree.update(fibers.view());
    judge.update(fibers.view());
    live.update();
    follower.check(live, judge, /*all_end=*/step == 0);
  }
  EXPECT_GT(live.count(), 0u);
  EXPECT_EQ(live.counters().listings, 1);
}

// A mannequin's head rests while its wig is turned. What most points do is not what the head does.
TEST(LiveMeshPairs, HairTurnsOverAHeadAtRest) {
  for (const bool is_updated : {false, true}) {
    Assembly<double> fibers = curledFibers<double>(1, 40);
    const Triangles<double> shape = boxMesh({-0.4, -0.05, -0.3}, {0.4, 0.05, 0.3});
    TriangleMesh head(shape.view(), TriangleMesh::Kind::kSolid);
    FiberTree tree(capsules()), judge(capsules());
    tree.build(fibers.view());
    judge.build(fibers.view());
    LivePairs live(tree, head, {/*skin=*/0.03});
    Follower follower;
    for (int step = 0; step < 60; ++step) {
      // First about an axis far away, which is nearly a shift.
      const Eigen::Vector3d axis(0.2, 1, 0.1), far(0, 0, step < 30 ? 4 : 0);
      const Eigen::Matrix3d turn(
          Eigen::AngleAxisd(step < 30 ? 0.002 : 0.015, axis.normalized()).toRotationMatrix());
      for (std::size_t i = 0; i < fibers.pointCount(); ++i) {
        Eigen::Map<Eigen::Vector3d> p(&fibers.points[3 * i]);
        p = (turn * (p - far) + far).eval();
      }
      if (is_updated) head.update(shape.view());
      tree.update(fibers.view());
      judge.update(fibers.view());
      live.update();
      follower.check(live, judge, /*all_end=*/step == 0);
    }
    EXPECT_LT(live.counters().listings, 50);
  }
}

// A ground may reach to the horizon, or a stray triangle far beyond what a float holds.
TEST(LiveMeshPairs, AMeshMayReachFarOut) {
  for (const double far : {1e4, 1e200}) {
    Assembly<double> fibers = curledFibers<double>(3, 12);
    Triangles<double> shape = ball<double>(0.3, 8, 12);
    const std::int32_t first = shape.addPoint({far, 0, 0});
    shape.addPoint({far, 0, far});
    shape.addPoint({far, far, 0});
    shape.addTriangle(first, first + 1, first + 2);
    TriangleMesh mesh(shape.view());
    FiberTree tree(capsules()), judge(capsules());
    tree.build(fibers.view());
    judge.build(fibers.view());
    LivePairs live(tree, mesh, {/*skin=*/0.02});
    Follower follower;
    Random random(7);
    for (int step = 0; step < 9; ++step) {
      for (double& x : fibers.points) x += random.between(-0.004, 0.004);
      if (step % 3 == 1) {
        shape.points[0] += 0.01;
        shape.points[3 * static_cast<std::size_t>(first)] *= 1.5;
        mesh.update(shape.view());
      }
      if (step % 3 == 2) mesh.setPose(randomPose(static_cast<std::uint64_t>(step), 0.01));
      tree.update(fibers.view());
      judge.update(fibers.view());
      live.update();
      follower.check(live, judge, /*all_end=*/step == 0);
    }
  }
}

// A program would go on with pairs of before, or with none, instead of hearing what is wrong.
TEST(LiveMeshPairs, RefuseByNameWhatASearchRefuses) {
  const TriangleMesh table(boxMesh({-2, -2, -2}, {2, 2, 0}).view());
  const auto messageOf = [](auto&& call) -> std::string {
    try {
      call();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "nothing was refused";
  };
  FiberTreeOptions volumes;
  volumes.report = Report::kVolumes;
  FiberTree of_volumes(volumes);
  EXPECT_THAT(messageOf([&] { LiveMesh(of_volumes, table); }),
              testing::HasSubstr("Report::kCapsules"));

  OneCapsule one;
  TriangleMesh moving = table;
  LivePairs live(one.tree, moving);
  one.moveTo(0.04);
  live.update();
  const std::size_t count = live.count();
  EXPECT_GT(count, 0u);
  moving.setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0x1p999, 0, 0}});
  EXPECT_THAT(messageOf([&] { live.update(); }),
              testing::AllOf(testing::HasSubstr("LivePairs::update: "),
                             testing::HasSubstr("coordinates of the mesh overflow")));
  EXPECT_EQ(live.count(), count) << "after it has thrown, all is as it was";
  moving.setPose({});
  live.update();
  EXPECT_EQ(live.count(), count);
  EXPECT_TRUE(live.begun().empty());
}

// A solver that asks for contacts of the pairs it keeps would push along those of other pairs.
TEST(LiveMeshPairs, HaveContactsInTheirOrder) {
  const Assembly<double> fibers = curledFibers<double>(2, 40);
  const TriangleMesh mesh(ball<double>(0.3, 8, 12).view(), TriangleMesh::Kind::kSolid);
  FiberTree tree(capsules());
  tree.build(fibers.view());
  LivePairs live(tree, mesh);
  live.update();
  std::vector<TrianglePair> pairs;
  std::vector<MeshContact> contacts;
  live.find(pairs);
  live.find(Contacts{fibers.view()}, contacts);
  ASSERT_EQ(contacts.size(), pairs.size());
  EXPECT_GT(pairs.size(), 100u);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_EQ(contacts[i].segment, pairs[i].segment);
    EXPECT_EQ(contacts[i].triangle, pairs[i].triangle);
  }
}

/// Fibers beside a mesh that are moved by their safe distances, and what decides whether a segment
/// touches: brute force and a tree that has just been built.
template <typename S>
class SafeSteps {
 public:
  explicit SafeSteps(const Scene& scene)
      : scene_(scene),
        random_(scene.seed),
        fibers_(curledFibers<S>(scene.seed, 14)),
        shape_(scene.kind == TriangleMesh::Kind::kSurface ? soup<S>(scene.seed, 120, 0.4)
                                                          : ball<S>(0.3, 6, 8)),
        mesh_(shape_.view(), scene.kind),
        tree_(capsules(1, scene.margin)),
        live_(tree_, mesh_, {scene.skin}) {
    for (std::size_t i = 0; i < fibers_.points.size(); ++i) {
      fibers_.points[i] += static_cast<S>(i % 3 == 0 ? scene_.offset : 0);
    }
    if (scene.has_cones) {
      fibers_.radii_are = Assembly<S>::Radii::kPerPoint;
      for (S& radius : fibers_.radii) radius *= static_cast<S>(random_.between(0.2, 2));
    }
    for (std::size_t f = 0; f < fibers_.fiberCount(); ++f) {
      meets_.push_back(scene.has_rules && f % 4 == 1 ? 0b10 : ~0u);
    }
    mesh_.setCategories(0b01);
    tree_.build(view());
  }

  void step(bool skips) {
    if (random_.below(3) == 0) {
      mesh_.setPose(
          poseOf(random_.rotation(0.3).toRotationMatrix(), middle() + random_.inCube(0.05)));
    }
    // Without being asked, the list serves until less than half of the skin is left.
    for (std::size_t unasked = random_.below(4); unasked > 0; --unasked) {
      live_.update();
      MeshPose pose = mesh_.pose();
      pose.position[0] += random_.between(-0.3, 0.3) * scene_.skin;
      mesh_.setPose(pose);
      for (S& x : fibers_.points) {
        x += static_cast<S>(random_.between(-0.3, 0.3) * scene_.skin);
      }
      tree_.update(view());
    }
    live_.update();
    const std::set<std::int32_t> before = touching();
    std::vector<double> distances;
    live_.safeDistances(distances, skips);
    ASSERT_EQ(distances.size(), fibers_.pointCount());
    if (!skips) {
      for (const std::int32_t segment : before) {
        EXPECT_EQ(distances[static_cast<std::size_t>(segment)], 0);
        EXPECT_EQ(distances[static_cast<std::size_t>(segment) + 1], 0);
      }
    }
    fibers_.visitCapsules([&](std::size_t fiber, std::size_t i) {
      EXPECT_GE(distances[i], 0);
      EXPECT_EQ(meets_[fiber] == 0b10, distances[i] == kInfinity && distances[i + 1] == kInfinity &&
                                           before.count(static_cast<std::int32_t>(i)) == 0);
    });
    move(distances);
    tree_.update(view());
    for (const std::int32_t segment : touching()) {
      EXPECT_EQ(before.count(segment), 1u) << "segment " << segment << " has come to touch";
    }
  }

  std::size_t moved() const { return moved_; }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  Eigen::Vector3d middle() const { return {scene_.offset, 0, 0}; }
  FiberArrays<S> view() const {
    FiberArrays<S> view = fibers_.view();
    view.meets = meets_.data();
    return view;
  }

  /// Moves each point by at most its distance, mostly by nearly all of it, and often inward.
  void move(const std::vector<double>& distances) {
    const Eigen::Vector3d common = random_.direction();
    for (std::size_t i = 0; i < distances.size(); ++i) {
      const auto [x, y, z] = fibers_.point(i);
      const Eigen::Vector3d p(x, y, z);
      const double most = std::min(distances[i], 0.3);
      const double length = most * (random_.below(3) == 0 ? random_.unit() : 1) * (1 - 0x1p-50);
      const auto kind = random_.below(3);
      const Eigen::Vector3d way = kind == 0   ? (middle() - p).normalized()
                                  : kind == 1 ? common
                                              : random_.direction();
      S moved[3];
      Real squared = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        moved[k] = static_cast<S>(p[axis] + length * way[axis]);
        const Real d = static_cast<Real>(moved[k]) - static_cast<Real>(fibers_.points[3 * i + k]);
        squared += d * d;
      }
      // The point is rounded.
      if (std::sqrt(squared) > distances[i]) continue;
      std::copy(moved, moved + 3, &fibers_.points[3 * i]);
      moved_ += squared > 0 ? 1 : 0;
    }
  }

  std::set<std::int32_t> touching() const {
    FiberTree fresh(tree_.options());
    fresh.build(view());
    std::set<std::int32_t> touching;
    fresh.visit(Pairs{}, mesh_, [&](TrianglePair pair) { touching.insert(pair.segment); });
    std::vector<ExactTriangle> triangles;
    for (std::size_t t = 0; t < shape_.count(); ++t) {
      triangles.push_back(shape_.triangle(t, mesh_.pose()));
    }
    fibers_.visitCapsules([&](std::size_t fiber, std::size_t i) {
      if (meets_[fiber] == 0b10) return;
      const auto pointOf = [&](std::size_t k) -> Point {
        const auto [x, y, z] = fibers_.point(k);
        return {x, y, z};
      };
      const Point a = pointOf(i), b = pointOf(i + 1);
      const auto first = static_cast<Real>(fibers_.radii[i]);
      const auto last = static_cast<Real>(fibers_.radii[scene_.has_cones ? i + 1 : i]);
      const Real reach = std::max(first, last) + static_cast<Real>(scene_.margin);
      const bool touches = std::any_of(triangles.begin(), triangles.end(), [&](const auto& t) {
        const Real most = reach + (b - a).norm() + (t.b - t.a).norm() + (t.c - t.a).norm();
        if ((a - t.a).norm() > most || segmentTriangleDistance(a, b, t) > reach) return false;
        if (first == last) return true;
        return leastOfConvex([&](Real s) {
                 const Point x = (1 - s) * a + s * b;
                 return segmentTriangleDistance(x, x, t) - ((1 - s) * first + s * last);
               }) <= static_cast<Real>(scene_.margin);
      });
      if (touches) touching.insert(static_cast<std::int32_t>(i));
    });
    return touching;
  }

  const Scene scene_;
  Random random_;
  Assembly<S> fibers_;
  std::vector<std::uint32_t> meets_;
  Triangles<S> shape_;
  TriangleMesh mesh_;
  FiberTree tree_;
  LiveMesh live_;
  std::size_t moved_ = 0;
};

// A solver that cuts its steps to these distances would let hair through the head, or into it.
TYPED_TEST(LiveMeshPairsOf, SafeDistancesKeepSegmentsOffAMesh) {
  using Kind = TriangleMesh::Kind;
  std::size_t moved = 0;
  for (std::uint64_t seed = 0; seed < sceneCount(8); ++seed) {
    SCOPED_TRACE(seed);
    Scene scene{seed, seed % 2 == 0 ? Kind::kSurface : Kind::kSolid};
    scene.margin = seed % 4 < 2 ? 0 : 0.01;
    scene.offset = seed % 3 == 0 ? (std::is_same_v<TypeParam, float> ? 8 : 1e6) : 0;
    scene.has_rules = seed % 5 < 2;
    scene.has_cones = seed % 8 > 3;
    scene.skin = Random(seed).between(0.005, 0.2);
    SafeSteps<TypeParam> steps(scene);
    for (int i = 0; i < 8; ++i) {
      steps.step(/*skips=*/i % 2 == 0);
      if (testing::Test::HasFailure()) return;
    }
    moved += steps.moved();
  }
  EXPECT_GT(moved, 5000u);
}

// A fiber would stop far from what it is to rest on: half of the gap would be for a mesh at rest.
TEST(LiveMeshPairs, SafeDistancesUseTheGap) {
  OneCapsule one;
  TriangleMesh table(boxMesh({-2, -2, -2}, {2, 2, 0}).view(), TriangleMesh::Kind::kSolid);
  for (const double skin : {0.02, 0.5}) {
    LivePairs live(one.tree, table, {skin});
    for (const double gap : {1e-9, 1e-4, 0.15}) {
      one.moveTo(0.05 + gap);
      live.update();
      std::vector<double> distances;
      live.safeDistances(distances);
      const double possible = std::min(gap, live.skin());
      // The list that is left serves while half of the skin is left.
      const double least = gap < skin ? 0.9 * possible : 0.45 * possible;
      for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
        EXPECT_GE(distances[i], least) << gap << " of " << skin;
        EXPECT_LE(distances[i], gap) << skin;
      }
    }
  }
}

// What has come near since it was listed would be let through.
TEST(LiveMeshPairs, SafeDistancesCountWhatIsNotListed) {
  OneCapsule one;
  const TriangleMesh table(boxMesh({-2, -2, -2}, {2, 2, 0}).view());
  LivePairs live(one.tree, table, {/*skin=*/0.4});
  std::vector<double> distances;
  for (const double gap : {0.42, 0.12}) {
    one.moveTo(0.05 + gap);
    live.update();
  }
  EXPECT_EQ(live.counters().listings, 1);
  live.safeDistances(distances);
  EXPECT_GT(distances[0], 0.09);
  EXPECT_LE(distances[0], 0.12);
}

// What lies on a table would be stuck there: at the next triangle, or once it has sunk in.
TEST(LiveMeshPairs, SafeDistancesLeaveOutWhatTouchesOnRequest) {
  OneCapsule one;
  const TriangleMesh table(boxMesh({-2, -2, -2}, {2, 2, 0}).view(), TriangleMesh::Kind::kSolid);
  LivePairs live(one.tree, table, {/*skin=*/0.4});
  std::vector<double> distances;
  for (const double height : {0.04, -0.1, -1.0}) {  // at the top, just below, deep inside
    one.moveTo(height);
    live.update();
    EXPECT_GT(live.count(), 0u);
    live.safeDistances(distances);
    EXPECT_EQ(distances[0], 0) << height;
    live.safeDistances(distances, /*skips_touching=*/true);
    EXPECT_EQ(distances[0], std::numeric_limits<double>::infinity()) << height;
    EXPECT_GT(distances[2], 0) << "another fiber";
    EXPECT_LT(distances[2], 1) << "another fiber";
  }
}

// Distances from a mesh that has gone elsewhere would be taken for those from where it is.
TEST(LiveMeshPairs, SafeDistancesAreRefusedOnceAnythingHasMoved) {
  OneCapsule one;
  const Triangles<double> shape = boxMesh({-2, -2, -2}, {2, 2, 0});
  TriangleMesh table(shape.view());
  LivePairs live(one.tree, table, {0.1});
  std::vector<double> distances, of_mesh;
  const auto isRefused = [&] {
    try {
      live.safeDistances(distances);
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("the fibers or the mesh have changed"));
      live.update();
      EXPECT_NO_THROW(live.safeDistances(distances));
      return true;
    }
    return false;
  };
  EXPECT_TRUE(isRefused());
  one.moveTo(0.3);
  EXPECT_TRUE(isRefused());
  table.setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0.01}});
  EXPECT_TRUE(isRefused());
  table.update(shape.view());
  EXPECT_TRUE(isRefused());
  table.setMeets(1);
  EXPECT_TRUE(isRefused());
  EXPECT_FALSE(isRefused());
  EXPECT_THROW(live.safeDistances(distances, of_mesh), std::invalid_argument);
  LivePairs searches(one.tree, table, {0});
  searches.update();
  EXPECT_THROW(searches.safeDistances(distances), std::invalid_argument);
}

}  // namespace
}  // namespace fcl_fibers::test
