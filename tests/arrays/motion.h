// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "support/random.h"

namespace fcl_fibers::test {

/// What a reported pair may miss a touch by: 2^-36 of its size, which is below 4.
constexpr double kTolerance = 4 * 0x1p-36;

/// Parts of a step, at whose ends the oracles look.
constexpr int kSamples = 32;

/// Fibers at the start and at the end of a step.
template <typename S>
struct Motion {
  Assembly<S> start, end;
  std::vector<std::uint8_t> closed = {};  ///< as in FiberArrays; empty if no fiber is closed
  std::vector<std::int32_t> groups = {};  ///< likewise

  /// Fibers that fly through each other, each as a whole and each point by itself.
  static Motion random(std::uint64_t seed, int fibers, double away) {
    Motion motion{curledFibers<S>(seed, fibers), {}};
    motion.end = motion.start;
    Random random(seed + 1000);
    for (std::size_t f = 0; f < motion.end.fiberCount(); ++f) {
      const Eigen::Vector3d whole = random.inCube(away);
      for (std::size_t i = motion.end.point_begin[f]; i < motion.end.point_begin[f + 1]; ++i) {
        const Eigen::Vector3d way = whole + random.inCube(0.2 * away);
        for (std::size_t k = 0; k < 3; ++k) {
          motion.end.points[3 * i + k] += static_cast<S>(way[static_cast<Eigen::Index>(k)]);
        }
        if (i % 3 == 0) motion.end.radii[i] *= S(1.5);
      }
    }
    return motion;
  }

  /// Closes every third fiber and puts two of three into groups.
  void closeAndGroup() {
    for (std::size_t f = 0; f < start.fiberCount(); ++f) {
      const std::size_t first = start.point_begin[f], last = start.point_begin[f + 1];
      const bool closes = f % 3 == 1 && last > first + 3;
      for (std::size_t k = 0; closes && k < 3; ++k) {
        for (auto* fibers : {&start, &end}) {
          fibers->points[3 * (last - 1) + k] = fibers->points[3 * first + k];
        }
      }
      closed.push_back(closes ? 1 : 0);
      groups.push_back(static_cast<std::int32_t>(f / 2 % 3));
    }
  }

  /// Whether no query reports the pair, because its capsules are neighbours or of one group.
  bool leavesOut(const std::pair<std::int32_t, std::int32_t>& pair, int ignored) const {
    const auto a = static_cast<std::size_t>(pair.first), b = static_cast<std::size_t>(pair.second);
    const std::size_t f = start.fiberOf(a), g = start.fiberOf(b);
    if (!groups.empty() && groups[f] != 0 && groups[f] == groups[g]) return true;
    if (f != g) return false;
    const std::size_t capsules = start.point_begin[f + 1] - start.point_begin[f] - 1, way = b - a;
    const bool is_closed = !closed.empty() && closed[f] != 0;
    return std::min(way, is_closed ? capsules - way : way) <= static_cast<std::size_t>(ignored);
  }

  FiberArrays<S> viewOf(const Assembly<S>& fibers) const {
    FiberArrays<S> view = fibers.view();
    if (!closed.empty()) view.closed = closed.data();
    if (!groups.empty()) view.groups = groups.data();
    return view;
  }

  /// In doubles, because the points in between are not those of a float array.
  Assembly<double> at(double time) const {
    Assembly<double> now;
    now.point_begin = start.point_begin;
    const auto between = [&](S a, S b) {
      return (1 - time) * static_cast<double>(a) + time * static_cast<double>(b);
    };
    for (std::size_t i = 0; i < start.points.size(); ++i) {
      now.points.push_back(between(start.points[i], end.points[i]));
    }
    for (std::size_t i = 0; i < start.radii.size(); ++i) {
      now.radii.push_back(between(start.radii[i], end.radii[i]));
    }
    return now;
  }
};

using Pair = std::pair<std::int32_t, std::int32_t>;

inline FiberTreeOptions capsules(int ignored = 1, double margin = 0) {
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = ignored;
  options.margin = margin;
  return options;
}

template <typename S>
FiberTree treeOf(const Motion<S>& motion, const FiberTreeOptions& options) {
  FiberTree tree(options);
  tree.build(motion.viewOf(motion.end));
  tree.update(motion.viewOf(motion.start), motion.viewOf(motion.end));
  return tree;
}

inline std::map<Pair, Impact> impactsOf(const FiberTree& tree) {
  std::map<Pair, Impact> impacts;
  tree.visit(Impacts{}, [&](const Impact& impact) {
    EXPECT_LT(impact.pair.a, impact.pair.b);
    EXPECT_TRUE(impacts.emplace(Pair{impact.pair.a, impact.pair.b}, impact).second)
        << "a pair came twice";
  });
  return impacts;
}

using MeshPairs = std::map<Pair, double>;

template <typename S>
MeshPairs impactsOf(const FiberTree& tree, const TriangleMesh& start, const TriangleMesh& end,
                    const Motion<S>& motion) {
  MeshPairs impacts;
  tree.visit(Impacts{}, MeshStep{start, end}, [&](const MeshImpact& impact) {
    EXPECT_TRUE(
        impacts.emplace(Pair{impact.pair.segment, impact.pair.triangle}, impact.time).second)
        << "a pair came twice";
    const MeshContact contact =
        impactContact(motion.start.view(), motion.end.view(), MeshStep{start, end}, impact);
    EXPECT_LE(contact.distance, tree.options().margin + kTolerance);
    // In a solid the distance is a depth, and a segment may meet a surface from inside.
    if (impact.time > 0 && !contact.solid) {
      EXPECT_GE(contact.distance, tree.options().margin - kTolerance) << "too late";
    }
  });
  return impacts;
}

}  // namespace fcl_fibers::test
