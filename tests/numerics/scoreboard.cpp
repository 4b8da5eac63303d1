// SPDX-License-Identifier: BSD-3-Clause
//
//   fcl_fibers_scoreboard [ROW...]
//
// Prints docs/scoreboard.md: who misses what at the extremes. Each contender answers each row in a
// process of its own, which may crash or take too long.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_SSaP.h>
#include <fcl/broadphase/broadphase_SaP.h>
#include <fcl/broadphase/broadphase_bruteforce.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree_array.h>
#include <fcl/broadphase/broadphase_interval_tree.h>
#include <fcl/broadphase/broadphase_spatialhash.h>
#include <fcl/config.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include "benchmarks/contenders/closed_form.h"
#include "numerics/extreme_rows.h"
#include "numerics/row_copies.h"
#include "numerics/scoreboard_peers.h"
#include "numerics/specimen.h"

namespace fcl_fibers::test {
namespace {

constexpr unsigned kMostSeconds = 10;  ///< of a row

template <typename S>
struct Contender {
  std::string name;
  bool has_margin;
  Form form;  ///< of the capsules that it is given, and judged by
  Ask<S> pairs;
};

FiberTreeOptions touching(double margin) {
  FiberTreeOptions options = FiberOptions{Topology::kBundle, Report::kCapsules};
  options.margin = margin;
  return options;
}

template <typename S>
std::vector<NumberPair> ours(const Specimen<S>& specimen, double margin) {
  return specimen.pairs(touching(margin));
}

// --- FCL's narrow phases ---

template <typename S>
using Narrow = bool (*)(const fcl::CollisionObject<S>&, const fcl::CollisionObject<S>&);

template <typename S>
bool isAtNoDistance(const fcl::CollisionObject<S>& a, const fcl::CollisionObject<S>& b) {
  fcl::DistanceResult<S> result;
  return fcl::distance(&a, &b, fcl::DistanceRequest<S>(), result) <= 0;
}

template <fcl::GJKSolverType kSolver, typename S>
bool collide(const fcl::CollisionObject<S>& a, const fcl::CollisionObject<S>& b) {
  fcl::CollisionRequest<S> request;
  request.gjk_solver_type = kSolver;
  fcl::CollisionResult<S> result;
  return fcl::collide(&a, &b, request, result) > 0;
}

// --- FCL's managers ---

template <typename S>
using Manager = fcl::BroadPhaseCollisionManager<S>;
template <typename S>
using Make = std::unique_ptr<Manager<S>> (*)(Objects<S>&);

template <typename S, class M>
std::unique_ptr<Manager<S>> make(Objects<S>&) {
  return std::make_unique<M>();
}

/// With cells of a twentieth of the scene, as in FCL's tests, where it is longest.
template <typename S>
std::unique_ptr<Manager<S>> makeSpatialHashing(Objects<S>& objects) {
  using Hashing = fcl::SpatialHashingCollisionManager<S>;
  fcl::Vector3<S> low, high;
  Hashing::computeBound(objects, low, high);
  return std::make_unique<Hashing>((high - low).maxCoeff() / 20, low, high);
}

/// A manager on the boxes that its objects have, and a narrow phase in the callback.
template <typename S>
Contender<S> fclManager(const std::string& name, Make<S> make, Narrow<S> narrow) {
  const auto pairs = [=](const Specimen<S>& specimen, double) {
    using Object = fcl::CollisionObject<S>;
    Objects<S> objects = withBoxes(specimen);
    const std::map<const Object*, std::int32_t> numbers = numbersOf<S>(objects);
    const std::unique_ptr<Manager<S>> manager = make(objects);
    manager->registerObjects(objects);
    manager->setup();
    struct Query {
      Narrow<S> narrow;
      const std::map<const Object*, std::int32_t>& numbers;
      std::vector<NumberPair> found;
    } query{narrow, numbers, {}};
    manager->collide(&query, [](Object* a, Object* b, void* data) {
      auto& asked = *static_cast<Query*>(data);
      if (asked.narrow(*a, *b)) asked.found.push_back({asked.numbers.at(a), asked.numbers.at(b)});
      return false;
    });
    return query.found;
  };
  return {name, false, Form::kObjects, pairs};
}

// --- The contenders ---

constexpr std::size_t kClosedForm = 2;  ///< of FCL's tree, among the following

template <typename S>
std::vector<Contender<S>> contenders() {
  const Make<S> tree = make<S, fcl::DynamicAABBTreeCollisionManager<S>>;
  std::vector<Contender<S>> all = {
      {"FiberTree", true, Form::kArrays, ours<S>},
      {"our manager", true, Form::kObjects, ours<S>},
      fclManager<S>("FCL, closed form", tree, benchmarks::capsulesTouch<S>),
      fclManager<S>("FCL, `fcl::distance`", tree, isAtNoDistance<S>),
      fclManager<S>("FCL, libccd", tree, collide<fcl::GST_LIBCCD, S>),
      fclManager<S>("FCL, its GJK", tree, collide<fcl::GST_INDEP, S>)};
  for (const auto& [name, pairs] : peers<S>()) all.push_back({name, false, Form::kObjects, pairs});
  return all;
}

/// FCL's other managers, with the closed form.
template <typename S>
std::vector<Contender<S>> otherManagers() {
  const std::pair<const char*, Make<S>> all[] = {
      {"DynamicAABBTree_Array", make<S, fcl::DynamicAABBTreeCollisionManager_Array<S>>},
      {"SaP", make<S, fcl::SaPCollisionManager<S>>},
      {"SSaP", make<S, fcl::SSaPCollisionManager<S>>},
      {"IntervalTree", make<S, fcl::IntervalTreeCollisionManager<S>>},
      {"SpatialHashing", makeSpatialHashing<S>},
      {"Naive", make<S, fcl::NaiveCollisionManager<S>>}};
  std::vector<Contender<S>> managers;
  for (const auto& [name, make] : all) {
    managers.push_back(fclManager<S>(name, make, benchmarks::capsulesTouch<S>));
  }
  return managers;
}

// --- What they are worth ---

struct Score {
  bool answered = false;
  std::size_t missed = 0, wrong = 0;
};

template <typename S>
Score scoreOf(const Contender<S>& contender, const ExtremeRow<S>& row) {
  const Specimen<S> specimen(row.fibers, contender.form);
  std::vector<NumberPair> pairs;
  {
    const ScopedFloatEnvironment environment(row.environment);
    pairs = contender.pairs(specimen, row.margin);
  }
  alarm(0);
  // What is promised of ours has the rounding of double. FCL computes in the scalar of its objects.
  const ExactBox box = boxAround(row.fibers);
  const Real excess = 256 * (Real(std::numeric_limits<S>::epsilon()) -
                             Real(std::numeric_limits<double>::epsilon()));
  const double slack = static_cast<double>(excess * (box.max - box.min).norm());
  const Findings findings = examine(specimen.truth(), touchingPairs(specimen.truth(), row.margin),
                                    touching(row.margin + slack), std::move(pairs));
  return {true, findings.missed, findings.unpromised + findings.repeated};
}

/// What a table has of a contender and a row.
template <typename S>
std::string cellOf(const Contender<S>& contender, const ExtremeRow<S>& row) {
  if (row.margin > 0 && !contender.has_margin) return "no margin";
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("scoreboard: pipe() failed");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("scoreboard: fork() failed");
  if (child == 0) {
    Score score;
    // FCL writes about what it cannot solve.
    if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(1);
    alarm(kMostSeconds);
    try {
      score = scoreOf(contender, row);
    } catch (const std::exception&) {
    }
    const bool written = write(ends[1], &score, sizeof score) == sizeof score;
    _exit(written ? 0 : 1);
  }
  close(ends[1]);
  Score score;
  const bool has_score = read(ends[0], &score, sizeof score) == sizeof score;
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) return "hangs";
  if (!has_score) return "crashes";
  if (!score.answered) return "refuses";
  if (score.missed == 0 && score.wrong == 0) return "0";
  return std::to_string(score.missed) + ", " + std::to_string(score.wrong);
}

// --- The page ---

using Cells = std::vector<std::string>;  ///< of a line, the first of which is its name

std::string line(const Cells& cells) {
  std::string text = "|";
  for (const std::string& cell : cells) text += ' ' + cell + " |";
  return text + '\n';
}

std::string head(const Cells& names) {
  std::string text = line(names) + "|---|";
  for (std::size_t i = 1; i < names.size(); ++i) text += "--:|";
  return text + '\n';
}

/// Lines of which a column for each of FCL's managers follows that of its tree: which managers ever
/// differ from the tree, where they do, and which never do.
void printManagers(const Cells& names, const std::vector<Cells>& lines) {
  std::vector<std::size_t> kept = {0, 1};
  std::string same;
  for (std::size_t i = 2; i < names.size(); ++i) {
    const bool differs =
        std::any_of(lines.begin(), lines.end(), [&](const Cells& l) { return l[i] != l[1]; });
    if (differs) kept.push_back(i);
    if (!differs) same += (same.empty() ? "" : ", ") + names[i];
  }
  const auto shortened = [&](const Cells& cells) {
    Cells some;
    for (const std::size_t i : kept) some.push_back(cells[i]);
    return some;
  };
  std::cout << "\nThe rows in which another manager of FCL, with the closed form, has other cells "
               "than its tree has:\n\n"
            << head(shortened(names));
  for (const Cells& cells : lines) {
    const Cells some = shortened(cells);
    const bool differs = std::any_of(some.begin() + 2, some.end(),
                                     [&](const std::string& cell) { return cell != some[1]; });
    if (differs) std::cout << line(some);
  }
  if (!same.empty()) std::cout << "\nThe same as the tree in every row: " << same << ".\n";
}

/// @param wanted  names of rows; all if there are none
template <typename S>
void printTables(const std::vector<std::string>& wanted) {
  const std::vector<Contender<S>> all = contenders<S>(), managers = otherManagers<S>();
  Cells names = {"row"}, manager_names = {"row", "DynamicAABBTree"};
  for (const auto& contender : all) names.push_back(contender.name);
  for (const auto& manager : managers) manager_names.push_back(manager.name);
  std::cout << head(names);
  std::vector<std::size_t> right(all.size());
  std::size_t rows = 0, margins = 0;
  std::vector<Cells> manager_lines;
  for (const ExtremeRow<S>& row : extremeRows<S>()) {
    const bool is_named = std::find(wanted.begin(), wanted.end(), row.name) != wanted.end();
    if (row.isTapered() || !row.environment.isPossible() || !(wanted.empty() || is_named)) continue;
    ++rows;
    margins += row.margin > 0 ? 1 : 0;
    std::cerr << row.name << '\n';
    Cells cells = {row.name};
    for (std::size_t i = 0; i < all.size(); ++i) {
      cells.push_back(cellOf(all[i], row));
      right[i] += cells.back() == "0" ? 1 : 0;
    }
    std::cout << line(cells);
    Cells of_managers = {row.name, cells[1 + kClosedForm]};
    for (const auto& manager : managers) of_managers.push_back(cellOf(manager, row));
    manager_lines.push_back(std::move(of_managers));
  }
  Cells sums = {"*right in, of " + std::to_string(rows) + ", " + std::to_string(margins) +
                " with a margin*"};
  for (const std::size_t count : right) sums.push_back(std::to_string(count));
  std::cout << line(sums);
  printManagers(manager_names, manager_lines);
}

void printPage(const std::vector<std::string>& wanted) {
  std::cout
      << "# The scoreboard: who misses what at the extremes\n\n"
         "`build/release/tests/fcl_fibers_scoreboard > docs/scoreboard.md` writes this page. Each "
         "row of\n[numerics.md](numerics.md#rows) is asked of each contender, in a process of its "
         "own. A cell has the touching pairs\nthat are missed, and the pairs that are reported "
         "twice or although rounding does not explain them: their distance\nexceeds the radii by "
         "more than 256 eps of the extent, where eps is that of the row's numbers. 0 means "
         "neither.\n\n"
         "*Hangs*: no answer in "
      << kMostSeconds
      << " seconds. *Crashes*: the process has ended. *Refuses*: an exception. FCL and its peers "
         "know no\nmargin.\n\nThe contenders:\n\n"
         "* **FiberTree** and **our manager** report what touches.\n"
         "* **FCL** " FCL_VERSION
         ": `DynamicAABBTreeCollisionManager` on the boxes of its objects. In the callback is the "
         "closed form\n  of two capsules as textbooks have it, or `fcl::distance`, or "
         "`fcl::collide` with libccd, which is FCL's default, or\n  with FCL's own GJK, both with "
         "their default tolerance. FCL's boxes and the closed form have the numbers of the "
         "row.\n"
         "* **FCL's other managers** have the closed form. The cells of its "
         "`SpatialHashingCollisionManager` are a twentieth of\n  the longest side of the scene. "
         "Which object of a pair comes first may depend on addresses, and the closed form\n"
         "  rounds by it, so a cell may differ by one from run to run.\n";
  for (const std::string& line : peerTexts()) std::cout << "* " << line << '\n';
  const char* const commit = std::getenv("FCL_FIBERS_COMMIT");
  std::cout
      << "\nPeers are found where `CMAKE_PREFIX_PATH` leads to them; PyPI's coal is in the folder "
         "`cmeel.prefix`. Compiled\nwith "
      << (std::string(__VERSION__).find("lang") == std::string::npos ? "g++ " : "") << __VERSION__
      << "; commit " << (commit == nullptr ? "unknown" : commit) << ".\n";
  std::cout << "\nIn the row SubnormalFlushedToZero the program makes one point of the whole scene "
               "before anyone is asked.\n\n## In double\n\n";
  printTables<double>(wanted);
  std::cout << "\n## In float\n\n";
  printTables<float>(wanted);
}

}  // namespace
}  // namespace fcl_fibers::test

int main(int argc, char** argv) {
  try {
    fcl_fibers::test::printPage({argv + 1, argv + argc});
    return 0;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
