// SPDX-License-Identifier: BSD-3-Clause
#include "scene_source.h"

#include <charconv>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "messages.h"

namespace fcl_fibers::tools {
namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw std::invalid_argument("'" + text + "': " + why);
}

/// Rotates each fiber about its root, around the x axis; or all about that of the first, if fibers
/// branch, so that they still meet.
FiberPolylines swing(FiberPolylines scene, double angle) {
  const bool is_whole = !scene.starts_at.empty() || !scene.ends_at.empty();
  const Point of_all = scene.points.empty() ? Point{} : scene.points.front();
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    if (scene.segmentCount(f) == 0) continue;
    const Point root = is_whole ? of_all : scene.points[scene.point_begin[f]];
    for (std::size_t i = scene.point_begin[f]; i < scene.point_begin[f + 1]; ++i) {
      Point& point = scene.points[i];
      const double y = point[1] - root[1];
      const double z = point[2] - root[2];
      point[1] = root[1] + std::cos(angle) * y - std::sin(angle) * z;
      point[2] = root[2] + std::sin(angle) * y + std::cos(angle) * z;
    }
  }
  return scene;
}

const std::string kStandardInput = "-";

/// Texts of the library name options as C++ does.
/// @param path  what the text may name before them, which stays
std::string asOnTheCommandLine(std::string text, const std::string& path = {}) {
  const std::size_t named = text.find(path);
  const std::size_t begin = named == text.npos ? 0 : named + path.size();
  constexpr std::pair<std::string_view, std::string_view> kOptions[] = {
      {"radius_from", "--radius-from"}, {"groups_from", "--groups-from"}};
  for (const auto& [option, flag] : kOptions) {
    for (std::size_t at = text.find(option, begin); at != text.npos; at = text.find(option, at)) {
      text.replace(at, option.size(), flag);
    }
  }
  return text;
}

io::FiberFile read(const std::string& path, const io::FiberFileOptions& options) try {
  if (path == kStandardInput) {
    const std::string bytes(std::istreambuf_iterator<char>(std::cin), {});
    return io::parseFibers(bytes, "standard input", options);
  }
  return io::readFibers(path, options);
} catch (const std::invalid_argument& error) {
  throw std::invalid_argument(asOnTheCommandLine(error.what(), path));
} catch (const std::runtime_error& error) {
  throw std::runtime_error(asOnTheCommandLine(error.what(), path));
}

/// Returns why a tree could not hold the points. Its own error could not name the file.
std::string problemOf(const FiberPolylines& fibers) {
  constexpr double kLimit = std::numeric_limits<double>::max() / 64;
  for (std::size_t i = 0; i < fibers.points.size(); ++i) {
    for (const double c : fibers.points[i]) {
      if (std::abs(c) <= kLimit) continue;
      return "a coordinate of point " + std::to_string(i) +
             " is too large to compute with; change the unit";
    }
  }
  return "";
}

SceneSource readFile(const std::string& path, const io::FiberFileOptions& options) {
  SceneSource source;
  const bool is_input = path == kStandardInput;
  source.name =
      is_input ? "standard input" : readable(std::filesystem::path(path).filename().string());
  source.title = source.name;
  source.is_file = true;
  source.playable = {0};
  progress("reading " + path);
  io::FiberFile file = read(path, options);
  source.has_radius = file.has_radius;
  source.has_samples = !file.fibers.samples.empty();
  source.problem = problemOf(file.fibers);
  for (const std::string& warning : file.warnings) {
    source.warnings.push_back(asOnTheCommandLine(warning));
  }
  for (const double number : file.group_values) source.groups.push_back({number});
  source.passed_over = std::move(file.passed_over);
  source.make = [scene = std::move(file.fibers)](int frame) {
    return frame == 0 ? scene : swing(scene, 0.01 * frame);
  };
  return source;
}

}  // namespace

std::string SceneGroup::text() const {
  char digits[32];
  const auto end = std::to_chars(std::begin(digits), std::end(digits), number).ptr;
  return "group " + std::string(digits, end) + (name.empty() ? "" : ", " + name);
}

bool isFile(const std::string& text) {
  std::error_code error;
  return text == kStandardInput || std::filesystem::exists(text, error);
}

SceneSource SceneName::find() const {
  if (isFile(text)) return readFile(text, options);
  if (!generated->make) {
    refuse(text, "there is no file of that name; give the path of a file of fibers");
  }
  if (!options.radius_from.empty()) {
    refuse(text, "--radius-from is for files; a generated scene has the key `radius`");
  }
  if (!options.groups_from.empty()) {
    refuse(text, "--groups-from is for files; --groups makes groups of several scenes");
  }
  return generated->make(*this);
}

void requireNoProblem(const SceneSource& source) {
  if (!source.problem.empty()) refuse(source.title, source.problem);
}

SceneSource SceneName::open() const {
  SceneSource source = find();
  printWarnings(source);
  requireNoProblem(source);
  if (!source.has_radius) {
    refuse(text,
           "the file holds no radius, and fibers without thickness touch nothing; give "
           "--radius R, in the file's unit");
  }
  return source;
}

void printWarnings(const SceneSource& source) {
  progress("");
  for (const std::string& warning : source.warnings) warn(source.name, warning);
}

std::string sceneHelp(const GeneratedScenes& generated) {
  return std::string("SCENE is a file of fibers") +
         (generated.make ? ", `-`, or a generated scene" : ", or `-`") +
         ". Files are .hair, .tfx, .bcc, .vtp, .tck,\n"
         ".trk, .swc, or text with a point x y z on each line and a blank line between fibers; "
         "spaces,\ncommas, semicolons or tabs separate numbers. Files that gzip packed are "
         "unpacked."
         "\n`-` reads a file from standard input.\n" +
         generated.help;
}

}  // namespace fcl_fibers::tools
