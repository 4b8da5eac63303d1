// SPDX-License-Identifier: BSD-3-Clause
//
// A tree over arrays of any bits, with or without groups, closed fibers, roots and categories:
// built, updated, moved, searched, met by shapes, by meshes and by another tree. What is refused
// must leave the tree as it was; what is answered must have each pair once, all pairs that surely
// touch, and under Report::kCapsules none that are surely apart. In a step no impact is missed or
// late, and no step is safe too long. All this is the same, in the same order, on two threads.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/meshes.h"
#include "fuzz_hair.h"
#include "fuzz_input.h"
#include "support/exact_geometry.h"
#include "support/impact_oracle.h"
#include "support/touch_oracle.h"

namespace {

using fcl_fibers::BoxShape;
using fcl_fibers::CapsuleShape;
using fcl_fibers::FiberTree;
using fcl_fibers::FiberTreeOptions;
using fcl_fibers::Impact;
using fcl_fibers::MeshContact;
using fcl_fibers::MeshImpact;
using fcl_fibers::MeshPose;
using fcl_fibers::Report;
using fcl_fibers::SegmentPair;
using fcl_fibers::TreeVolume;
using fcl_fibers::TriangleMesh;
using fcl_fibers::TrianglePair;
using fcl_fibers::fuzz::Hair;
using fcl_fibers::fuzz::isRefused;
using fcl_fibers::fuzz::kNumbers;
using fcl_fibers::fuzz::readByte;
using fcl_fibers::fuzz::readNumber;
using fcl_fibers::fuzz::readOptions;
using fcl_fibers::fuzz::require;
using fcl_fibers::test::ExactTriangle;
using fcl_fibers::test::GivenCapsule;
using fcl_fibers::test::GivenInstant;
using fcl_fibers::test::GivenMotion;
using fcl_fibers::test::ImpactOracle;
using fcl_fibers::test::Point;
using fcl_fibers::test::Real;
using fcl_fibers::test::TouchOracle;
using fcl_fibers::test::Triangles;
using PairList = std::vector<std::pair<int, int>>;

/// What a run has been told, in order.
std::vector<double>* told = nullptr;

PairList pairsOf(const FiberTree& tree) {
  PairList pairs;
  tree.visit(fcl_fibers::Pairs{}, [&](SegmentPair pair) { pairs.emplace_back(pair.a, pair.b); });
  for (const auto& [a, b] : pairs) told->insert(told->end(), {double(a), double(b)});
  return pairs;
}

/// The band about contact in which either answer is right, see docs/numerics.md, is smaller than
/// this part of the scene's size.
constexpr double kBand = 1e-12;
/// The same during a step. What the times of impacts may be early by is less, see
/// FiberTree::visitImpacts().
constexpr double kStepBand = 2 * 0x1p-36 * 4;

/// @param size  of the scene, and the margin
void checkPair(const GivenCapsule& p, const GivenCapsule& q, const FiberTreeOptions& options,
               double size, bool found) {
  const bool touch = TouchOracle::judge(p, q, options.margin).touching;
  const double band = kBand * size;
  if (!found) {
    require(!touch || !TouchOracle::touchExactly(p, q, options.margin - band));
  } else if (options.report == Report::kCapsules) {
    require(touch || TouchOracle::judge(p, q, options.margin + band).touching);
  }
}

/// Calls visit(a, b) for all pairs of capsules that a tree has to report if they touch, or of two
/// trees if there is another one. Those that it may not report are not among `found`.
template <typename S, class Visit>
void visitCandidates(const Hair<S>& hair, const Hair<S>* other, const FiberTreeOptions& options,
                     const std::set<std::pair<int, int>>& found, Visit&& visit) {
  const Hair<S>& second = other != nullptr ? *other : hair;
  std::size_t counted = 0;
  for (std::size_t a = 0; a < hair.pointCount(); ++a) {
    if (!hair.startsCapsule(a)) continue;
    for (std::size_t b = other != nullptr ? 0 : a + 1; b < second.pointCount(); ++b) {
      if (!second.startsCapsule(b)) continue;
      const SegmentPair pair{static_cast<int>(a), static_cast<int>(b)};
      const bool is_found = found.count({pair.a, pair.b}) > 0;
      counted += is_found;
      const std::optional<bool> left_out = other != nullptr ? false : hair.isLeftOut(pair, options);
      require(!is_found || left_out != true);
      if (left_out == false) visit(a, b, is_found);
    }
  }
  require(counted == found.size());
}

template <typename S>
void checkAnswers(const PairList& pairs, const FiberTreeOptions& options, const Hair<S>& hair,
                  const Hair<S>* other = nullptr) {
  const Hair<S>& second = other != nullptr ? *other : hair;
  const double size = std::max(hair.size(), second.size()) + options.margin;
  const std::set<std::pair<int, int>> found(pairs.begin(), pairs.end());
  require(found.size() == pairs.size());
  visitCandidates(hair, other, options, found, [&](std::size_t a, std::size_t b, bool is_found) {
    checkPair(hair.capsule(a), second.capsule(b), options, size, is_found);
  });
}

/// The impacts of a tree, or of two, none if it refuses to tell them.
struct Impacts {
  std::set<std::pair<int, int>> pairs;
  std::map<std::pair<int, int>, Impact> all;
  bool refused;

  explicit Impacts(const FiberTree& tree, const FiberTree* other = nullptr) {
    const auto take = [&](const Impact& impact) {
      const std::pair<int, int> pair(impact.pair.a, impact.pair.b);
      require(all.emplace(pair, impact).second);
      pairs.insert(pair);
      require(impact.time >= 0 && impact.time <= 1);
      told->insert(told->end(), {double(pair.first), double(pair.second), impact.time, impact.s});
    };
    refused = isRefused([&] {
      other != nullptr ? tree.visit(fcl_fibers::Impacts{}, *other, take)
                       : tree.visit(fcl_fibers::Impacts{}, take);
    });
  }
};

/// Whether two are certainly farther apart all the time than by less than the margin.
bool apart(GivenMotion motion, double less, double until) {
  motion.margin -= less;
  return ImpactOracle::apartDuring(motion, 0, until).certain;
}

/// An impact that is missed or late, or a step that is safe too long, would be one during which the
/// two come nearer.
/// @param time  of the impact; 2 if there is none
/// @param safe  the safe step, which may be later than that of this pair
void checkMotion(const GivenMotion& motion, double time, double safe, double size) {
  if (time > 0) require(apart(motion, kStepBand * size, std::min(time, 1.0)));
  if (ImpactOracle::excessAt(motion, 0) > kStepBand * size) {
    require(apart(motion, kStepBand * size, safe));
  }
}

/// Fibers at the start and the end of a step.
template <typename S>
struct Step {
  Hair<S> start, end;

  double size() const { return std::max(start.size(), end.size()); }
};

GivenInstant instantOf(const GivenCapsule& p, const GivenCapsule& q) {
  return {{p.a, p.b}, {q.a, q.b}, {p.radius, q.radius}};
}

/// @param other, its_step  null for the pairs of one tree
template <typename S>
void checkStep(const FiberTree& tree, const Step<S>& step, const FiberTree* other = nullptr,
               const Step<S>* its_step = nullptr) {
  const FiberTreeOptions& options = tree.options();
  std::set<std::pair<int, int>> moving;
  const auto take = [&](SegmentPair pair) {
    require(moving.emplace(pair.a, pair.b).second);
    told->insert(told->end(), {double(pair.a), double(pair.b)});
  };
  other != nullptr ? tree.visit(fcl_fibers::MovingPairs{}, *other, take)
                   : tree.visit(fcl_fibers::MovingPairs{}, take);
  const Impacts impacts(tree, other);
  const auto safeStep = [&] { return other != nullptr ? tree.safeStep(*other) : tree.safeStep(); };
  if (options.report == Report::kVolumes) {
    return require(impacts.refused && isRefused([&] { (void)safeStep(); }));
  }
  require(!impacts.refused);
  const double safe = safeStep();
  require(safe >= 0 && safe <= 1);
  const Step<S>& second = its_step != nullptr ? *its_step : step;
  const double size = std::max(step.size(), second.size()) + options.margin;
  const Hair<S>* others = its_step != nullptr ? &its_step->end : nullptr;
  visitCandidates(step.end, others, options, moving, [](std::size_t, std::size_t, bool) {});
  visitCandidates(
      step.end, others, options, impacts.pairs, [&](std::size_t a, std::size_t b, bool is_found) {
        const std::pair<int, int> pair(static_cast<int>(a), static_cast<int>(b));
        require(!is_found || moving.count(pair) > 0);
        const GivenMotion motion{instantOf(step.start.capsule(a), second.start.capsule(b)),
                                 instantOf(step.end.capsule(a), second.end.capsule(b)), 2,
                                 options.margin};
        checkMotion(motion, is_found ? impacts.all.at(pair).time : 2, safe, size);
      });
}

/// The segments that touch a shape, whose distance from an axis is gap(axis).
template <typename S, class Shape, class Gap>
void checkOverlaps(const FiberTree& tree, const Hair<S>& hair, const Shape& shape, double size,
                   Gap&& gap) {
  std::set<int> found;
  if (isRefused([&] {
        tree.visit(fcl_fibers::Pairs{}, shape, [&](std::int32_t segment) {
          require(found.insert(segment).second);
          told->push_back(segment);
        });
      })) {
    return require(size > 1e100);
  }
  std::size_t counted = 0;
  size += hair.size() + tree.options().margin;
  for (std::size_t a = 0; a < hair.pointCount(); ++a) {
    if (!hair.startsCapsule(a)) continue;
    const auto capsule = fcl_fibers::test::roundedCapsule(hair.capsule(a));
    const Real apart = gap(capsule) - capsule.radius - tree.options().margin;
    const bool is_found = found.count(static_cast<int>(a)) > 0;
    counted += is_found;
    require(is_found || apart > -4 * kBand * size);
    require(!is_found || tree.options().report == Report::kVolumes || apart <= 4 * kBand * size);
  }
  require(counted == found.size());
}

Point pointOf(const std::array<double, 3>& p) { return {p[0], p[1], p[2]}; }

template <typename S>
void fuzzOverlaps(FuzzedDataProvider& data, const FiberTree& tree, const Hair<S>& hair) {
  std::array<double, 3> p, q;
  for (double& x : p) x = readNumber<double>(data, kNumbers);
  for (double& x : q) x = readNumber<double>(data, kNumbers);
  const double radius = std::fabs(readNumber<double>(data, kNumbers)) / 4;
  double size = radius;
  for (const double x : {p[0], p[1], p[2], q[0], q[1], q[2]}) {
    size = std::isfinite(x) ? std::max(size, std::fabs(x)) : INFINITY;
  }
  checkOverlaps(tree, hair, CapsuleShape{p, q, radius}, size, [&](const auto& capsule) {
    return fcl_fibers::test::segmentDistance(capsule.a, capsule.b, pointOf(p), pointOf(q)) - radius;
  });
  BoxShape box{p, p};
  for (std::size_t i = 0; i < 3; ++i) {
    box.low[i] = std::min(p[i], q[i]);
    box.high[i] = std::max(p[i], q[i]);
  }
  checkOverlaps(tree, hair, box, size, [&](const auto& capsule) {
    return fcl_fibers::test::segmentBoxDistance(capsule.a, capsule.b,
                                                {pointOf(box.low), pointOf(box.high)});
  });
}

template <typename S>
void checkVolumes(const FiberTree& tree, const Hair<S>& hair, int depth) {
  std::vector<TreeVolume> volumes;
  if (isRefused([&] { volumes = tree.volumes(depth); })) return require(depth < 0);
  require(depth >= 0);
  const double half_margin = tree.options().margin / 2;
  const double band = 4 * kBand * (hair.size() + half_margin);
  std::set<int> seen;
  for (const TreeVolume& volume : volumes) {
    const Point center(volume.center[0], volume.center[1], volume.center[2]);
    for (std::size_t i = 0; i < volume.segment_count; ++i) {
      require(seen.insert(volume.segments[i]).second);
      const auto capsule = fcl_fibers::test::roundedCapsule(
          hair.capsule(static_cast<std::size_t>(volume.segments[i])));
      for (const Point& end : {capsule.a, capsule.b}) {
        const Point from = (end - center).cwiseAbs();
        const Real reach = capsule.radius + half_margin - band;
        if (volume.kind == FiberTreeOptions::Volumes::kWrappedSpheres) {
          require(from.norm() + reach <= volume.half[0]);
        } else {
          for (int k = 0; k < 3; ++k) require(from[k] + reach <= volume.half[k]);
        }
      }
    }
  }
  require(seen.size() == tree.segmentCount());
}

template <typename S>
Triangles<S> readMesh(FuzzedDataProvider& data) {
  Triangles<S> mesh;
  const int points = data.ConsumeIntegralInRange(0, 8), any = data.ConsumeIntegralInRange(0, 9);
  for (int i = 0; i < 3 * points; ++i) mesh.points.push_back(readNumber<S>(data, kNumbers));
  if (any == 0) {  // any indices
    for (int i = data.ConsumeIntegralInRange(0, 4); i > 0; --i) {
      mesh.addTriangle(data.ConsumeIntegralInRange(-1, 8), data.ConsumeIntegralInRange(-1, 8),
                       data.ConsumeIntegralInRange(-1, 8));
    }
  } else if (points == 4 && any < 4) {  // closed, its normals outward or inward
    mesh.indices = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  } else if (points > 0) {
    for (int i = data.ConsumeIntegralInRange(0, 12); i > 0; --i) {
      mesh.addTriangle(data.ConsumeIntegralInRange(0, points - 1),
                       data.ConsumeIntegralInRange(0, points - 1),
                       data.ConsumeIntegralInRange(0, points - 1));
    }
  }
  return mesh;
}

MeshPose readPose(FuzzedDataProvider& data) {
  MeshPose pose;
  const int turn = data.ConsumeIntegralInRange(0, 4);
  if (turn == 1) pose.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  if (turn == 2) pose.rotation = {0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1};
  if (turn == 3) pose.rotation = {0.36, 0.48, -0.8, -0.8, 0.6, 0, 0.48, 0.64, 0.6};
  if (turn == 4) pose.rotation[data.ConsumeIntegralInRange<std::size_t>(0, 8)] = 0.5;
  for (double& x : pose.position) x = readNumber<double>(data, kNumbers);
  return pose;
}

/// The triangles of a surface that each segment touches are known; in a solid those inside come
/// with one more, and what is inside is not judged here.
template <typename S>
double sizeOf(const Triangles<S>& triangles, const TriangleMesh& mesh) {
  double size = 0;
  for (const S x : triangles.points) size = std::max(size, std::fabs(static_cast<double>(x)));
  for (const double x : mesh.pose().position) size = std::max(size, std::fabs(x));
  return size;
}

template <typename S>
void checkMesh(const FiberTree& tree, const Hair<S>& hair, const Triangles<S>& triangles,
               const TriangleMesh& mesh) {
  const double size = std::max(hair.size() + tree.options().margin, sizeOf(triangles, mesh));
  const Real band = 4 * kBand * size, margin = tree.options().margin;
  std::set<std::pair<int, int>> found;
  std::set<int> touching;
  const auto take = [&](TrianglePair pair) {
    require(found.emplace(pair.segment, pair.triangle).second);
    touching.insert(pair.segment);
    told->insert(told->end(), {double(pair.segment), double(pair.triangle)});
  };
  if (isRefused([&] { tree.visit(fcl_fibers::Pairs{}, mesh, take); })) {
    return require(size > 1e100 || tree.options().report == Report::kVolumes);
  }
  std::vector<std::int32_t> segments;
  tree.find(fcl_fibers::TouchingSegments{}, mesh, segments);
  require(std::set<int>(segments.begin(), segments.end()) == touching &&
          segments.size() == touching.size());
  std::vector<TrianglePair> nearest;
  const double distance = 1.5;
  tree.find(fcl_fibers::Nearest{distance}, mesh, nearest);
  std::vector<std::int32_t> nearest_of(hair.pointCount(), -1);
  for (const TrianglePair& pair : nearest) {
    std::int32_t& triangle = nearest_of[static_cast<std::size_t>(pair.segment)];
    require(triangle == -1);
    triangle = pair.triangle;
  }
  std::size_t counted = 0;
  for (std::size_t a = 0; a < hair.pointCount(); ++a) {
    if (!hair.startsCapsule(a)) continue;
    const auto capsule = fcl_fibers::test::roundedCapsule(hair.capsule(a));
    const auto near = static_cast<std::size_t>(nearest_of[a]);
    if (hair.isLeftOut(a, mesh.categories())) {
      require(touching.count(static_cast<int>(a)) == 0 && nearest_of[a] == -1);
      continue;
    }
    Real least = INFINITY, of_nearest = INFINITY;
    for (std::size_t t = 0; t < triangles.count(); ++t) {
      const Real gap = fcl_fibers::test::segmentTriangleDistance(
                           capsule.a, capsule.b, triangles.triangle(t, mesh.pose())) -
                       capsule.radius;
      const bool is_found = found.count({static_cast<int>(a), static_cast<int>(t)}) > 0;
      counted += is_found;
      require(is_found || gap > margin - band);
      require(!is_found || gap <= margin + band || mesh.kind() == TriangleMesh::Kind::kSolid);
      least = std::min(least, gap);
      if (nearest_of[a] >= 0 && t == near) of_nearest = gap;
    }
    require(nearest_of[a] >= 0 ? of_nearest <= least + band && least <= distance + band
                               : least > distance - band);
  }
  require(counted == found.size());
}

GivenInstant instantOf(const GivenCapsule& p, const ExactTriangle& triangle) {
  const auto numbers = [](const Point& x) {
    return std::array{double(x[0]), double(x[1]), double(x[2])};
  };
  return {
      {p.a, p.b}, {numbers(triangle.a), numbers(triangle.b), numbers(triangle.c)}, {p.radius, 0}};
}

/// @param step  null if the tree has none
template <typename S>
void checkStep(const FiberTree& tree, const Step<S>* step, const Triangles<S>& triangles,
               const TriangleMesh& at_start, const Triangles<S>& triangles_at_end,
               const TriangleMesh& at_end) {
  std::map<std::pair<int, int>, double> impacts;
  double safe = 1;
  if (isRefused([&] {
        tree.visit(
            fcl_fibers::Impacts{}, fcl_fibers::MeshStep{at_start, at_end},
            [&](const MeshImpact& impact) {
              const std::pair<int, int> pair(impact.pair.segment, impact.pair.triangle);
              require(impacts.emplace(pair, impact.time).second);
              require(impact.time >= 0 && impact.time <= 1);
              told->insert(told->end(), {double(pair.first), double(pair.second), impact.time});
            });
        safe = tree.safeStep(fcl_fibers::MeshStep{at_start, at_end});
      })) {
    return;
  }
  require(step != nullptr && safe >= 0 && safe <= 1);
  const double size = step->size() + tree.options().margin + sizeOf(triangles, at_start) +
                      sizeOf(triangles_at_end, at_end);
  std::size_t counted = 0;
  for (std::size_t a = 0; a < step->end.pointCount(); ++a) {
    if (!step->end.startsCapsule(a) || step->end.isLeftOut(a, at_end.categories())) continue;
    for (std::size_t t = 0; t < triangles.count(); ++t) {
      const auto impact = impacts.find({static_cast<int>(a), static_cast<int>(t)});
      counted += impact != impacts.end();
      const GivenMotion motion{
          instantOf(step->start.capsule(a), triangles.triangle(t, at_start.pose())),
          instantOf(step->end.capsule(a), triangles_at_end.triangle(t, at_end.pose())), 3,
          tree.options().margin};
      checkMotion(motion, impact != impacts.end() ? impact->second : 2, safe, size);
    }
  }
  require(counted == impacts.size());
}

/// @param step  the tree's, or null
template <typename S>
void fuzzMesh(FuzzedDataProvider& data, const FiberTree& tree, const Hair<S>& hair,
              const Step<S>* step) {
  Triangles<S> triangles = readMesh<S>(data);
  const auto kind = data.ConsumeBool() ? TriangleMesh::Kind::kSurface : TriangleMesh::Kind::kSolid;
  std::optional<TriangleMesh> mesh;
  if (isRefused([&] { mesh.emplace(triangles.view(), kind); })) return;
  if (const std::uint8_t bits = readByte(data); bits != 0) mesh->setCategories(bits & 3);
  const MeshPose pose = readPose(data);
  isRefused([&] { mesh->setPose(pose); });
  checkMesh(tree, hair, triangles, *mesh);
  const Triangles<S> before = triangles;
  const TriangleMesh at_start = *mesh;
  for (S& x : triangles.points) x = readNumber<S>(data, kNumbers);
  const bool refused = isRefused([&] { mesh->update(triangles.view()); });
  checkMesh(tree, hair, refused ? before : triangles, *mesh);
  checkStep(tree, step, before, at_start, refused ? before : triangles, *mesh);
  std::vector<MeshContact> contacts;
  isRefused([&] { tree.find(fcl_fibers::Contacts{hair.arrays()}, *mesh, contacts); });
}

/// Moves the tree and the hair, unless it refuses.
template <typename S>
std::optional<Step<S>> readStep(FuzzedDataProvider& data, FiberTree& tree, Hair<S>& hair) {
  Step<S> step{hair, hair};
  if (data.ConsumeBool()) step.start.readNumbers(data);
  step.end.readNumbers(data);
  const PairList before = pairsOf(tree);
  const std::set<std::pair<int, int>> impacts_before = Impacts(tree).pairs;
  if (isRefused([&] { tree.update(step.start.arrays(), step.end.arrays()); })) {
    require(pairsOf(tree) == before && Impacts(tree).pairs == impacts_before);
    return std::nullopt;
  }
  require(tree.options().volumes == FiberTreeOptions::Volumes::kLayeredBoxes);
  hair = step.end;
  return step;
}

/// A tree, what it was given last, and the step if that was one.
template <typename S>
struct Fibers {
  FiberTree tree;
  std::optional<Hair<S>> hair;
  std::optional<Step<S>> step;

  explicit Fibers(const FiberTreeOptions& options) : tree(options) {}

  void build(FuzzedDataProvider& data) {
    Hair<S> next = hair && data.ConsumeBool() ? *hair : Hair<S>(data);
    const bool same_fibers = hair && next.hasFibersOf(*hair);
    if (same_fibers) next.readNumbers(data);
    const PairList before = pairsOf(tree);
    const bool updates = same_fibers && data.ConsumeBool();
    updates ? next.measureAs(*hair) : next.measure();
    if (isRefused([&] { updates ? tree.update(next.arrays()) : tree.build(next.arrays()); })) {
      return require(pairsOf(tree) == before);
    }
    hair = next;
    step.reset();
    checkAnswers(pairsOf(tree), tree.options(), *hair);
    require(isRefused([&] { tree.visit(fcl_fibers::MovingPairs{}, [](SegmentPair) {}); }));
  }

  void move(FuzzedDataProvider& data) {
    std::optional<Step<S>> next = readStep(data, tree, *hair);
    if (!next) return;
    step = std::move(next);
    checkAnswers(pairsOf(tree), tree.options(), *hair);
    checkStep(tree, *step);
  }
};

template <typename S>
void checkBoth(const Fibers<S>& first, const Fibers<S>& second) {
  if (!first.hair || !second.hair) return;
  PairList pairs;
  first.tree.visit(fcl_fibers::Pairs{}, second.tree, [&](SegmentPair pair) {
    pairs.emplace_back(pair.a, pair.b);
    told->insert(told->end(), {double(pair.a), double(pair.b)});
  });
  checkAnswers(pairs, first.tree.options(), *first.hair, &*second.hair);
  if (first.step && second.step) {
    checkStep(first.tree, *first.step, &second.tree, &*second.step);
  } else {
    require(Impacts(first.tree, &second.tree).refused);
  }
}

/// The capsules are more than one task's.
template <typename S>
void fuzzMany(const FiberTree& tree, const Hair<S>& hair) {
  Hair<S> many = hair;
  FiberTree other(tree.options());
  for (int i = 0; i < 5 && many.pointCount() < 600; ++i) many.repeat();
  if (!isRefused([&] { other.build(many.arrays()); })) pairsOf(other);
}

template <typename S>
void fuzz(FuzzedDataProvider& data, int threads) {
  FiberTreeOptions options = readOptions(data);
  options.threads = threads;
  Fibers<S> fibers(options), others(options);
  FiberTree& tree = fibers.tree;
  bool had_many = false;
  while (data.remaining_bytes() > 0) {
    switch (data.ConsumeIntegralInRange(0, 5)) {
      case 0:
      case 1:
        fibers.build(data);
        break;
      case 2:
        if (others.hair && (readByte(data) & 1) != 0) {
          others.move(data);
        } else {
          others.build(data);
        }
        checkBoth(fibers, others);
        break;
      case 3: {
        const int most = data.ConsumeIntegralInRange(1, 40);
        int calls = 0;
        const bool stopped =
            tree.visit(fcl_fibers::Pairs{}, [&](SegmentPair) { return ++calls == most; });
        require(calls <= most && stopped == (calls == most));
        if (!fibers.hair) break;
        const std::uint8_t more = readByte(data);
        if ((more & 1) != 0) fuzzOverlaps(data, tree, *fibers.hair);
        if ((more & 2) != 0) checkVolumes(tree, *fibers.hair, (more >> 3) - 1);
        // Once, as there may be half a million pairs.
        if ((more & 4) != 0 && !std::exchange(had_many, true)) fuzzMany(tree, *fibers.hair);
        break;
      }
      case 4:
        if (fibers.hair) fuzzMesh(data, tree, *fibers.hair, fibers.step ? &*fibers.step : nullptr);
        break;
      default: {
        if (fibers.hair && data.ConsumeBool()) {
          fibers.move(data);
          if (others.hair && fibers.step) checkBoth(fibers, others);
          break;
        }
        const int segment = data.ConsumeIntegral<int>();
        isRefused([&] { tree.fiberSegment(segment); });
      }
    }
  }
}

template <typename S>
void fuzzTwice(const std::uint8_t* bytes, std::size_t size) {
  std::vector<double> answers[2];
  for (const int threads : {1, 2}) {
    FuzzedDataProvider data(bytes, size);
    (void)data.ConsumeBool();
    told = &answers[threads - 1];
    fuzz<S>(data, threads);
  }
  require(answers[0] == answers[1]);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (FuzzedDataProvider(bytes, size).ConsumeBool()) {
    fuzzTwice<float>(bytes, size);
  } else {
    fuzzTwice<double>(bytes, size);
  }
  return 0;
}
