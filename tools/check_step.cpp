// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "answer_stream.h"
#include "commands.h"
#include "contact_rows.h"
#include "step_impacts.h"

namespace fcl_fibers::tools {
namespace {

struct Motion {
  double mean = 0, largest = 0;
};

Motion motionOf(const StepScene& step) {
  Motion motion;
  for (std::size_t i = 0; i < step.start.points.size(); ++i) {
    const Point &p = step.start.points[i], &q = step.end.points[i];
    const double length = std::hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
    motion.mean += length / static_cast<double>(step.start.points.size());
    motion.largest = std::max(motion.largest, length);
  }
  return motion;
}

/// @param rows  of the impacts, those that are listed
void writeText(const StepScene& step, const StepImpacts& found, const std::vector<Impact>& rows,
               AnswerStream& stream) {
  const Motion motion = motionOf(step);
  const std::size_t count = found.count;
  stream.write(fmt::format(
      "{} to {}: {}\n"
      "points move by {:.4g} on average, and by {:.4g} at most\n"
      "{}{} {} during the step, {} of them at its start\n"
      "safe step: {:.6g}\n"
      "built and searched in {:.3g} s\n",
      step.start_title, step.end_title,
      sizeText(step.start.segmentCount(), step.start.fiberCount()), motion.mean, motion.largest,
      found.ended ? "at least " : "", countText(count), count == 1 ? "pair touches" : "pairs touch",
      countText(found.at_start), found.safe_step, found.seconds));
  if (count == 0) return;
  stream.write(fmt::format("\n{:>8} {:>8}   {:>8} {:>8} {:>12}\n", "fiber", "segment", "fiber",
                           "segment", "time"));
  for (const Impact& impact : rows) {
    const Contact c = contactOf(step, impact);
    stream.write(fmt::format("{:>8} {:>8}   {:>8} {:>8} {:>12.6g}\n", c.a.fiber, c.a.segment,
                             c.b.fiber, c.b.segment, impact.time));
  }
  stream.write(moreText(count - rows.size()));
}

nlohmann::ordered_json headJson(const Request& request, const StepScene& step,
                                const StepImpacts& found) {
  const Motion motion = motionOf(step);
  return {{"version", FCL_FIBERS_VERSION},
          {"margin", request.tree.margin},
          {"ignored_neighbors", request.tree.ignored_neighbors},
          {"ignored_arc_length", request.tree.ignored_arc_length},
          {"scene", step.start_title},
          {"end", step.end_title},
          {"fibers", step.start.fiberCount()},
          {"segments", step.start.segmentCount()},
          {"radius", radiusJson(step.start)},
          {"radius_at_end", radiusJson(step.end)},
          {"mean_motion", motion.mean},
          {"largest_motion", motion.largest},
          {"seconds", found.seconds},
          {"complete", found.isComplete()},
          {"impact_count", found.count},
          {"touching_at_start", found.at_start},
          {"safe_step", found.safe_step}};
}

}  // namespace

int checkStep(const Request& request) {
  if (request.scenes.size() != 1) {
    throw std::invalid_argument("--end takes one scene, which is the start of the step");
  }
  if (request.other || !request.meshes.paths.empty() || request.summary || request.hasPictures()) {
    throw std::invalid_argument(
        "--end lists impacts within one scene; leave out --against, --mesh, --summary and "
        "--write-...");
  }
  progress("reading " + request.scenes.front().text);
  const StepScene step = readStep(request.scenes.front().open(), request.end->open());
  progress("looking for impacts in " + step.start_title);
  StepImpacts found = findImpacts(step, request.tree, request.limit);
  if (request.order == Request::Order::kFiber) {
    std::sort(found.impacts.begin(), found.impacts.end(), [](const Impact& i, const Impact& j) {
      return std::tie(i.pair.a, i.pair.b) < std::tie(j.pair.a, j.pair.b);
    });
  }
  progress("");
  AnswerStream stream(request.path);
  std::vector<Impact> rows = found.impacts;
  rows.resize(std::min(rows.size(), request.mostRows()));
  const auto row = [&](const Impact& impact) {
    return contactRow(FoundContact(contactOf(step, impact)), false, impact.time);
  };
  if (request.output == Output::kText) {
    writeText(step, found, rows, stream);
  } else if (request.output == Output::kJson) {
    writeJson(headJson(request, step, found), "impacts", rows, row, stream);
    stream.write("\n");
  } else {
    stream.write(csvHead(contactRow(FoundContact(Contact{}), false, 0.0)));
    for (const Impact& impact : rows) stream.write(csvLine(row(impact)));
  }
  stream.finish();
  return !found.impacts.empty() && !request.exit_zero ? kExitContacts : 0;
}

}  // namespace fcl_fibers::tools
