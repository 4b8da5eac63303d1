// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <set>
#include <sstream>
#include <stdexcept>

#include "contenders/contender.h"

namespace fcl_fibers::benchmarks {
namespace {

using Contenders = std::vector<Contender>;

void add(Contenders& contenders, const Contenders& more) {
  contenders.insert(contenders.end(), more.begin(), more.end());
}

/// Those of the pool that a list names.
Against named(const std::string& list, const Contenders& pool) {
  std::set<std::string> names;
  std::istringstream words(list);
  for (std::string name; std::getline(words, name, ',');) names.insert(name);
  Against against;
  std::string all;
  for (const Contender& contender : pool) {
    if (names.erase(contender.name()) > 0) against.contenders.push_back(contender);
    all += " " + contender.name();
  }
  if (names.empty()) return against;
  throw std::invalid_argument("--against=" + list + ": there is no '" + *names.begin() +
                              "'; there are headline, full, all, paper, paper_all, and" + all);
}

}  // namespace

std::vector<Contender> Against::all() const {
  Contenders found = contenders;
  for (const Boxes boxes : fcl_trees) add(found, fclTrees(boxes));
  return found;
}

Against readAgainst(const std::string& text) {
  constexpr std::array kBoth = {Boxes::kTight, Boxes::kStock};
  const std::string paper = "paper:";
  Against against;
  if (text == "headline" || text == "full") {
    const bool all = text == "full";
    for (const Contender& contender : ourContenders()) {
      // It takes minutes on the scenes of `full`.
      if (contender.variant == "super_thread") continue;
      if (all || contender.manager == "LayeredAABBTree") against.contenders.push_back(contender);
    }
    for (const Contender& contender : foreignContenders()) {
      // A rebuild by surface area takes the longest of Embree's updates.
      const bool short_enough =
          contender.manager == "Embree" && contender.variant.find("rebuild") != 0;
      if (all || short_enough) against.contenders.push_back(contender);
    }
  } else if (text == "all") {
    add(against.contenders, ourContenders());
    for (const Boxes boxes : kBoth) add(against.contenders, otherFclManagers(boxes));
  } else if (text == "paper" || text == "paper_all") {
    against.contenders = paperTrees();
    if (text == "paper_all") add(against.contenders, otherFclManagers(Boxes::kTight));
    against.fcl_trees = {Boxes::kTight};
    return against;
  } else {
    const bool is_paper = text.compare(0, paper.size(), paper) == 0;
    Contenders pool = is_paper ? paperTrees() : ourContenders();
    for (const Boxes boxes : kBoth) {
      add(pool, fclTrees(boxes));
      add(pool, fclManagers(boxes));
    }
    add(pool, foreignContenders());
    if (!is_paper) return named(text, pool);
    // One more, to which counts are held.
    return named(text.substr(paper.size()) + ",LayeredAABBTree/boxes", pool);
  }
  against.fcl_trees = {kBoth.begin(), kBoth.end()};
  against.narrow_phase = against.quick = text != "all";
  return against;
}

}  // namespace fcl_fibers::benchmarks
