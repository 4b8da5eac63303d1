// SPDX-License-Identifier: BSD-3-Clause
//
// The long runs behind docs/numerics.md, and its tables in docs/numerics.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <iostream>
#include <string>

#include <CLI/CLI.hpp>

#include "numerics/array_order.h"
#include "numerics/differential.h"
#include "numerics/extreme_rows.h"
#include "numerics/impact_decisions.h"
#include "numerics/manager_differential.h"
#include "numerics/object_order.h"
#include "numerics/recorded_scenes.h"
#include "numerics/row_times.h"
#include "numerics/touch_decisions.h"

namespace fcl_fibers::test {
namespace {

int runDifferential(double decisions, std::size_t capsules, std::uint64_t seed) {
  const HairFiles hair = HairFiles::find();
  if (hair.empty()) std::cerr << "no hair; FCL_FIBERS_DATA names the folder of .tfx files\n";
  const auto wanted = static_cast<std::uint64_t>(decisions);
  std::uint64_t told = 0;
  const auto goOn = [&](const Tally& so_far) {
    if (so_far.decisions - told >= 500'000'000) {
      told = so_far.decisions;
      std::cerr << told << " pairs, " << so_far.wrong << " wrong\n";
    }
    return so_far.decisions < wanted || so_far.within_radius < wanted / 1000 ||
           so_far.at_contact < wanted / 100'000;
  };
  const Tally tally = differWhile(goOn, capsules, seed, hair);
  std::cout << "scenes                               " << tally.scenes
            << "\npairs decided by brute force         " << tally.decisions
            << "\n  touching                           " << tally.touching
            << "\n  within one radius of contact       " << tally.within_radius
            << "\n  within 1e-12 of contact            " << tally.at_contact
            << "\n  decided in integers                " << tally.exact
            << "\nreported by eight kinds of trees     " << tally.reported
            << "\nmissed, repeated or unpromised       " << tally.wrong << '\n';
  if (tally.wrong == 0) return EXIT_SUCCESS;
  std::cerr << tally.first_wrong << '\n';
  return EXIT_FAILURE;
}

int runTouches(double decisions, std::uint64_t seed) {
  const auto wanted = static_cast<std::uint64_t>(decisions / 2);
  bool is_right = true;
  for (const std::size_t corners : {2u, 3u}) {
    const TouchTally tally = decideTouches(corners, wanted, seed);
    std::cout << (corners == 2 ? "pairs of capsules decided            "
                               : "segments and triangles decided       ")
              << tally.decisions << "\n  within reach                       " << tally.within
              << "\n  within 1e-12 of contact            " << tally.at_contact
              << "\n  decided by bounds in double        " << tally.decisions - tally.exact
              << "\n  decided in integers                " << tally.exact
              << "\n  decided in float                   " << tally.in_float
              << "\nmissed                               " << tally.missed
              << "\nreported, beyond the usual           " << tally.beyond_usual
              << "\nreported, beyond what is promised    " << tally.unpromised
              << "\nwrong in float                       " << tally.wrong_in_float << '\n';
    if (!tally.first_wrong.empty()) std::cerr << tally.first_wrong << '\n';
    is_right = is_right && tally.missed + tally.unpromised + tally.wrong_in_float == 0;
  }
  return is_right ? EXIT_SUCCESS : EXIT_FAILURE;
}

int runImpacts(double decisions, std::uint64_t seed, bool exact) {
  const auto wanted = static_cast<std::uint64_t>(decisions / 2);
  bool is_right = true;
  for (const ImpactShape shape : {ImpactShape::kCapsules, ImpactShape::kTriangle}) {
    const ImpactTally tally = decideImpacts(shape, -1, wanted, seed, exact);
    std::cout << (shape == ImpactShape::kCapsules ? "pairs of capsules that move          "
                                                  : "capsules and triangles that move     ")
              << tally.decisions << "\n  impacts                            " << tally.impacts
              << "\n  of these at the start              " << tally.at_start
              << "\n  that have to come nearer           " << tally.approaches
              << "\n  decided by bounds in double        " << tally.decisions - tally.exact
              << "\n  decided in integers                " << tally.exact
              << "\nmissed or too late                   " << tally.late
              << "\ntoo early                            " << tally.early
              << "\n  by at most, in tolerances          " << tally.earliest
              << "\nwrong closest points                 " << tally.misplaced << '\n';
    if (!tally.first_wrong.empty()) std::cerr << tally.first_wrong << '\n';
    // A search that ends early for want of rounds is no more than rare.
    is_right = is_right && tally.late + tally.misplaced == 0 && tally.early <= wanted / 1'000'000;
  }
  return is_right ? EXIT_SUCCESS : EXIT_FAILURE;
}

int runManagers(double scenes, std::uint64_t seed, std::uint64_t first) {
  constexpr std::uint64_t kEnough = 100'000, kLeastCovered = 500;
  ManagerTally tally;
  while (tally.scenes < static_cast<std::uint64_t>(scenes)) {
    const std::uint64_t number = first + tally.scenes;
    const std::string wrong = differManagers(seed, number, tally);
    if (!wrong.empty()) {
      std::cerr << wrong << "\n  in the scene of managers --seed " << seed << " --first " << number
                << " --scenes 1\n";
    }
    if (tally.scenes % 10'000 == 0) {
      std::cerr << tally.scenes << " scenes, " << tally.wrongs() << " wrong; --first " << number + 1
                << " goes on\n";
    }
  }
  const std::size_t least = tally.leastCovered();
  const auto possible =
      std::count_if(allTriples().begin(), allTriples().end(), std::not_fn(isImpossible));
  std::cout << "scenes                               " << tally.scenes
            << "\ncalls                                " << tally.queries
            << "\n  for distances                      " << tally.distances
            << "\npairs that touch                     " << tally.touching
            << "\n  at a time that was asked for       " << tally.impacts
            << "\npairs that touch and are left out    " << tally.forbidden
            << "\npairs apart                          " << tally.apart
            << "\npairs left open                      " << tally.open
            << "\ntriples of features                  " << possible
            << "\n  each in so many scenes at least    " << tally.covered[least] << "  ("
            << nameOf(allTriples()[least]) << ")\nwrong                                "
            << tally.wrongs() << '\n';
  for (const auto& [what, count] : tally.wrong) std::cout << "  " << what << ' ' << count << '\n';
  const bool is_covered = tally.scenes < kEnough || tally.covered[least] >= kLeastCovered;
  return tally.wrongs() == 0 && is_covered ? EXIT_SUCCESS : EXIT_FAILURE;
}

int printHashes(int threads) {
  std::cout << table("arrays", arrayOrderHashes(threads))
            << table("objects", objectOrderHashes(threads));
  return EXIT_SUCCESS;
}

/// Float's scene of contact is another one, with pairs 1 ulp of float from contact.
int recordScenes() {
  constexpr std::size_t kCapsules = 1200, kSeed = 41;
  for (const RandomKind kind : kRandomKinds) {
    if (kind == RandomKind::kHair || kind == RandomKind::kTapered) continue;
    recordScene(nameOf(kind), randomScene<double>(kind, kCapsules, kSeed, HairFiles::none()));
  }
  const auto in_float =
      randomScene<float>(RandomKind::kContact, kCapsules, kSeed, HairFiles::none());
  Assembly<double> fibers;
  fibers.points.assign(in_float.points.begin(), in_float.points.end());
  fibers.radii.assign(in_float.radii.begin(), in_float.radii.end());
  fibers.point_begin = in_float.point_begin;
  recordScene("contact_float", fibers);
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace fcl_fibers::test

int main(int argc, char** argv) {
  namespace test = fcl_fibers::test;
  CLI::App app("Numbers at the extremes: tables and long runs.");
  app.require_subcommand(1);

  CLI::App* rows = app.add_subcommand("rows", "docs/numerics/rows.csv, as it is now");
  CLI::App* times = app.add_subcommand("times", "docs/numerics/times.csv, as measured now");
  std::string names;
  times->add_option("--rows", names, "those whose names begin so, such as Tapered");

  double decisions = 1e10;
  std::size_t capsules = 1500;
  std::uint64_t seed = 1;
  CLI::App* differential =
      app.add_subcommand("differential", "Random scenes against exact brute force");
  differential
      ->add_option("--decisions", decisions,
                   "pairs to decide, a thousandth of them within one radius of\n"
                   "contact, a hundred-thousandth within 1e-12")
      ->capture_default_str();
  differential->add_option("--capsules", capsules, "of a scene, about")->capture_default_str();
  differential->add_option("--seed", seed, "of the first scene")->capture_default_str();

  double pairs = 1e8;
  CLI::App* touches = app.add_subcommand(
      "touches", "Capsules near contact, half of them with triangles, decided exactly");
  touches->add_option("--decisions", pairs, "pairs to decide")->capture_default_str();
  touches->add_option("--seed", seed, "of all pairs")->capture_default_str();

  double motions = 1e8;
  bool exact = false;
  CLI::App* impacts = app.add_subcommand(
      "impacts", "Times of impact of pairs that move, half of them with triangles");
  impacts->add_option("--decisions", motions, "pairs to decide")->capture_default_str();
  impacts->add_option("--seed", seed, "of all pairs")->capture_default_str();
  impacts->add_flag("--exact", exact, "judge in integers only");

  double scenes = 1e5;
  std::uint64_t first = 0;
  CLI::App* managers =
      app.add_subcommand("managers", "Random scenes of two managers against brute force");
  managers->add_option("--scenes", scenes, "from the first on; 1e5 have to cover all triples")
      ->capture_default_str();
  managers->add_option("--seed", seed, "of all scenes")->capture_default_str();
  managers->add_option("--first", first, "number of the first scene, to go on or to look at one")
      ->capture_default_str();

  CLI::App* impact_rows =
      app.add_subcommand("impact_rows", "docs/numerics/impacts.csv, as it is now");

  int threads = 1;
  CLI::App* hashes = app.add_subcommand(
      "hashes", "Hashes of pairs in their order, the same for every build and machine");
  hashes->add_option("--threads", threads)->capture_default_str();

  CLI::App* record = app.add_subcommand(
      "record", "Write the scenes of tests/data/pair_order anew; then write hashes.txt anew too");

  CLI11_PARSE(app, argc, argv);
  try {
    if (*rows) {
      std::cout << test::rowsTable();
      return EXIT_SUCCESS;
    }
    if (*times) {
      std::cout << test::rowTimesTable(names);
      return EXIT_SUCCESS;
    }
    if (*touches) return test::runTouches(pairs, seed);
    if (*impacts) return test::runImpacts(motions, seed, exact);
    if (*managers) return test::runManagers(scenes, seed, first);
    if (*impact_rows) {
      std::cout << test::impactsTable();
      return EXIT_SUCCESS;
    }
    if (*hashes) return test::printHashes(threads);
    if (*record) return test::recordScenes();
    return test::runDifferential(decisions, capsules, seed);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return EXIT_FAILURE;
  }
}
