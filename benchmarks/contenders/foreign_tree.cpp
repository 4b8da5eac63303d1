// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/foreign_tree.h"

#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace fcl_fibers::benchmarks {
namespace {

/// An ulp at least, without the branches of nextafter.
float below(double x) {
  const auto nearest = static_cast<float>(x);
  return nearest - std::abs(nearest) * std::numeric_limits<float>::epsilon();
}

float above(double x) { return -below(-x); }

}  // namespace

FloatBox floatBox(const fcl::AABBd& box) {
  FloatBox result;
  for (int axis = 0; axis < 3; ++axis) {
    result.least[static_cast<std::size_t>(axis)] = below(box.min_[axis]);
    result.greatest[static_cast<std::size_t>(axis)] = above(box.max_[axis]);
  }
  return result;
}

ForeignTree::ForeignTree(int threads) : executor_(parallel::makeExecutor(threads)) {}

void ForeignTree::readBoxes() {
  constexpr std::size_t kGrain = 4096;
  boxes_.resize(objects_.size());
  parallel::forRanges(
      executor_.get(), objects_.size(), kGrain, [this](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          boxes_[i] = floatBox(static_cast<const CapsuleObject*>(objects_[i])->tightBox());
        }
      });
}

std::vector<Contender> foreignContenders() {
  std::vector<Contender> contenders;
  // Without any of the libraries, it has no use.
  [[maybe_unused]] const auto add = [&](const char* library, const std::string& variant,
                                        auto makeTree) {
    const auto make = [makeTree](const std::vector<Object*>&) { return makeTree(); };
    contenders.push_back({library, variant, false, Boxes::kNone, Reported::kTouchingAtLeast, make});
  };
#ifdef FCL_FIBERS_WITH_EMBREE
  for (const int threads : {1, 2}) {
    const std::string suffix = threads == 1 ? "" : "_2_threads";
    const auto addWay = [&](const char* name, EmbreeUpdate update) {
      add("Embree", name + suffix, [=] { return makeEmbreeTree(update, threads); });
    };
    addWay("rebuild", EmbreeUpdate::kRebuild);
    addWay("morton", EmbreeUpdate::kRebuildMorton);
    addWay("refit", EmbreeUpdate::kRefit);
  }
#endif
#ifdef FCL_FIBERS_WITH_BULLET
  add("Bullet", "refit", makeBulletTree);
#endif
  return contenders;
}

std::string missingLibraries() {
  std::string missing;
#ifndef FCL_FIBERS_WITH_EMBREE
  missing = "Embree";
#endif
#ifndef FCL_FIBERS_WITH_BULLET
  missing += missing.empty() ? "Bullet" : ", Bullet";
#endif
  return missing;
}

}  // namespace fcl_fibers::benchmarks
