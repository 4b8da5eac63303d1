// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bounds.h"
#include "commands.h"
#include "nearest.h"

namespace fcl_fibers::tools {
namespace {

struct Spread {
  double least = 0, median = 0, largest = 0, total = 0;

  explicit Spread(std::vector<double> lengths) {
    if (lengths.empty()) return;
    total = std::accumulate(lengths.begin(), lengths.end(), 0.0);
    std::sort(lengths.begin(), lengths.end());
    least = lengths.front();
    median = lengths[lengths.size() / 2];
    largest = lengths.back();
  }
};

struct Facts {
  std::vector<double> fiber_lengths;
  std::vector<double> segment_lengths, radii;  ///< by segment
  std::size_t fewest_segments = 0, most_segments = 0;
  std::size_t without_segment = 0, closed = 0;  ///< fibers
  std::size_t start_at_others = 0, end_at_others = 0;
  std::size_t tapering = 0;  ///< segments
  double largest_ratio = 1;  ///< of the radii at the ends of a segment, neither of which is 0
  Bounds bounds;

  explicit Facts(const FiberPolylines& scene) {
    for (const Point& point : scene.points) bounds.add(point);
    if (scene.points.empty()) bounds.low = bounds.high = Point{};
    fewest_segments = scene.fiberCount() > 0 ? std::numeric_limits<std::size_t>::max() : 0;
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
      double length = 0;
      for (std::size_t i = begin; i + 1 < end; ++i) {
        const Point &p = scene.points[i], &q = scene.points[i + 1];
        segment_lengths.push_back(std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]));
        radii.push_back(scene.radiusAt(i));
        const double least = std::min(scene.radiusAt(i, 0), scene.radiusAt(i, 1));
        tapering += least < radii.back() ? 1 : 0;
        if (least > 0) largest_ratio = std::max(largest_ratio, radii.back() / least);
        length += segment_lengths.back();
      }
      fiber_lengths.push_back(length);
      fewest_segments = std::min(fewest_segments, scene.segmentCount(f));
      most_segments = std::max(most_segments, scene.segmentCount(f));
      without_segment += scene.segmentCount(f) == 0 ? 1 : 0;
      closed += scene.isClosed(f) ? 1 : 0;
      const auto names = [&](const std::vector<std::int32_t>& places) {
        return !places.empty() && places[f] >= 0;
      };
      start_at_others += names(scene.starts_at) ? 1 : 0;
      end_at_others += names(scene.ends_at) ? 1 : 0;
    }
  }
};

/// How many fibers begin where an earlier fiber does, although no branch joins the two there.
std::size_t copiedRoots(const FiberPolylines& scene) {
  // Each point leads to one that branches make the same.
  std::vector<std::size_t> same(scene.points.size());
  std::iota(same.begin(), same.end(), std::size_t{0});
  const auto sameAs = [&](std::size_t i) {
    while (same[i] != i) i = same[i] = same[same[i]];
    return i;
  };
  const auto join = [&](const std::vector<std::int32_t>& places, std::size_t f, std::size_t own) {
    if (places.empty() || places[f] < 0) return;
    same[sameAs(own)] = sameAs(static_cast<std::size_t>(places[f]));
  };
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f], last = scene.point_begin[f + 1] - 1;
    join(scene.starts_at, f, begin);
    join(scene.ends_at, f, last);
    if (scene.isClosed(f)) same[sameAs(begin)] = sameAs(last);
  }
  std::vector<std::pair<Point, std::size_t>> roots;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f];
    if (begin < scene.point_begin[f + 1]) roots.emplace_back(scene.points[begin], sameAs(begin));
  }
  // The first one of the file is the original.
  std::stable_sort(roots.begin(), roots.end(),
                   [](const auto& p, const auto& q) { return p.first < q.first; });
  std::size_t count = 0, first = 0;
  for (std::size_t i = 0; i < roots.size(); ++i) {
    if (roots[i].first != roots[first].first) first = i;
    count += roots[i].second != roots[first].second ? 1 : 0;
  }
  return count;
}

/// What a user should know before trusting an answer.
std::vector<std::string> warnings(const SceneSource& source, const FiberPolylines& scene,
                                  const Facts& facts, const Spread& segments) {
  std::vector<std::string> texts;
  const auto count = [&](auto&& holds) {
    std::size_t found = 0;
    for (std::size_t i = 0; i < facts.segment_lengths.size(); ++i) {
      found += holds(facts.segment_lengths[i], facts.radii[i]) ? 1 : 0;
    }
    return found;
  };
  const auto warn = [&](auto number, const char* text) {
    if (number > 0) {
      texts.push_back(fmt::format(text, countText(static_cast<std::size_t>(number))));
    }
  };
  if (scene.segmentCount() == 0) texts.push_back("there is no segment");
  warn(facts.without_segment, "fibers of one point or none, which touch nothing: {}");
  warn(count([](double length, double) { return length == 0; }),
       "segments of length zero, whose points coincide: {}");
  warn(count([&](double length, double) { return length > 20 * segments.median; }),
       "segments more than 20 times as long as the median, which may join two fibers: {}");
  if (source.has_radius) {
    warn(count([](double, double radius) { return radius == 0; }),
         "segments of radius zero, which touch each other only if their axes cross: {}");
  } else {
    texts.push_back("the file holds no radius; check, distance, trade and view need --radius");
  }
  const double thickest =
      facts.radii.empty() ? 0 : *std::max_element(facts.radii.begin(), facts.radii.end());
  const std::string short_segments = fmt::format(
      "segments shorter than wide, so that those next but one along a fiber touch, too; give check "
      "--ignored-arc-length {:.4g}, pi times the radius: {{}}",
      std::acos(-1.0) * thickest);
  warn(count([](double length, double radius) { return length < 2 * radius; }),
       short_segments.c_str());
  warn(copiedRoots(scene),
       "fibers that begin at the same place as another one, and so touch it there, because the "
       "file tells no branch there: {}");
  double size = 0, far = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double low = facts.bounds.low[k], high = facts.bounds.high[k];
    size = std::max(size, high - low);
    far = std::max({far, std::fabs(low), std::fabs(high)});
  }
  if (size > 0 && far > 1e6 * size) {
    texts.push_back("the scene is more than a million times its size away from the origin");
  }
  return texts;
}

std::optional<Contact> nearestAxes(const FiberPolylines& scene) {
  progress("looking for the radius at which contact begins");
  FiberPolylines axes = scene;
  axes.radii.clear();
  axes.radius = 0;
  FiberOptions adjacent;
  adjacent.ignored_neighbors = 1;
  return findNearest(axes, nullptr, adjacent);
}

}  // namespace

int info(const Request& request) {
  const SceneSource source = request.scenes.front().find();
  requireNoProblem(source);
  progress("reading " + source.title);
  const FiberPolylines scene = source.scene();
  const Facts facts(scene);
  const std::optional<Contact> nearest = nearestAxes(scene);
  progress("");
  const Spread fibers(facts.fiber_lengths), segments(facts.segment_lengths), radii(facts.radii);
  std::vector<std::string> warned = source.warnings;
  for (std::string& text : warnings(source, scene, facts, segments)) {
    warned.push_back(std::move(text));
  }

  if (request.output == Output::kJson) {
    const auto spread = [](const Spread& lengths) {
      return nlohmann::ordered_json{
          {"min", lengths.least}, {"median", lengths.median}, {"max", lengths.largest}};
    };
    nlohmann::ordered_json json = {
        {"scene", source.title},
        {"fibers", scene.fiberCount()},
        {"segments", scene.segmentCount()},
        {"points", scene.points.size()},
        {"segments_per_fiber", {{"min", facts.fewest_segments}, {"max", facts.most_segments}}},
        {"closed_fibers", facts.closed},
        {"branches",
         {{"fibers_that_start_at_others", facts.start_at_others},
          {"fibers_that_end_at_others", facts.end_at_others}}},
        {"tapers", {{"segments", facts.tapering}, {"largest_ratio", facts.largest_ratio}}},
        {"radius", source.has_radius ? spread(radii) : nlohmann::ordered_json()},
        {"contact_radius",
         nearest ? nlohmann::ordered_json(nearest->distance / 2) : nlohmann::ordered_json()},
        {"length", fibers.total},
        {"fiber_length", spread(fibers)},
        {"segment_length", spread(segments)},
        {"bounds", {{"min", facts.bounds.low}, {"max", facts.bounds.high}}},
        {"warnings", warned}};
    print(json.dump(2) + "\n");
    return 0;
  }

  const std::string per_fiber =
      facts.fewest_segments == facts.most_segments
          ? countText(facts.most_segments) + " a fiber"
          : fmt::format("{} to {} a fiber", countText(facts.fewest_segments),
                        countText(facts.most_segments));
  std::string text = fmt::format("{}\n\n", source.title);
  const auto line = [&](const char* name, const std::string& value) {
    text += fmt::format("  {:<16}{}\n", name, value);
  };
  const auto spread = [](const Spread& lengths) {
    return fmt::format("{:.4g} to {:.4g}, median {:.4g}", lengths.least, lengths.largest,
                       lengths.median);
  };
  line("fibers", countText(scene.fiberCount()));
  line("segments", fmt::format("{}, {}", countText(scene.segmentCount()), per_fiber));
  if (facts.closed > 0) line("closed", countText(facts.closed));
  if (facts.start_at_others + facts.end_at_others > 0) {
    const auto text = [](std::size_t count, const char* verb) {
      return fmt::format("{} {}{} at another one", counted(count, "fiber"), verb,
                         count == 1 ? "s" : "");
    };
    const std::size_t starts = facts.start_at_others, ends = facts.end_at_others;
    line("branches", (starts > 0 ? text(starts, "start") : "") +
                         (starts > 0 && ends > 0 ? ", " : "") +
                         (ends > 0 ? text(ends, "end") : ""));
  }
  line("radius", !source.has_radius             ? "none"
                 : radii.least == radii.largest ? fmt::format("{:.4g}", radii.least)
                                                : spread(radii));
  if (facts.tapering > 0) {
    line("tapers", fmt::format("{}, by up to {:.4g} to 1", counted(facts.tapering, "segment"),
                               facts.largest_ratio));
  }
  if (nearest) {
    line("contact", fmt::format("begins at radius {:.4g}", nearest->distance / 2));
  }
  line("fiber length", fmt::format("{}, sum {:.4g}", spread(fibers), fibers.total));
  line("segment length", spread(segments));
  for (std::size_t k = 0; k < 3; ++k) {
    line(k == 0 ? "bounds" : "", fmt::format("{}  {:>10.4g} to {:.4g}", "xyz"[k],
                                             facts.bounds.low[k], facts.bounds.high[k]));
  }
  if (!warned.empty()) text += "\n";
  for (const std::string& warning : warned) text += "  warning: " + warning + "\n";
  print(text);
  return 0;
}

}  // namespace fcl_fibers::tools
