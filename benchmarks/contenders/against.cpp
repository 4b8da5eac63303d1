// SPDX-License-Identifier: BSD-3-Clause
#include <set>
#include <sstream>
#include <stdexcept>

#include "contenders/contender.h"

namespace fcl_fibers::benchmarks {
namespace {

template <typename S>
using Contenders = std::vector<BasicContender<S>>;

template <typename S>
void add(Contenders<S>& contenders, const Contenders<S>& more) {
  contenders.insert(contenders.end(), more.begin(), more.end());
}

/// Those of the pool that a list names.
template <typename S>
BasicAgainst<S> named(const std::string& list, const Contenders<S>& pool) {
  std::set<std::string> names;
  std::istringstream words(list);
  for (std::string name; std::getline(words, name, ',');) names.insert(name);
  BasicAgainst<S> against;
  std::string all;
  for (const BasicContender<S>& contender : pool) {
    if (names.erase(contender.name()) > 0) against.contenders.push_back(contender);
    all += " " + contender.name();
  }
  if (names.empty()) return against;
  throw std::invalid_argument("--against=" + list + ": there is no '" + *names.begin() +
                              "'; there are headline, full, fcl, embree, paper, paper_all, and" +
                              all);
}

}  // namespace

template <typename S>
Contenders<S> BasicAgainst<S>::all() const {
  Contenders<S> found = contenders;
  add(found, tried);
  return found;
}

template <typename S>
BasicAgainst<S> readAgainst(const std::string& text) {
  const std::string paper = "paper:";
  BasicAgainst<S> against;
  against.tried = allOf<S>({Group::kFclTuned, Group::kFclNeverRebuilt});
  if (text == "headline" || text == "full" || text == "fcl") {
    for (const BasicContender<S>& contender : allOf<S>({Group::kOurs})) {
      const bool is_box_tree = contender.manager == "LayeredAABBTree";
      // It takes minutes on the scenes of `full`.
      if (contender.variant == "super_thread") continue;
      if (text == "full" || is_box_tree) against.contenders.push_back(contender);
    }
    against.quick = true;
    against.pair_work = {PairWork::kTest};
    for (const BasicContender<S>& contender : allOf<S>({Group::kForeign})) {
      const bool is_short = contender.manager == "Grid";
      // Bullet takes a minute on the cap.
      const bool is_long = contender.manager == "Bullet";
      if (is_short || text == "full" || (text == "headline" && !is_long)) {
        against.contenders.push_back(contender);
      }
    }
    if (text == "fcl") return against;
    against.pair_work.push_back(PairWork::kCollide);
    add(against.tried, allOf<S>({Group::kForeignTuned}));
  } else if (text == "embree") {
    against.tried.clear();
    against.quick = true;
    against.pair_work = {PairWork::kTest};
    for (const BasicContender<S>& contender : allOf<S>({Group::kOurs, Group::kForeign})) {
      const std::string name = contender.name();
      const bool is_ours = name == "LayeredAABBTree/boxes" || name == "LayeredAABBTree/capsules";
      const bool is_embree = contender.manager == "Embree" && name.find("threads") == name.npos;
      if (is_ours || is_embree) against.contenders.push_back(contender);
    }
  } else if (text == "paper" || text == "paper_all") {
    against.contenders = paperTrees<S>();
    if (text == "paper_all") {
      add(against.contenders, allOf<S>({Group::kFclOthers}, Boxes::kTight));
    }
    against.tried = allOf<S>({Group::kFclTuned, Group::kFclNeverRebuilt}, Boxes::kTight);
  } else {
    const bool is_paper = text.compare(0, paper.size(), paper) == 0;
    Contenders<S> pool = is_paper ? paperTrees<S>() : allOf<S>({Group::kOurs});
    add(pool, allOf<S>({Group::kFclTuned, Group::kFclNeverRebuilt, Group::kFclTrees,
                        Group::kFclOthers, Group::kForeign, Group::kForeignTuned}));
    if (!is_paper) return named(text, pool);
    // One more, to which counts are held.
    return named(text.substr(paper.size()) + ",LayeredAABBTree/boxes", pool);
  }
  return against;
}

template struct BasicAgainst<float>;
template struct BasicAgainst<double>;
template BasicAgainst<float> readAgainst(const std::string&);
template BasicAgainst<double> readAgainst(const std::string&);

}  // namespace fcl_fibers::benchmarks
