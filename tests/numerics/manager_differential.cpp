// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/manager_differential.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <numeric>
#include <optional>
#include <sstream>

#include "numerics/manager_scenes.h"

namespace fcl_fibers::test {
namespace {

constexpr const char* kNames[kFeatures] = {
    "motion",           "no motion", "solid",        "open",       "deforming", "unequal margins",
    "in both",          "roots",     "groups",       "categories", "clone",     "failed update",
    "coming and going", "self",      "two managers", "one object", "distance",  "findImpact",
    "other report"};

/// So that scenes of consecutive numbers have nothing in common.
std::uint64_t mixed(std::uint64_t seed, std::uint64_t number) {
  std::uint64_t x = seed * 0x9e3779b97f4a7c15 + number + 1;
  for (const std::uint64_t factor : {0xbf58476d1ce4e5b9, 0x94d049bb133111eb}) {
    x = (x ^ (x >> 30)) * factor;
  }
  return x ^ (x >> 31);
}

std::size_t at(Feature feature) { return static_cast<std::size_t>(feature); }

/// Why a pair is left out.
enum class Rule { kNone, kItself, kNeighbors, kGroup, kRoot, kCategories };

Rule ruleOf(const Party& a, const Party& b) {
  if (a.is_obstacle == b.is_obstacle) return Rule::kNone;
  if (a.is_root || b.is_root) return Rule::kRoot;
  return (a.bits & b.bits) != 0 ? Rule::kNone : Rule::kCategories;
}

bool areNeighbors(const Member& a, const Member& b, int ignored) {
  if (a.fiber < 0 || a.fiber != b.fiber) return false;
  const int apart = std::abs(a.segment - b.segment);
  return apart <= ignored || (a.is_closed && a.fiber_size - apart <= ignored);
}

/// A manager is asked about itself, another manager or one object.
class Query {
 public:
  /// What brute force knows of a pair.
  struct Candidate {
    const Member* a;
    Thing* b;
    Body body_a, body_b;
    Rule rule;
  };

  Query(ManagerScene& scene, ManagerTally& tally, std::string& first_wrong)
      : scene_(scene),
        tally_(tally),
        first_wrong_(first_wrong),
        random_(scene.random()),
        asked_index_(random_.below(2)),
        asked_(scene.manager(asked_index_)),
        is_distance_(random_.below(3) == 0),
        moves_(asked_.options().motion && !is_distance_) {
    const std::size_t form = random_.below(8);
    if (form < 3) {
      other_ = &scene.manager(1 - asked_index_);
    } else if (form < 6) {
      const std::size_t kind = random_.below(4);
      object_ = kind == 0 || asked_.members().empty()
                    ? scene.things()[random_.below(scene.things().size())].get()
                    : asked_.members()[random_.below(asked_.members().size())].thing;
      now_ = object_->now();
    }
    setFeatures();
  }

  void run() { is_distance_ ? distance() : collide(); }
  const Features& features() const { return features_; }
  bool isCovered() const { return is_covered_; }

 private:
  using Object = fcl::CollisionObjectd;
  using Counts = std::map<std::pair<std::size_t, std::size_t>, int>;

  void collide();
  void distance();
  template <class Visit>
  void visitCandidates(Visit&& visit) const;
  Candidate candidate(const Member& a, Thing* b, const Member* its) const;
  std::optional<Candidate> find(const Thing* a, Thing* b) const;
  Counts reported() const;
  void judgeReported();
  void judgeImpact(const Candidate& pair, const StepVerdict& verdict);
  template <class Callback>
  bool ask(const char* call, Callback&& callback);

  double tolerance() const {
    // Far more than rounding. In steps it also bounds the number of parts.
    const double margin = is_distance_ ? 0 : asked_.options().margin;
    return scene_.size() * (moves_ ? 1e-6 : 1e-9) + 1e-12 * margin;
  }
  void setFeatures();
  void cover(const Candidate& pair);
  void wrong(const std::string& what, const std::string& of);
  std::string describe(const Candidate& pair) const;
  std::string describe() const;

  ManagerScene& scene_;
  ManagerTally& tally_;
  std::string& first_wrong_;
  Random& random_;
  const std::size_t asked_index_;
  ModelledManager& asked_;
  const bool is_distance_;
  const bool moves_;  ///< whether the step counts, not only its end
  ModelledManager* other_ = nullptr;
  Thing* object_ = nullptr;
  Instant now_;  ///< of the object
  Features features_;
  bool is_covered_ = false;
  std::vector<std::pair<Thing*, Thing*>> calls_;
};

// --- Pairs ---

Query::Candidate Query::candidate(const Member& a, Thing* b, const Member* its) const {
  const Member* own = asked_.find(b);
  Rule rule = Rule::kNone;
  if (a.thing == b) {
    rule = Rule::kItself;
  } else if (own != nullptr && areNeighbors(a, *own, asked_.options().ignored_neighbors)) {
    rule = Rule::kNeighbors;
  } else if (own != nullptr && a.group != 0 && a.group == own->group) {
    rule = Rule::kGroup;
  } else {
    // What neither manager knows is an obstacle of all categories.
    rule = ruleOf(a.party, its != nullptr ? its->party : own != nullptr ? own->party : Party{});
  }
  const Body body_b = its != nullptr   ? other_->body(*its, moves_)
                      : own != nullptr ? asked_.body(*own, moves_)
                                       : Body{&b->shape(), &now_, &now_, false};
  return {&a, b, asked_.body(a, moves_), body_b, rule};
}

/// All pairs of the query in the order of their arguments.
template <class Visit>
void Query::visitCandidates(Visit&& visit) const {
  const auto& members = asked_.members();
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (other_ != nullptr) {
      for (const Member& b : other_->members()) visit(candidate(members[i], b.thing, &b));
    } else if (object_ != nullptr) {
      visit(candidate(members[i], object_, nullptr));
    } else {
      for (std::size_t j = i + 1; j < members.size(); ++j) {
        visit(candidate(members[i], members[j].thing, nullptr));
      }
    }
  }
}

/// The candidate with these arguments, if it is one.
std::optional<Query::Candidate> Query::find(const Thing* a, Thing* b) const {
  const Member* first = asked_.find(a);
  const Member* its = other_ != nullptr ? other_->find(b) : nullptr;
  const Member* own = asked_.find(b);
  const bool is_asked = other_ != nullptr    ? its != nullptr
                        : object_ != nullptr ? b == object_
                                             : own != nullptr && first < own;
  if (first == nullptr || !is_asked) return std::nullopt;
  return candidate(*first, b, its);
}

// --- Coverage ---

void Query::setFeatures() {
  const auto has = [&](auto&& property) {
    return property(asked_) || (other_ != nullptr && property(*other_));
  };
  const auto set = [&](Feature feature, bool is_set) { features_[at(feature)] = is_set; };
  set(Feature::kMotion, asked_.options().motion);
  set(Feature::kNoMotion, has([](const auto& m) { return !m.options().motion; }));
  set(Feature::kClone, has([](const auto& m) { return m.was_cloned; }));
  set(Feature::kFailedUpdate, has([](const auto& m) { return m.has_failed; }));
  set(Feature::kComingAndGoing, has([](const auto& m) { return m.has_changed; }));
  set(Feature::kSelf, other_ == nullptr && object_ == nullptr);
  set(Feature::kTwoManagers, other_ != nullptr);
  set(Feature::kOneObject, object_ != nullptr);
  set(Feature::kDistance, is_distance_);
  if (other_ == nullptr) return;
  set(Feature::kUnequalMargins, asked_.options().margin != other_->options().margin);
  set(Feature::kOtherReport, asked_.options().report != other_->options().report);
}

/// Notes what a pair that touches, or is left out, has to do with.
void Query::cover(const Candidate& pair) {
  const auto set = [&](Feature feature) { features_.set(at(feature)); };
  if (pair.rule == Rule::kRoot) set(Feature::kRoots);
  if (pair.rule == Rule::kGroup) set(Feature::kGroups);
  if (pair.rule == Rule::kCategories) set(Feature::kCategories);
  if (pair.rule != Rule::kNone) return;
  is_covered_ = true;
  for (const auto& [thing, body] :
       {std::pair(pair.a->thing, pair.body_a), std::pair(pair.b, pair.body_b)}) {
    if (thing->isMesh()) set(body.is_solid ? Feature::kSolid : Feature::kOpen);
    if (thing->isDeformed()) set(Feature::kDeforming);
    if (scene_.manager(0).find(thing) != nullptr && scene_.manager(1).find(thing) != nullptr) {
      set(Feature::kInBoth);
    }
  }
}

// --- What is wrong ---

std::string Query::describe() const {
  std::ostringstream text;
  text << (asked_index_ == 0 ? "A" : "B") << (is_distance_ ? ".distance(" : ".collide(");
  if (object_ != nullptr) text << "object " << object_->number();
  if (other_ != nullptr) text << (asked_index_ == 0 ? "B" : "A");
  text << ')';
  for (const ModelledManager* manager : {&asked_, other_}) {
    if (manager == nullptr) continue;
    const FiberManagerOptions& options = manager->options();
    text << (manager == &asked_ ? ": " : " and ")
         << (options.report == Report::kCapsules ? "capsules" : "volumes")
         << (manager->isOfSpheres() ? " by spheres" : "") << (options.motion ? " in motion" : "")
         << ", margin " << options.margin;
  }
  return text.str();
}

std::string Query::describe(const Candidate& pair) const {
  constexpr const char* kKinds[] = {"capsule", "mesh", "box", "half-space"};
  std::ostringstream text;
  for (const auto& [thing, body] :
       {std::pair(pair.a->thing, pair.body_a), std::pair(pair.b, pair.body_b)}) {
    text << (body.is_solid ? "solid " : "") << kKinds[static_cast<int>(thing->shape().kind)] << ' '
         << thing->number() << (thing == pair.b ? "" : " and ");
  }
  return text.str();
}

void Query::wrong(const std::string& what, const std::string& of) {
  ++tally_.wrong[what];
  if (first_wrong_.empty()) first_wrong_ = what + ": " + of + "\n  by " + describe();
}

Query::Counts Query::reported() const {
  Counts counts;
  for (const auto& [a, b] : calls_) ++counts[{a->number(), b->number()}];
  return counts;
}

/// Judges all that can be without distances.
void Query::judgeReported() {
  for (const auto& [pair, count] : reported()) {
    const auto name = [&, &pair = pair] {
      return std::to_string(pair.first) + " and " + std::to_string(pair.second);
    };
    if (count > 1) wrong("twice", name());
    const auto& things = scene_.things();
    const auto candidate = find(things[pair.first].get(), things[pair.second].get());
    if (!candidate || candidate->rule != Rule::kNone) wrong("rule", name());
  }
}

template <class Callback>
bool Query::ask(const char* call, Callback&& callback) {
  ++tally_.queries;
  try {
    callback();
  } catch (const std::exception& error) {
    wrong("refused", std::string(call) + ": " + error.what());
    return false;
  }
  return true;
}

// --- Queries ---

void Query::collide() {
  const auto take = [](Object* a, Object* b, void* calls) {
    static_cast<decltype(calls_)*>(calls)->emplace_back(static_cast<Thing*>(a),
                                                        static_cast<Thing*>(b));
    return false;
  };
  const bool is_answered = ask("collide", [&] {
    if (other_ != nullptr) return asked_->collide(&**other_, &calls_, take);
    if (object_ != nullptr) return asked_->collide(object_, &calls_, take);
    asked_->collide(&calls_, take);
  });
  if (!is_answered) return;
  asked_.seeStep();
  if (other_ != nullptr && moves_) other_->seeStep();
  judgeReported();

  const auto counts = reported();
  const double margin = asked_.options().margin;
  visitCandidates([&](const Candidate& pair) {
    if (!isJudged(pair.body_a, pair.body_b) || pair.rule == Rule::kItself) return;
    const StepVerdict verdict = judgeStep(pair.body_a, pair.body_b, margin, tolerance());
    if (verdict.state == StepVerdict::kTouching) cover(pair);
    if (pair.rule != Rule::kNone) {
      tally_.forbidden += verdict.state == StepVerdict::kTouching;
      return;
    }
    const bool is_reported = counts.count({pair.a->thing->number(), pair.b->number()}) > 0;
    tally_.touching += verdict.state == StepVerdict::kTouching;
    tally_.open += verdict.state == StepVerdict::kOpen;
    if (verdict.state == StepVerdict::kTouching && !is_reported) wrong("missed", describe(pair));
    if (verdict.state == StepVerdict::kApart && asked_.options().report == Report::kCapsules) {
      ++tally_.apart;
      if (is_reported) wrong("beyond", describe(pair));
    }
    if (is_reported && moves_) judgeImpact(pair, verdict);
  });
}

void Query::judgeImpact(const Candidate& pair, const StepVerdict& verdict) {
  TimedContact contact;
  bool is_found = false;
  const bool is_answered = ask("findImpact", [&] {
    is_found = asked_->findImpact(pair.a->thing, pair.b, other_ ? &**other_ : nullptr, contact);
  });
  if (!is_answered) return;
  const auto name = [&] { return describe(pair) + " at " + std::to_string(contact.time); };
  constexpr double kRounding = 1e-9;
  if (verdict.state == StepVerdict::kTouching) {
    ++tally_.impacts;
    features_.set(at(Feature::kFindImpact));
    if (!is_found) return wrong("no time", describe(pair));
    if (!(contact.time <= verdict.touch + kRounding)) {
      wrong("late", name() + ", not after " + std::to_string(verdict.touch));
    }
  }
  if (is_found && contact.is_exact && !(contact.time >= verdict.first - kRounding)) {
    wrong("early", name() + ", not before " + std::to_string(verdict.first));
  }
}

/// The callback asks for all that is nearer than a limit, or for the least distance.
void Query::distance() {
  struct Search {
    Query* query;
    bool lowers;
    double limit;
  };
  Search search{this, random_.below(2) == 0, scene_.size() * random_.between(0.01, 0.3)};
  if (search.lowers) search.limit = std::numeric_limits<double>::max();
  const auto take = [](Object* a, Object* b, void* data, double& distance) {
    auto& [query, lowers, limit] = *static_cast<Search*>(data);
    Thing *first = static_cast<Thing*>(a), *second = static_cast<Thing*>(b);
    query->calls_.emplace_back(first, second);
    const auto pair = query->find(first, second);
    if (lowers && pair && isJudged(pair->body_a, pair->body_b)) {
      limit = std::min(limit, distanceAtEnd(pair->body_a, pair->body_b));
    }
    distance = limit;
    return false;
  };
  const bool is_answered = ask("distance", [&] {
    if (other_ != nullptr) return asked_->distance(&**other_, &search, take);
    if (object_ != nullptr) return asked_->distance(object_, &search, take);
    asked_->distance(&search, take);
  });
  if (!is_answered) return;
  judgeReported();

  ++tally_.distances;
  const auto counts = reported();
  visitCandidates([&](const Candidate& pair) {
    if (!isJudged(pair.body_a, pair.body_b) || pair.rule == Rule::kItself) return;
    const double distance = distanceAtEnd(pair.body_a, pair.body_b);
    const bool is_near = distance < search.limit - tolerance();
    const bool is_least = search.lowers && distance <= search.limit + tolerance();
    if (is_near || is_least) cover(pair);
    if (pair.rule != Rule::kNone || !is_near) return;
    const bool is_handed = counts.count({pair.a->thing->number(), pair.b->number()}) > 0;
    if (!is_handed) {
      wrong("too far",
            describe(pair) + " at " + std::to_string(distance / scene_.size()) + " of the size");
    }
  });
}

}  // namespace

// --- Triples ---

const std::vector<Triple>& allTriples() {
  static const std::vector<Triple> triples = [] {
    std::vector<Triple> all;
    for (std::size_t i = 0; i < kFeatures; ++i) {
      for (std::size_t j = i + 1; j < kFeatures; ++j) {
        for (std::size_t k = j + 1; k < kFeatures; ++k) {
          all.push_back({Feature(i), Feature(j), Feature(k)});
        }
      }
    }
    return all;
  }();
  return triples;
}

std::string nameOf(const Triple& triple) {
  std::string name;
  for (const Feature feature : triple) {
    name += (name.empty() ? "" : ", ") + std::string(kNames[at(feature)]);
  }
  return name;
}

bool isImpossible(const Triple& triple) {
  const auto has = [&](Feature feature) {
    return std::find(triple.begin(), triple.end(), feature) != triple.end();
  };
  const bool self = has(Feature::kSelf), one = has(Feature::kOneObject);
  const bool two =
      has(Feature::kTwoManagers) || has(Feature::kUnequalMargins) || has(Feature::kOtherReport);
  const bool moves = has(Feature::kMotion) || has(Feature::kFindImpact);
  // A query is of one form. It is for distances or for pairs. A manager has motion or not, and
  // without it no times of impact.
  return self + one + two > 1 || (has(Feature::kDistance) && has(Feature::kFindImpact)) ||
         (moves && has(Feature::kNoMotion) && (self || one));
}

std::uint64_t ManagerTally::wrongs() const {
  return std::accumulate(wrong.begin(), wrong.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const auto& entry) { return sum + entry.second; });
}

std::size_t ManagerTally::leastCovered() const {
  std::size_t least = kTriples;
  for (std::size_t i = 0; i < kTriples; ++i) {
    if (isImpossible(allTriples()[i])) continue;
    if (least == kTriples || covered[i] < covered[least]) least = i;
  }
  return least;
}

std::string differManagers(Random source, int threads, ManagerTally& tally) {
  ++tally.scenes;
  std::string first_wrong;
  std::vector<Features> covered;
  try {
    ManagerScene scene(std::move(source), threads);
    Random& random = scene.random();
    for (std::size_t rounds = 2 + random.below(3); rounds > 0; --rounds) {
      for (std::size_t queries = 3 + random.below(4); queries > 0; --queries) {
        Query query(scene, tally, first_wrong);
        query.run();
        if (query.isCovered()) covered.push_back(query.features());
      }
      if (rounds > 1) scene.change();
    }
  } catch (const std::exception& error) {
    ++tally.wrong["refused"];
    if (first_wrong.empty()) first_wrong = std::string("refused: ") + error.what();
  }
  for (std::size_t i = 0; i < kTriples; ++i) {
    const Triple& triple = allTriples()[i];
    tally.covered[i] += std::any_of(covered.begin(), covered.end(), [&](const Features& features) {
      return features[at(triple[0])] && features[at(triple[1])] && features[at(triple[2])];
    });
  }
  return first_wrong;
}

std::string differManagers(std::uint64_t seed, std::uint64_t number, ManagerTally& tally) {
  return differManagers(Random(mixed(seed, number)), 1, tally);
}

}  // namespace fcl_fibers::test
