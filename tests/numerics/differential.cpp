// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/differential.h"

#include <cmath>
#include <iterator>
#include <type_traits>

namespace fcl_fibers::test {

template <typename S>
void differ(RandomKind kind, std::size_t capsules, std::uint64_t seed, Form form,
            const HairFiles& hair, Tally& tally) {
  const Assembly<S> fibers = randomScene<S>(kind, capsules, seed, hair);
  const Specimen<S> specimen(fibers, form);
  const TouchOracle& truth = specimen.truth();
  const double margin = seed % 5 == 0 ? 0.01 : 0;

  std::vector<NumberPair> touching;
  truth.visitNearPairs(margin, [&](std::size_t i, std::size_t j, const auto& verdict) {
    const double off = std::fabs(verdict.excess);
    tally.within_radius += off <= verdict.reach / 2;
    tally.at_contact += off <= 1e-12 * verdict.reach;
    tally.exact += verdict.exact;
    if (!verdict.touching) return;
    touching.push_back({static_cast<std::int32_t>(i), static_cast<std::int32_t>(j)});
  });
  ++tally.scenes;
  tally.decisions += truth.size() * (truth.size() - (truth.size() > 0)) / 2;
  tally.touching += touching.size();

  constexpr History kHistories[] = {History::kNew, History::kUpdated, History::kGrown};
  std::size_t kind_of_tree = 0;
  for (const FiberTreeOptions& options : allKinds(margin)) {
    const std::size_t history = (seed + kind_of_tree++) % std::size(kHistories);
    const Findings findings =
        examine(truth, touching, options, specimen.pairs(options, kHistories[history]));
    tally.reported += findings.reported;
    tally.wrong += findings.missed + findings.repeated + findings.unpromised;
    if (findings.isRight() || !tally.first_wrong.empty()) continue;
    tally.first_wrong = nameOf(kind) + ", " + (std::is_same_v<S, float> ? "float" : "double") +
                        ", seed " + std::to_string(seed) + ", " + std::to_string(capsules) +
                        " capsules, " + describe(form, options) + ", history " +
                        std::to_string(history) + ": " + findings.first_wrong;
  }
}

template void differ<float>(RandomKind, std::size_t, std::uint64_t, Form, const HairFiles&, Tally&);
template void differ<double>(RandomKind, std::size_t, std::uint64_t, Form, const HairFiles&,
                             Tally&);

}  // namespace fcl_fibers::test
