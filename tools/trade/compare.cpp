// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
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
  return a < b || b == kMesh ? Name{a, b} : Name{b, a};
}

/// Whether one of `names`, ascending, is that of these two segments or, if `beside`, of segments
/// beside them.
bool has(const std::vector<Name>& names, const Name& name, bool beside) {
  const std::int32_t reach = beside ? 1 : 0;
  for (std::int32_t i = -reach; i <= reach; ++i) {
    for (std::int32_t j = -reach; j <= reach; ++j) {
      if (std::binary_search(names.begin(), names.end(), nameOf(name.first + i, name.second + j))) {
        return true;
      }
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

}  // namespace

double radiusOf(const FiberPolylines& fibers, const Touch& touch) {
  const double a = fibers.radiusAt(static_cast<std::size_t>(touch.a));
  return touch.b == kMesh ? a : (a + fibers.radiusAt(static_cast<std::size_t>(touch.b))) / 2;
}

double Outcome::missedShare() const {
  return contacts > 0 ? static_cast<double>(missed) / static_cast<double>(contacts) : 0;
}
double Outcome::falseShare() const {
  return judged > 0 ? static_cast<double>(wrong) / static_cast<double>(judged) : 0;
}

Outcome compare(const Scene& scene, const Verdict& verdict, const Setting& setting,
                const std::vector<Touch>& found) {
  const bool is_coarser = setting.segment_of != nullptr;
  const auto own = [&](std::int32_t segment) {
    return is_coarser && segment != kMesh ? (*setting.segment_of)[static_cast<std::size_t>(segment)]
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
  for (std::size_t i = 0; i < verdict.contacts.size(); ++i) {
    if (!has(names, true_names[i], is_coarser)) ++outcome.missed;
  }
  outcome.most_missed = verdict.isWhole()
                            ? outcome.missedShare()
                            : upperBound(outcome.missedShare(), verdict.effective_count);

  // Segments of the trial all of whose neighbourhood is in the sample.
  std::vector<std::uint8_t> is_judged(verdict.in_sample.size(), 1);
  for (std::size_t f = 0; f < scene.fibers.fiberCount(); ++f) {
    for (std::size_t n = 0; n < scene.fibers.segmentCount(f); ++n) {
      const std::size_t i = scene.fibers.point_begin[f] + n;
      if (verdict.in_sample[i] != 0) continue;
      const std::int32_t segment = own(static_cast<std::int32_t>(i));
      const std::int32_t reach = is_coarser ? 1 : 0;
      for (std::int32_t k = std::max(segment - reach, 0); k <= segment + reach; ++k) {
        is_judged[static_cast<std::size_t>(k)] = 0;
      }
    }
  }
  const auto isJudged = [&](std::int32_t segment) {
    return segment != kMesh && is_judged[static_cast<std::size_t>(segment)] != 0;
  };
  std::vector<std::pair<Name, const Touch*>> deepest;
  for (std::size_t i = 0; i < verdict.contacts.size(); ++i) {
    deepest.emplace_back(true_names[i], &verdict.contacts[i]);
  }
  std::sort(true_names.begin(), true_names.end());
  for (const Name& name : names) {
    if (!isJudged(name.first) && !isJudged(name.second)) continue;
    ++outcome.judged;
    if (!has(true_names, name, is_coarser)) ++outcome.wrong;
  }

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
