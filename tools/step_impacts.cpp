// SPDX-License-Identifier: BSD-3-Clause
#include "step_impacts.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "first_of.h"
#include "messages.h"
#include "seconds.h"

namespace fcl_fibers::tools {
namespace {

/// A radius far too large makes all segments touch. More would take minutes.
constexpr std::size_t kMostSearched = 10000000;

bool isEarlier(const Impact& i, const Impact& j) {
  return std::tie(i.time, i.pair.a, i.pair.b) < std::tie(j.time, j.pair.a, j.pair.b);
}

/// Gives fibers what a file has no place for, from the file with the other end of the step.
void complete(FiberPolylines& fibers, const FiberPolylines& other) {
  if (fibers.starts_at.empty() && fibers.ends_at.empty()) {
    fibers.starts_at = other.starts_at;
    fibers.ends_at = other.ends_at;
  }
  if (fibers.samples.empty()) {
    fibers.samples = other.samples;
    fibers.types = other.types;
  }
}

/// Throws std::invalid_argument if a fiber does not start and end where its branches are.
void requireJoined(const std::string& title, const FiberPolylines& fibers) {
  const auto require = [&](const std::vector<std::int32_t>& places, std::size_t f, std::size_t own,
                           const char* verb) {
    if (places.empty() || places[f] < 0) return;
    if (fibers.points[static_cast<std::size_t>(places[f])] == fibers.points[own]) return;
    throw std::invalid_argument(fmt::format(
        "in '{}' fiber {} {} at another place than point {}, at which it branches; give both the "
        "same coordinates",
        title, f, verb, places[f]));
  };
  for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
    require(fibers.starts_at, f, fibers.point_begin[f], "starts");
    require(fibers.ends_at, f, fibers.point_begin[f + 1] - 1, "ends");
  }
}

}  // namespace

bool StepImpacts::isComplete(double until) const {
  return !ended && (impacts.size() == count || until < impacts.back().time);
}

FiberPolylines StepScene::at(double time) const {
  FiberPolylines fibers = start;
  const auto move = [time](double& x, double to) { x += time * (to - x); };
  for (std::size_t i = 0; i < fibers.points.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) move(fibers.points[i][k], end.points[i][k]);
  }
  move(fibers.radius, end.radius);
  if (start.radii.empty() && end.radii.empty()) return fibers;
  const auto radiiOf = [](const FiberPolylines& scene) {
    return scene.radii.empty() ? std::vector<double>(scene.points.size(), scene.radius)
                               : scene.radii;
  };
  if (end.hasRadiiOfPoints()) fibers.radii_are = end.radii_are;
  fibers.radii = radiiOf(start);
  const std::vector<double> radii = radiiOf(end);
  for (std::size_t i = 0; i < radii.size(); ++i) move(fibers.radii[i], radii[i]);
  return fibers;
}

StepScene readStep(const SceneSource& start, const SceneSource& end) {
  for (const SceneSource* source : {&start, &end}) {
    if (source->asked.size() > 1) {
      throw std::invalid_argument("'" + source->title +
                                  "' has several frames; a step has one start and one --end");
    }
  }
  StepScene step{start.title, end.title, start.scene(), end.scene()};
  if (step.start.point_begin != step.end.point_begin) {
    throw std::invalid_argument(fmt::format(
        "'{}' has {} points of {} fibers, and '{}' has {} of {}; both need the same fibers, with "
        "as many points each",
        start.title, countText(step.start.points.size()), countText(step.start.fiberCount()),
        end.title, countText(step.end.points.size()), countText(step.end.fiberCount())));
  }
  const bool both_have_radii = !step.start.radii.empty() && !step.end.radii.empty();
  if (both_have_radii && step.start.radii_are != step.end.radii_are) {
    throw std::invalid_argument(fmt::format(
        "of '{}' and '{}' one has radii of segments, and the other one radii at points; give both "
        "radii at points",
        start.title, end.title));
  }
  complete(step.start, step.end);
  complete(step.end, step.start);
  if (step.start.starts_at != step.end.starts_at || step.start.ends_at != step.end.ends_at) {
    throw std::invalid_argument(fmt::format(
        "in '{}' and '{}' fibers do not branch at the same points; both need the same branches",
        start.title, end.title));
  }
  requireJoined(start.title, step.start);
  requireJoined(end.title, step.end);
  return step;
}

StepImpacts findImpacts(const StepScene& step, const FiberTreeOptions& options, std::size_t limit) {
  if (options.report != Report::kCapsules ||
      options.volumes != FiberTreeOptions::Volumes::kLayeredBoxes) {
    throw std::invalid_argument(
        "--end looks for capsules that touch, by boxes that move; give it without --report volumes "
        "and --volumes spheres");
  }
  StepImpacts found;
  FirstOf<Impact> first(limit, isEarlier);
  found.seconds = seconds([&] {
    FiberTree tree(options);
    tree.build(fiberArrays(step.start));
    tree.update(fiberArrays(step.start), fiberArrays(step.end));
    const std::size_t most = std::max(limit, kMostSearched);
    found.ended = tree.visit(Impacts{}, [&](const Impact& impact) {
      if (found.count == most) return true;
      ++found.count;
      found.at_start += impact.time == 0 ? 1 : 0;
      first.add(impact);
      return false;
    });
    found.safe_step = tree.safeStep();
  });
  found.impacts = first.take();
  if (found.ended) {
    warn(step.start_title, "the search ended after " + countText(found.count) +
                               " impacts; is the radius too large? --limit N sets another limit");
  } else if (!found.isComplete()) {
    warn(step.start_title, "of " + countText(found.count) + " impacts the first " +
                               countText(limit) + " are kept; --limit N sets another limit");
  }
  return found;
}

Contact contactOf(const StepScene& step, const Impact& impact) {
  return impactContact(fiberArrays(step.start), fiberArrays(step.end), impact);
}

}  // namespace fcl_fibers::tools
