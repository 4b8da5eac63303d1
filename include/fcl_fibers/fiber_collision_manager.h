// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/eigen_alignment.h>
#include <fcl_fibers/export.h>
#include <fcl_fibers/fiber_manager_options.h>

namespace fcl_fibers {

/// The first touch of two objects in a step; see FiberCollisionManager::findImpact(). The contact
/// describes the objects at `time`. An object's own margin, see Bounds, is part of its radius here.
struct TimedContact : Contact {
  double time = 0;  ///< in [0, 1]; 0 if they touch at the start
  /// Whether `time` is when the shapes touch. It is for two capsules or spheres, and for one of
  /// them and a mesh whose triangles count. Otherwise `time` is when the boxes around the objects
  /// meet, which may be too early, and only `a`, `b`, `triangle` and `time` are set.
  bool is_exact = false;
  /// If one object is a mesh whose triangles count: the triangle that is touched first; of several
  /// at that time, the one with the least index. Otherwise -1. The arc parameter of the mesh is 0.
  std::int32_t triangle = -1;
};

/// Two objects that touch, and the slot that their pair has as long as they do; see
/// FiberCollisionManager::findLivePairs(). `a` was registered first.
template <typename S>
struct LiveObjectPair {
  fcl::CollisionObject<S>* a;  ///< one object
  fcl::CollisionObject<S>* b;  ///< the other one
  std::int32_t slot;           ///< below FiberCollisionManager::liveSlotCount()
};

/// Finds the pairs of objects that touch, or whose volumes overlap (see Report), among thousands of
/// fibers. It has FCL's broad-phase interface. This is the base of both fiber managers; start with
/// LayeredAABBTreeCollisionManager.
///
///     LayeredAABBTreeCollisionManagerd manager(options);
///     manager.registerFiber(fiber);      // pointers to capsules, in their order along the fiber
///     manager.collide(&data, callback);  // calls callback(a, b, &data) for each pair
///
/// **Objects.** The manager borrows its objects and never owns them. Capsules (`fcl::Capsule`),
/// cylinders and boxes form fibers; objects of any shape may be registered beside them. A capsule
/// or a sphere counts by its pose and shape. Any other object counts by the least box around its
/// shape. So `computeAABB` is not needed. The linear part R of a pose may have drifted from a
/// rotation: an object counts by the image of its shape under R as it is. The ends of a capsule's
/// axis are its position plus and minus half its length times the third column, and its thickness
/// stays. A pose is refused if an entry of R^T R - I is larger than 1e-3, or if R reflects. Under
/// Report::kCapsules a capsule and an `fcl::BVHModel` of triangles are a pair only if the capsule
/// touches a triangle, and a capsule and another shape only if they may touch; see Report. If the
/// program has made an object's box larger, the difference is a margin of that object; see Bounds.
///
/// **FCL's managers.** Never pass one of these managers to one of FCL's. `fcls.collide(&ours, ...)`
/// and `fcls.distance(&ours, ...)` are undefined behaviour, because FCL's managers cast the other
/// manager to their own class without a check. `ours.collide(&fcls, ...)` works.
///
/// **Reading.** `setup` and `update` read the objects, and queries find them where they were read
/// last. There are four exceptions:
/// * The first query after objects were registered or unregistered does the work of `setup`.
/// * An object that is passed to `collide` or `distance`, and the objects of a manager that is no
///   fiber manager, count as they are now, even if they are managed here. **Motion** tells when
///   they do not.
/// * Under Report::kVolumes, `distance` measures all objects where they are now.
/// * A query with another fiber manager that has Report::kVolumes reads its objects afresh in two
///   cases. Either the volumes, topology or report of the two managers differ, or the margin of the
///   other manager exceeds both this one's margin and the size of its own scene.
///
/// Under Report::kCapsules an update leaves two things to the first query that needs them: it
/// compares the triangles of a mesh with those that the manager has read, and it reads the shape
/// within a box. A mesh, plane or half-space that has moved since the update counts where it was.
/// Another shape counts as a query has read it since the update, or else by the box around it where
/// it was. If FiberManagerOptions::motion is set, or for a solid mesh, an update leaves nothing to
/// queries.
///
/// **Motion.** If FiberManagerOptions::motion is set, `collide` reports the pairs that touch at any
/// time of a *step*. A step runs from where the objects were read last before beginStep() to where
/// they are read last before the query. So several updates lengthen it, and after an update of some
/// objects the others rest. The next beginStep() begins the next step, and endStep() ends the step
/// without beginning another. Without a step all objects rest. An object that is registered during
/// a step starts where it is first read. A `collide` with another manager sees the steps of both.
///
/// During a step, end points and radii of capsules and spheres move linearly, also those of a
/// capsule that turns. Any other object counts by its box, whose sides move linearly. If such an
/// object does not turn, capsules are tested against its shape itself. That test may report a pair
/// that stays apart by 2^-36 of the sizes and the distance of the two. The points of an
/// `fcl::BVHModel` move linearly, also those of a mesh that turns. If it has other triangles at the
/// end than at the start, it rests where it is at the end. In `collide`, unlike without motion, a
/// managed object counts as it was read, even if it is passed to the call and has moved since. An
/// object that is not managed, and one of a manager without a step, rests. `distance` answers for
/// the end of the step. An update that fails leaves the start as it is, and
/// the next one that succeeds lengthens the same step. clear() ends the step. Unregistering an
/// object takes it out of the step. A clone has no step.
///
/// **Threads.** Queries are const and may run from several threads at once. While a query runs, for
/// instance in its callback, the manager refuses to register, unregister, update or clear. The
/// program must not change an object or its geometry meanwhile, because the query may read it.
///
/// **Pairs.** A query reports every pair once, and never an object with itself. Only in a query
/// with another manager, two objects that are in both managers come twice, as (a, b) and (b, a).
/// The callback's first argument is the object registered first in a self-query, the managed object
/// in a query with one object, and this manager's object in a query with another manager. A
/// callback that returns true ends the query at once. The order of the pairs depends on the
/// objects, their poses and the earlier calls, but never on addresses. It depends on the calls
/// because objects registered after the tree was built are searched apart.
///
/// **Errors.** A call that cannot be answered throws `std::invalid_argument` and changes nothing.
/// The text names the call, the object and the remedy. There is one exception: after an `update`
/// that throws, `std::bad_alloc` included, all objects stay registered, but queries throw until
/// update() or setup() succeeds. If a query reads a manager of another class, it reads that
/// manager's objects one by one, so it may refuse a broken object after it has reported some pairs.
/// The first query after an update that compares the triangles of a mesh may refuse it so, too, if
/// a point of it has become NaN.
template <typename S>
class FCL_FIBERS_EXPORT FiberCollisionManager : public fcl::BroadPhaseCollisionManager<S> {
 public:
  using Object = fcl::CollisionObject<S>;  ///< an object of the manager

  FiberCollisionManager(const FiberCollisionManager&) = delete;
  FiberCollisionManager& operator=(const FiberCollisionManager&) = delete;
  ~FiberCollisionManager() override;

  /// Registers one fiber: capsules, cylinders or boxes in their order along it. Consecutive ones
  /// are neighbours; see FiberOptions::ignored_neighbors. Each is as long as its shape is along its
  /// z axis, which is `lz` or `side[2]`; see FiberOptions::ignored_arc_length. Segments of one
  /// group are never paired with one another, not even those of one fiber; see FiberGroup.
  /// `obstacles` tells which obstacles the fiber meets, and `joints` where it meets other fibers,
  /// so that fibers form trees and loops. An empty fiber registers nothing.
  ///
  /// Throws std::invalid_argument and registers nothing if an object is null, has another shape or
  /// is already registered, if its pose or size cannot be read, if a number of `obstacles` is out
  /// of range, if a joint names a point that the fiber has not, or an object that is no segment of
  /// a registered fiber or of this one, or while a query runs.
  void registerFiber(const std::vector<Object*>& fiber, FiberEnds ends = FiberEnds::kOpen,
                     FiberGroup group = {}, const FiberObstacles& obstacles = {},
                     const std::vector<FiberJoint<Object>>& joints = {});

  /// Registers an object that is no fiber, such as a head or a floor, with options. Throws
  /// std::invalid_argument as registerObject() does. Under either report it also throws if the mesh
  /// is to be solid but is not watertight, or if its triangles are clockwise seen from outside.
  void registerObstacle(Object* object, const ObstacleOptions& options = {});

  /// Registers objects of any kind. Consecutive capsules that share an end point, to 4 ulp of the
  /// largest coordinate, become a fiber. Such a fiber shapes the tree and has a number, but none of
  /// its pairs are left out. Throws std::invalid_argument as registerFiber() does, except that
  /// every shape is accepted.
  ///@{
  void registerObjects(const std::vector<Object*>& objects) override;
  void registerObject(Object* object) override;
  ///@}

  /// Unregisters an object. All others keep their fiber and segment numbers. Once a fiber has no
  /// objects left, no other fiber starts or ends at it. Throws std::invalid_argument and changes
  /// nothing if the object is not registered, or while a query runs.
  void unregisterObject(Object* object) override;

  /// Brings the tree up to date. The first query after objects were registered or unregistered does
  /// this by itself.
  /// * The call reads all objects and builds the tree if there is none, if many objects were
  ///   registered or unregistered since it was built, or if the last update failed.
  /// * In a new clone it reads all objects and refits the tree.
  /// * If a few objects were registered since the tree was built and some are unread, it reads
  ///   these few.
  /// * Otherwise it does nothing.
  ///
  /// Throws std::invalid_argument if an object cannot be read.
  void setup() override;

  /// Reads all objects, or the given ones, after they have moved or changed their shape. Given
  /// objects that are not registered are ignored. The call reads all objects if more than a quarter
  /// of them are given, or if so many have been updated that it pays to rebuild the tree.
  ///
  /// Throws std::invalid_argument and changes nothing if a given object is null. It also throws
  /// std::invalid_argument if an object has become invalid; queries then throw until update() or
  /// setup() succeeds.
  ///@{
  void update() override;
  void update(Object* object) override;
  void update(const std::vector<Object*>& objects) override;
  ///@}

  /// Begins a step, at the objects as they were read last, or ends it. See **Motion** above.
  /// Call beginStep() before objects move: it does the work of setup() first, which reads all
  /// objects if many have come or gone. It may be called again, which begins the next step.
  /// endStep() without a step does nothing.
  ///
  /// Both throw std::invalid_argument and change nothing if FiberManagerOptions::motion is not set,
  /// and while a query runs. beginStep() also throws it if an object cannot be read.
  ///@{
  void beginStep();
  void endStep();
  ///@}

  /// Unregisters all objects. They may already have been destroyed. Throws std::invalid_argument
  /// and changes nothing while a query runs.
  void clear() override;

  /// Replaces the content of `objects` by the managed objects, in the order of registration.
  void getObjects(std::vector<Object*>& objects) const override;

  /// Calls `callback(a, b, cdata)` for each pair that FiberManagerOptions asks for. The first form
  /// reports pairs of `object`, registered or not, with the managed objects. The second one reports
  /// pairs of the managed objects. The third one reports pairs of these with the objects of
  /// `other`, a manager of any class.
  ///
  /// An object does not know the rules that another manager has for it. So in the first form, an
  /// object that only another manager has counts as an obstacle of all categories that is not
  /// solid. In the third form, the rules of `other` count for its objects, if it is a fiber
  /// manager.
  ///
  /// All throw std::invalid_argument if the object, manager or callback is null, or if an object
  /// cannot be read.
  ///@{
  void collide(Object* object, void* cdata, fcl::CollisionCallBack<S> callback) const override;
  void collide(void* cdata, fcl::CollisionCallBack<S> callback) const override;
  void collide(fcl::BroadPhaseCollisionManager<S>* other, void* cdata,
               fcl::CollisionCallBack<S> callback) const override;
  ///@}

  /// Calls `callback(a, b, cdata, dist)` for each pair whose volumes are nearer than `dist`. The
  /// three forms are those of collide(). The callback may lower `dist`, which starts as the largest
  /// number of S. FiberOptions::margin has no effect here. A capsule inside a solid mesh is at
  /// distance 0 from it.
  ///
  /// Pairs of capsules that are at least `dist` apart are skipped even if their volumes are nearer.
  /// Under Report::kCapsules all such pairs are skipped; under Report::kVolumes most are, where
  /// that saves time. Under Report::kVolumes, objects that have moved since the last update are
  /// measured where they are now. Ignored neighbours and pairs of one group are left out. Throws as
  /// collide() does.
  ///@{
  void distance(Object* object, void* cdata, fcl::DistanceCallBack<S> callback) const override;
  void distance(void* cdata, fcl::DistanceCallBack<S> callback) const override;
  void distance(fcl::BroadPhaseCollisionManager<S>* other, void* cdata,
                fcl::DistanceCallBack<S> callback) const override;
  ///@}

  /// The pairs that live. A pair of two objects of the manager lives while the two touch, within
  /// the margin, at each of consecutive updates, whether a query asks about it or not. Only an
  /// update() without arguments finds these pairs anew. The functions below tell what the last such
  /// update has found, also after other calls. A pair has a slot, a small number for arrays of a
  /// program's own, such as friction or impulses. The slot is that of another pair only after
  /// endedPairs() has had the pair for one update.
  ///
  /// The objects of these pairs are capsules, spheres, and other objects, which count by their
  /// boxes; see Bounds. Meshes whose triangles count, planes, half-spaces and other unbounded
  /// shapes have no such pairs. If one object or both count by a box, the shapes within may still
  /// be apart.
  ///
  /// Unregistering an object, or clear(), ends its pairs at the next update(). If the object is
  /// registered again, its pairs begin anew. Nothing begins or ends at an update() that fails. A
  /// clone begins without pairs.
  ///
  /// All throw std::invalid_argument if FiberManagerOptions::skin is 0.
  ///@{

  /// Replaces the content of `pairs` by all pairs that live, in an order that depends on the
  /// objects and the earlier calls.
  void findLivePairs(std::vector<LiveObjectPair<S>>& pairs) const;
  /// Returns the pairs that began to live at the last update().
  std::vector<LiveObjectPair<S>> begunPairs() const;
  /// Returns the pairs that ended at the last update(). An object of such a pair may have been
  /// unregistered and destroyed before, so do not read it: its address only tells which one it was.
  std::vector<LiveObjectPair<S>> endedPairs() const;
  /// All slots are from 0 to liveSlotCount() - 1. It never falls.
  std::int32_t liveSlotCount() const;
  ///@}

  bool empty() const override;        ///< whether no object is registered
  std::size_t size() const override;  ///< number of registered objects

  const FiberManagerOptions& options() const;  ///< the options given at construction

  bool isRegistered(const Object* object) const;  ///< whether it is managed; false for null

  /// Returns the fiber and segment number of a managed object. Throws std::invalid_argument if the
  /// object is not registered.
  FiberSegment fiberSegment(const Object* object) const;

  /// Returns whether an update() would change an answer, because an object has moved or changed its
  /// shape, or whether the points of a mesh with ObstacleOptions::rigid have changed. This is for
  /// an assertion before a query. The call reads objects, on the calling thread, up to the first
  /// that has moved. If none has, it costs about as much as an update() on one thread. It returns
  /// true after a failed update(), and false if the next query reads all objects anyway.
  bool movedSinceUpdate() const;

  /// Returns the margin of an object under Bounds::kShapesAndMargins, in the scene's unit of
  /// length: the most that the program has added to its box on one side. Under other bounds it is
  /// 0. Throws std::invalid_argument if the object is null or cannot be read.
  double margin(const Object* object) const;

  /// Replaces the content of `contacts` by those of a capsule or sphere and an `fcl::BVHModel` of
  /// triangles, at their present poses. There is one for each triangle that is no further from the
  /// capsule than `margin` and the two objects' own margins together, in ascending order of
  /// triangles. If there is none, as inside a solid mesh, the contact is that with the nearest
  /// triangle. MeshContact::triangle counts in `tri_indices`.
  ///
  /// The call takes the triangles as this manager read them last, in an update or in a query that
  /// needed them. If the manager has not read them since the last update of the mesh here, or
  /// never, the call reads them now. A mesh is solid if it was registered as such here. The call
  /// returns false, without contacts, if the mesh is a cloud of points.
  ///
  /// Throws std::invalid_argument if an object is null, has another shape or cannot be read, or if
  /// the margin is negative or NaN.
  bool findMeshContacts(const Object* capsule, const Object* mesh, double margin,
                        std::vector<MeshContact>& contacts) const;

  /// Finds when two objects touch first in the step of this manager, within the margin, for a pair
  /// that `collide` has reported. `a` is managed here. `b` may be managed by `other`, which may be
  /// null, or here. If it is managed by both, its step in `other` counts. If it is managed by
  /// neither, it rests where it is now. The objects move as they were read last, as in `collide`.
  /// The time is never too late. The call returns false if the two do not touch in the step.
  ///
  /// Throws std::invalid_argument if FiberManagerOptions::motion is not set, if `a` is null or not
  /// registered, or if `b` is null or cannot be read.
  bool findImpact(const Object* a, const Object* b, const FiberCollisionManager* other,
                  TimedContact& contact) const;

  /// Returns the bytes that this manager holds, without the objects, and including those that a
  /// query on several threads keeps for the next one.
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
  FCL_FIBERS_NO_EXPORT std::shared_ptr<const Impl> impl() const;

 private:
  Hierarchy hierarchy_;
  FiberManagerOptions options_;
  std::unique_ptr<Impl> impl_;  ///< null after a move
  /// @endcond
};

extern template class FiberCollisionManager<float>;
extern template class FiberCollisionManager<double>;

}  // namespace fcl_fibers
