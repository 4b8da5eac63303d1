// SPDX-License-Identifier: BSD-3-Clause
//
// A reader of fiber files on any bytes: a scene as FiberPolylines says, or a refusal that names the
// place. FCL_FIBERS_FUZZED_FORMAT is the format. Bytes that gzip packed are unpacked first. Where
// radii may be in several places, the same bytes are read with radii from another one, too.
#include <fcl_fibers/io/fiber_file.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>

#include "fuzz_input.h"

using fcl_fibers::FiberPolylines;
using fcl_fibers::io::FiberFile;
using fcl_fibers::io::FiberFormat;

namespace {

using fcl_fibers::fuzz::require;

bool isLength(double length) { return length >= 0 && std::isfinite(length); }

void requireWellFormed(const FiberPolylines& scene) {
  require(scene.fiberCount() > 0 && scene.point_begin.front() == 0);
  require(scene.point_begin.back() == scene.points.size());
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
    require(begin <= end);
    if (scene.isClosed(f)) require(begin < end && scene.points[begin] == scene.points[end - 1]);
  }
  for (const auto& point : scene.points) {
    for (const double coordinate : point) require(std::isfinite(coordinate));
  }
  require(scene.closed.empty() || scene.closed.size() == scene.fiberCount());
  require(scene.radii.empty() || scene.radii.size() == scene.points.size());
  require(isLength(scene.radius));
  for (const double radius : scene.radii) require(isLength(radius));
  require(scene.samples.empty() || scene.samples.size() == scene.points.size());
  require(scene.types.empty() || scene.types.size() == scene.points.size());
  for (const auto* places : {&scene.starts_at, &scene.ends_at}) {
    require(places->empty() || places->size() == scene.fiberCount());
    for (std::size_t f = 0; f < places->size(); ++f) {
      if ((*places)[f] == -1) continue;
      const auto place = static_cast<std::size_t>((*places)[f]);
      require(place < scene.points.size() && scene.point_begin[f] < scene.point_begin[f + 1]);
    }
  }
}

/// Where the corpus has radii beside the usual place, or empty.
std::string otherRadii() {
  constexpr FiberFormat kFormat = FiberFormat::FCL_FIBERS_FUZZED_FORMAT;
  return kFormat == FiberFormat::kVtp ? "R" : kFormat == FiberFormat::kPolylines ? "4" : "";
}

void read(std::string_view bytes, const std::string& numbers_from) {
  fcl_fibers::io::FiberFileOptions options;
  constexpr FiberFormat kFormat = FiberFormat::FCL_FIBERS_FUZZED_FORMAT;
  options.radius_from = numbers_from;
  options.groups_from = kFormat == FiberFormat::kSwc ? "type" : numbers_from;
  try {
    const FiberFile file = fcl_fibers::io::parseFibers(
        bytes, "the input", FiberFormat::FCL_FIBERS_FUZZED_FORMAT, options);
    requireWellFormed(file.fibers);
  } catch (const std::runtime_error& error) {
    const std::string what = error.what();
    require(what.find("'the input', byte ") != std::string::npos ||
            what.find("'the input', line ") != std::string::npos);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  read(bytes, "");
  if (!otherRadii().empty()) read(bytes, otherRadii());
  fcl_fibers::io::recognizeFormat(bytes, "the input.gz");
  return 0;
}
