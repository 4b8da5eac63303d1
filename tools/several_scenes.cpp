// SPDX-License-Identifier: BSD-3-Clause
#include "several_scenes.h"

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace fcl_fibers::tools {
namespace {

/// Appends `more` to the numbers of `before` items, where none stand if all are `none`.
template <typename Number>
void append(std::vector<Number>& all, std::size_t before, const std::vector<Number>& more,
            std::size_t count, Number none) {
  if (all.empty() && more.empty()) return;
  all.resize(before, none);
  all.insert(all.end(), more.begin(), more.end());
  all.resize(before + count, none);
}

/// By point, as scenes have them.
std::vector<double> radiiOf(const FiberPolylines& scene) {
  return scene.radii.empty() ? std::vector<double>(scene.points.size(), scene.radius) : scene.radii;
}

/// Appends fibers to others, as a group of their own.
void appendGroup(const FiberPolylines& more, std::int32_t group, FiberPolylines& all) {
  const std::size_t points = all.points.size(), fibers = all.fiberCount();
  const std::size_t point_count = more.points.size(), fiber_count = more.fiberCount();
  const bool one_radius =
      all.radii.empty() && more.radii.empty() && (points == 0 || all.radius == more.radius);
  if (!one_radius) {
    all.radii = radiiOf(all);
    all.radii_are = FiberArrays<double>::Radii::kPerPoint;
    append(all.radii, points, radiiOf(more), point_count, 0.0);
  }
  all.radius = more.radius;
  const auto shifted = [&](std::vector<std::int32_t> at) {
    for (std::int32_t& point : at) point += point < 0 ? 0 : static_cast<std::int32_t>(points);
    return at;
  };
  append(all.starts_at, fibers, shifted(more.starts_at), fiber_count, std::int32_t{-1});
  append(all.ends_at, fibers, shifted(more.ends_at), fiber_count, std::int32_t{-1});
  append(all.closed, fibers, more.closed, fiber_count, std::uint8_t{0});
  append(all.samples, points, more.samples, point_count, std::int64_t{-1});
  append(all.types, points, more.types, point_count, std::int64_t{-1});
  all.groups.resize(fibers + fiber_count, group);
  all.points.insert(all.points.end(), more.points.begin(), more.points.end());
  for (std::size_t f = 0; f < fiber_count; ++f) {
    all.point_begin.push_back(points + more.point_begin[f + 1]);
  }
}

/// What the first scene tells, with the names of all.
SceneSource named(const std::vector<SceneSource>& sources, const char* option, const char* part) {
  if (sources.size() < 2) {
    throw std::invalid_argument(
        fmt::format("{} takes two or more scenes, each of which is a {}", option, part));
  }
  SceneSource all = sources.front();
  all.guide.reset();
  for (std::size_t i = 1; i < sources.size(); ++i) {
    all.name += ", " + sources[i].name;
    all.title += ", " + sources[i].title;
    all.has_samples = all.has_samples || sources[i].has_samples;
  }
  return all;
}

}  // namespace

SceneSource asGroups(std::vector<SceneSource> sources) {
  SceneSource all = named(sources, "--groups", "group");
  std::size_t fibers = 0;
  for (const SceneSource& source : sources) {
    all.groups.push_back({static_cast<double>(all.groups.size()), source.name, fibers});
    fibers += source.scene().fiberCount();
  }
  all.make = [sources = std::move(sources)](int frame) {
    FiberPolylines scene;
    for (std::size_t i = 0; i < sources.size(); ++i) {
      appendGroup(sources[i].make(i == 0 ? frame : sources[i].frame),
                  static_cast<std::int32_t>(i) + 1, scene);
    }
    return scene;
  };
  return all;
}

SceneSource asFrames(std::vector<SceneSource> sources) {
  SceneSource all = named(sources, "--frames", "frame");
  const FiberPolylines first = sources.front().scene();
  for (const SceneSource& source : sources) {
    if (source.scene().point_begin == first.point_begin) continue;
    throw std::invalid_argument(
        fmt::format("'{}' cannot be a frame after '{}': --frames needs as many fibers in each "
                    "scene, with as many points each",
                    source.title, sources.front().title));
  }
  all.frame = 0;
  all.playable.resize(sources.size());
  std::iota(all.playable.begin(), all.playable.end(), 0);
  all.make = [sources = std::move(sources), groups = first.groups](int frame) {
    FiberPolylines scene = sources[static_cast<std::size_t>(frame)].scene();
    scene.groups = groups;
    return scene;
  };
  return all;
}

}  // namespace fcl_fibers::tools
