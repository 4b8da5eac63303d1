// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>

#include <fcl_fibers/eigen_alignment.h>
#include <fcl_fibers/export.h>
#include <fcl_fibers/fiber_manager_options.h>

namespace fcl_fibers {

/// What both fiber managers share: FCL's broad-phase interface over fibers of capsules.
///
/// Objects are borrowed, never owned. Capsules (`fcl::Capsule`) form the fibers; any other object
/// is welcome beside them. Objects count by pose and shape, so that `computeAABB` is not needed; a
/// box that the program has made larger is a margin of that object, see Bounds.
///
/// Never hand one of these managers to one of FCL's: `fcls.collide(&ours, ...)` and
/// `fcls.distance(&ours, ...)` are undefined behaviour, as FCL's managers cast the other manager to
/// their own class without a check. `ours.collide(&fcls, ...)` works.
///
/// `setup` and `update` read the objects; queries do not, so objects that move take part in queries
/// where they were at the last of these calls. (Under Report::kVolumes objects are read again for
/// pairs with unbounded objects and for queries of a fiber manager of another kind or report, as
/// segments are not kept then.) A query right after registering or unregistering needs no `setup`:
/// the first one does its work, and reads all objects; or those few that have come, where the
/// others are many and up to date. Queries are const and may run from several threads at once;
/// registering, updating or clearing while a query runs, from its callback for instance, is
/// refused.
///
/// Every pair is reported once, never an object with itself. Self-queries pass the object
/// registered first as the callback's first argument, queries of one object `(managed, object)`,
/// queries of another manager `(this manager's, the other's)`. The order of pairs is a function of
/// the objects and their poses, never of addresses. A callback returning true ends the query at
/// once.
///
/// Whatever cannot be answered is refused with `std::invalid_argument`, whose text names the call,
/// the object and the remedy, and nothing changes, with one exception: an `update` that is refused
/// leaves all objects registered, but queries refuse until an update or setup() succeeds. The same
/// holds where memory runs out (`std::bad_alloc`). Objects of a manager of another class are read
/// one by one, so that a broken one may be refused after first pairs.
template <typename S>
class FCL_FIBERS_EXPORT FiberCollisionManager : public fcl::BroadPhaseCollisionManager<S> {
 public:
  using Object = fcl::CollisionObject<S>;  ///< what it holds

  FiberCollisionManager(const FiberCollisionManager&) = delete;
  FiberCollisionManager& operator=(const FiberCollisionManager&) = delete;
  ~FiberCollisionManager() override;

  /// Registers one fiber: capsules in their order along it. Consecutive capsules are neighbours,
  /// see FiberOptions::ignored_neighbors. An empty fiber is a no-op. Segments of one group
  /// are never reported with one another, those of one fiber with a group among them.
  ///
  /// Throws std::invalid_argument, and registers nothing, if an object is null, no capsule,
  /// registered already, or of a pose, radius or length that is not finite; or while a query runs.
  void registerFiber(const std::vector<Object*>& fiber, FiberEnds ends = FiberEnds::kOpen,
                     FiberGroup group = {});

  /// Registers objects of any kind. Runs of consecutive capsules that share an end point (to 4 ulp
  /// of the largest coordinate) are taken for fibers, for the tree's shape only: no pair of them is
  /// ever ignored. Throws std::invalid_argument as registerFiber() does, except for the shape.
  ///@{
  void registerObjects(const std::vector<Object*>& objects) override;
  void registerObject(Object* object) override;
  ///@}

  /// The fiber and segment numbers of all other objects stay as they are. Throws
  /// std::invalid_argument, and changes nothing, if the object is not registered.
  void unregisterObject(Object* object) override;

  /// Reads the objects and builds the tree, if there is none or many objects were registered or
  /// unregistered since it was built; reads those registered, if they are few; else there is
  /// nothing to do.
  void setup() override;

  /// Reads the objects, or those given, after they have moved or changed their shape. Objects that
  /// are not registered are passed over. Given objects are read alone, except where they are more
  /// than a quarter of all, and where so many have been updated that it pays to bundle the fibers
  /// anew: all are read then. Throws std::invalid_argument if one is null, and nothing changes, or
  /// if one has gone bad, after which queries refuse until update() or setup() succeeds.
  ///@{
  void update() override;
  void update(Object* object) override;
  void update(const std::vector<Object*>& objects) override;
  ///@}

  /// Forgets all objects, which may be gone by now.
  void clear() override;

  /// Replaces the content of `objects` by the managed objects in registration order.
  void getObjects(std::vector<Object*>& objects) const override;

  /// Calls `callback(a, b, cdata)` for each pair that FiberManagerOptions asks for: of one object,
  /// registered or not, with the managed ones; of the managed ones; of these with another
  /// manager's, of any class. Throws std::invalid_argument if object, manager or callback is null,
  /// or an object cannot be read.
  ///@{
  void collide(Object* object, void* cdata, fcl::CollisionCallBack<S> callback) const override;
  void collide(void* cdata, fcl::CollisionCallBack<S> callback) const override;
  void collide(fcl::BroadPhaseCollisionManager<S>* other, void* cdata,
               fcl::CollisionCallBack<S> callback) const override;
  ///@}

  /// Calls `callback(a, b, cdata, dist)`, which may lower `dist`, for each such pair whose volumes
  /// are nearer than `dist`; the first `dist` is the largest number of S. The margin does not
  /// matter; under Report::kCapsules pairs whose capsules are at least `dist` apart are passed
  /// over, too. Neighbours along a fiber are left out. Throws as collide() does.
  ///@{
  void distance(Object* object, void* cdata, fcl::DistanceCallBack<S> callback) const override;
  void distance(void* cdata, fcl::DistanceCallBack<S> callback) const override;
  void distance(fcl::BroadPhaseCollisionManager<S>* other, void* cdata,
                fcl::DistanceCallBack<S> callback) const override;
  ///@}

  bool empty() const override;        ///< whether no object is registered
  std::size_t size() const override;  ///< number of registered objects

  const FiberManagerOptions& options() const;  ///< as at construction

  bool isRegistered(const Object* object) const;  ///< false for null

  /// Fiber and segment number of a managed object. Throws std::invalid_argument if it is not
  /// registered.
  FiberSegment fiberSegment(const Object* object) const;

  /// Whether an object has moved or changed its shape so that an update() would change an answer:
  /// for an assertion before a query. Reads the objects, on this thread, up to the first that has
  /// moved, and costs about as much as an update() on one thread if none has. True after an
  /// update() that failed; false where the next query reads the objects anyway.
  bool movedSinceUpdate() const;

  /// The margin that an object has by itself under Bounds::kShapesAndMargins: what the program has
  /// added to its box, at its largest where that is uneven. 0 for shapes other than capsules and
  /// spheres, which count by their boxes. In the scene's unit of length. Throws
  /// std::invalid_argument if it cannot be read.
  double margin(const Object* object) const;

  /// Bytes that this manager holds, with what a query on several threads keeps for the next one;
  /// the objects apart.
  std::size_t memoryUsage() const;

  /// @cond for the managers of this library only
 protected:
  enum class Hierarchy { kLayeredBoxes, kWrappedSpheres };
  FiberCollisionManager(Hierarchy hierarchy, const FiberManagerOptions& options);
  FiberCollisionManager(FiberCollisionManager&& other) noexcept;
  FiberCollisionManager& operator=(FiberCollisionManager&& other) noexcept;
  /// A clone: see the subclasses.
  FiberCollisionManager(const FiberCollisionManager& original, const std::vector<Object*>& objects);

  class FCL_FIBERS_NO_EXPORT Impl;
  FCL_FIBERS_NO_EXPORT Impl& impl();
  FCL_FIBERS_NO_EXPORT const Impl& impl() const;

 private:
  Hierarchy hierarchy_;
  FiberManagerOptions options_;
  std::unique_ptr<Impl> impl_;  ///< null after a move
  /// @endcond
};

extern template class FiberCollisionManager<float>;
extern template class FiberCollisionManager<double>;

}  // namespace fcl_fibers
