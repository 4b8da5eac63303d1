// SPDX-License-Identifier: BSD-3-Clause
#include "contenders/foreign_tree.h"

#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include <fcl/config.h>

#include "contenders/narrow_phase.h"

namespace fcl_fibers::benchmarks {
namespace {

/// An ulp at least, without the branches of nextafter.
float below(double x) {
  const auto nearest = static_cast<float>(x);
  return nearest - std::abs(nearest) * std::numeric_limits<float>::epsilon();
}

float above(double x) { return -below(-x); }

/// By the names of libraries.
std::map<std::string, std::string>& versions() {
  static std::map<std::string, std::string> all;
  return all;
}

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

const std::vector<CapsuleAxis<double>>& ForeignTree::axesOfObjects() const {
  return readAxes<double>(size(), [this](std::size_t i) { return axisOf(*objects_[i]); });
}

NarrowPhase ForeignTree::collideSome(const std::vector<std::pair<Object*, Object*>>& pairs) const {
  return collidePairs<double>(pairs);
}

AddLibrary::AddLibrary(const std::string& library, const std::string& version,
                       const std::vector<Contender>& contenders) {
  if (!version.empty()) versions().emplace(library, version);
  for (const Contender& contender : contenders) foreignContenders().push_back(contender);
}

std::string versionsOfLibraries() {
  std::string text = "FCL " FCL_VERSION;
  for (const auto& [library, version] : versions()) text += ", " + library + " " + version;
  return text;
}

std::string missingLibraries() {
  std::string missing;
  for (const char* const library : {"Embree", "Bullet", "coal"}) {
    if (versions().count(library) == 0)
      missing += (missing.empty() ? "" : ", ") + std::string(library);
  }
  return missing;
}

}  // namespace fcl_fibers::benchmarks
