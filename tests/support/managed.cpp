// SPDX-License-Identifier: BSD-3-Clause
#include "support/managed.h"

#include <algorithm>
#include <limits>
#include <unordered_map>

namespace fcl_fibers::test {

template <typename S>
typename Answering<S>::Objects Answering<S>::every(std::size_t step) const {
  Objects some;
  for (std::size_t i = 0; i < size(); i += step) some.push_back(objects_[i]);
  return some;
}

template <typename S>
std::vector<std::pair<std::size_t, std::size_t>> Answering<S>::numbered(
    const Calls<S>& calls, const Objects& others) const {
  EXPECT_FALSE(calls.empty()) << "there is nothing to compare";
  std::unordered_map<const Object*, std::size_t> number;
  for (const Objects* objects : {&objects_, &others}) {
    for (const Object* object : *objects) number.emplace(object, number.size());
  }
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const auto& [a, b] : calls) pairs.emplace_back(number.at(a), number.at(b));
  return pairs;
}

template <typename S>
PairOracle<S> Answering<S>::oracle(const Objects& others, const PairRules& rules) const {
  Objects all = objects_;
  all.insert(all.end(), others.begin(), others.end());
  return PairOracle<S>(all, rules, fibers_, groups_, ends_);
}

template <typename S>
testing::AssertionResult Answering<S>::answersSelf(std::size_t least) const {
  const Objects held = objectsOf<S>(*manager_);
  const bool is_same =
      order_ == ArgumentOrder::kPromised
          ? held == objects_
          : std::is_permutation(held.begin(), held.end(), objects_.begin(), objects_.end());
  if (!is_same || manager_->size() != size() || manager_->empty() != objects_.empty()) {
    return testing::AssertionFailure()
           << "other objects are held: size is " << manager_->size() << " instead of " << size();
  }
  return oracle().answersSelf(selfPairs(*manager_), objects_, order_, least);
}

template <typename S>
testing::AssertionResult Answering<S>::answersWith(const QueryPartner<S>& partner,
                                                   std::size_t least) const {
  PairCollector<S> found;
  partner.collide(*manager_, &found, &PairCollector<S>::collide);
  return oracle(partner.objects)
      .answersBetween(found.calls, objects_, partner.objects, order_, least);
}

template <typename S>
testing::AssertionResult Answering<S>::areTouching(const Calls<S>& pairs,
                                                   const QueryPartner<S>& partner,
                                                   std::size_t least) const {
  PairRules rules = rules_;
  rules.report = Report::kCapsules;
  const PairOracle<S> truth = oracle(partner.objects, rules);
  return partner.isSelf() ? truth.answersSelf(pairs, objects_, order_, least)
                          : truth.answersBetween(pairs, objects_, partner.objects, order_, least);
}

template <typename S>
void Answering<S>::expectAnswersWith(const Objects& partners) const {
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < partners.size(); ++i) {
    EXPECT_TRUE(answersWith(partners[i], 0)) << "partner " << i;
    pairs += pairsWith(*manager_, *partners[i]).size();
  }
  EXPECT_GT(pairs, 0u) << "no partner meets anything";
}

template <typename S>
void Answering<S>::run(DistanceSearch<S>& search, const QueryPartner<S>& partner) const {
  search.run(*manager_, partner);
  EXPECT_TRUE(search.keepsToTheRules());
  if (order_ == ArgumentOrder::kAny) return;
  const auto rank = [](const Object* object, const Objects& list) {
    return std::find(list.begin(), list.end(), object) - list.begin();
  };
  for (const auto& [a, b] : search.calls) {
    const bool in_order =
        partner.isSelf() ? rank(a, objects_) < rank(b, objects_)
                         : std::count(objects_.begin(), objects_.end(), a) != 0 &&
                               std::count(partner.objects.begin(), partner.objects.end(), b) != 0;
    EXPECT_TRUE(in_order) << "objects " << rank(a, objects_) << " and " << rank(b, objects_);
  }
}

template <typename S>
S Answering<S>::expectNearest(const QueryPartner<S>& partner) const {
  const PairOracle<S> truth = oracle(partner.objects);
  DistanceSearch<S> search(truth);
  run(search, partner);
  const S smallest =
      truth.smallestDistance(objects_, partner.isSelf() ? nullptr : &partner.objects);
  if (smallest <= 0) {
    EXPECT_LE(search.result(), 0);
  } else if (order_ == ArgumentOrder::kPromised) {
    // Ours prunes by true lower bounds only, so that its answer is the smallest to the last bit.
    EXPECT_EQ(search.result(), smallest);
  } else {
    // FCL rounds its boxes to nearest.
    const Real band = 16 * std::numeric_limits<S>::epsilon() * truth.largestCoordinate();
    EXPECT_NEAR(search.result(), smallest, static_cast<double>(band));
  }
  if (order_ == ArgumentOrder::kPromised) {
    for (std::size_t i = 0; i + 1 < search.left.size(); ++i) EXPECT_GT(search.left[i], 0);
  }
  return smallest;
}

template <typename S>
void Answering<S>::expectEveryPair(const QueryPartner<S>& partner) const {
  const PairOracle<S> truth = oracle(partner.objects);
  DistanceSearch<S> search(truth);
  search.lowers = false;
  run(search, partner);
  std::size_t count = 0;
  if (partner.isSelf()) {
    count = truth.pairCount(objects_);
  } else {
    for (const Object* a : objects_) {
      for (const Object* b : partner.objects) count += a != b && !truth.ignored(a, b);
    }
  }
  EXPECT_EQ(search.calls.size(), count);
}

template <typename S>
void Answering<S>::remember(const Objects& objects) {
  // What comes back is no part of its fiber any more.
  for (Object* object : objects) {
    if (gone_.erase(object) == 0) continue;
    for (Objects& fiber : fibers_) {
      std::replace(fiber.begin(), fiber.end(), object, static_cast<Object*>(nullptr));
    }
  }
  objects_.insert(objects_.end(), objects.begin(), objects.end());
}

template <typename S>
void Answering<S>::rememberAs(const Answering& other, const Objects& objects) {
  objects_ = objects;
  fibers_ = other.fibers_;
  groups_ = other.groups_;
  ends_ = other.ends_;
  gone_ = other.gone_;
  for (Objects& fiber : fibers_) {
    for (Object*& object : fiber) {
      const auto place = std::find(other.objects_.begin(), other.objects_.end(), object);
      // What is gone stays, as an arc length counts it.
      if (place == other.objects_.end()) continue;
      object = objects[static_cast<std::size_t>(place - other.objects_.begin())];
    }
  }
}

template <typename S>
void Answering<S>::registerObject(Object* object) {
  manager_->registerObject(object);
  remember({object});
}

template <typename S>
void Answering<S>::registerObjects(const Objects& objects) {
  manager_->registerObjects(objects);
  remember(objects);
}

template <typename S>
void Answering<S>::registerEach(const Objects& objects) {
  for (Object* object : objects) registerObject(object);
}

template <typename S>
void Answering<S>::unregisterObject(Object* object) {
  manager_->unregisterObject(object);
  gone_.insert(object);
  objects_.erase(std::find(objects_.begin(), objects_.end(), object));
}

template <typename S>
fcl::CollisionObject<S>* Answering<S>::unregister(std::size_t i) {
  Object* const object = objects_[i];
  unregisterObject(object);
  return object;
}

template <typename S>
void Answering<S>::clear() {
  manager_->clear();
  objects_.clear();
  gone_.clear();
  fibers_.clear();
  groups_.clear();
  ends_.clear();
}

template class Answering<float>;
template class Answering<double>;

}  // namespace fcl_fibers::test
