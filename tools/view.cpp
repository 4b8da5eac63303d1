// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bytes.h"
#include "commands.h"
#include "drawn_points.h"
#include "output_file.h"
#include "page.h"
#include "page_contacts.h"
#include "several_scenes.h"
#include "step_impacts.h"

namespace fcl_fibers::tools {
namespace {

using nlohmann::json;

constexpr std::size_t kMostMarkers = 100000;       // of a frame
constexpr int kInstants = 32;                      // of a step, after its start
constexpr std::size_t kMostMarkersOfAll = 500000;  // of all frames; 24 MB

/// By depth, the centre of each volume, relative to the middle, and its half extent.
json volumesJson(const FiberTree& tree, int depth, const Point& middle) {
  json levels = json::array();
  std::size_t count = 0;
  for (int d = 0; d <= depth; ++d) {
    const std::vector<TreeVolume> volumes = tree.volumes(d);
    if (volumes.size() == count) break;  // there is nothing deeper
    count = volumes.size();
    std::string bytes;
    for (const TreeVolume& volume : volumes) {
      for (std::size_t k = 0; k < 3; ++k) {
        appendLittleEndian(bytes, static_cast<float>(volume.center[k] - middle[k]));
      }
      for (const double half : volume.half) appendLittleEndian(bytes, static_cast<float>(half));
    }
    levels.push_back(base64(bytes));
  }
  return levels;
}

/// By contact, the shallowest first: its place relative to the middle, which is midway between two
/// fibers or on a mesh; the distance; the depth; fiber and segment of both sides, or of one side,
/// and mesh and triangle; the time, which is that of an impact or 0.
json markersJson(const std::vector<Marker>& markers, const Point& middle) {
  std::string places, distances, depths, segments, times;
  for (const auto& [contact, depth, time] : markers) {
    const bool is_mesh = contact.mesh != kNoMesh;
    const Point& from = is_mesh ? contact.point_b : contact.point_a;
    for (std::size_t k = 0; k < 3; ++k) {
      const double place = (from[k] + contact.point_b[k]) / 2;
      appendLittleEndian(places, static_cast<float>(place - middle[k]));
    }
    appendLittleEndian(distances, static_cast<float>(contact.distance));
    appendLittleEndian(depths, static_cast<float>(depth));
    appendLittleEndian(times, static_cast<float>(time));
    const FiberSegment of_mesh = {static_cast<std::size_t>(contact.mesh),
                                  static_cast<std::size_t>(contact.triangle)};
    for (const FiberSegment& side : {contact.a, is_mesh ? of_mesh : contact.b}) {
      appendLittleEndian(segments, static_cast<std::uint32_t>(side.fiber));
      appendLittleEndian(segments, static_cast<std::uint32_t>(side.number));
    }
  }
  return {
      {"places", base64(places)},     {"distances", base64(distances)},
      {"depths", base64(depths)},     {"times", base64(times)},
      {"segments", base64(segments)}, {"deepest", markers.empty() ? 0.0 : markers.back().depth}};
}

/// Points relative to the middle of the mesh, and three of them for each triangle.
json meshJson(const MeshFile& mesh) {
  const Point middle = Steps({&mesh.points}).middle;
  std::string points, triangles;
  for (const Point& point : mesh.points) {
    for (std::size_t k = 0; k < 3; ++k) {
      appendLittleEndian(points, static_cast<float>(point[k] - middle[k]));
    }
  }
  for (const std::int32_t corner : mesh.triangles) {
    appendLittleEndian(triangles, static_cast<std::uint32_t>(corner));
  }
  return {{"name", mesh.name},
          {"middle", middle},
          {"points", base64(points)},
          {"triangles", base64(triangles)}};
}

/// @param contactsIn  returns the contacts, given a tree of the frame
template <typename ContactsIn>
json frameJson(const FiberPolylines& scene, const std::string& label, const Thinning& thinning,
               const Steps& steps, const Request& request, ContactsIn&& contactsIn) {
  using Volumes = FiberTreeOptions::Volumes;
  json frame = {{"label", label}, {"points", pointsText(scene, thinning, steps)}};
  for (const auto kind : {Volumes::kLayeredBoxes, Volumes::kWrappedSpheres}) {
    const bool boxes = kind == Volumes::kLayeredBoxes;
    FiberTreeOptions options = request.tree;
    options.volumes = kind;
    options.report = boxes ? Report::kCapsules : Report::kVolumes;
    FiberTree tree(options);
    FiberArrays<double> arrays = fiberArrays(scene);
    const std::vector<std::int32_t> roots = request.meshes.roots(scene);
    if (!roots.empty()) arrays.root_segments = roots.data();
    if (request.within) arrays.groups = nullptr;
    tree.build(arrays);
    frame["volumes"][boxes ? "boxes" : "spheres"] = volumesJson(tree, request.depth, steps.middle);
    if (!boxes) continue;
    const PageContacts found = contactsIn(tree);
    frame["contacts"] = found.count;
    frame["meshContacts"] = found.mesh_count;
    frame["stopped"] = found.stopped;
    frame["touching"] = touchingText(scene, thinning, found.touching);
    frame["markers"] = markersJson(found.markers, steps.middle);
    frame["meshmarkers"] = markersJson(found.mesh_markers, steps.middle);
  }
  return frame;
}

/// The axis that points up, if nobody tells: z for generated scenes, y for TressFX, and for other
/// files y if their fibers run along it from root to tip, or if all points are nearly in one plane
/// z; else z.
std::string guessedUp(const SceneSource& source, const FiberPolylines& scene, const Steps& steps) {
  if (!source.is_file) return "z";
  if (std::filesystem::path(source.name).extension() == ".tfx") return "y";
  Point mean{};
  double length = 0;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    if (scene.segmentCount(f) == 0) continue;
    const Point& root = scene.points[scene.point_begin[f]];
    const Point& tip = scene.points[scene.point_begin[f + 1] - 1];
    for (std::size_t k = 0; k < 3; ++k) mean[k] += tip[k] - root[k];
    length += std::hypot(tip[0] - root[0], tip[1] - root[1], tip[2] - root[2]);
  }
  const bool runs_along_y = std::abs(mean[1]) > 0.6 * length;
  const bool flat = steps.size[2] < 0.1 * std::min(steps.size[0], steps.size[1]);
  return runs_along_y || flat ? "y" : "z";
}

/// A frame of a page, and what it is called there.
struct PageFrame {
  FiberPolylines fibers;
  std::string label;
};

std::vector<PageFrame> framesOf(const SceneSource& source) {
  std::vector<PageFrame> frames;
  for (const int frame : source.playable) {
    progress(fmt::format("{}: reading frame {}", source.name, frame));
    frames.push_back({source.make(frame), fmt::format("frame {}", frame)});
  }
  return frames;
}

std::vector<PageFrame> framesOf(const StepScene& step) {
  std::vector<PageFrame> frames;
  for (int i = 0; i <= kInstants; ++i) {
    const double time = static_cast<double>(i) / kInstants;
    frames.push_back({step.at(time), fmt::format("time {:.3f}", time)});
  }
  return frames;
}

json groupsJson(const SceneSource& source, const FiberPolylines& scene) {
  json groups = json::array();
  for (const SceneGroup& group : source.groups) {
    const auto number = static_cast<std::int32_t>(groups.size()) + 1;
    groups.push_back({{"name", group.name.empty() ? group.text() : group.name},
                      {"first", group.first_fiber},
                      {"fibers", std::count(scene.groups.begin(), scene.groups.end(), number)}});
  }
  return groups;
}

json sceneJson(const SceneSource& source, const Request& request,
               const std::vector<MeshFile>& meshes) {
  std::optional<StepScene> step;
  StepImpacts impacts;
  if (request.end) {
    progress(source.name + ": looking for impacts");
    step = readStep(source, request.end->open());
    FiberTreeOptions options = request.tree;
    options.report = Report::kCapsules;
    impacts = findImpacts(*step, options, request.limit);
  }
  const std::vector<PageFrame> frames = step ? framesOf(*step) : framesOf(source);
  const FiberPolylines& first = frames.front().fibers;
  if (first.segmentCount() == 0) {
    throw std::runtime_error(fmt::format("'{}' has no segment to show", source.title));
  }
  const Thinning thinning = Thinning::forScene(first, request.points / frames.size());
  std::vector<const std::vector<Point>*> points_of_frames;
  for (const PageFrame& frame : frames) points_of_frames.push_back(&frame.fibers.points);
  const Steps steps(points_of_frames);
  std::string begin, segments, groups;
  std::size_t points = 0;
  appendLittleEndian(begin, std::uint32_t{0});
  thinning.forEachFiber(first, [&](std::size_t f, const std::vector<std::size_t>& drawn) {
    points += drawn.size();
    appendLittleEndian(begin, static_cast<std::uint32_t>(points));
    appendLittleEndian(segments, static_cast<std::uint32_t>(first.segmentCount(f)));
  });
  if (!source.groups.empty()) {
    for (const std::int32_t group : first.groups) {
      appendLittleEndian(groups, static_cast<std::uint32_t>(group));
    }
  }
  json scene = {{"name", source.name},
                {"title", step ? step->start_title + " to " + step->end_title : source.title},
                {"impacts", step ? json(impacts.count) : json()},
                {"up", request.up.empty() ? guessedUp(source, first, steps) : request.up},
                {"fibers", first.fiberCount()},
                {"segments", first.segmentCount()},
                {"radii", radiiText(first, thinning)},
                {"tapers", first.hasRadiiOfPoints()},
                {"drawn", thinning.text()},
                {"fiberStep", thinning.fiber_step},
                {"pointStep", thinning.point_step},
                {"step", steps.step},
                {"middle", steps.middle},
                {"begin", base64(begin)},
                {"segmentsOfFibers", base64(segments)},
                {"groupsOfFibers", base64(groups)},
                {"groups", groupsJson(source, first)},
                {"opened", 0},
                {"frames", json::array()}};
  if (request.record) {
    scene["guide"] = {{"length", source.guide->length}, {"stiffness", source.guide->stiffness}};
  }
  const std::size_t most_markers = std::min(kMostMarkers, kMostMarkersOfAll / frames.size() + 1);
  bool stopped = false;
  std::size_t next_impact = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    progress(fmt::format("{}: frame {} of {}", source.name, i + 1, frames.size()));
    const FiberPolylines& fibers = frames[i].fibers;
    json frame =
        frameJson(fibers, frames[i].label, thinning, steps, request, [&](const FiberTree& tree) {
          if (!step) {
            return findPageContacts({tree, fibers, request.limit, nullptr, true, &meshes},
                                    most_markers);
          }
          const double time = static_cast<double>(i) / kInstants;
          return takeImpacts(*step, impacts, time, most_markers, next_impact);
        });
    stopped = stopped || frame["stopped"];
    scene["frames"].push_back(std::move(frame));
    if (!step && source.playable[i] <= source.frame) scene["opened"] = i;
  }
  if (stopped && !step) {
    warn(source.name, "a frame has more than " + countText(request.limit) +
                          " pairs, so the page shows the contacts of that many. The radius is "
                          "probably too large.");
  }
  return scene;
}

std::string pageOf(const std::vector<SceneSource>& sources, const Request& request,
                   const std::vector<MeshFile>& meshes) {
  json data = {{"scenes", json::array()}, {"meshes", json::array()}};
  for (const MeshFile& mesh : meshes) data["meshes"].push_back(meshJson(mesh));
  std::string title;
  for (const SceneSource& source : sources) {
    data["scenes"].push_back(sceneJson(source, request, meshes));
    title += (title.empty() ? "" : ", ") + source.name;
  }
  return makePage(title, data.dump(), request.fragment, request.record);
}

}  // namespace

int view(const Request& request) {
  std::vector<SceneSource> sources;
  for (const SceneName& name : request.scenes) sources.push_back(name.open());
  if (request.groups) sources = {asGroups(std::move(sources))};
  if (request.frames) sources = {asFrames(std::move(sources))};
  if (request.end && sources.size() > 1) {
    throw std::invalid_argument("--end takes one scene, which is the start of the step");
  }
  if (request.end && !request.meshes.paths.empty()) {
    throw std::invalid_argument("--end plays fibers alone; leave out --mesh");
  }
  for (const SceneSource& source : sources) {
    if (request.record && !source.guide) {
      throw std::invalid_argument(
          fmt::format("'{}' has no guide filament to record; give --record with paper-dynamic, not "
                      "turned",
                      source.title));
    }
  }
  OutputFile file(request.path);
  const std::vector<MeshFile> meshes = request.meshes.read();
  for (const SceneSource& source : sources) {
    if (!meshes.empty()) warnOfMeshSize(source.scene(), meshes, request.tree.margin, source.name);
  }
  const std::string page = pageOf(sources, request, meshes);
  progress("writing " + request.path);
  file.write(page);
  file.commit();
  progress("");
  return 0;
}

std::string pageOf(const std::string& title, const FiberPolylines& fibers, const Request& request,
                   const std::vector<MeshFile>& meshes) {
  SceneSource source;
  source.name = title;
  source.title = title;
  source.is_file = true;
  source.playable = {0};
  source.make = [&](int) { return fibers; };
  Request at_rest = request;
  at_rest.end.reset();
  const struct Cleared {
    ~Cleared() { progress(""); }
  } cleared;
  return pageOf({source}, at_rest, meshes);
}

}  // namespace fcl_fibers::tools
