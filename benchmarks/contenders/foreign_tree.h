// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "contenders/closed_form.h"
#include "contenders/contender.h"
#include "parallel/executor.h"

namespace fcl_fibers::benchmarks {

/// A box in floats, rounded outward.
struct FloatBox {
  std::array<float, 3> least;
  std::array<float, 3> greatest;
};

FloatBox floatBox(const fcl::AABBd& box);

inline bool overlap(const FloatBox& a, const FloatBox& b) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (a.least[axis] > b.greatest[axis] || b.least[axis] > a.greatest[axis]) return false;
  }
  return true;
}

/// A tree of another library behind FCL's interface, as far as it is needed here: objects are
/// registered once, all of them MovingFibers', and the only query is self-collision. Whatever else
/// is called throws std::logic_error.
class ForeignTree : public Manager, public ForeignManager {
 public:
  /// @param threads  that read boxes, of a pool as ours are
  explicit ForeignTree(int threads);

  using Manager::update;

  void registerObjects(const std::vector<Object*>& objects) override {
    if (!objects_.empty()) refuse();
    objects_ = objects;
  }
  void getObjects(std::vector<Object*>& objects) const override { objects = objects_; }
  bool empty() const override { return objects_.empty(); }
  std::size_t size() const override { return objects_.size(); }
  void collide(void* cdata, fcl::CollisionCallBack<double> callback) const override = 0;

  void registerObject(Object*) override { refuse(); }
  void unregisterObject(Object*) override { refuse(); }
  void clear() override { refuse(); }
  void collide(Object*, void*, fcl::CollisionCallBack<double>) const override { refuse(); }
  void collide(Manager*, void*, fcl::CollisionCallBack<double>) const override { refuse(); }
  void distance(Object*, void*, fcl::DistanceCallBack<double>) const override { refuse(); }
  void distance(void*, fcl::DistanceCallBack<double>) const override { refuse(); }
  void distance(Manager*, void*, fcl::DistanceCallBack<double>) const override { refuse(); }

  /// Of FCL's objects.
  NarrowPhase collideSome(const std::vector<std::pair<Object*, Object*>>& pairs) const override;

 protected:
  /// Reads the tight boxes from the poses, as our manager does.
  void readBoxes();

  /// Reads all objects, in their order: what a test of pairs needs.
  const std::vector<CapsuleAxis<double>>& axesOfObjects() const;

  /// Without the copy of the boxes, which only this class needs.
  std::size_t libraryBytes(std::size_t allocated) const override {
    return allocated - boxes_.capacity() * sizeof(FloatBox);
  }

  const std::vector<FloatBox>& boxes() const { return boxes_; }
  Object* object(std::size_t i) const { return objects_[i]; }
  const std::vector<Object*>& objects() const { return objects_; }
  parallel::Executor* executor() const { return executor_.get(); }

 private:
  [[noreturn]] static void refuse() {
    throw std::logic_error("ForeignTree: only self-collision of objects registered once");
  }

  std::vector<Object*> objects_;
  std::vector<FloatBox> boxes_;
  std::unique_ptr<parallel::Executor> executor_;
};

/// Makes a contender of a tree that reads poses.
/// @param make  returns it as a std::unique_ptr
template <typename Make>
Contender foreignContender(const char* library, const std::string& variant, Make make) {
  return {Group::kForeign,
          library,
          variant,
          false,
          Boxes::kNone,
          Reported::kTouchingAtLeast,
          [make](const std::vector<Object*>&) { return make(); }};
}

/// Adds to foreignContenders() before main().
struct AddLibrary {
  /// @param version  nothing if it is no library, but written here
  AddLibrary(const std::string& library, const std::string& version,
             const std::vector<Contender>& contenders);
};

#ifdef FCL_FIBERS_WITH_EMBREE
/// A tree over boxes alone, on one thread.
class BoxTree {
 public:
  /// Pairs of boxes that overlap, by their numbers.
  using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  using Visitor = std::function<void(const Pairs& pairs)>;

  virtual ~BoxTree() = default;
  /// Builds it anew, as the library does this after a motion.
  /// @param boxes  borrowed until the next update
  virtual void update(const std::vector<FloatBox>& boxes) = 0;
  /// Visits each pair once, in blocks of a thousand or so.
  virtual void visitPairs(const Visitor& visit) const = 0;
};

/// @param morton  by Morton codes; otherwise by surface area
std::unique_ptr<BoxTree> makeEmbreeBoxes(bool morton);

/// Builds two trees on one thread, with one box to a leaf, and returns a query that counts the
/// pairs of a box of each which overlap.
/// @param morton  by Morton codes; otherwise by surface area
std::function<std::size_t()> embreeOverlaps(const std::vector<FloatBox>& a,
                                            const std::vector<FloatBox>& b, bool morton);
#endif

}  // namespace fcl_fibers::benchmarks
