// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include "tools/trade/trial.h"

namespace fcl_fibers::tools::trade {
namespace {

using Name = std::pair<std::int32_t, std::int32_t>;

Name nameOf(std::int32_t a, std::int32_t b) {
  return a < b || b == kAMesh ? Name{a, b} : Name{b, a};
}

/// The segments beside each one and itself, of a trial whose segments are its own.
using Beside = std::vector<std::array<std::int32_t, 3>>;

/// By the trial's first points; the ends of a closed fiber are beside each other.
Beside besideOf(const FiberPolylines& fibers, const std::vector<std::int32_t>& segment_of) {
  Beside beside(segment_of.size());
  for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
    if (fibers.segmentCount(f) == 0) continue;
    const std::int32_t first = segment_of[fibers.point_begin[f]];
    const std::int32_t last = segment_of[fibers.point_begin[f] + fibers.segmentCount(f) - 1];
    for (std::int32_t i = first; i <= last; ++i) {
      const bool wraps = fibers.isClosed(f);
      beside[static_cast<std::size_t>(i)] = {i,
                                             i > first ? i - 1
                                             : wraps   ? last
                                                       : i,
                                             i < last ? i + 1
                                             : wraps  ? first
                                                      : i};
    }
  }
  return beside;
}

/// Whether one of `names`, ascending, is that of these two segments or of segments beside them.
bool has(const std::vector<Name>& names, const Name& name, const Beside& beside) {
  if (beside.empty() || name.second == kAMesh) {
    return std::binary_search(names.begin(), names.end(), name);
  }
  for (const std::int32_t a : beside[static_cast<std::size_t>(name.first)]) {
    for (const std::int32_t b : beside[static_cast<std::size_t>(name.second)]) {
      if (std::binary_search(names.begin(), names.end(), nameOf(a, b))) return true;
    }
  }
  return false;
}

/// The share of which a sample of n shows `share`, at most, with 97.5 % confidence (Wilson, 1927).
double upperBound(double share, double n) {
  if (!(n > 0)) return 1;
  constexpr double z = 1.959964;
  const double z2 = z * z / n;
  return (share + z2 / 2 + z * std::sqrt(share * (1 - share) / n + z2 / (4 * n))) / (1 + z2);
}

Errors errorsOf(std::vector<double> values) {
  if (values.empty()) return {};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return {*middle, *std::max_element(values.begin(), values.end()), values.size()};
}

double degreesBetween(const Point& p, const Point& q) {
  // As exact for small angles as for large ones.
  double apart = 0, together = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    apart += (p[k] - q[k]) * (p[k] - q[k]);
    together += (p[k] + q[k]) * (p[k] + q[k]);
  }
  return 2 * std::atan2(std::sqrt(apart), std::sqrt(together)) * 57.29577951308232;
}

bool isNull(const Point& p) { return p == Point{}; }

/// Adds a pair of two segments, of which each brings one half if it is in the sample, as it does to
/// Verdict::weightOf().
/// @param piece  by segment; 0 for those outside of the sample
void addPair(const std::vector<std::size_t>& piece, std::int32_t a, std::int32_t b,
             EffectiveCount& pairs) {
  const auto addEnd = [&](std::int32_t i, double weight) {
    const std::size_t its = piece[static_cast<std::size_t>(i)];
    if (its != 0) pairs.add(its, weight);
  };
  addEnd(a, b == kAMesh ? 1 : 0.5);
  if (b != kAMesh) addEnd(b, 0.5);
}

}  // namespace

double radiusOf(const FiberPolylines& fibers, const Touch& touch) {
  const double a = fibers.radiusAt(static_cast<std::size_t>(touch.a));
  return touch.b == kAMesh ? a : (a + fibers.radiusAt(static_cast<std::size_t>(touch.b))) / 2;
}

double mostHidden(const Verdict& verdict) {
  if (verdict.isWhole()) return 0;
  EffectiveCount contacts;
  for (const Touch& touch : verdict.contacts) {
    addPair(verdict.sample, touch.a, touch.b, contacts);
  }
  return upperBound(0, contacts.get());
}

Outcome compare(const Scene& scene, const Verdict& verdict, const Setting& setting,
                const std::vector<Touch>& found) {
  const bool is_coarser = setting.segment_of != nullptr;
  const auto own = [&](std::int32_t segment) {
    return is_coarser && segment != kAMesh
               ? (*setting.segment_of)[static_cast<std::size_t>(segment)]
               : segment;
  };
  Outcome outcome;
  outcome.reported = found.size();
  outcome.contacts = verdict.contacts.size();

  std::vector<Name> names;
  names.reserve(found.size());
  for (const Touch& touch : found) names.emplace_back(touch.a, touch.b);
  std::vector<Name> true_names;
  for (const auto* touches : {&verdict.contacts, &verdict.open}) {
    for (const Touch& touch : *touches) {
      true_names.push_back(nameOf(own(touch.a), own(touch.b)));
    }
  }
  const Beside beside = is_coarser ? besideOf(scene.fibers, *setting.segment_of) : Beside();
  double weight = 0, missed_weight = 0;
  EffectiveCount contacts;
  for (std::size_t i = 0; i < verdict.contacts.size(); ++i) {
    const Touch& touch = verdict.contacts[i];
    const double of_one = verdict.weightOf(touch.a, touch.b);
    weight += of_one;
    addPair(verdict.sample, touch.a, touch.b, contacts);
    if (has(names, true_names[i], beside)) continue;
    ++outcome.missed;
    missed_weight += of_one;
  }
  outcome.missed_share = weight > 0 ? missed_weight / weight : 0;
  const auto mostOf = [&](double share, const EffectiveCount& pairs) {
    return verdict.isWhole() ? share : upperBound(share, pairs.get());
  };
  outcome.most_missed = mostOf(outcome.missed_share, contacts);

  // Segments of the trial all of whose neighbourhood is in the sample, and one of their pieces.
  std::vector<bool> is_judged(verdict.sample.size(), true);
  std::vector<std::size_t> piece(verdict.sample.size());
  for (std::size_t f = 0; f < scene.fibers.fiberCount(); ++f) {
    for (std::size_t n = 0; n < scene.fibers.segmentCount(f); ++n) {
      const std::size_t i = scene.fibers.point_begin[f] + n;
      const auto segment = static_cast<std::size_t>(own(static_cast<std::int32_t>(i)));
      piece[segment] = std::max(piece[segment], verdict.sample[i]);
      if (verdict.sample[i] != 0) continue;
      is_judged[segment] = false;
      if (!is_coarser) continue;
      for (const std::int32_t k : beside[segment]) is_judged[static_cast<std::size_t>(k)] = false;
    }
  }
  for (std::size_t i = 0; i < piece.size(); ++i) {
    if (!is_judged[i]) piece[i] = 0;
  }
  const auto isJudged = [&](std::int32_t segment) {
    return segment != kAMesh && piece[static_cast<std::size_t>(segment)] != 0;
  };
  std::vector<std::pair<Name, const Touch*>> deepest;
  for (std::size_t i = 0; i < verdict.contacts.size(); ++i) {
    deepest.emplace_back(true_names[i], &verdict.contacts[i]);
  }
  std::sort(true_names.begin(), true_names.end());
  double judged_weight = 0, wrong_weight = 0;
  EffectiveCount judged;
  for (const Name& name : names) {
    const bool a = isJudged(name.first), b = isJudged(name.second);
    if (!a && !b) continue;
    // As Verdict::weightOf() of a contact.
    const double of_one = (a && b) || name.second == kAMesh ? 1 : 0.5;
    ++outcome.judged;
    judged_weight += of_one;
    addPair(piece, name.first, name.second, judged);
    if (has(true_names, name, beside)) continue;
    ++outcome.wrong;
    wrong_weight += of_one;
  }
  outcome.false_share = judged_weight > 0 ? wrong_weight / judged_weight : 0;
  outcome.most_false = mostOf(outcome.false_share, judged);

  // A pair is compared with the deepest of the contacts that its segments have.
  std::sort(deepest.begin(), deepest.end(), [](const auto& p, const auto& q) {
    return std::tie(p.first, p.second->distance) < std::tie(q.first, q.second->distance);
  });
  std::vector<double> depth, normal, place;
  for (std::size_t i = 0; i < deepest.size(); ++i) {
    if (i > 0 && deepest[i].first == deepest[i - 1].first) continue;
    const auto at = std::lower_bound(names.begin(), names.end(), deepest[i].first);
    if (at == names.end() || *at != deepest[i].first) continue;
    const Touch& touch = found[static_cast<std::size_t>(at - names.begin())];
    const Touch& truth = *deepest[i].second;
    const double radius = radiusOf(scene.fibers, truth);
    if (!(radius > 0)) continue;
    depth.push_back(std::abs(touch.distance - truth.distance) / radius);
    if (isNull(truth.normal) || isNull(touch.normal)) continue;
    normal.push_back(degreesBetween(touch.normal, truth.normal));
    if (!truth.is_at_one_place) continue;
    place.push_back(std::hypot(touch.place[0] - truth.place[0], touch.place[1] - truth.place[1],
                               touch.place[2] - truth.place[2]) /
                    radius);
  }
  outcome.depth = errorsOf(std::move(depth));
  outcome.normal = errorsOf(std::move(normal));
  outcome.place = errorsOf(std::move(place));
  return outcome;
}

}  // namespace fcl_fibers::tools::trade
