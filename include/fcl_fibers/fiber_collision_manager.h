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

/// The base of both fiber managers: FCL's broad-phase interface over fibers of capsules.
///
/// Objects are borrowed, never owned. Capsules (`fcl::Capsule`), cylinders and boxes form the
/// fibers; objects of any shape may be registered beside them. Objects count by pose and shape: a
/// capsule or sphere as such, any other by the least box around it. So `computeAABB` is not needed.
/// If the program has made an object's box larger, the difference is a margin of that object, see
/// Bounds.
///
/// Never pass one of these managers to one of FCL's: `fcls.collide(&ours, ...)` and
/// `fcls.distance(&ours, ...)` are undefined behaviour, because FCL's managers cast the other
/// manager to their own class without a check. `ours.collide(&fcls, ...)` works.
///
/// `setup` and `update` read the managed objects, and queries find them where they were read last.
/// There are two exceptions. The first query after registering or unregistering does the work of
/// `setup`. A query with another fiber manager reads that manager's objects again if it has
/// Report::kVolumes, and other volumes, topology or report than this one.
///
/// Queries are const and may run from several threads at once. While a query runs, for instance in
/// its callback, registering, unregistering, updating and clearing are refused.
///
/// Every pair is reported once, and no object with itself. The callback's first argument is the
/// object registered first in self-queries, the managed object in queries of one object, and this
/// manager's object in queries with another manager. The order of pairs depends on the objects,
/// their poses and the calls before, because objects registered since the tree was built are
/// searched apart. It never depends on addresses. A callback that returns true ends the query at
/// once.
///
/// A call that cannot be answered throws `std::invalid_argument`, whose text names the call, the
/// object and the remedy, and changes nothing. The exception is an `update` that throws: it leaves
/// all objects registered, but queries are refused until an update or setup() succeeds. The same
/// holds for `std::bad_alloc`. Objects of a manager of another class are read one by one, so a
/// broken one may be refused after the first pairs.
template <typename S>
class FCL_FIBERS_EXPORT FiberCollisionManager : public fcl::BroadPhaseCollisionManager<S> {
 public:
  using Object = fcl::CollisionObject<S>;  ///< an object that it manages

  FiberCollisionManager(const FiberCollisionManager&) = delete;
  FiberCollisionManager& operator=(const FiberCollisionManager&) = delete;
  ~FiberCollisionManager() override;

  /// Registers one fiber: capsules, cylinders or boxes in their order along it. Consecutive ones
  /// are neighbours, see FiberOptions::ignored_neighbors. Each counts as long as it is along its z
  /// axis, `lz` or `side[2]`, see FiberOptions::ignored_arc_length. Segments of one group are not
  /// paired with one another, not even within one fiber. Each manager has group numbers of its own.
  /// An empty fiber registers nothing.
  ///
  /// Throws std::invalid_argument, and registers nothing, if an object is null, of another shape or
  /// already registered; if its pose or a size of it is not one that can be read; or while a query
  /// runs.
  void registerFiber(const std::vector<Object*>& fiber, FiberEnds ends = FiberEnds::kOpen,
                     FiberGroup group = {});

  /// Registers objects of any kind. Consecutive capsules that share an end point, to 4 ulp of the
  /// largest coordinate, are taken for a fiber. It shapes the tree and has a number, but no pair of
  /// it is ignored. Throws std::invalid_argument as registerFiber() does, except for the shape.
  ///@{
  void registerObjects(const std::vector<Object*>& objects) override;
  void registerObject(Object* object) override;
  ///@}

  /// Unregisters an object. The fiber and segment numbers of all others stay as they are. Throws
  /// std::invalid_argument, and changes nothing, if the object is not registered, or while a query
  /// runs.
  void unregisterObject(Object* object) override;

  /// Brings the tree up to date:
  /// * It reads all objects and builds the tree if there is none, if many objects were registered
  ///   or unregistered since it was built, or if the last update failed.
  /// * It reads all objects of a new clone and refits the tree.
  /// * It reads the objects registered since the tree was built if they are few and some of them
  ///   are unread.
  /// * Otherwise it does nothing.
  ///
  /// Throws std::invalid_argument if an object cannot be read.
  void setup() override;

  /// Reads all objects, or those given, after they have moved or changed their shape. Given objects
  /// that are not registered are passed over. All objects are read if more than a quarter of them
  /// are given, and if so many have been updated that it pays to bundle the fibers anew.
  ///
  /// Throws std::invalid_argument if a given object is null, and nothing changes; or if an object
  /// has become invalid, after which queries are refused until update() or setup() succeeds.
  ///@{
  void update() override;
  void update(Object* object) override;
  void update(const std::vector<Object*>& objects) override;
  ///@}

  /// Unregisters all objects, which may have been destroyed by now.
  void clear() override;

  /// Replaces the content of `objects` by the managed objects in registration order.
  void getObjects(std::vector<Object*>& objects) const override;

  /// Calls `callback(a, b, cdata)` for each pair that FiberManagerOptions asks for: of `object`,
  /// registered or not, with the managed objects; of the managed objects; or of these with those of
  /// `other`, a manager of any class. Throws std::invalid_argument if the object, manager or
  /// callback is null, or if an object cannot be read.
  ///@{
  void collide(Object* object, void* cdata, fcl::CollisionCallBack<S> callback) const override;
  void collide(void* cdata, fcl::CollisionCallBack<S> callback) const override;
  void collide(fcl::BroadPhaseCollisionManager<S>* other, void* cdata,
               fcl::CollisionCallBack<S> callback) const override;
  ///@}

  /// Calls `callback(a, b, cdata, dist)`, which may lower `dist`, for each such pair whose volumes
  /// are nearer than `dist`. At first `dist` is the largest number of S. FiberOptions::margin does
  /// not matter. Pairs whose capsules are at least `dist` apart are skipped too: all of them under
  /// Report::kCapsules. Under Report::kVolumes most of them are, where that saves time, and objects
  /// that have moved since the last update are measured where they are now. Ignored neighbours and
  /// pairs of one group are left out. Throws as collide() does.
  ///@{
  void distance(Object* object, void* cdata, fcl::DistanceCallBack<S> callback) const override;
  void distance(void* cdata, fcl::DistanceCallBack<S> callback) const override;
  void distance(fcl::BroadPhaseCollisionManager<S>* other, void* cdata,
                fcl::DistanceCallBack<S> callback) const override;
  ///@}

  bool empty() const override;        ///< whether no object is registered
  std::size_t size() const override;  ///< number of registered objects

  const FiberManagerOptions& options() const;  ///< the options given at construction

  bool isRegistered(const Object* object) const;  ///< whether it is managed; false for null

  /// The fiber and segment number of a managed object. Throws std::invalid_argument if the object
  /// is not registered.
  FiberSegment fiberSegment(const Object* object) const;

  /// Whether an update() would change an answer, because an object has moved or changed its shape;
  /// for an assertion before a query. It reads objects on this thread up to the first that has
  /// moved. If none has, it costs about as much as an update() on one thread. It is true after a
  /// failed update() and false if the next query reads all objects anyway.
  bool movedSinceUpdate() const;

  /// The margin of an object under Bounds::kShapesAndMargins, in the scene's unit of length: the
  /// most that the program has added to its box on a side. It is 0 under other bounds. Throws
  /// std::invalid_argument if the object is null or cannot be read.
  double margin(const Object* object) const;

  /// Bytes that this manager holds, including what a query on several threads keeps for the next
  /// one, excluding the objects.
  std::size_t memoryUsage() const;

  /// @cond for the managers of this library only
 protected:
  enum class Hierarchy { kLayeredBoxes, kWrappedSpheres };
  FiberCollisionManager(Hierarchy hierarchy, const FiberManagerOptions& options);
  FiberCollisionManager(FiberCollisionManager&& other) noexcept;
  FiberCollisionManager& operator=(FiberCollisionManager&& other) noexcept;
  /// See clone() of the subclasses.
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
