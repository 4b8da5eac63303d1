// SPDX-License-Identifier: BSD-3-Clause
//
// All that is measured. Without --measure it is a minute's headline: ours beside FCL's tree, by the
// same door as anyone's manager (fcl_fibers/benchmark/managers.h). Otherwise one run is one
// measure, on one scene where it has any; its results go to a file of Google Benchmark's, of which
// benchmarks/report makes tables, and benchmarks/run.sh runs what belongs together:
//
//   fcl_fibers_bench --measure=frames [SCENE] [--against=WHOM] [--scalar=double|float]
//   fcl_fibers_bench --measure=card [SCENE] [--scalar=double|float]
//   fcl_fibers_bench --measure=arrays|growth [SCENE]
//   fcl_fibers_bench --measure=threads [SCENE] [--threads=1,2,...] [--runs=N]
//   fcl_fibers_bench --measure=live|live-objects|live-skins|safe-distances [SCENE]
//                    [--motion=NAME,...] [--steps=N] [--runs=N]
//   fcl_fibers_bench --measure=obstacles --scene=cap|combed [--triangles=N]
//   fcl_fibers_bench --measure=cables [--cables=N] [--triangles=N]
//   fcl_fibers_bench --measure=motion [--fibers=N] [--radii=R]
//   fcl_fibers_bench --measure=shapes|narrow|unused [SCENE]
//   fcl_fibers_bench --measure=arms|queries|clients|costs
//   fcl_fibers_bench --measure=pictures                                 the paper's
//   fcl_fibers_bench --measure=cascade [SCENE] [--runs=N]               the paper's
//   fcl_fibers_bench --measure=volume-tests [SCENE] --against=WHOM      the paper's
//   fcl_fibers_bench --measure=replay --scene=SCENE --against=WHOM      the paper's
//
// WHOM is headline, full, fcl, embree, paper, paper_all, or names of contenders, NAME,... Of these,
// fcl is short: ours, FCL's fastest trees and the grid, with the closed form of two capsules. In
// float, only FCL's managers and ours are measured. Add --benchmark_out=FILE.json and any other
// flag of Google Benchmark. SCENE is --scene=NAME:key=value,... as `fcl_fibers --help` lists them,
// or --hair=FILE [--radius=R]. The context of results names the versions of "libraries", those
// "left_out", the compiler's "flags", and the target of our SIMD in use, "simd":
// FCL_FIBERS_SIMD=sse4 or avx2 restricts it. benchmarks/fcl_native.sh builds all of it, FCL too,
// for the machine's processor.
//
// The results of frames. Every contender first has to show, in a process of its own, that it
// reports every touching pair, once, before a motion and after it. What is wrong, crashes or
// refuses is not timed, and neither is what takes longer than --limit seconds in any phase. Runs
// are in random order.
//
//   Tried/...    FCL's dynamic tree and its array form, and coal's, with every tree_init_level,
//                the least of three runs of one frame; the fastest of each library in set-up,
//                update, detection and a frame go on, those of the first two to that phase only
//   Checked/...  the check: pairs, touching pairs, bytes, and the seconds of each phase, once; the
//                label says why a contender is not timed
//   Frames/...   set_up: construct the manager, register all objects, setup(). Of a frame, after
//                every pose was set anew, update: boxes as the manager reads them (computeAABB for
//                FCL's "stock", end points +- radius for FCL's "tight", none for ours) + update();
//                detection: the query of all pairs, with a callback that counts. Of the paper's
//                dynamic assembly the sum over --steps. "visited" are pairs before any filter:
//                Embree visits both orders of a pair, and each object with itself; a grid's are
//                pairs of boxes in cells next to each other. "boxes" are the seconds of writing all
//                boxes once, which set_up of FCL's is without. `_and_test`: detection with the
//                closed form of two capsules in the callback, on all pairs. `_and_collide`:
//                fcl::collide, or coal::collide, on `sampled` pairs `of` those reported, scaled to
//                all.
//   Floor/read   a loop over the objects that reads their transforms and capsules
//
// The results of card: `Card/<contender>/<segments>` is the check at each size of the scene, as
// Checked/... is; whoever is not right is left out of the larger sizes. At the full size there are
// `Frames/...` too.
//
// Of the times of Embree, Bullet and the grid, set-up and update read the boxes from the poses, as
// our manager does. Those of coal write the boxes of its own objects, tight or stock, which take
// the poses over before that, in no time. coal's trees are set up anew before each update, as FCL's
// are.
//
//   Query/<query>/...     FCL's other queries; answers are the same for all
//   Objects/<shape>/...   objects that are no fibers
//   Candidates/<shape>/.. their pairs, and those of them that touch: ours of their poses alone and
//                         after computeAABB(), and FCL's
//   Clients/<what>/...    rods of few links: update and queries, FCL's other managers too
//   Changes/<what>        self-collision after objects have come or fibers have changed places;
//                         "reference" is before that, or of a new manager
//   Beside/<report>/<what>    self-collision beside one object that touches nothing; "reference" is
//                         without it
//   FibersOf/<shape>      the scene as fibers of such shapes, kCapsules, neighbours left out
//   OneByOne/<what>/...   objects that come, move and go by calls of their own
//   Arms/<cell>/...       1,000 poses of an arm, or of a cable and an arm: update() of what moves,
//                         and a query with a callback that ends it at the first hit. The time is
//                         the median of the poses without a hit, "hit" of those with one, "update"
//                         of all. "pairs" and "pairs_of_hit" are the mean calls of the callback
//   Arrays/<tree>         FiberTree, and a plain loop that reads the points and writes boxes
//   Threads/<what>/<n>    the stages of arrays, of a manager, or a plain loop over the points on n
//                         threads, of which the library takes no more than the machine has.
//                         Capsules are without neighbours in a fiber, and volumes with them. Each
//                         run makes its own tree and has to find as much as the first one, and
//                         runs of all numbers of threads are in random order
//   Live/<motion>         --steps steps of fibers, in each of which a tree finds what touches, and
//                         LivePairs of another tree, in turns the one first and the other. Both
//                         have to find the same pairs in every step. "without" and "with" live
//                         pairs: the set-up with the first query, the median and the longest step,
//                         its update, and all together. "loop" is the median of a plain loop that
//                         reads the points and writes displacements. Motions are in radii. "slow"
//                         and "fast": the scene turns as a whole by 0.02 or 0.2 in the mean, and
//                         fibers move against each other by 0.012 or 0.04 at most. "slow" adds
//                         noise of 0.02. "weather": 20 steps of "slow" and 20 of storm take turns.
//                         "creeping": from one frame of the scene to the next by 0.4 a step,
//                         "frames": a whole frame a step. "touching", "uncovered" and "tested"
//                         pairs are means of the steps
//   LiveObjects/<motion>  the same of FCL's objects and two managers: update() and collide(). Each
//                         has objects of its own, which are part of its set-up, and moves them
//                         before the time of a step is taken
//   LiveSkins/<skin>/<motion>   the same of trees, with this skin in radii
//   SafeDistances/<motion>      safeDistances() after each update, from a list with a skin of one
//                         radius: medians of both. "distance" is their mean, in radii
//   Growth/<segments>     the tree over plain arrays at some sizes of one density, or of the one
//                         scene that is named, per segment
//   Unused/<what>         a frame of a tree or manager with a feature that the scene does not use,
//                         and in turns one "without" it; and the bytes of both
//   Costs/arrays|objects  bytes and seconds of every combination of what may be asked for. Fibers
//                         that taper or branch are asked in turns with fibers that do not: "times"
//                         is the ratio, and "pairs_without" is what these find
//   Touching/<set>/<who>  segments that touch the head, all or without those at roots: the update
//                         of the head's pose and the query. "turned" is by arrays, for a head that
//                         is stored at another rotation; FCL's is the head's query with
//                         fcl::collide
//   Judged/<set>          the check of these: FCL's errors, by a judge that takes all triangles
//   Contacts/<set>        of all segments and triangles that touch, by arrays
//   Boxes/<who>           pairs of a segment's and a triangle's box that overlap
//   Refit/mesh            TriangleMesh::update(), and a plain loop that writes boxes
//   Distance/<who>        least distance of cables and an arm of 20 meshes, whose poses change
//   Narrow/<scene>/<scalar>/<who>/touch  a pair of capsules whose boxes overlap, in the unit of the
//                         scene, or of a kind that is made by formula: contacts "missed", "false"
//                         ones, and those of these that are "beyond" what docs/numerics.md promises
//   Narrow/.../contact    the pair with its contact: median and "most" error of "depth" and "point"
//                         in radii, of the "normal" in radians, and the "way" beyond the depth, in
//                         radii, after which they are apart along the normal
//   Motion/<who>          a step of the cap in the wind, --radii in the mean. Of ours: the update
//                         without motion and with it, the static query of touching pairs, that of
//                         moving pairs, and that of impacts. Others have boxes around both
//                         positions, and our test of impacts behind them
//   Judged/impacts        the check of a scene of a tenth of the fibers, by a judge that takes
//                         all pairs of such boxes
//   Safe/step             the safe step of a scene of two fifths of the fibers, as thin as it
//                         takes for none to touch at the start, and all their impacts
//   Replay/...            the paper's dynamic assembly, all --steps: update:007 is of step 7
//   VolumeTests/<who>     tests of two volumes in the self query of frame 0, its leaf pairs and the
//                         seconds of its traversal, and touching pairs. After --limit seconds
//                         those of ours are estimates from a random "share" of the traversal: then
//                         "made" are the tests that were made, and "error" is the relative standard
//                         error
//   Cascade/<kept>/<by>   the paper's tree through the frames of the scene, in one plain loop: the
//                         seconds to "build" it at the first, and those of an "update", the mean of
//                         the others; the share of the cages that are made "anew"; "tests" of a
//                         leaf or a cage below against a cage; how many times as large as the least
//                         cages are at the end, "loose", and the "volume_tests" of a query then; of
//                         Welzl's algorithm the tests of a ball against a sphere, the mean of all
//                         frames. "boxes" are united or keep their basis, and have "bytes"
//   Root/<by>             one sphere around all segments of the last frame, by Welzl's algorithm
//   Picture/...           counts of what --out_dir=FOLDER gets as files

#include <benchmark/benchmark.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include <fcl_fibers/benchmark/managers.h>
#include <hwy/targets.h>

#include "contenders/contender.h"
#include "harness/command_line.h"
#include "measures.h"
#include "simd/dispatch.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {

std::map<std::string, Measure>& measures() {
  static std::map<std::string, Measure> all;
  return all;
}

namespace {

void addOptions(CLI::App& app, std::string& measure, Request& request) {
  app.allow_extras();
  app.add_option("--measure", measure)->check(CLI::IsMember(measures()))->required();
  auto* const scene = app.add_option("--scene", request.scene.text);
  auto* const hair =
      app.add_option("--hair", request.scene.text,
                     "Fibers of a .hair, .tfx, .bcc, .vtp, .tck, .trk, .swc or text file")
          ->check(CLI::ExistingFile)
          ->excludes(scene);
  app.add_option("--radius", request.scene.radius,
                 "Radius of the fibers, in the file's unit; may be left out if the file has one")
      ->needs(hair);
  app.add_flag("--rows", request.scene.rows, "Fibers in the order of rows of roots");
  app.add_option("--steps", request.scene.steps,
                 "Of the paper's dynamic assembly, or of fibers whose pairs live")
      ->check(CLI::Range(1, 1000));
  app.add_option("--against", request.against, "Who is measured");
  app.add_option("--scalar", request.scalar, "Of the card's objects and managers")
      ->check(CLI::IsMember({"double", "float"}));
  app.add_option("--limit", request.limit, "Seconds that a phase may take")
      ->check(CLI::Range(0.01, 1e6));
  app.add_option("--triangles", request.triangles, "Of a head or an arm, about");
  app.add_option("--cables", request.cables)->check(CLI::Range(1, 1000000));
  app.add_option("--fibers", request.fibers, "Of the cap in motion")->check(CLI::Range(1, 330809));
  app.add_option("--radii", request.radii, "Its mean motion");
  app.add_option("--threads", request.threads, "Numbers of threads that are compared")
      ->delimiter(',')
      ->check(CLI::Range(1, 1024));
  app.add_option("--motion", request.motions, "Of fibers whose pairs live")
      ->delimiter(',')
      ->check(CLI::IsMember({"slow", "fast", "weather", "creeping", "frames"}));
  app.add_option("--runs", request.runs, "Of each number of threads, or of each motion")
      ->check(CLI::Range(1, 1000));
  app.add_option("--out_dir", request.out_dir, "Where pictures are written");
}

/// The target that ours choose, `avx2`.
std::string simdInUse() {
  simd::readEnvironment();
  for (const std::int64_t target : simd::availableTargets()) {
    if ((hwy::SupportedTargets() & target) != 0) return simd::targetName(target);
  }
  return "unknown";
}

void addContext(int argc, char** argv, const std::string& measure, const Request& request) {
  const auto told = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value == nullptr ? "unknown" : value);
  };
  // The folders of the program, of files and of results mean nothing to others.
  std::string command = "fcl_fibers_bench";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.rfind("--benchmark_out", 0) != 0) command += " " + word;
  }
  std::string scene = request.scene.text;
  if (tools::isFile(scene)) scene = scene.substr(scene.find_last_of('/') + 1);
  const std::size_t seed = scene.find("seed=");
  benchmark::AddCustomContext("build_type", FCL_FIBERS_BUILD_TYPE);
  benchmark::AddCustomContext("commit", told("FCL_FIBERS_COMMIT"));
  benchmark::AddCustomContext("code", told("FCL_FIBERS_CODE"));
  benchmark::AddCustomContext("command", command);
  benchmark::AddCustomContext("flags", FCL_FIBERS_CXX_FLAGS);
  benchmark::AddCustomContext("libraries", versionsOfLibraries());
  benchmark::AddCustomContext("left_out", missingLibraries());
  benchmark::AddCustomContext("measure", measure);
  benchmark::AddCustomContext("scene", scene);
  benchmark::AddCustomContext("simd", simdInUse());
  benchmark::AddCustomContext(
      "seed",
      seed == std::string::npos ? "1" : scene.substr(seed + 5, scene.find(',', seed) - seed - 5));
}

/// Ours beside FCL's tree on some of the paper's scenes.
int runHeadline(int argc, char** argv) {
  registerPeers();
  const int code = run(argc, argv,
                       {"paper-static:fibers=500", "paper-half-scalp:fibers=2000",
                        "paper-strand:fibers=50,area=0.3077"});
  std::string names;
  for (const auto& [name, measure] : measures()) names += (names.empty() ? "" : "|") + name;
  if (code == 0) {
    std::printf(
        "More: --scene=SCENE, of which --help lists the names; --measure=%s,\n"
        "which the head of benchmarks/main.cpp explains; benchmarks/run.sh --help\n",
        names.c_str());
  }
  return code;
}

int runMeasure(int argc, char** argv) {
  std::string measure;
  Request request;
  CLI::App app("Measures what --measure names. Other flags are Google Benchmark's.");
  addOptions(app, measure, request);
  CLI11_PARSE(app, argc, argv);
  initializeBenchmark(argv[0], app.remaining());
  addContext(argc, argv, measure, request);
  const bool right = measures().at(measure)(request);
  tools::progress("");
  if (!right) std::fprintf(stderr, "fcl_fibers_bench: one of ours is wrong\n");
  return right ? 0 : 1;
}

}  // namespace
}  // namespace fcl_fibers::benchmarks

int main(int argc, char** argv) {
  const bool is_measure = std::any_of(argv + 1, argv + argc, [](const char* word) {
    return std::string(word).rfind("--measure", 0) == 0;
  });
  if (!is_measure) return fcl_fibers::benchmarks::runHeadline(argc, argv);
  fcl_fibers::tools::showProgressEverywhere();
  try {
    return fcl_fibers::benchmarks::runMeasure(argc, argv);
  } catch (const std::exception& error) {
    fcl_fibers::tools::progress("");
    std::fprintf(stderr, "fcl_fibers_bench: %s\n", error.what());
    return 1;
  }
}
