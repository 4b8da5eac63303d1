// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <sstream>
#include <stdexcept>

#include "contenders/contender.h"

namespace fcl_fibers::benchmarks {
namespace {

using Contenders = std::vector<Contender>;

void add(Contenders& contenders, const Contenders& more) {
  contenders.insert(contenders.end(), more.begin(), more.end());
}

void addOtherFclManagers(Contenders& contenders, Boxes boxes) {
  for (const Contender& manager : fclManagers(boxes)) {
    if (manager.manager.find("DynamicAABBTree") != 0) contenders.push_back(manager);
  }
}

/// Those of the pool that a list names.
Against named(const std::string& list, const Contenders& pool) {
  Against against;
  std::istringstream names(list);
  for (std::string name; std::getline(names, name, ',');) {
    const auto found = std::find_if(pool.begin(), pool.end(), [&](const Contender& contender) {
      return contender.name() == name;
    });
    if (found == pool.end()) {
      std::string all;
      for (const Contender& contender : pool) all += " " + contender.name();
      throw std::invalid_argument("--against=" + list + ": there is no '" + name +
                                  "'; there are headline, full, all, paper, paper_all, and" + all);
    }
    const auto isIt = [&](const Contender& other) { return other.name() == name; };
    if (std::none_of(against.contenders.begin(), against.contenders.end(), isIt)) {
      against.contenders.push_back(*found);
    }
  }
  return against;
}

}  // namespace

Against readAgainst(const std::string& text) {
  constexpr std::array kBoth = {Boxes::kTight, Boxes::kStock};
  const std::string paper = "paper:";
  Against against;
  if (text == "headline") {
    for (const Contender& contender : ourContenders()) {
      const bool is_other = contender.variant == "super_thread" ||
                            contender.reported == Reported::kSpheres ||
                            contender.manager == "WrappedSphereTree";
      if (!is_other) against.contenders.push_back(contender);
    }
    for (const Contender& contender : foreignContenders()) {
      if (contender.manager == "Embree") against.contenders.push_back(contender);
    }
  } else if (text == "full") {
    add(against.contenders, ourContenders());
    add(against.contenders, foreignContenders());
  } else if (text == "all") {
    add(against.contenders, ourContenders());
    for (const Boxes boxes : kBoth) addOtherFclManagers(against.contenders, boxes);
  } else if (text == "paper" || text == "paper_all") {
    against.contenders = paperTrees();
    if (text == "paper_all") addOtherFclManagers(against.contenders, Boxes::kTight);
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
