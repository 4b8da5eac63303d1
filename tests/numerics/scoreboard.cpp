// SPDX-License-Identifier: BSD-3-Clause
//
//   fcl_fibers_scoreboard FOLDER [ROW...]
//
// Who misses what at the extremes: prints docs/scoreboard.md, and writes its tables to the folder,
// which is docs/measured. Each contender answers each row in a process of its own, which may crash
// or take too long.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
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
constexpr const char* kNoMargin = "no margin";

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
    managers.push_back(
        fclManager<S>(std::string("FCL's ") + name, make, benchmarks::capsulesTouch<S>));
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
  if (row.margin > 0 && !contender.has_margin) return kNoMargin;
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

// --- The page and its tables ---

/// What the page and the tables are of.
std::string source() {
  const auto told = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value == nullptr ? "unknown" : value);
  };
  const bool is_gcc = std::string(__VERSION__).find("lang") == std::string::npos;
  return (is_gcc ? "g++ " : "") + std::string(__VERSION__) + "; commit " +
         told("FCL_FIBERS_COMMIT") + ", code " + told("FCL_FIBERS_CODE") + '.';
}

void writeLine(std::ostream& out, const std::vector<std::string>& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const bool is_quoted = cells[i].find(',') != std::string::npos;
    out << (i > 0 ? "," : "") << (is_quoted ? '"' + cells[i] + '"' : cells[i]);
  }
  out << '\n';
}

/// In how many rows a contender is right, of those that it can be asked.
struct Sum {
  std::string name;
  std::size_t right = 0, asked = 0;
};

/// Writes a row for each extreme and a column for each contender.
/// @param wanted  names of rows; all if there are none
template <typename S>
std::vector<Sum> writeTable(const std::string& path, const std::vector<std::string>& wanted) {
  std::vector<Contender<S>> all = contenders<S>();
  for (Contender<S>& manager : otherManagers<S>()) all.push_back(std::move(manager));
  std::vector<Sum> sums;
  std::vector<std::string> names = {"row"};
  for (const Contender<S>& contender : all) {
    names.push_back(contender.name);
    sums.push_back({contender.name});
  }
  std::ofstream table(path);
  writeLine(table, names);
  for (const ExtremeRow<S>& row : extremeRows<S>()) {
    const bool is_named = std::find(wanted.begin(), wanted.end(), row.name) != wanted.end();
    if (row.isTapered() || !row.environment.isPossible() || !(wanted.empty() || is_named)) continue;
    std::cerr << row.name << '\n';
    std::vector<std::string> cells = {row.name};
    for (std::size_t i = 0; i < all.size(); ++i) {
      cells.push_back(cellOf(all[i], row));
      sums[i].right += cells.back() == "0" ? 1 : 0;
      sums[i].asked += cells.back() == kNoMargin ? 0 : 1;
    }
    writeLine(table, cells);
  }
  std::vector<std::string> last(names.size());
  last[0] = source();
  writeLine(table, last);
  if (!table.flush()) throw std::runtime_error("scoreboard: " + path + " cannot be written");
  return sums;
}

std::string cellOf(const std::vector<Sum>& sums, const std::string& name) {
  for (const Sum& sum : sums) {
    if (sum.name == name) return std::to_string(sum.right) + " of " + std::to_string(sum.asked);
  }
  return "-";
}

void printPage(const std::string& folder, const std::vector<std::string>& wanted) {
  const std::vector<Sum> in_double = writeTable<double>(folder + "/scoreboard_double.csv", wanted);
  const std::vector<Sum> in_float = writeTable<float>(folder + "/scoreboard_float.csv", wanted);
  std::cout
      << "# The scoreboard: who misses what at the extremes\n\n"
         "Each row of [numerics.md](numerics.md#rows) without tapers is asked of each contender, "
         "in a process of its own. A\nrow is right if no touching pair is missed, no pair is "
         "reported twice, and none is reported whose distance exceeds the\nradii by more than 256 "
         "eps of the extent, in the numbers of its column. [In\n"
         "double](measured/scoreboard_double.csv) and [in float](measured/scoreboard_float.csv) "
         "have "
         "a cell for each row: 0 if it\nis right, or the numbers of pairs that are missed, and of "
         "pairs that are repeated or too far apart. *Hangs*: no\nanswer in "
      << kMostSeconds
      << " seconds. *Crashes*: the process has ended. *Refuses*: an exception. The rows with a "
         "margin are asked of\nour library alone, because a margin is another number in each "
         "library.\n\n"
         "| rows that are right | in double | in float |\n|---|--:|--:|\n";
  for (const Sum& sum : in_double) {
    std::cout << "| " << sum.name << " | " << cellOf(in_double, sum.name) << " | "
              << cellOf(in_float, sum.name) << " |\n";
  }
  std::cout
      << "\n`fcl_fibers_scoreboard docs/measured > docs/scoreboard.md`, " << source()
      << "\n\n* **FiberTree** and **our manager** report what touches. In "
         "SubnormalFlushedToZero they report pairs that do not\n  touch, and miss none.\n"
         "* **FCL** " FCL_VERSION
         ": `DynamicAABBTreeCollisionManager` on the boxes of its objects. In the callback is the "
         "closed form of\n  two capsules as textbooks have it, or `fcl::distance`, or "
         "`fcl::collide` with libccd, which is FCL's default, or\n  with FCL's own GJK, both with "
         "their default tolerance.\n"
         "* **FCL's other managers** have the closed form. The cells of its "
         "`SpatialHashingCollisionManager` are a twentieth of\n  the longest side of the scene. "
         "Which object of a pair comes first may depend on addresses, and peers\n"
         "  may round by it. So their numbers of pairs may differ from run to run, and so may\n"
         "  their numbers of right rows. A row that takes about 10 seconds hangs in some runs.\n";
  for (const std::string& line : peerTexts()) std::cout << "* " << line << '\n';
  std::cout
      << "\nPeers are found where `CMAKE_PREFIX_PATH` leads to them; PyPI's coal is in the "
         "folder `cmeel.prefix`. In the row\nSubnormalFlushedToZero the program makes one point "
         "of the whole scene before anyone is asked.\n";
}

}  // namespace
}  // namespace fcl_fibers::test

int main(int argc, char** argv) {
  try {
    if (argc < 2) throw std::runtime_error("fcl_fibers_scoreboard FOLDER [ROW...]");
    fcl_fibers::test::printPage(argv[1], {argv + 2, argv + argc});
    return 0;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
