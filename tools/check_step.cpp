// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "answer_stream.h"
#include "commands.h"
#include "contact_json.h"
#include "contact_list.h"
#include "step_impacts.h"

namespace fcl_fibers::tools {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kFew = 10;

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

/// Impacts that are listed.
std::size_t rowCount(const Request& request, const StepImpacts& found) {
  const std::size_t count = found.impacts.size();
  return std::min(count, request.top.value_or(request.output == Output::kText ? kFew : count));
}

/// The samples of a pair as columns. Without a pair, the names of these columns. Empty if the
/// fibers have no samples.
std::string samplesOf(const StepScene& step, Output output, const Contact* contact = nullptr) {
  if (step.start.samples.empty()) return "";
  if (contact == nullptr) return sampleNames(output);
  const SegmentPair pair = contact->pair;
  return sampleColumns(output, {sampleOf(step.start, pair.a), sampleOf(step.start, pair.b)});
}

void writeText(const Request& request, const StepScene& step, const StepImpacts& found,
               AnswerStream& stream) {
  const Motion motion = motionOf(step);
  const std::size_t count = found.count;
  stream.write(fmt::format(
      "{} to {}: {} of {}\n"
      "points move by {:.4g} on average, and by {:.4g} at most\n"
      "{}{} {} during the step, {} of them at its start\n"
      "safe step: {:.6g}\n"
      "built and searched in {:.3g} s\n",
      step.start_title, step.end_title, counted(step.start.segmentCount(), "segment"),
      counted(step.start.fiberCount(), "fiber"), motion.mean, motion.largest,
      found.ended ? "at least " : "", countText(count), count == 1 ? "pair touches" : "pairs touch",
      countText(found.at_start), found.safe_step, found.seconds));
  if (count == 0) return;
  stream.write(fmt::format("\n{:>8} {:>8}   {:>8} {:>8} {:>12}{}\n", "fiber", "number", "fiber",
                           "number", "time", samplesOf(step, Output::kText)));
  const std::size_t rows = rowCount(request, found);
  for (std::size_t i = 0; i < rows; ++i) {
    const Contact c = contactOf(step, found.impacts[i]);
    stream.write(fmt::format("{:>8} {:>8}   {:>8} {:>8} {:>12.6g}{}\n", c.a.fiber, c.a.number,
                             c.b.fiber, c.b.number, found.impacts[i].time,
                             samplesOf(step, Output::kText, &c)));
  }
  if (count > rows) {
    stream.write(fmt::format("and {} more; --top N lists more, --csv and --json list all\n",
                             countText(count - rows)));
  }
}

void writeCsv(const Request& request, const StepScene& step, const StepImpacts& found,
              AnswerStream& stream) {
  stream.write(
      "fiber_a,number_a,s,fiber_b,number_b,t,time,distance,point_a_x,point_a_y,point_a_z,"
      "point_b_x,point_b_y,point_b_z,normal_x,normal_y,normal_z" +
      samplesOf(step, Output::kCsv) + "\n");
  const std::size_t rows = rowCount(request, found);
  for (std::size_t i = 0; i < rows; ++i) {
    const Contact c = contactOf(step, found.impacts[i]);
    stream.write(fmt::format("{},{},{},{},{},{},{},{}", c.a.fiber, c.a.number, c.s, c.b.fiber,
                             c.b.number, c.t, found.impacts[i].time, c.distance));
    for (const std::array<double, 3>& vector : {c.point_a, c.point_b, c.normal}) {
      stream.write(fmt::format(",{},{},{}", vector[0], vector[1], vector[2]));
    }
    stream.write(samplesOf(step, Output::kCsv, &c) + "\n");
  }
}

void writeJson(const Request& request, const StepScene& step, const StepImpacts& found,
               AnswerStream& stream) {
  const Motion motion = motionOf(step);
  const ordered_json head = {{"version", FCL_FIBERS_VERSION},
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
  stream.write(openJson(head) + ",\n \"impacts\": [");
  const std::size_t rows = rowCount(request, found);
  const char* between = "\n  ";
  for (std::size_t i = 0; i < rows; ++i) {
    ordered_json item = contactJson(contactOf(step, found.impacts[i]), step.start, step.start);
    item["time"] = found.impacts[i].time;
    stream.write(between + item.dump());
    between = ",\n  ";
  }
  stream.write("\n ]\n}\n");
}

}  // namespace

int checkStep(const Request& request) {
  if (request.scenes.size() != 1) {
    throw std::invalid_argument("--end takes one scene, which is the start of the step");
  }
  const bool pictures = !request.segments_path.empty() || !request.contacts_path.empty() ||
                        !request.volumes_path.empty();
  if (request.other || !request.meshes.paths.empty() || request.summary || pictures) {
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
  if (request.output == Output::kText) writeText(request, step, found, stream);
  if (request.output == Output::kCsv) writeCsv(request, step, found, stream);
  if (request.output == Output::kJson) writeJson(request, step, found, stream);
  stream.finish();
  return !found.impacts.empty() && !request.exit_zero ? kExitContacts : 0;
}

}  // namespace fcl_fibers::tools
