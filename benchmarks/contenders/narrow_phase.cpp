// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/narrow_phase.h"

#include <algorithm>
#include <type_traits>

#include <fcl/narrowphase/collision.h>

namespace fcl_fibers::benchmarks {
namespace {

template <typename S>
struct Sampler {
  static constexpr std::size_t kBlock = 500;

  std::size_t stride;  ///< in blocks
  PairSample<S> sample = {};

  static bool callback(fcl::CollisionObject<S>* a, fcl::CollisionObject<S>* b, void* data) {
    auto& self = *static_cast<Sampler*>(data);
    if (self.sample.of++ / kBlock % self.stride == 0) self.sample.pairs.emplace_back(a, b);
    return false;
  }
};

}  // namespace

template <typename S>
PairSample<S> samplePairs(const BasicManager<S>& manager, std::size_t reported, std::size_t size) {
  // Fewer blocks than these say little of a scene whose parts differ.
  constexpr std::size_t kLeastBlocks = 20, kBlock = Sampler<S>::kBlock;
  const std::size_t blocks = std::max(kLeastBlocks, size / kBlock);
  Sampler<S> sampler{std::max<std::size_t>(1, reported / kBlock / blocks)};
  manager.collide(&sampler, Sampler<S>::callback);
  return std::move(sampler.sample);
}

template <typename S>
PairSample<S> partOf(const PairSample<S>& sample, std::size_t first, std::size_t parts) {
  if (sample.pairs.size() == sample.of) return sample;
  PairSample<S> part;
  part.of = sample.of;
  for (std::size_t i = 0; i < sample.pairs.size(); ++i) {
    if (i / Sampler<S>::kBlock % parts == first % parts) part.pairs.push_back(sample.pairs[i]);
  }
  return part;
}

template <typename S>
NarrowPhase collidePairs(const ObjectPairs<S>& pairs) {
  std::size_t touching = 0;
  const double taken = seconds([&] {
    const fcl::CollisionRequest<S> request;
    fcl::CollisionResult<S> result;
    for (const auto& [a, b] : pairs) {
      result.clear();
      fcl::collide(a, b, request, result);
      if (result.isCollision()) ++touching;
    }
  });
  return {taken, static_cast<double>(touching)};
}

template <typename S>
NarrowPhase collide(const BasicManager<S>& manager, const PairSample<S>& sample) {
  if (sample.pairs.empty()) return {};
  NarrowPhase found;
  if constexpr (std::is_same_v<S, double>) {
    const auto* const foreign = dynamic_cast<const ForeignManager*>(&manager);
    found = foreign != nullptr ? foreign->collideSome(sample.pairs) : collidePairs<S>(sample.pairs);
  } else {
    found = collidePairs<S>(sample.pairs);
  }
  const double scale = static_cast<double>(sample.of) / static_cast<double>(sample.pairs.size());
  return {scale * found.seconds, scale * found.touching};
}

template <typename S>
std::size_t countTouching(const BasicManager<S>& manager,
                          const std::vector<fcl::CollisionObject<S>*>& objects) {
  if (const auto* const foreign = dynamic_cast<const ForeignManager*>(&manager)) {
    return foreign->countTouching();
  }
  struct Counter {
    const std::vector<CapsuleAxis<S>>& axes;
    std::size_t count = 0;
  } counter = {readAxes<S>(objects.size(), [&](std::size_t i) { return axisOf(*objects[i]); })};
  manager.collide(&counter, [](auto* a, auto* b, void* data) {
    auto& found = *static_cast<Counter*>(data);
    found.count += capsulesTouch(found.axes[BasicMovingFibers<S>::index(a)],
                                 found.axes[BasicMovingFibers<S>::index(b)]);
    return false;
  });
  return counter.count;
}

#define FCL_FIBERS_NARROW_PHASE(S)                                                      \
  template PairSample<S> samplePairs(const BasicManager<S>&, std::size_t, std::size_t); \
  template PairSample<S> partOf(const PairSample<S>&, std::size_t, std::size_t);        \
  template NarrowPhase collidePairs<S>(const ObjectPairs<S>&);                          \
  template NarrowPhase collide(const BasicManager<S>&, const PairSample<S>&);           \
  template std::size_t countTouching(const BasicManager<S>&,                            \
                                     const std::vector<fcl::CollisionObject<S>*>&);
FCL_FIBERS_NARROW_PHASE(float)
FCL_FIBERS_NARROW_PHASE(double)

}  // namespace fcl_fibers::benchmarks
