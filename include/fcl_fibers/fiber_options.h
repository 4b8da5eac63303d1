// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include <fcl_fibers/tree_export.h>

/// Collision detection among fibers of capsules.
namespace fcl_fibers {

/// Stands for the fiber number of what is in no manager or tree.
inline constexpr std::size_t kNoFiber = ~std::size_t{0};

/// The place of a segment: its fiber, and its number along that fiber. Both count from 0. Fibers
/// are numbered in the order in which they were given. An object of a manager that is outside any
/// fiber counts as a fiber of one segment. What is in no manager or tree has no place; both numbers
/// are kNoFiber.
struct FiberSegment {
  std::size_t fiber = kNoFiber;   ///< among all fibers
  std::size_t number = kNoFiber;  ///< along that fiber
};

/// Whether a fiber has two ends or is a ring, in which the last segment is a neighbour of the
/// first.
enum class FiberEnds {
  kOpen,    ///< it has two ends
  kClosed,  ///< its last segment leads back to its first
};

/// A point where a new fiber meets one that registerFiber() has registered before, or itself. An
/// example is the first point of a branch of a neuron or a vessel. Neighbours also count across
/// such a point; see FiberOptions::ignored_neighbors. You may name any of the segments that begin
/// or end at the point. The fibers stay joined until one of them has no object left. The points of
/// the two fibers may differ a little, unlike those of FiberArrays::starts_at, because each object
/// moves on its own, and its ends are rounded.
///
///     manager.registerFiber(trunk);
///     manager.registerFiber(branch, FiberEnds::kOpen, {}, {}, {{0, trunk[7]}});
template <typename Object>
struct FiberJoint {
  /// Which point of the new fiber, from 0 to its number of segments: 0 is where its first segment
  /// begins, and its number of segments is where the last one ends.
  std::size_t point = 0;
  const Object* segment = nullptr;  ///< a segment of another fiber, or of the new one
  bool at_end = false;  ///< whether that segment ends at the point; if not, it begins there
};

/// The group of a fiber, such as the cables of one harness. Fibers of one group are never paired
/// with one another, nor are two segments of one such fiber. A query does not search for pairs
/// within a part of the tree that belongs to one group, which saves time. Each manager or tree has
/// numbers of its own.
///
///     manager.registerFiber(cable, FiberEnds::kOpen, FiberGroup{1});
struct FiberGroup {
  std::int32_t number = 0;  ///< 0 means no group
};

/// The shape of the tree over the segments. It decides how fast queries are, never which pairs they
/// report.
enum class Topology {
  /// A node holds a set of fibers over a range along them, and has up to eight children. It is fast
  /// in whatever order the fibers are registered.
  kBundle,
  /// The tree of Sobottka, Varnik and Weber, Collision Detection in Densely Packed Fiber Assemblies
  /// with Application to Hair Modeling, 2005, section 3.2. It is a balanced binary tree over the
  /// fibers in the order of registration, alternately root to tip and tip to root.
  kSuperThread,
};

/// What makes two segments a pair that a query reports: their volumes overlap, or they touch.
enum class Report {
  /// Their volumes overlap: tight boxes around the shapes, or spheres around the segments. On tight
  /// boxes FCL's broad phase reports the same pairs as the box tree, except for a few more of ours,
  /// because bounds are rounded outward. Some of these pairs do not touch.
  kVolumes,
  /// They touch: the axes of two capsules are no further apart than the sum of their radii and the
  /// margin. A sphere is a capsule of length zero. A capsule and a mesh of triangles touch if one
  /// of the triangles is within that distance of the axis; a capsule wholly inside a mesh does not
  /// touch it unless the mesh is solid. A capsule also touches a box, plane, half-space, triangle
  /// or convex polytope that is within that distance of the axis. Any other shape counts by a box
  /// that turns with it. Two objects that are neither capsules nor spheres count by their boxes.
  kCapsules,
};

/// The options that managers and trees have in common. A manager or tree throws
/// std::invalid_argument if it is constructed with an option out of the range given here. The
/// defaults here are those of managers; FiberTreeOptions has its own.
///
///     FiberManagerOptions options;         // FiberTreeOptions has the next two by default
///     options.report = Report::kCapsules;  // only segments that touch
///     options.ignored_neighbors = 1;       // neighbours share a point, so they always touch
struct FiberOptions {
  Topology topology = Topology::kBundle;  ///< shape of the tree
  Report report = Report::kVolumes;       ///< which pairs a query reports

  /// A query leaves out two segments of one fiber whose numbers differ by at most this. 0 leaves
  /// out none. 1 leaves out adjacent segments, which always touch. Not negative. Where a fiber
  /// starts or ends at a point of another one, the segments count along both, by the shortest way:
  /// all that share a point are adjacent.
  int ignored_neighbors = 0;

  /// A query also leaves out two segments of one fiber, or of fibers that are joined, with at most
  /// this length of fiber between them, in the scene's unit. The length is measured when the fiber
  /// is registered or the tree is built. This option suits fibers of unequal segments. 0 leaves out
  /// none. Finite, not negative.
  double ignored_arc_length = 0;

  /// Segments that are at most this far apart count as touching, in the scene's unit. Finite, not
  /// negative.
  double margin = 0;

  /// Number of threads that share the work of a build, a registration, an update, a self-collision,
  /// and a collision with another manager, tree or mesh of this library. The calling thread is one
  /// of them, and only it runs callbacks and visitors. At least 1. Pairs and their order are the
  /// same for every number. docs/options.md lists what runs on one thread.
  int threads = 1;
};

}  // namespace fcl_fibers
