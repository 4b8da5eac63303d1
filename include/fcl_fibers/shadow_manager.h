// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_collision_manager.h>

#include <fcl_fibers/eigen_alignment.h>
#include <fcl_fibers/export.h>
#include <fcl_fibers/fiber_manager_options.h>

namespace fcl_fibers {

/// What a ShadowManager has seen of one of its two managers.
struct ShadowSide {
  std::size_t pairs = 0;  ///< how many pairs its queries handed on
  double seconds = 0;     ///< time in its calls, without the program's callbacks
};

/// What a ShadowManager has seen so far.
struct ShadowResult {
  std::size_t changes = 0;  ///< calls that register, unregister, set up, update, clear or step
  std::size_t queries = 0;  ///< calls of collide and distance
  ShadowSide first;         ///< the program's manager
  ShadowSide second;        ///< the one beside it

  std::size_t differences = 0;  ///< queries and changes in which the two differ
  std::string difference;       ///< the first difference in words; empty if there is none
  std::string file;             ///< the record that was written at the first difference, if any

  /// Pairs that one manager reports and the other one may leave out. There are three reasons: an
  /// object has moved since its update; an option may leave the pair out; or a manager is in a
  /// step, and it is not known where an object began it.
  std::size_t undecided = 0;

  /// What went wrong with the comparison itself, such as a record that could not be written. The
  /// program is not affected.
  std::string problem;
};

/// Options of a ShadowManager.
struct ShadowOptions {
  /// The file that takes the record at the first difference; see ShadowManager::writeRecord(). If
  /// there is such a file, `-2`, `-3` and so on is appended to the name. Empty for none.
  std::string file = "fcl_fibers_shadow.txt";

  /// The most bytes of memory that the record of all calls may take. Beyond that it ends, and says
  /// so. 0 for no record.
  std::size_t record_limit = std::size_t{1} << 30;

  /// This is called once, when the call in which the first difference was found ends. If it throws,
  /// that call throws the exception.
  std::function<void(const ShadowResult&)> on_difference;
};

/// What replayRecord() has found when it made the calls of a record again.
struct ShadowReplay {
  ShadowResult result;   ///< of the managers that were asked again, up to the first difference
  std::string recorded;  ///< the difference that the record was written for; empty if for none
  std::string managers;  ///< which managers were asked, and in place of which
};

/// Makes the calls of a record again, with fiber managers of the recorded options, FCL's naive
/// manager where that was recorded, and its dynamic tree in place of any other. It stops at the
/// first difference. Throws std::runtime_error with the path, the line and the problem if the file
/// is no whole record.
FCL_FIBERS_EXPORT ShadowReplay replayRecord(const std::string& path);

/// Runs the program's manager and another one side by side, so that a program can try the other one
/// on its own data without depending on it.
///
///     ShadowManagerd manager(std::make_unique<fcl::DynamicAABBTreeCollisionManagerd>());
///     ...                                    // the program, as it is
///     std::cout << manager.result().difference;
///
/// **What the program sees** is the first manager alone: its pairs in its order, its exceptions,
/// its objects. Callbacks are called for the first manager only. If a call of the second manager
/// throws, that is a difference, and after a change that throws it is asked no more. Nothing writes
/// to the program's objects.
///
/// **What is compared.** Pairs that touch have to be in both managers once. A FiberCollisionManager
/// has to report every pair within its margins. Under Report::kCapsules it must not report other
/// pairs of capsules. A query that the callback ended is compared as far as it went. The least
/// distances have to agree, where both are known. Pairs count where their objects were at the last
/// update, and in a step of a manager with motion on the straight way there; an object that has
/// moved since decides nothing. docs/contract.md has the details.
///
/// **Another manager.** If the other manager of a query is a ShadowManager too, the first ones meet
/// and the second ones meet. So wrap all managers of a program, or ask the wrapped one: FCL's
/// managers cast the other manager to their own class, so never hand a ShadowManager to them.
///
/// **Threads.** Queries may run from several threads at once if those of both managers may.
///
/// **Memory and time.** The record keeps every call with the shapes, poses and boxes that changed.
/// A query costs at least those of both managers.
template <typename S>
class FCL_FIBERS_EXPORT ShadowManager final : public fcl::BroadPhaseCollisionManager<S> {
 public:
  using Object = fcl::CollisionObject<S>;              ///< an object of the manager
  using Manager = fcl::BroadPhaseCollisionManager<S>;  ///< any of FCL's interface

  /// Puts a LayeredAABBTreeCollisionManager beside the first manager. Throws std::invalid_argument
  /// if the first manager is null or has objects. It also throws what the constructor of
  /// LayeredAABBTreeCollisionManager throws.
  explicit ShadowManager(std::unique_ptr<Manager> first, const FiberManagerOptions& options = {},
                         ShadowOptions shadow_options = {});

  /// Puts the second manager beside the first. Throws std::invalid_argument if one is null or has
  /// objects.
  ShadowManager(std::unique_ptr<Manager> first, std::unique_ptr<Manager> second,
                ShadowOptions shadow_options = {});

  /// Takes over the managers of the other one, even while a query of it runs. The other one then
  /// has no managers: assign to it or destroy it. All other calls throw std::logic_error.
  ///@{
  ShadowManager(ShadowManager&& other) noexcept : impl_(std::move(other.impl_)) {}
  ShadowManager& operator=(ShadowManager&& other) noexcept {
    impl_ = std::move(other.impl_);
    return *this;
  }
  ///@}
  ~ShadowManager() override = default;

  /// Registers a fiber: by registerFiber() in each FiberCollisionManager, by registerObjects() in a
  /// manager of any other class. Pairs of neighbours that the options leave out are no difference.
  /// This call takes no groups, rules for obstacles or joints.
  void registerFiber(const std::vector<Object*>& fiber, FiberEnds ends = FiberEnds::kOpen) {
    change(ends == FiberEnds::kOpen ? "registerFiber" : "registerRing", fiber);
  }

  /// Begins or ends a step in each FiberCollisionManager, whose comment explains steps under
  /// **Motion**. Throws as the first manager does. The pairs of a manager with
  /// FiberManagerOptions::motion are compared for the step.
  ///@{
  void beginStep() { change("beginStep", {}); }
  void endStep() { change("endStep", {}); }
  ///@}

  /// FCL's interface: what the program sees of the first manager, with the second one beside it.
  ///@{
  void registerObjects(const std::vector<Object*>& objects) override {
    change("registerObjects", objects);
  }
  void registerObject(Object* object) override { change("registerObject", {object}); }
  void unregisterObject(Object* object) override { change("unregisterObject", {object}); }
  void setup() override { change("setup", {}); }
  void update() override { change("update", {}); }
  void update(Object* object) override { change("updateObject", {object}); }
  void update(const std::vector<Object*>& objects) override { change("updateObjects", objects); }
  void clear() override { change("clear", {}); }
  void getObjects(std::vector<Object*>& objects) const override { first().getObjects(objects); }
  bool empty() const override { return first().empty(); }
  std::size_t size() const override { return first().size(); }
  void collide(Object* object, void* cdata, fcl::CollisionCallBack<S> callback) const override {
    query("collideObject", object, nullptr, bound(cdata, callback));
  }
  void collide(void* cdata, fcl::CollisionCallBack<S> callback) const override {
    query("collideSelf", nullptr, nullptr, bound(cdata, callback));
  }
  void collide(Manager* other, void* cdata, fcl::CollisionCallBack<S> callback) const override {
    query("collideManager", nullptr, other, bound(cdata, callback));
  }
  void distance(Object* object, void* cdata, fcl::DistanceCallBack<S> callback) const override {
    query("distanceObject", object, nullptr, bound(cdata, callback));
  }
  void distance(void* cdata, fcl::DistanceCallBack<S> callback) const override {
    query("distanceSelf", nullptr, nullptr, bound(cdata, callback));
  }
  void distance(Manager* other, void* cdata, fcl::DistanceCallBack<S> callback) const override {
    query("distanceManager", nullptr, other, bound(cdata, callback));
  }
  ///@}

  const Manager& first() const;  ///< the program's manager
  ShadowResult result() const;   ///< what was seen so far

  /// Writes all calls so far, with shapes, poses and boxes, to a file, which the command `replay`
  /// runs again. The file appears whole or not at all. Throws std::runtime_error if it cannot be
  /// written.
  void writeRecord(const std::string& path) const;

 private:
  friend ShadowReplay replayRecord(const std::string& path);
  struct FCL_FIBERS_NO_EXPORT Impl;
  class FCL_FIBERS_NO_EXPORT Player;
  void change(const std::string& call, const std::vector<Object*>& objects);
  /// A callback of collide, for which the distance is null, or of distance.
  using Callback = std::function<bool(Object* a, Object* b, S* dist)>;
  static Callback bound(void* cdata, fcl::CollisionCallBack<S> callback) {
    if (callback == nullptr) return nullptr;
    return [=](Object* a, Object* b, S*) { return callback(a, b, cdata); };
  }
  static Callback bound(void* cdata, fcl::DistanceCallBack<S> callback) {
    if (callback == nullptr) return nullptr;
    return [=](Object* a, Object* b, S* dist) { return callback(a, b, cdata, *dist); };
  }
  void query(const std::string& call, Object* object, Manager* other,
             const Callback& callback) const;
  FCL_FIBERS_NO_EXPORT std::shared_ptr<Impl> impl() const;

  std::shared_ptr<Impl> impl_;  ///< null after a move; a query keeps it alive
};

/// The manager for objects whose numbers are floats.
using ShadowManagerf = ShadowManager<float>;
/// The manager for objects whose numbers are doubles.
using ShadowManagerd = ShadowManager<double>;

extern template class ShadowManager<float>;
extern template class ShadowManager<double>;

}  // namespace fcl_fibers
