// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "numerics/row_judge.h"
#include "support/managers_under_test.h"
#include "support/pair_queries.h"

namespace fcl_fibers::test {

/// A row as objects, of which every other fiber moves.
template <typename S>
class ObjectRow {
 public:
  using Object = fcl::CollisionObject<S>;

  explicit ObjectRow(const ExtremeRow<S>& row)
      : specimen(row.fibers, Form::kObjects),
        objects(specimen.objects()),
        judge(row, row.fibers, specimen.capsules()),
        size(usualSize(judge)) {
    judge.measureAll();
    row.fibers.visitCapsules(
        [&](std::size_t fiber, std::size_t) { moves.push_back(!(fiber % 2)); });
    for (const Object* object : objects) {
      numbers_.emplace(object, numbers_.size());
      centers_.push_back(object->getTranslation());
    }
  }

  /// Moves every other fiber along y, by so many of the usual size away from its place.
  void move(double times) {
    for (std::size_t k = 0; k < objects.size(); ++k) {
      if (!moves[k]) continue;
      fcl::Vector3<S> center = centers_[k];
      center[1] = static_cast<S>(static_cast<double>(center[1]) + times * size);
      objects[k]->setTranslation(center);
    }
  }

  /// What is true after such a motion.
  const Judge<S>& moved(double times) {
    move(times);
    if (times == 0) return judge;
    return moved_.try_emplace(times, judge.row, judge.fibers, specimen.capsules()).first->second;
  }

  std::size_t numberOf(const Object* object) const { return numbers_.at(object); }
  NumberPair numbersOf(const Object* a, const Object* b) const {
    return {static_cast<std::int32_t>(numberOf(a)), static_cast<std::int32_t>(numberOf(b))};
  }

  Specimen<S> specimen;
  std::vector<Object*> objects;
  Judge<S> judge;
  double size;
  std::vector<bool> moves;

 private:
  std::unordered_map<const Object*, std::size_t> numbers_;
  std::vector<fcl::Vector3<S>> centers_;
  std::map<double, Judge<S>> moved_;
};

/// How managers are asked.
struct Way {
  FiberTreeOptions options;
  bool are_two;  ///< what moves is in the manager that is asked, and the rest in another one

  template <typename S>
  bool isAsked(const ObjectRow<S>& row, std::size_t i, std::size_t j) const {
    return !are_two || row.moves[i] != row.moves[j];
  }
  template <typename S>
  std::vector<NumberPair> touching(const ObjectRow<S>& row) const {
    std::vector<NumberPair> asked;
    for (const NumberPair& pair : row.judge.touching()) {
      if (isAsked(row, std::size_t(pair.a), std::size_t(pair.b))) asked.push_back(pair);
    }
    return asked;
  }
};

/// The managers of a row. A second one has a margin that does not count.
template <typename S>
class Managers {
 public:
  using Object = fcl::CollisionObject<S>;

  Managers(const ObjectRow<S>& row, const Way& way, bool motion = false, double skin = 0) {
    FiberManagerOptions options{way.options};
    options.motion = motion;
    options.skin = skin;
    first = make(way, options);
    if (way.are_two) {
      options.margin = 1.5 * options.margin + row.size;
      second = make(way, options);
    }
    std::vector<Object*> objects[2];
    for (std::size_t k = 0; k < row.objects.size(); ++k) {
      objects[way.are_two && !row.moves[k]].push_back(row.objects[k]);
    }
    both([&](auto& manager) { manager.registerObjects(objects[&manager == second.get()]); });
  }

  template <class Act>
  void both(Act&& act) {
    act(*first);
    if (second) act(*second);
  }
  void collide(void* data, fcl::CollisionCallBack<S> callback) const {
    second ? first->collide(second.get(), data, callback) : first->collide(data, callback);
  }
  Calls<S> pairs() const { return second ? pairsWith<S>(*first, *second) : selfPairs<S>(*first); }
  void distance(void* data, fcl::DistanceCallBack<S> callback) const {
    second ? first->distance(second.get(), data, callback) : first->distance(data, callback);
  }

  std::unique_ptr<FiberCollisionManager<S>> first, second;  ///< the latter only of two

 private:
  static std::unique_ptr<FiberCollisionManager<S>> make(const Way& way,
                                                        const FiberManagerOptions& options) {
    if (isOfBoxes(way.options)) return makeLayeredAabbTree<S>(options);
    return makeWrappedSphereTree<S>(options);
  }
};

}  // namespace fcl_fibers::test
