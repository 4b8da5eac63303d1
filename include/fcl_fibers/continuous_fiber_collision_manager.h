// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <fcl/broadphase/broadphase_continuous_collision_manager.h>

#include <fcl_fibers/eigen_alignment.h>
#include <fcl_fibers/export.h>
#include <fcl_fibers/fiber_collision_manager.h>
#include <fcl_fibers/fiber_options.h>

namespace fcl_fibers {

/// Finds the pairs of moving objects that may touch at some time in a step. It has FCL's interface
/// of continuous broad phases, of which FCL itself has no class.
///
///     ContinuousFiberCollisionManagerd manager(options);
///     manager.registerFiber(fiber);      // pointers to continuous objects, in their order
///     manager.collide(&data, callback);  // calls callback(a, b, &data) for each pair
///
/// **Queries.** FCL's pure virtual queries take callbacks of `fcl::CollisionObject`, which an
/// `fcl::ContinuousCollisionObject` is not. So these throw, and there are overloads that take
/// `fcl::ContinuousCollisionCallBack` and `fcl::ContinuousDistanceCallBack`.
///
/// **Motion.** The step lasts from time 0 to time 1 of each motion. An object counts by a box at
/// the start and a box at the end: at every time the box between them contains the object where
/// `integrate()` puts it. Two objects are a pair if their boxes overlap at one time, and not if one
/// has left when the other arrives. Under Report::kCapsules two capsules or spheres that only move
/// along lines are a pair if they touch at some time. `fcl::TranslationMotion`, `InterpMotion`,
/// `ScrewMotion` and `SplineMotion` are bounded by their parameters; a motion of any other class by
/// its `getTaylorModel()`, which has to be valid from time 0 to 1. Objects and motions are never
/// changed, and `computeAABB` is not needed: FCL's is wrong for translations and splines. A motion
/// may be made of matrices that deviate from rotations as FiberCollisionManager allows.
///
/// A mesh, an octree, a plane or a half-space counts by the local box of its shape, so call
/// `computeLocalAABB()` of such a shape.
///
/// **Changes.** A manager borrows its objects. It reads their shapes and motions in setup(), in
/// update(), and in the first query after objects were registered, which builds the tree anew. So
/// registering objects one by one costs little, unless there is a query after each. FCL's object
/// keeps its motion for life. To start a new step, assign to the motion that `getMotion()` returns,
/// and call update().
///
/// **Threads.** Queries are const and may run from several threads at once. While a query runs, for
/// instance in its callback, the manager refuses to register, unregister, update or clear. With
/// FiberOptions::threads above 1 the motions of several objects are read at the same time.
///
/// **Pairs.** A query reports every pair once, and never an object with itself. The callback's
/// first argument is the object registered first in a self-query, the managed object in a query
/// with one object, and this manager's object in a query with another manager. A callback that
/// returns true ends the query at once. The order of the pairs depends on the objects, their
/// motions and the earlier calls, but never on addresses or threads.
///
/// **Errors.** A call that cannot be answered throws `std::invalid_argument` and changes nothing.
/// The text names the call, the object and the remedy. There is one exception: after an `update`
/// that throws, all objects stay registered, but queries throw until update() or setup() succeeds.
template <typename S>
class FCL_FIBERS_EXPORT ContinuousFiberCollisionManager
    : public fcl::BroadPhaseContinuousCollisionManager<S> {
 public:
  using Object = fcl::ContinuousCollisionObject<S>;           ///< an object of the manager
  using Base = fcl::BroadPhaseContinuousCollisionManager<S>;  ///< FCL's interface

  /// Makes an empty manager. Throws std::invalid_argument if an option is out of range, and
  /// std::runtime_error if FCL's objects have another layout than the library was compiled for.
  explicit ContinuousFiberCollisionManager(const FiberOptions& options = {});
  ~ContinuousFiberCollisionManager() override;
  ContinuousFiberCollisionManager(const ContinuousFiberCollisionManager&) = delete;
  ContinuousFiberCollisionManager& operator=(const ContinuousFiberCollisionManager&) = delete;

  /// Registers one fiber: capsules, cylinders or boxes in their order along it. See
  /// FiberCollisionManager::registerFiber() for neighbours, lengths and groups.
  ///
  /// Throws std::invalid_argument and registers nothing if an object is null, has no shape or no
  /// motion, has another shape, is already registered or cannot be read, or while a query runs.
  void registerFiber(const std::vector<Object*>& fiber, FiberEnds ends = FiberEnds::kOpen,
                     FiberGroup group = {});

  /// Registers objects of any shape, each by itself. Throws std::invalid_argument as
  /// registerFiber() does.
  ///@{
  void registerObjects(const std::vector<Object*>& objects) override;
  void registerObject(Object* object) override;
  ///@}

  /// Unregisters an object. Throws std::invalid_argument and changes nothing if the object is not
  /// registered, or while a query runs.
  void unregisterObject(Object* object) override;

  /// Reads all objects and builds the tree, if objects came or went since it was built or the last
  /// update failed. Throws std::invalid_argument if an object cannot be read.
  void setup() override;

  /// Reads all objects, or the given ones, after their motions or shapes have changed. Given
  /// objects that are not registered are ignored.
  ///
  /// Throws std::invalid_argument and changes nothing if a given object is null. It also throws
  /// std::invalid_argument if an object has become invalid; queries then throw until update() or
  /// setup() succeeds.
  ///@{
  void update() override;
  void update(Object* object) override;
  void update(const std::vector<Object*>& objects) override;
  ///@}

  /// Unregisters all objects. They may already have been destroyed.
  void clear() override;

  /// Replaces the content of `objects` by the managed objects, in the order of registration.
  void getObjects(std::vector<Object*>& objects) const override;

  /// Calls `callback(a, b, cdata)` for each pair whose boxes overlap at some time in the step, or
  /// whose capsules touch, if FiberOptions::report says so, within FiberOptions::margin. The first
  /// form reports pairs of `object`, registered or not, with the managed objects. The second one
  /// reports pairs of the managed objects. The third one reports pairs of these with the objects of
  /// `other`, a manager of any class. They throw std::invalid_argument if the object, manager or
  /// callback is null, or if an object cannot be read.
  ///@{
  void collide(Object* object, void* cdata, fcl::ContinuousCollisionCallBack<S> callback) const;
  void collide(void* cdata, fcl::ContinuousCollisionCallBack<S> callback) const;
  void collide(Base* other, void* cdata, fcl::ContinuousCollisionCallBack<S> callback) const;
  ///@}

  /// Calls `callback(a, b, cdata, dist)` for each pair that may come nearer than `dist` at some
  /// time in the step: their boxes do, at one time. Pairs whose boxes come that near on every axis
  /// but are farther apart may be passed as well. Under Report::kCapsules, a capsule or sphere that
  /// rests counts by itself instead of its box. The three forms are those of collide(). The
  /// callback may lower `dist`, which starts as the largest number of S. FiberOptions::margin has
  /// no effect here. Throws as collide() does.
  ///@{
  void distance(Object* object, void* cdata, fcl::ContinuousDistanceCallBack<S> callback) const;
  void distance(void* cdata, fcl::ContinuousDistanceCallBack<S> callback) const;
  void distance(Base* other, void* cdata, fcl::ContinuousDistanceCallBack<S> callback) const;
  ///@}

  /// These throw std::invalid_argument, because their callbacks take `fcl::CollisionObject`.
  ///@{
  void collide(Object* object, void* cdata, fcl::CollisionCallBack<S> callback) const override;
  void collide(void* cdata, fcl::CollisionCallBack<S> callback) const override;
  void collide(Base* other, void* cdata, fcl::CollisionCallBack<S> callback) const override;
  void distance(Object* object, void* cdata, fcl::DistanceCallBack<S> callback) const override;
  void distance(void* cdata, fcl::DistanceCallBack<S> callback) const override;
  void distance(Base* other, void* cdata, fcl::DistanceCallBack<S> callback) const override;
  ///@}

  bool empty() const override;        ///< whether no object is registered
  std::size_t size() const override;  ///< number of registered objects

  const FiberOptions& options() const;  ///< the options given at construction

  bool isRegistered(const Object* object) const;  ///< false for null

  /// Returns the fiber and segment number of a managed object. Throws std::invalid_argument if the
  /// object is not registered.
  FiberSegment fiberSegment(const Object* object) const;

  /// Finds when two objects touch first in the step, within FiberOptions::margin. `a` is managed
  /// here. `b` is managed here or by `other`, which may be null, and otherwise moves by its motion.
  /// Managed objects count as they were last read. It returns false if the two do not touch.
  ///
  /// Of two capsules or spheres that only move along lines, the time is that of the first touch, up
  /// to rounding, and the contact is exact, whatever FiberOptions::report is. For any other pair
  /// the time is when their boxes meet, which may be too early: a bound from which to look on. The
  /// time is never too late.
  ///
  ///     TimedContact contact;  // in the callback
  ///     if (manager.findImpact(a, b, nullptr, contact)) first = std::min(first, contact.time);
  ///
  /// Throws std::invalid_argument if `a` is null or not registered, or if `b` is null or cannot be
  /// read.
  bool findImpact(const Object* a, const Object* b, const ContinuousFiberCollisionManager* other,
                  TimedContact& contact) const;

  /// Returns the bytes that this manager holds, without the objects and their motions.
  std::size_t memoryUsage() const;

 private:
  class FCL_FIBERS_NO_EXPORT Impl;
  std::unique_ptr<Impl> impl_;
};

/// The manager for objects whose numbers are floats.
using ContinuousFiberCollisionManagerf = ContinuousFiberCollisionManager<float>;
/// The manager for objects whose numbers are doubles.
using ContinuousFiberCollisionManagerd = ContinuousFiberCollisionManager<double>;

extern template class ContinuousFiberCollisionManager<float>;
extern template class ContinuousFiberCollisionManager<double>;

}  // namespace fcl_fibers
