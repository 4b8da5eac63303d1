// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <string>

#include <fcl_fibers/io/export_geometry.h>
#include <fcl_fibers/io/fiber_file.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "commands.h"
#include "output_file.h"

namespace fcl_fibers::tools {
namespace {

/// One point per line and a blank line between fibers. Reading restores every bit.
std::string polylinesText(const FiberPolylines& scene) {
  fmt::memory_buffer text;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    if (scene.point_begin[f] == scene.point_begin[f + 1]) {
      throw std::invalid_argument(
          fmt::format("fiber {} has no points, which text cannot hold; write .vtp", f));
    }
    if (f > 0) text.push_back('\n');
    for (std::size_t i = scene.point_begin[f]; i < scene.point_begin[f + 1]; ++i) {
      const Point& p = scene.points[i];
      fmt::format_to(std::back_inserter(text), "{} {} {}\n", p[0], p[1], p[2]);
    }
  }
  return fmt::to_string(text);
}

/// The radius of a file without one is 0, which no format keeps.
void write(const SceneSource& source, const std::string& path) {
  OutputFile file(path);
  const FiberPolylines scene = source.scene();
  progress("writing " + path);
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending == ".hair") {
    io::writeHair(file.draft(), scene);
  } else if (ending == ".txt") {
    file.write(polylinesText(scene));
  } else if (ending == ".vtp") {
    io::exportFibers(file.draft(), scene);
  } else {
    throw std::invalid_argument(
        fmt::format("'{}': give a file that ends in .vtp, .hair or .txt{}", path,
                    ending == ".gz" ? ", and pack it by gzip afterwards" : ""));
  }
  file.commit();
  progress("");
  if (ending == ".txt" && source.has_radius) {
    warn(path, "text has no place for the radius; " +
                   (scene.radii.empty() ? fmt::format("read it with --radius {}", scene.radius)
                                        : "those of this scene differ and are lost"));
  }
  const bool branches = !scene.starts_at.empty() || !scene.ends_at.empty();
  if (ending != ".vtp" && (branches || !scene.samples.empty())) {
    warn(path, std::string(ending == ".txt" ? "text" : ".hair") +
                   " has no place for branches, samples and types; write .vtp to keep them");
  }
  if (!source.passed_over.empty()) {
    warn(source.name, fmt::format("points, radii, closed curves and branches are kept, and not: {}",
                                  fmt::join(source.passed_over, ", ")));
  }
}

}  // namespace

int generate(const Request& request) {
  const SceneSource source = request.scenes.front().find();
  if (source.is_file) {
    throw std::invalid_argument(
        fmt::format("'{}' is a file, and only generated scenes are written by this command; for "
                    "another format use: {} convert",
                    source.title, programName()));
  }
  write(source, request.path);
  return 0;
}

int convert(const Request& request) {
  const SceneSource source = request.scenes.front().find();
  printWarnings(source);
  if (!source.is_file) {
    throw std::invalid_argument(
        fmt::format("'{}' is no file; to write a generated scene use: {} generate", source.title,
                    programName()));
  }
  write(source, request.path);
  return 0;
}

}  // namespace fcl_fibers::tools
