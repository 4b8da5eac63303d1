// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/live_pairs.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"
#include "support/random.h"
#include "support/scene_count.h"

namespace fcl_fibers::test {

/// Fibers whose points a test moves.
template <typename S>
class MovingFibers {
 public:
  std::vector<Eigen::Vector3d> points;
  std::vector<std::size_t> begin = {0};
  std::vector<double> radii;
  typename FiberArrays<S>::Radii radii_are = FiberArrays<S>::Radii::kOne;
  // What is empty is not given.
  std::vector<std::size_t> end;
  std::vector<std::int32_t> groups, root_segments;
  std::vector<std::uint8_t> closed;
  std::vector<std::uint32_t> meets;

  void addPoint(const Eigen::Vector3d& p) { points.push_back(p); }
  void endFiber() { begin.push_back(points.size()); }
  std::size_t fiberCount() const { return begin.size() - 1; }

  /// @pre both have as many points
  void swapFibers(std::size_t f, std::size_t g) {
    std::swap_ranges(points.begin() + static_cast<std::ptrdiff_t>(begin[f]),
                     points.begin() + static_cast<std::ptrdiff_t>(begin[f + 1]),
                     points.begin() + static_cast<std::ptrdiff_t>(begin[g]));
  }

  std::size_t endOf(std::size_t fiber) const { return end.empty() ? begin[fiber + 1] : end[fiber]; }

  /// Brings the last point of each closed fiber back to its first.
  void close() {
    for (std::size_t f = 0; f < closed.size(); ++f) {
      if (closed[f] != 0) points[endOf(f) - 1] = points[begin[f]];
    }
  }

  /// The arrays live until the next call.
  template <typename T = S>
  FiberArrays<T> view() {
    auto& [numbers, given_radii] = std::get<Arrays<T>>(arrays_);
    numbers.clear();
    for (const Eigen::Vector3d& p : points) {
      for (int k = 0; k < 3; ++k) numbers.push_back(static_cast<T>(p[k]));
    }
    given_radii.clear();
    for (const double radius : radii) given_radii.push_back(static_cast<T>(radius));
    FiberArrays<T> fibers{numbers.data(), points.size(), begin.data(), fiberCount(),
                          given_radii.data()};
    fibers.radii_are = static_cast<typename FiberArrays<T>::Radii>(radii_are);
    const auto give = [](const auto& all, auto& to) { to = all.empty() ? nullptr : all.data(); };
    give(groups, fibers.groups);
    give(closed, fibers.closed);
    give(meets, fibers.meets);
    give(root_segments, fibers.root_segments);
    give(end, fibers.point_end);
    return fibers;
  }

 private:
  template <typename T>
  struct Arrays {
    std::vector<T> numbers, radii;
  };
  std::tuple<Arrays<float>, Arrays<double>> arrays_;
};

template <class Pair>
PairList sorted(const std::vector<Pair>& pairs) {
  PairList list;
  for (const auto& [a, b] : pairs) list.emplace_back(a, b);
  std::sort(list.begin(), list.end());
  return list;
}
inline PairList pairsOfMesh(const FiberTree& tree, const TriangleMesh& mesh) {
  std::vector<TrianglePair> found;
  tree.find(Pairs{}, mesh, found);
  return sorted(found);
}

/// All that a program can see of pairs that live, in its order.
template <class Live>
std::vector<double> recordOf(const Live& live) {
  std::vector<LivePair<typename Live::Pair>> pairs;
  live.find(pairs);
  std::vector<double> record;
  for (const auto& list : {pairs, live.begun(), live.ended()}) {
    for (const auto& one : list) {
      const auto [a, b] = one.pair;
      record.insert(record.end(), {1.0 * a, 1.0 * b, 1.0 * one.slot});
    }
    record.push_back(-9);
  }
  record.insert(record.end(), {live.skin(), 1.0 * live.slotCount()});
  return record;
}

/// Follows live pairs by what begins and ends, as a program does.
template <class Partner>
class LiveWatch {
 public:
  using Pair = std::pair<std::int32_t, std::int32_t>;

  template <class Live>
  void check(const Live& live, const FiberTree& tree) {
    checkPairs(live, pairsOf(tree), /*all_end=*/false);
  }
  template <class Live>
  void checkAfterBuild(const Live& live, const FiberTree& tree) {
    checkPairs(live, pairsOf(tree), /*all_end=*/true);
  }

  /// @param expected  the pairs that a search finds, ascending
  /// @param all_end   whether no pair of before may go on
  template <class Live>
  void checkPairs(const Live& live, const PairList& expected, bool all_end) {
    std::vector<LivePair<typename Live::Pair>> pairs;
    live.find(pairs);
    std::vector<typename Live::Pair> bare;
    live.find(bare);
    ASSERT_EQ(bare.size(), pairs.size());
    ASSERT_EQ(live.count(), pairs.size());
    std::size_t visited = 0;
    live.visit([&](const auto& pair, std::int32_t slot) {
      ASSERT_LT(visited, pairs.size());
      EXPECT_EQ(keyOf(pair), keyOf(pairs[visited].pair));
      EXPECT_EQ(keyOf(pair), keyOf(bare[visited]));
      EXPECT_EQ(slot, pairs[visited++].slot);
    });
    ASSERT_EQ(visited, pairs.size());

    std::map<Pair, std::int32_t> now;
    PairList list;
    for (const auto& one : pairs) {
      EXPECT_TRUE(now.emplace(keyOf(one.pair), one.slot).second) << "a pair came twice";
      list.push_back(keyOf(one.pair));
    }
    std::sort(list.begin(), list.end());
    ASSERT_EQ(list, expected);

    const auto ended = live.ended();
    for (const auto& one : ended) {
      const auto known = told_.find(keyOf(one.pair));
      ASSERT_TRUE(known != told_.end()) << "a pair ends that did not live, or twice";
      EXPECT_EQ(known->second, one.slot) << "it ends with the slot of another pair";
      told_.erase(known);
      EXPECT_TRUE(all_end || now.count(keyOf(one.pair)) == 0) << "it ends although it lives";
    }
    EXPECT_TRUE(!all_end || told_.empty()) << "a pair outlives its segments";
    std::set<std::int32_t> used = slots_;  // with those whose ends are only told now
    slots_.clear();
    for (const auto& one : live.begun()) {
      EXPECT_TRUE(told_.emplace(keyOf(one.pair), one.slot).second) << "it begins although it lives";
      EXPECT_TRUE(used.insert(one.slot).second) << "a slot is reused before its end is told";
    }
    ASSERT_EQ(told_, now) << "what was told does not add up to what lives";
    for (const auto& [pair, slot] : now) {
      EXPECT_TRUE(slots_.insert(slot).second) << "two pairs share a slot";
      EXPECT_TRUE(slot >= 0 && slot < live.slotCount());
    }
    most_ = std::max(most_, now.size() + ended.size());
    EXPECT_LE(static_cast<std::size_t>(live.slotCount()), most_) << "slots are not dense";
  }

 private:
  static Pair keyOf(const SegmentPair& pair) { return {pair.a, pair.b}; }
  static Pair keyOf(const TrianglePair& pair) { return {pair.segment, pair.triangle}; }

  std::map<Pair, std::int32_t> told_;
  std::set<std::int32_t> slots_;  ///< of these
  std::size_t most_ = 0;
};

/// Two trees, a mesh, and all that can live between them.
class LiveWorld {
 public:
  static constexpr std::size_t kOfTrees = 4, kKinds = 5;

  LiveWorld(FiberTreeOptions options, FiberTreeOptions other_options, TriangleMesh its_mesh,
            int its_threads, const std::vector<double>& skins)
      : threads(its_threads),
        trees{FiberTree(withThreads(options)), FiberTree(withThreads(other_options))},
        mesh(std::move(its_mesh)) {
    for (std::size_t kind = 0; kind < kOfTrees; ++kind) of_trees.push_back(make(kind, skins[kind]));
    of_mesh.emplace(trees[0], mesh, LivePairsOptions{skins[kOfTrees]});
  }

  FiberTreeOptions withThreads(FiberTreeOptions options) const {
    options.threads = threads;
    return options;
  }

  LivePairs<FiberTree> make(std::size_t kind, double skin) {
    const LivePairsOptions options{skin};
    if (kind < 2) return LivePairs<FiberTree>(trees[0], options);
    return LivePairs<FiberTree>(trees[kind - 2], trees[3 - kind], options);
  }
  void makeAnew(std::size_t kind, double skin) {
    if (kind < kOfTrees) return void(of_trees[kind] = make(kind, skin));
    of_mesh = LivePairs<TriangleMesh>(trees[0], mesh, LivePairsOptions{skin});
  }
  template <class Act>
  void with(std::size_t kind, Act&& act) {
    kind < kOfTrees ? act(of_trees[kind]) : act(*of_mesh);
  }

  /// All that a program can see of one kind.
  std::vector<double> record(std::size_t kind) {
    std::vector<double> record;
    with(kind, [&](const auto& live) {
      record = recordOf(live);
      const LivePairsCounters counters = live.counters();
      for (const std::int64_t count :
           {counters.updates, counters.listings, counters.uncovered_pairs, counters.tested_pairs,
            counters.touching_pairs, counters.longest_life}) {
        record.push_back(static_cast<double>(count));
      }
    });
    return record;
  }

  int threads;
  std::array<FiberTree, 2> trees;
  TriangleMesh mesh;
  std::vector<LivePairs<FiberTree>> of_trees;  ///< two of the first, the first with the second, and
                                               ///< the second with the first
  std::optional<LivePairs<TriangleMesh>> of_mesh;  ///< of the first
};

/// Random fibers, options and calls. After each step the pairs that live are compared with those of
/// trees that have just been built. Some scenes have worlds of 1, 2 and 3 threads, which all are to
/// tell the same.
template <typename S>
class LiveCalls {
 public:
  explicit LiveCalls(Random& random)
      : radius_(std::pow(10.0, random.between(-3, 3))), is_calm_(random.below(3) != 0) {
    const double far[] = {0, 0, 0, 0, 1000, 1e6};
    place_ = far[random.below(6)] * radius_ * random.inCube(1);
    for (const std::size_t i : kBoth) makeFibers(random, i);
    chooseOptions(random);
    makeShape(random);
    for (double& skin : skins_) skin = someSkin(random);
    const bool are_compared = random.below(4) == 0;
    const int threads = random.below(4) == 0 ? 3 : 1;
    for (const int count : are_compared ? std::vector{1, 2, 3} : std::vector{threads}) {
      worlds_.emplace_back(options_[0], options_[1], TriangleMesh(shape_.view(), shape_kind_),
                           count, skins_);
    }
    for (const std::size_t i : kBoth) build<S>(i);
    poseMesh();
  }

  void step(Random& random) {
    using Other = std::conditional_t<std::is_same_v<S, float>, double, float>;
    if (std::is_same_v<S, double> && random.below(6) == 0) return moveSafely(random);
    random.below(8) == 0 ? stepAs<Other>(random) : stepAs<S>(random);
  }

  std::size_t pairsSeen() const { return pairs_seen_; }
  std::size_t safePoints() const { return safe_points_; }

 private:
  static constexpr std::size_t kKinds = LiveWorld::kKinds;
  static constexpr std::array<std::size_t, 2> kBoth{0, 1};

  double someSkin(Random& random) const {
    const double skins[] = {-1, 0, 40, 0.2, 0.5, 1, 2, 5};
    return skins[is_calm_ && random.below(3) != 0 ? 3 + random.below(5) : random.below(8)] *
           radius_;
  }
  void chooseOptions(Random& random) {
    const Topology topology = random.below(8) == 0 ? Topology::kSuperThread : Topology::kBundle;
    for (FiberTreeOptions& options : options_) {
      options.topology = topology;
      options.margin = random.below(3) == 0 ? radius_ * random.between(0, 2) : 0;
      options.ignored_neighbors = static_cast<int>(random.below(4));
      options.ignored_arc_length = random.below(8) == 0 ? radius_ * 20 : 0;
    }
  }

  void makeFibers(Random& random, std::size_t which) {
    MovingFibers<S>& fibers = fibers_[which] = {};
    home_[which].clear();
    // The second tree may be of another unit and place.
    const bool is_other = which == 1 && random.below(3) == 0;
    const double unit = radius_ * (is_other ? std::pow(10.0, random.between(-1.5, 0.7)) : 1);
    const Eigen::Vector3d place = place_ + (is_other ? 20 * radius_ : 0) * random.inCube(1);
    const std::size_t count = 1 + random.below(!is_other && random.below(4) == 0 ? 120 : 25);
    const double size = radius_ * random.between(5, 40);
    const double length = unit * random.between(0.1, 6);
    const double clump = random.between(0, 1);
    const bool has_gaps = random.below(4) == 0, are_closed = random.below(4) == 0;
    const auto skip = [&] {
      constexpr double kUnread = std::numeric_limits<double>::quiet_NaN();
      for (std::size_t i = random.below(3); i > 0; --i) fibers.addPoint({kUnread, kUnread, 0});
    };
    if (has_gaps) {
      skip();
      fibers.begin[0] = fibers.points.size();
    }
    for (std::size_t f = 0; f < count; ++f) {
      Eigen::Vector3d p = place + size * random.inCube(1);
      Eigen::Vector3d along = random.inCube(length);
      const std::size_t points = random.below(14);
      for (std::size_t i = points; i > 0; --i) {
        fibers.addPoint(p);
        if (random.below(20) == 0) continue;  // a segment without length
        p += clump * along + (1 - clump) * random.inCube(length);
      }
      if (are_closed) fibers.closed.push_back(points > 2 && random.below(2) == 0 ? 1 : 0);
      if (has_gaps) {
        fibers.end.push_back(fibers.points.size());
        skip();
      }
      fibers.endFiber();
    }
    fibers.close();
    giveRadii(random, fibers, unit);
    const bool has_groups = random.below(3) == 0, has_rules = random.below(3) == 0;
    for (std::size_t f = 0; f < count; ++f) {
      if (has_groups) fibers.groups.push_back(static_cast<std::int32_t>(random.below(4)));
      if (!has_rules) continue;
      fibers.meets.push_back(random.below(3) == 0 ? 0b01 : random.below(2) == 0 ? 0b10 : ~0u);
      fibers.root_segments.push_back(static_cast<std::int32_t>(random.below(3)));
    }
  }

  static void giveRadii(Random& random, MovingFibers<S>& fibers, double unit) {
    using Radii = typename FiberArrays<S>::Radii;
    constexpr std::array kKindsOfRadii{Radii::kOne, Radii::kPerFiber, Radii::kPerFirstPoint,
                                       Radii::kPerPoint};
    const std::size_t points = std::max<std::size_t>(fibers.points.size(), 1);
    const std::size_t kind = random.below(4);
    fibers.radii_are = kKindsOfRadii[kind];
    fibers.radii.resize(std::array{std::size_t{1}, fibers.fiberCount(), points, points}[kind]);
    for (double& radius : fibers.radii) {
      radius = unit * (random.below(6) == 0 ? 0 : random.between(0.3, 1.5));
    }
  }

  void makeShape(Random& random) {
    const double size = radius_ * random.between(3, 20);
    shape_kind_ = random.below(2) == 0 ? TriangleMesh::Kind::kSurface : TriangleMesh::Kind::kSolid;
    shape_ = shape_kind_ == TriangleMesh::Kind::kSurface ? soup<S>(random.below(1000), 60, 1)
                                                         : ball<S>(1, 4, 6);
    for (S& x : shape_.points) x = static_cast<S>(size * static_cast<double>(x));
  }
  void poseMesh() {
    for (LiveWorld& world : worlds_) world.mesh.setPose(poseOf(turn_, place_ + shift_));
  }

  void move(Random& random, std::size_t which) {
    MovingFibers<S>& fibers = fibers_[which];
    std::vector<Eigen::Vector3d>& home = home_[which];
    const double step =
        radius_ * std::pow(10.0, is_calm_ ? random.between(-4, -1) : random.between(-3, 0.5));
    bool is_exact = random.below(8) == 0;
    const auto forFiber = [&](std::size_t f, const auto& act) {
      for (std::size_t i = fibers.begin[f]; i < fibers.endOf(f); ++i) act(fibers.points[i]);
    };
    const bool is_usual = is_calm_ && random.below(4) != 0;
    switch (is_usual ? 13 + random.below(2) : random.below(13)) {
      case 0:  // it rests
        return;
      case 1:  // a rigid motion
      case 2: {
        const Eigen::Matrix3d turn =
            Eigen::AngleAxisd(random.between(-0.3, 0.3), random.direction()).toRotationMatrix();
        const Eigen::Vector3d shift = 10 * random.inCube(radius_);
        for (auto& p : fibers.points) p = place_ + turn * (p - place_) + shift;
        break;
      }
      case 3:  // some whip
        for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
          if (random.below(6) != 0) continue;
          const Eigen::Vector3d jump = random.inCube(30 * radius_);
          forFiber(f, [&](Eigen::Vector3d& p) { p += jump + random.inCube(step); });
        }
        break;
      case 4:  // radii grow or shrink
        for (double& radius : fibers.radii) radius *= random.between(0.7, 1.5);
        break;
      case 5: {  // one does, or vanishes, and comes back
        double& radius = fibers.radii[random.below(fibers.radii.size())];
        radius = radius == 0 ? radius_ : random.below(2) == 0 ? 0 : 4 * std::min(radius, radius_);
        break;
      }
      case 6:  // single points
        for (std::size_t i = 0; i < fibers.points.size(); i += 1 + random.below(40)) {
          fibers.points[i] += random.inCube(5 * radius_);
        }
        break;
      case 7:  // all shear
        for (auto& p : fibers.points) p.x() += 0.05 * (p - place_).y();
        break;
      case 8:  // all fly
        if (fibers.fiberCount() > 3 && random.below(3) == 0) {
          for (auto& p : fibers.points) p += random.inCube(20 * radius_);
        }
        break;
      case 9: {  // one fiber is at the end of the world for a while
        const std::size_t f = home.empty() ? random.below(fibers.fiberCount()) : away_[which];
        is_exact = true;
        if (home.empty()) {
          home = fibers.points;
          const double far = radius_ * std::pow(10.0, random.between(1, 30));
          const Eigen::Vector3d jump = far * random.direction();
          forFiber(f, [&](Eigen::Vector3d& p) { p += jump; });
        } else {
          std::copy(home.begin() + static_cast<std::ptrdiff_t>(fibers.begin[f]),
                    home.begin() + static_cast<std::ptrdiff_t>(fibers.endOf(f)),
                    fibers.points.begin() + static_cast<std::ptrdiff_t>(fibers.begin[f]));
          home.clear();
        }
        away_[which] = f;
        break;
      }
      case 10: {  // one fiber, or all, are in one point
        const bool is_all = fibers.points.size() < 150 && random.below(2) == 0;
        const std::size_t only = random.below(fibers.fiberCount());
        const Eigen::Vector3d point = place_ + random.inCube(5 * radius_);
        for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
          if (is_all || f == only) forFiber(f, [&](Eigen::Vector3d& p) { p = point; });
        }
        break;
      }
      case 11:  // radii are of another kind
        giveRadii(random, fibers, radius_);
        break;
      case 13: {  // a point or a fiber leaves its surroundings
        const std::size_t f = random.below(fibers.fiberCount());
        const Eigen::Vector3d jump = random.inCube(5 * radius_);
        const bool is_all = random.below(2) == 0;
        forFiber(f, [&](Eigen::Vector3d& p) {
          if (is_all || random.below(4) == 0) p += jump;
        });
        break;
      }
      default:
        break;
    }
    if (!is_exact) {
      for (auto& p : fibers.points) p += random.inCube(step);
    }
    fibers.close();
  }

  void moveMesh(Random& random) {
    switch (random.below(8)) {
      case 0:
        turn_ = random.rotation(0.5).toRotationMatrix() * turn_;
        shift_ += random.inCube(3 * radius_);
        return poseMesh();
      case 1:
        shift_ += random.inCube(0.1 * radius_);
        return poseMesh();
      case 2:
        for (S& x : shape_.points) {
          if (random.below(4) != 0) continue;
          x = static_cast<S>(static_cast<double>(x) + random.between(-0.5, 0.5) * radius_);
        }
        for (LiveWorld& world : worlds_) world.mesh.update(shape_.view());
        return;
      case 3: {
        const std::uint32_t categories = random.below(2) == 0 ? ~0u : 0b01u;
        for (LiveWorld& world : worlds_) world.mesh.setCategories(categories);
        return;
      }
      case 4:
        if (random.below(4) != 0) return;
        makeShape(random);
        for (LiveWorld& world : worlds_) world.mesh = TriangleMesh(shape_.view(), shape_kind_);
        names_[2] = ++last_name_;
        return poseMesh();
      default:
        return;
    }
  }

  template <typename T>
  void build(std::size_t which) {
    for (LiveWorld& world : worlds_) world.trees[which].template build<T>(view<T>(which));
    plain_[which] = FiberTree(options_[which]);
    plain_[which].template build<T>(view<T>(which));
    names_[which] = ++last_name_;
    judge<T>(which);
  }
  template <typename T>
  void update(std::size_t which) {
    for (LiveWorld& world : worlds_) world.trees[which].template update<T>(view<T>(which));
    plain_[which].template update<T>(view<T>(which));
    judge<T>(which);
  }
  template <typename T>
  FiberArrays<T> view(std::size_t which) {
    return fibers_[which].template view<T>();
  }
  template <typename T>
  void judge(std::size_t which) {
    fresh_[which] = FiberTree(options_[which]);
    fresh_[which].template build<T>(view<T>(which));
    are_exact_[which] = std::is_same_v<S, T>;
    is_current_.fill(false);
  }

  template <typename T>
  void stepAs(Random& random) {
    const std::size_t which = random.below(4) == 0 ? 1 : 0;
    if (random.below(4) != 0) {
      move(random, 1 - which);
      update<T>(1 - which);
    }
    move(random, which);
    change<T>(random, which);
    if (random.below(is_calm_ ? 8 : 3) == 0) moveMesh(random);
    askTrees(random);
    // Several over one tree are updated in any order, some not at all, and some twice.
    std::array<std::size_t, kKinds> order{0, 1, 2, 3, 4};
    for (std::size_t i = kKinds; i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
    for (const std::size_t kind : order) {
      const std::size_t times = random.below(6);
      if (times > 0) updateAndCheck(kind);
      if (times > 4) updateAndCheck(kind);
    }
  }

  /// Does something to a tree, behind which it is that of the fibers.
  template <typename T>
  void change(Random& random, std::size_t which) {
    switch (random.below(is_calm_ ? 100 : 20)) {
      case 0:  // the same topology, or another one
        if (random.below(2) == 0) makeFibers(random, which);
        return build<T>(which);
      case 1: {  // another tree is assigned, perhaps of other options
        if (random.below(2) == 0) chooseOptions(random);
        for (const std::size_t i : kBoth) {
          for (LiveWorld& world : worlds_) {
            world.trees[i] = FiberTree(world.withThreads(options_[i]));
          }
          build<T>(i);
        }
        return;
      }
      case 2: {  // a step with motion: its end counts
        MovingFibers<S> start = fibers_[which];
        for (auto& p : start.points) p += random.inCube(radius_);
        start.close();
        for (LiveWorld& world : worlds_) {
          world.trees[which].update(start.template view<T>(), view<T>(which));
        }
        plain_[which].template update<T>(view<T>(which));
        return judge<T>(which);
      }
      case 3: {  // the tree is elsewhere for a while
        update<T>(which);
        const bool is_seen = random.below(2) == 0;
        std::list<FiberTree> held;
        for (LiveWorld& world : worlds_) held.push_back(std::move(world.trees[which]));
        if (is_seen) {
          std::swap(names_[which], gone_);
          FiberTree fresh = std::exchange(fresh_[which], FiberTree(options_[which]));
          FiberTree plain = std::exchange(plain_[which], FiberTree(options_[which]));
          for (std::size_t kind = 0; kind < kKinds; ++kind) updateAndCheck(kind);
          fresh_[which] = std::move(fresh);
          plain_[which] = std::move(plain);
          std::swap(names_[which], gone_);
          gone_ = ++last_name_;
          is_current_.fill(false);
        }
        for (LiveWorld& world : worlds_) {
          world.trees[which] = std::move(held.front());
          held.pop_front();
        }
        return;
      }
      case 4: {  // what is refused changes nothing
        update<T>(which);
        for (std::size_t kind = 0; kind < kKinds; ++kind) updateAndCheck(kind);
        const std::vector<std::vector<double>> before = records();
        MovingFibers<S>& fibers = fibers_[which];
        std::size_t f = 0;
        while (f < fibers.fiberCount() && fibers.endOf(f) == fibers.begin[f]) ++f;
        if (f == fibers.fiberCount()) return;
        const Eigen::Vector3d right = fibers.points[fibers.begin[f]];
        fibers.points[fibers.begin[f]].y() = std::numeric_limits<double>::quiet_NaN();
        for (LiveWorld& world : worlds_) {
          EXPECT_THROW(world.trees[which].update(view<T>(which)), std::invalid_argument);
        }
        fibers.points[fibers.begin[f]] = right;
        EXPECT_EQ(records(), before);
        return;
      }
      case 5:
        refuse();
        break;
      case 6: {  // live pairs are made anew, or elsewhere for a while
        const std::size_t kind = random.below(kKinds);
        const bool is_anew = random.below(2) == 0;
        if (is_anew) skins_[kind] = someSkin(random);
        for (LiveWorld& world : worlds_) {
          if (is_anew) {
            world.makeAnew(kind, skins_[kind]);
          } else {
            world.with(kind, [](auto& live) {
              auto held = std::move(live);
              live = std::move(held);
            });
          }
        }
        if (is_anew) {
          kind < LiveWorld::kOfTrees ? void(watches_[kind] = {}) : void(mesh_watch_ = {});
        }
        break;
      }
      case 7:  // twice
        update<T>(which);
        break;
      default:
        break;
    }
    update<T>(which);
  }

  /// Updates that are refused change nothing.
  void refuse() {
    const std::vector<std::vector<double>> before = records();
    for (LiveWorld& world : worlds_) {
      const auto expectRefusal = [](auto& live) {
        EXPECT_THROW(live.update(), std::invalid_argument);
      };
      // A query runs.
      world.trees[0].visit(Pairs{}, [&](SegmentPair) {
        for (const std::size_t kind : std::array<std::size_t, 4>{0, 1, 2, 4})
          world.with(kind, expectRefusal);
        return true;
      });
      FiberTreeOptions others = world.trees[1].options();
      others.topology =
          others.topology == Topology::kBundle ? Topology::kSuperThread : Topology::kBundle;
      FiberTree held = std::exchange(world.trees[1], FiberTree(others));
      for (const std::size_t kind : std::array<std::size_t, 2>{2, 3})
        world.with(kind, expectRefusal);
      world.trees[1] = std::move(held);
    }
    EXPECT_EQ(records(), before);
  }

  /// Moves points as far as the pairs that live let them, and expects nothing new.
  void moveSafely(Random& random) {
    std::vector<double> limits[2];
    for (const std::size_t i : kBoth) {
      limits[i].assign(fibers_[i].points.size(), std::numeric_limits<double>::infinity());
    }
    const bool skips = random.below(2) == 0;
    std::array<bool, LiveWorld::kOfTrees> are_safe{};
    for (std::size_t kind = 0; kind < are_safe.size(); ++kind) {
      if (!is_current_[kind] || worlds_.front().of_trees[kind].skin() == 0) continue;
      are_safe[kind] = true;
      std::vector<double> distances[2], first[2];
      for (LiveWorld& world : worlds_) {
        world.of_trees[kind].safeDistances(distances[0], distances[1], skips);
        for (const std::size_t i : kBoth) {
          if (&world == &worlds_.front()) first[i] = distances[i];
          EXPECT_EQ(distances[i], first[i]) << "it depends on threads";
        }
      }
      for (const std::size_t i : kBoth) {
        std::vector<double>& of_tree = limits[kind < 2 ? 0 : kind == 2 ? i : 1 - i];
        ASSERT_EQ(first[i].size(), of_tree.size());
        for (std::size_t k = 0; k < of_tree.size(); ++k) {
          ASSERT_GE(first[i][k], 0);
          of_tree[k] = std::min(of_tree[k], first[i][k]);
        }
      }
    }
    for (const std::size_t i : kBoth) {
      MovingFibers<S>& fibers = fibers_[i];
      // The points as the tree has read them.
      if (!are_exact_[i]) return stepAs<S>(random);
      for (std::size_t f = 0; f < fibers.closed.size(); ++f) {
        if (fibers.closed[f] == 0) continue;
        double& first = limits[i][fibers.begin[f]];
        first = std::min(first, limits[i][fibers.endOf(f) - 1]);
      }
      const Eigen::Vector3d common = random.direction();
      const std::size_t way = random.below(3);
      for (std::size_t k = 0; k < fibers.points.size(); ++k) {
        Eigen::Vector3d& p = fibers.points[k];
        const double most = std::min(limits[i][k], radius_);
        const double length = most * (way == 0 ? random.unit() : 1 - 0x1p-50);
        const Eigen::Vector3d to = p + length * (way == 2 ? common : random.direction());
        const auto moved = (to.cast<long double>() - p.cast<long double>()).eval();
        if (moved.norm() > static_cast<long double>(most)) continue;  // by rounding
        safe_points_ += limits[i][k] > 0 && to != p ? 1 : 0;
        p = to;
      }
      fibers.close();
      update<S>(i);
    }
    for (std::size_t kind = 0; kind < are_safe.size(); ++kind) {
      updateAndCheck(kind);
      if (!are_safe[kind]) continue;
      EXPECT_TRUE(worlds_.front().of_trees[kind].begun().empty()) << "kind " << kind;
    }
  }

  void askTrees(Random& random) {
    for (const std::size_t kind : std::array<std::size_t, 3>{0, 2, 4}) {
      if (random.below(5) != 0) continue;
      for (LiveWorld& world : worlds_) {
        const PairList found = pairsOf(kind, world.trees, world.mesh);
        EXPECT_EQ(withoutNearest(kind, found), withoutNearest(kind, expected(kind)));
      }
    }
  }
  /// The pairs of each kind, from trees without live pairs.
  PairList expected(std::size_t kind) const {
    // Lengths along a fiber are those of the last build.
    const bool are_plain = options_[0].ignored_arc_length > 0;
    return pairsOf(kind, are_plain ? plain_ : fresh_, worlds_.front().mesh);
  }
  /// Of what has one triangle of the mesh, leaves out which. If several are equally near to what is
  /// inside a solid, the frame of the tree tells.
  static PairList withoutNearest(std::size_t kind, PairList pairs) {
    for (std::size_t i = 0; kind == 4 && i < pairs.size(); ++i) {
      const bool is_first = i == 0 || pairs[i - 1].first != pairs[i].first;
      const bool is_last = i + 1 == pairs.size() || pairs[i + 1].first != pairs[i].first;
      if (is_first && is_last) pairs[i].second = -1;
    }
    return pairs;
  }
  static PairList pairsOf(std::size_t kind, const std::array<FiberTree, 2>& trees,
                          const TriangleMesh& mesh) {
    if (kind < 2) return test::pairsOf(trees[0]);
    if (kind < 4) return test::pairsOf(trees[kind - 2], trees[3 - kind]);
    return pairsOfMesh(trees[0], mesh);
  }

  void updateAndCheck(std::size_t kind) {
    SCOPED_TRACE("kind " + std::to_string(kind));
    for (LiveWorld& world : worlds_) {
      world.with(kind, [](auto& live) { live.update(); });
    }
    if (worlds_.size() > 1) {
      const std::vector<double> first = worlds_.front().record(kind);
      for (LiveWorld& world : worlds_) {
        EXPECT_TRUE(world.record(kind) == first) << world.threads << " threads tell otherwise";
      }
    }
    const std::array names{names_[0], kind < 2 ? 0 : kind < 4 ? names_[1] : names_[2]};
    const bool all_end = names != seen_names_[kind];
    PairList wanted = expected(kind);
    worlds_.front().with(kind, [&](const auto& live) {
      if constexpr (std::is_same_v<std::decay_t<decltype(live)>, LivePairs<FiberTree>>) {
        watches_[kind].checkPairs(live, wanted, all_end);
      } else {
        std::vector<TrianglePair> found;
        live.find(found);
        const PairList pairs = sorted(found);
        if (pairs != wanted) {
          EXPECT_EQ(withoutNearest(kind, pairs), withoutNearest(kind, wanted));
          wanted = pairsOf(kind, worlds_.front().trees, worlds_.front().mesh);
        }
        mesh_watch_.checkPairs(live, wanted, all_end);
      }
      pairs_seen_ += live.count();
    });
    seen_names_[kind] = names;
    is_current_[kind] = true;
  }
  std::vector<std::vector<double>> records() {
    std::vector<std::vector<double>> records;
    for (LiveWorld& world : worlds_) {
      for (std::size_t kind = 0; kind < kKinds; ++kind) records.push_back(world.record(kind));
    }
    return records;
  }

  const double radius_;  ///< the usual one
  const bool is_calm_;   ///< whether lists serve for some steps
  Eigen::Vector3d place_;
  MovingFibers<S> fibers_[2];
  std::vector<Eigen::Vector3d> home_[2];  ///< while a fiber is away, the points before
  std::size_t away_[2] = {};              ///< which one
  std::array<FiberTreeOptions, 2> options_;
  Triangles<S> shape_;
  TriangleMesh::Kind shape_kind_ = TriangleMesh::Kind::kSurface;
  Eigen::Matrix3d turn_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift_ = Eigen::Vector3d::Zero();

  std::vector<double> skins_ = std::vector<double>(kKinds);
  std::list<LiveWorld> worlds_;
  std::array<FiberTree, 2> fresh_;   ///< just built
  std::array<FiberTree, 2> plain_;   ///< as those of the worlds, without live pairs
  std::array<bool, 2> are_exact_{};  ///< whether they have read the points without rounding

  std::array<LiveWatch<FiberTree>, LiveWorld::kOfTrees> watches_;
  LiveWatch<TriangleMesh> mesh_watch_;
  // A build, or another tree or mesh, gives new names to segments or triangles.
  std::array<std::uint64_t, 3> names_{};
  std::uint64_t last_name_ = 1, gone_ = 1;
  std::array<std::array<std::uint64_t, 2>, kKinds> seen_names_{};
  std::array<bool, kKinds> is_current_{};  ///< updated since the last change of a tree
  std::size_t pairs_seen_ = 0, safe_points_ = 0;
};

}  // namespace fcl_fibers::test
