// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <fcl_fibers/fiber_options.h>

namespace fcl_fibers {

/// What an object of a manager counts by in the broad phase: its shape, its box or both.
enum class Bounds {
  /// Its pose and shape. The manager never reads `getAABB()`. This is the fastest, and enough for a
  /// program that does not enlarge boxes.
  kShapes,
  /// Its pose and shape, and a margin: what the program has added to FCL's own box of the shape. A
  /// program adds this to ask for a contact distance. A box that contains the shape, but adds more
  /// on some sides than on others, counts as well. Under Report::kCapsules another object then has
  /// to meet both the box and the shape, and the shape has the most that the box adds on any side
  /// as its margin. `computeAABB()` is not needed. FCL's larger boxes of turned objects add
  /// nothing. An outdated box still tells how much the program has enlarged it; its place is
  /// ignored. docs/contract.md has the whole rule.
  kShapesAndMargins,
  /// Its `getAABB()` alone, even for capsules, as in FCL's managers. So Report::kCapsules tests no
  /// capsule, triangle or shape then, and no solid counts. This is for a program that makes boxes
  /// smaller. It has to call `computeAABB()` to keep them up to date.
  kObjects,
};

/// What an object that is no fiber is to the fibers around it.
///
///     manager.registerObstacle(&head, ObstacleOptions{/*solid=*/true});
struct ObstacleOptions {
  /// Whether the inside of a mesh counts. This needs Report::kCapsules and bounds other than
  /// Bounds::kObjects. If it does not count, a capsule wholly inside does not touch it. The mesh
  /// has to be watertight: each edge of a triangle is that of exactly one other triangle, which
  /// runs through it in the opposite direction. The triangles are counterclockwise seen from
  /// outside. Boxes, spheres, half-spaces and other shapes are solid in any case.
  bool solid = false;
  /// Bits. A fiber and the obstacle meet only if each has a category that the other one meets:
  /// (fiber.categories & obstacle.meets) != 0 && (obstacle.categories & fiber.meets) != 0.
  std::uint32_t categories = ~std::uint32_t{0};
  std::uint32_t meets = ~std::uint32_t{0};  ///< bits: the categories of fibers that it meets
  /// Whether the points and triangles of a mesh stay the same in its `fcl::BVHModel`. Then no query
  /// under Report::kCapsules compares them with those that were read before, which takes some tens
  /// of nanoseconds for each kilobyte of them. The object may move, and it may get another model.
  /// If the points change all the same, the pairs are those of the points that were read first.
  bool rigid = false;
};

/// Which obstacles a fiber meets. An obstacle is an object that was registered by registerObstacle,
/// registerObject or registerObjects, or an object that is in no fiber manager of the query. Only
/// registerObstacle() takes categories; all other obstacles have all categories. An object does not
/// know the rules that another manager has for it. So `a.collide(&fiber_of_b, ...)` takes the
/// object for an obstacle of all categories that is not solid. `a.collide(&b, ...)` takes each
/// object for what it is in b.
///
///     FiberObstacles in_scalp;
///     in_scalp.root_length = 0.01;  // the first centimetre is under the skin
struct FiberObstacles {
  std::uint32_t meets = ~std::uint32_t{0};  ///< bits; see ObstacleOptions::categories

  /// How many of the first segments meet no obstacle. Not negative.
  int root_segments = 0;
  /// Segments that begin at less than this length from the start of the fiber meet no obstacle,
  /// either. The length is measured when the fiber is registered. Finite, not negative.
  double root_length = 0;
  std::uint32_t categories = ~std::uint32_t{0};  ///< bits; see ObstacleOptions::categories
};

/// Options of a fiber manager. The manager's constructor throws std::invalid_argument if one of
/// them is out of its range or needs another one that is not given. `collide` and `distance` both
/// leave out neighbours and pairs of one group. Neighbours are segments of fibers that were
/// registered by registerFiber(): of one fiber, or of fibers that are joined.
///
///     FiberManagerOptions options;
///     options.ignored_neighbors = 1;  // adjacent segments always touch
///     LayeredAABBTreeCollisionManagerd manager(options);
struct FiberManagerOptions : FiberOptions {
  Bounds bounds = Bounds::kShapesAndMargins;  ///< what an object counts by

  /// Whether the manager may have steps, which FiberCollisionManager::beginStep() begins. During
  /// one `collide` reports the pairs that touch at any time of it, not only at its end; see
  /// "Motion" in FiberCollisionManager. This needs Report::kCapsules and layered boxes.
  bool motion = false;

  /// update() lists the pairs that touch or are at most this far from touching, in the scene's unit
  /// of length. Finite. If it is negative, the library chooses it. At 0, the default, there is no
  /// list. A skin needs Report::kCapsules, layered boxes, and no motion.
  ///
  /// The list is for a solver, in whose steps objects move little. With a list, update() without
  /// arguments tests only the pairs that were near, and searches only where others may have come
  /// near. Until the next change, `collide` of the manager with itself hands on the listed pairs
  /// that touch. It searches only for pairs of what the list cannot hold: meshes whose triangles
  /// count, planes and half-spaces. After any other change, `collide` searches without the list
  /// until the next update() without arguments. The pairs are the same as without a list, in
  /// another order.
  ///
  /// FiberCollisionManager::begunPairs() and endedPairs() tell which pairs began and ended to
  /// touch. If objects were registered or unregistered, the next update() builds the tree, which
  /// takes as long as several updates.
  double skin = 0;
};

}  // namespace fcl_fibers
