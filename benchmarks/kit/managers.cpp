// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/benchmark/managers.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <exception>
#include <stdexcept>
#include <utility>

#include "contenders/contender.h"
#include "harness/command_line.h"
#include "harness/frame_runs.h"
#include "kit/table.h"
#include "measures/paper/row_order.h"
#include "scenes/generated_scenes.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

template <typename S>
std::vector<BasicContender<S>>& registered() {
  static std::vector<BasicContender<S>> contenders;
  return contenders;
}

template <typename S>
bool isTaken(const std::string& name) {
  const auto& contenders = registered<S>();
  return std::any_of(contenders.begin(), contenders.end(),
                     [&](const auto& other) { return other.name() == name; });
}

template <typename S>
void add(BasicContender<S> contender) {
  const std::string name = contender.name();
  if (name.empty()) throw std::invalid_argument("registerManager: give the manager a name");
  if (isTaken<float>(name) || isTaken<double>(name)) {
    throw std::invalid_argument("registerManager: there is a manager '" + name +
                                "' already; give another name");
  }
  registered<S>().push_back(std::move(contender));
}

struct Options {
  std::vector<std::string> scenes;
  SceneRequest scene;  ///< all but its text
  double limit = 20;
};

/// Some of the scene's fibers, far from each other and then each second one through the one before
/// it: whoever does not notice that everything has moved misses pairs.
template <typename S>
BasicMovingFibers<S> meetingFibers(const SceneRequest& request) {
  constexpr std::size_t kMostFibers = 40, kMostSegments = 2000;
  const FiberPolylines whole = openScene(request.text, request.radius).scene();
  std::vector<std::size_t> few;
  for (std::size_t f = 0; f < std::min(kMostFibers, whole.fiberCount()); ++f) {
    if (f >= 2 && whole.point_begin[f + 1] > kMostSegments) break;
    few.push_back(f);
  }
  const FiberPolylines scene = reordered(whole, few);
  double extent = 0;
  for (const Point& point : scene.points) {
    for (const double x : point) extent = std::max(extent, std::abs(x));
  }
  FiberPolylines apart = scene, together = scene;
  Point middle = {};
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
    const Point& own = scene.points[begin + (end - begin) / 2];
    if (f % 2 == 0) middle = own;
    for (std::size_t i = begin; i < end; ++i) {
      apart.points[i][0] += 4 * extent * static_cast<double>(f);
      for (std::size_t axis = 0; axis < 3; ++axis)
        together.points[i][axis] += middle[axis] - own[axis];
    }
  }
  return BasicMovingFibers<S>(request.text + " when fibers meet", apart, together);
}

/// The note of a table, in the words of its columns.
std::string noteOf(const Preflight& checked) {
  std::string note = checked.whyNotTimed();
  const std::string phase = phaseName(Phase::kSetUp);
  if (const std::size_t at = note.find(" in " + phase); at != std::string::npos) {
    note.replace(at + 4, phase.size(), "construction");
  }
  return note;
}

/// Checks the registered managers of one scalar on one scene and registers their entries.
template <typename S>
class SceneRuns {
 public:
  SceneRuns(const SceneRequest& request, double limit) : motion_(makeMotion<S>(request)) {
    PreflightLimits limits;
    limits.phase_seconds = limit;
    limits.again = limits.show_errors = true;
    const auto& contenders = registered<S>();
    BasicMovingFibers<S> meeting = meetingFibers<S>(request);
    checked_ = preflightAll(contenders, meeting, limits);
    const bool meet_right = oursAreRight(contenders, checked_);
    // Pairs are most at the end of a motion.
    auto& fibers = motion_.checked.empty() ? motion_.fibers : motion_.checked.back();
    const std::vector<Preflight> on_scene = preflightAll(contenders, fibers, limits);
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      if (checked_[i].right()) {
        checked_[i] = on_scene[i];
      } else {
        checked_[i].when += " when fibers meet";
      }
    }
    right_ = meet_right && oursAreRight(contenders, checked_);
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      const std::string entries = request.text + "/" + contenders[i].name();
      const Preflight& checked = checked_[i];
      rows_.push_back({contenders[i].name(), noteOf(checked), entries, checked.frames[0].reported,
                       checked.bytes});
      if (checked.right()) {
        runs_.emplace_back(contenders[i], checked, motion_).registerPhases(entries);
      }
    }
  }

  bool right() const { return right_; }
  const std::vector<TableRow>& rows() const { return rows_; }
  /// `helix: 100,000 segments of 1,000 fibers`
  std::string title(const std::string& scene) const {
    std::string text = scene + ": " + tools::counted(motion_.fibers.segmentCount(), "segment") +
                       " of " + tools::counted(motion_.fibers.fiberCount(), "fiber");
    if (motion_.summed) {
      const auto steps = static_cast<std::size_t>(motion_.fibers.frameCount() - 1);
      text += "; updates and queries are summed over " + tools::counted(steps, "step");
    }
    return text;
  }

 private:
  BasicMotion<S> motion_;
  std::vector<Preflight> checked_;
  std::deque<BasicFrameRuns<S>> runs_;
  std::vector<TableRow> rows_;
  bool right_ = true;
};

/// All scenes, which stay until their entries have run.
class AllRuns {
 public:
  explicit AllRuns(const Options& options) {
    for (const std::string& scene : options.scenes) {
      SceneRequest request = options.scene;
      request.text = scene;
      tables_.emplace_back();
      add(double_, request, options.limit);
      add(float_, request, options.limit);
    }
  }

  bool right() const { return right_; }
  const std::vector<TableOfScene>& tables() const { return tables_; }

 private:
  template <typename S>
  void add(std::deque<SceneRuns<S>>& scenes, const SceneRequest& request, double limit) {
    if (registered<S>().empty()) return;
    const SceneRuns<S>& runs = scenes.emplace_back(request, limit);
    right_ = right_ && runs.right();
    TableOfScene& table = tables_.back();
    table.title = runs.title(request.text);
    table.rows.insert(table.rows.end(), runs.rows().begin(), runs.rows().end());
  }

  std::deque<SceneRuns<double>> double_;
  std::deque<SceneRuns<float>> float_;
  std::vector<TableOfScene> tables_;
  bool right_ = true;
};

void addOptions(CLI::App& app, Options& options) {
  app.allow_extras();
  app.add_option("--scene", options.scenes, "A scene as below, or a file of fibers; repeat it");
  app.add_option("--radius", options.scene.radius, "Radius of a file's fibers, in its unit");
  app.add_option("--steps", options.scene.steps, "Of paper-dynamic")->check(CLI::Range(1, 100));
  app.add_option("--limit", options.limit, "Seconds that a phase of the check may take")
      ->check(CLI::Range(0.01, 1e6));
  app.footer("\n" + generatedScenes().help +
             "\nOptions of Google Benchmark go along, such as --benchmark_filter=update or "
             "--benchmark_out=FILE.json.");
}

int runChecked(int argc, char** argv, const std::vector<std::string>& scenes) {
  Options options;
  options.scenes = scenes;
  CLI::App app("Checks broad phases on scenes of fibers, and times those that are right.");
  addOptions(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 1;
  }
  if (registered<float>().empty() && registered<double>().empty()) {
    throw std::invalid_argument("there is no manager; call registerManager() before run()");
  }
  const std::vector<std::string> flags = app.remaining();
  const bool plain = std::any_of(flags.begin(), flags.end(), [](const std::string& flag) {
    return flag.rfind("--benchmark_format", 0) == 0 || flag.rfind("--benchmark_list", 0) == 0;
  });
  initializeBenchmark(argv[0], flags);
  const AllRuns runs(options);
  TableReporter table(runs.tables());
  const bool no_error = runRegistered(plain ? nullptr : &table);
  if (!plain) table.print();
  return runs.right() && no_error ? 0 : 1;
}

}  // namespace

template <typename S>
void registerManager(const std::string& name, MakeManager<S> make, Boxes boxes, Reported reported) {
  constexpr bool kOurs = true;  // what is wrong with it fails the program
  add<S>({Group::kOurs, name, "", kOurs, boxes, reported, std::move(make)});
}

template FCL_FIBERS_BENCHMARK_EXPORT void registerManager(const std::string&, MakeManager<float>,
                                                          Boxes, Reported);
template FCL_FIBERS_BENCHMARK_EXPORT void registerManager(const std::string&, MakeManager<double>,
                                                          Boxes, Reported);

void registerPeers() {
  for (const Boxes boxes : {Boxes::kTight, Boxes::kStock}) {
    add(allOf({Group::kFclTrees}, boxes).front());
  }
  for (const Contender& contender : allOf({Group::kOurs})) {
    if (contender.variant == "boxes" || contender.variant == "spheres" ||
        contender.name() == "LayeredAABBTree/capsules") {
      add(contender);
    }
  }
}

int run(int argc, char** argv, const std::vector<std::string>& scenes) {
  const std::string program = argv[0];
  tools::setProgramName(program.substr(program.find_last_of('/') + 1));
  try {
    return runChecked(argc, argv, scenes);
  } catch (const std::exception& error) {
    tools::progress("");
    std::fprintf(stderr, "%s: %s\n", tools::programName().c_str(), error.what());
    return 1;
  }
}

}  // namespace fcl_fibers::benchmarks
