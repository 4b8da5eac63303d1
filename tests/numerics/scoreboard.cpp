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
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/config.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include "benchmarks/contenders/closed_form.h"
#include "numerics/extreme_rows.h"
#include "numerics/scoreboard_peers.h"
#include "numerics/specimen.h"

namespace fcl_fibers::test {
namespace {

constexpr unsigned kMostSeconds = 10;  ///< of a row

struct Contender {
  std::string name;
  bool has_margin;
  Form form;  ///< of the capsules that it is given, and judged by
  std::function<std::vector<NumberPair>(const Specimen<double>&, double margin)> pairs;
};

FiberTreeOptions touching(double margin) {
  FiberTreeOptions options = FiberOptions{Topology::kBundle, Report::kCapsules};
  options.margin = margin;
  return options;
}

std::vector<NumberPair> ours(const Specimen<double>& specimen, double margin) {
  return specimen.pairs(touching(margin));
}

/// FCL's tree on the boxes that its objects have, and a narrow phase in the callback.
template <class Narrow>
Contender fclTree(const std::string& name, const Narrow& narrow) {
  const auto pairs = [narrow](const Specimen<double>& specimen, double) {
    const std::vector<Object*> objects = withBoxes(specimen);
    const std::map<const Object*, std::int32_t> numbers = numbersOf(objects);
    fcl::DynamicAABBTreeCollisionManagerd manager;
    manager.registerObjects(objects);
    manager.setup();
    struct Query {
      const Narrow& narrow;
      const std::map<const Object*, std::int32_t>& numbers;
      std::vector<NumberPair> found;
    } query{narrow, numbers, {}};
    manager.collide(&query, [](Object* a, Object* b, void* data) {
      auto& asked = *static_cast<Query*>(data);
      if (asked.narrow(*a, *b)) asked.found.push_back({asked.numbers.at(a), asked.numbers.at(b)});
      return false;
    });
    return query.found;
  };
  return {name, false, Form::kObjects, pairs};
}

bool collide(const Object& a, const Object& b, fcl::GJKSolverType solver) {
  fcl::CollisionRequestd request;
  request.gjk_solver_type = solver;
  fcl::CollisionResultd result;
  return fcl::collide(&a, &b, request, result) > 0;
}

std::vector<Contender> contenders() {
  std::vector<Contender> all = {
      {"FiberTree", true, Form::kArrays, ours},
      {"our manager", true, Form::kObjects, ours},
      fclTree("FCL, closed form",
              [](const Object& a, const Object& b) { return benchmarks::capsulesTouch(a, b); }),
      fclTree("FCL, `fcl::distance`",
              [](const Object& a, const Object& b) {
                fcl::DistanceResultd result;
                return fcl::distance(&a, &b, fcl::DistanceRequestd(), result) <= 0;
              }),
      fclTree("FCL, libccd",
              [](const Object& a, const Object& b) { return collide(a, b, fcl::GST_LIBCCD); }),
      fclTree("FCL, its GJK",
              [](const Object& a, const Object& b) { return collide(a, b, fcl::GST_INDEP); })};
  for (const auto& [name, pairs] : peers()) all.push_back({name, false, Form::kObjects, pairs});
  return all;
}

struct Score {
  bool answered = false;
  std::size_t missed = 0, wrong = 0;
};

/// What a table has of a contender and a row.
std::string cellOf(const Contender& contender, const ExtremeRow<double>& row) {
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
      const Specimen<double> specimen(row.fibers, contender.form);
      std::vector<NumberPair> pairs;
      {
        const ScopedFloatEnvironment environment(row.environment);
        pairs = contender.pairs(specimen, row.margin);
      }
      alarm(0);
      const Findings findings =
          examine(specimen.truth(), touchingPairs(specimen.truth(), row.margin),
                  touching(row.margin), std::move(pairs));
      score = {true, findings.missed, findings.unpromised + findings.repeated};
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

/// @param names  of rows; all if there are none
void printPage(const std::vector<std::string>& names) {
  const std::vector<Contender> all = contenders();
  std::cout
      << "# The scoreboard: who misses what at the extremes\n\n"
         "`build/release/tests/fcl_fibers_scoreboard > docs/scoreboard.md` writes this page. Each "
         "row of\n[numerics.md](numerics.md#rows), in double, is asked of each contender, in a "
         "process of its own. A cell has the\ntouching pairs that are missed, and the pairs that "
         "are reported twice or although rounding does not explain\nthem: their distance exceeds "
         "the radii by more than 256 eps of the extent. 0 means neither.\n\n"
         "*Hangs*: no answer in "
      << kMostSeconds
      << " seconds. *Crashes*: the process has ended. *Refuses*: an exception. FCL and its peers "
         "know no\nmargin.\n\nThe contenders:\n\n"
         "* **FiberTree** and **our manager** report what touches.\n"
         "* **FCL** " FCL_VERSION
         ": `DynamicAABBTreeCollisionManager` on the boxes of its objects. In the callback is the "
         "closed form\n  of two capsules as textbooks have it, or `fcl::distance`, or "
         "`fcl::collide` with libccd, which is FCL's default, or\n  with FCL's own GJK, both with "
         "their default tolerance. FCL's boxes are in double.\n";
  for (const std::string& line : peerTexts()) std::cout << "* " << line << '\n';
  const char* const commit = std::getenv("FCL_FIBERS_COMMIT");
  std::cout
      << "\nPeers are found where `CMAKE_PREFIX_PATH` leads to them; PyPI's coal is in the folder "
         "`cmeel.prefix`. Compiled\nwith "
      << (std::string(__VERSION__).find("lang") == std::string::npos ? "g++ " : "") << __VERSION__
      << "; commit " << (commit == nullptr ? "unknown" : commit) << ".\n";
  std::cout << "\nIn the row SubnormalFlushedToZero the program makes one point of the whole scene "
               "before anyone is asked.\n";
  std::cout << "\n| row |";
  for (const Contender& contender : all) std::cout << ' ' << contender.name << " |";
  std::cout << "\n|---|";
  for (std::size_t i = 0; i < all.size(); ++i) std::cout << "--:|";
  std::cout << '\n';
  std::vector<std::size_t> right(all.size());
  std::size_t rows = 0, margins = 0;
  for (const ExtremeRow<double>& row : extremeRows<double>()) {
    const bool is_named = std::find(names.begin(), names.end(), row.name) != names.end();
    if (!row.environment.isPossible() || !(names.empty() || is_named)) continue;
    ++rows;
    margins += row.margin > 0 ? 1 : 0;
    std::cerr << row.name << '\n';
    std::cout << "| " << row.name << " |";
    for (std::size_t i = 0; i < all.size(); ++i) {
      const std::string cell = cellOf(all[i], row);
      right[i] += cell == "0" ? 1 : 0;
      std::cout << ' ' << cell << " |";
    }
    std::cout << '\n';
  }
  std::cout << "| *right in, of " << rows << ", " << margins << " with a margin* |";
  for (const std::size_t count : right) std::cout << ' ' << count << " |";
  std::cout << '\n';
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
