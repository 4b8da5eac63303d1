// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/io/fiber_file.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "arguments.h"
#include "io/file_bytes.h"
#include "io/foreign_formats.h"
#include "io/formats.h"
#include "io/gzip.h"

namespace fcl_fibers::io {
namespace {

constexpr int kMostSegmentsPerSpan = 1000;

/// Rounding two points can change the distance of two fibers by sqrt(3) spacings of the
/// coordinates. This should stay below a tenth of the radius.
constexpr double kCoarsestSpacing = 0.05;

void requireOptions(const FiberFileOptions& options) {
  if (options.radius) requireRadius<double>("readFibers", *options.radius);
  if (options.segments_per_span < 1 || options.segments_per_span > kMostSegmentsPerSpan) {
    refuseArgument("readFibers", "segments_per_span", options.segments_per_span,
                   "give a number from 1 to 1000");
  }
  if (options.radius && !options.radius_from.empty()) {
    refuseArgument("readFibers", "radius_from", "'" + options.radius_from + "'",
                   "leave it out where a radius is given, which replaces those in the file");
  }
}

ParsedFibers parse(ByteReader& file, FiberFormat format, const FiberFileOptions& options) {
  if (!options.radius_from.empty() && format != FiberFormat::kVtp &&
      format != FiberFormat::kPolylines) {
    refuseArgument(
        "readFibers", "radius_from", "'" + options.radius_from + "'",
        "leave it out, because only .vtp files and text have several numbers that may be "
        "radii");
  }
  switch (format) {
    case FiberFormat::kHair:
      return parseHair(file);
    case FiberFormat::kTfx:
      return parseTfx(file);
    case FiberFormat::kBcc:
      return parseBcc(file, options);
    case FiberFormat::kPolylines:
      return parsePolylines(file, options);
    case FiberFormat::kVtp:
      return parseVtp(file, options);
    case FiberFormat::kTck:
      return parseTck(file);
    case FiberFormat::kTrk:
      return parseTrk(file);
    case FiberFormat::kSwc:
      return parseSwc(file);
  }
  refuseArgument("readFibers", "format", static_cast<int>(format), "give a value of FiberFormat");
}

/// Clears the vector and frees its memory.
template <typename T>
void release(std::vector<T>& vector) {
  vector = std::vector<T>();
}

/// If the format does not tell, a fiber is closed if it ends at its start. As FiberPolylines
/// requires, `closed` is empty if no fiber is closed.
void markClosedFibers(FiberPolylines& scene) {
  constexpr std::size_t kLeastPoints = 4;
  if (!scene.closed.empty()) {
    if (std::count(scene.closed.begin(), scene.closed.end(), 1) == 0) release(scene.closed);
    return;
  }
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
    const Point& start = scene.points[begin];
    if (end - begin < kLeastPoints || start != scene.points[end - 1]) continue;
    const auto first = scene.points.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = scene.points.begin() + static_cast<std::ptrdiff_t>(end);
    if (std::count(first, last, start) == last - first) continue;  // a point, repeated
    scene.closed.resize(scene.fiberCount());
    scene.closed[f] = 1;
  }
}

/// In every format no radius above 0 stands for an unknown one.
bool hasRadius(const FiberPolylines& scene) {
  const auto is_above_0 = [](double radius) { return radius > 0; };
  return scene.radius > 0 || std::any_of(scene.radii.begin(), scene.radii.end(), is_above_0);
}

/// Warns if neighbouring floats are far apart compared with the thinnest fiber.
void warnOfCoarseCoordinates(const FiberPolylines& scene, std::vector<std::string>& warnings) {
  float largest = 0;
  for (const Point& point : scene.points) {
    for (const double c : point) largest = std::max(largest, static_cast<float>(std::abs(c)));
  }
  // Hair may taper to radius 0.
  double radius = scene.radii.empty() ? scene.radius : std::numeric_limits<double>::infinity();
  for (const double r : scene.radii) radius = r > 0 ? std::min(radius, r) : radius;
  const double spacing = std::nextafter(largest, std::numeric_limits<float>::infinity()) - largest;
  if (radius <= 0 || spacing <= kCoarsestSpacing * radius) return;
  warnings.push_back(
      joinedText("Coordinates are floats up to ", largest, ", which are ", spacing,
                 " apart. That is coarse for a radius of ", radius,
                 ": move the fibers to the origin before they are written, or write doubles."));
}

bool startsWith(std::string_view bytes, std::string_view start) {
  return bytes.substr(0, start.size()) == start;
}

std::string extension(const std::string& name) {
  std::string extension = std::filesystem::path(name).extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

/// recognizeFormat() of bytes that are not packed, or not a format that is known and not read.
std::optional<FiberFormat> recognizeFibers(std::string_view bytes, const std::string& name) {
  if (startsWith(bytes, "HAIR")) return FiberFormat::kHair;
  if (startsWith(bytes, "BCC")) return FiberFormat::kBcc;
  if (startsWith(bytes, "<?xml") || startsWith(bytes, "<VTKFile")) return FiberFormat::kVtp;
  if (startsWith(bytes, "mrtrix tracks")) return FiberFormat::kTck;
  if (startsWith(bytes, "TRACK")) return FiberFormat::kTrk;
  if (bytes.size() >= sizeof(float)) {
    // A row of numbers cannot match: the fourth byte of such a float is '@'.
    const float version = decode<float>(bytes.data(), ByteOrder::kLittle);
    if (version >= 3 && version < 5) return FiberFormat::kTfx;
  }
  if (foreignFormat(bytes, name)) return std::nullopt;
  const std::string end = extension(name);
  if (end == ".hair") return FiberFormat::kHair;
  if (end == ".bcc") return FiberFormat::kBcc;
  if (end == ".vtp") return FiberFormat::kVtp;
  if (end == ".tfx") return FiberFormat::kTfx;
  if (end == ".tck") return FiberFormat::kTck;
  if (end == ".trk") return FiberFormat::kTrk;
  if (end == ".swc") return FiberFormat::kSwc;  // Its text would pass for polylines.
  // Marks of UTF-8 and UTF-16 may precede text.
  if (startsWith(bytes, "\xFF\xFE") || startsWith(bytes, "\xFE\xFF")) {
    return FiberFormat::kPolylines;
  }
  const std::size_t first =
      bytes.find_first_not_of(" \t\r\n", startsWith(bytes, "\xEF\xBB\xBF") ? 3 : 0);
  constexpr std::string_view kNumberOrComment = "+-.0123456789#";
  if (first != bytes.npos && kNumberOrComment.find(bytes[first]) != std::string_view::npos) {
    return FiberFormat::kPolylines;
  }
  if (end == ".txt" || end == ".xyz" || end == ".dat" || end == ".csv")
    return FiberFormat::kPolylines;
  return std::nullopt;
}

/// The start and the name of a file, unpacked if it is packed.
struct Start {
  std::string unpacked;
  std::string_view bytes;
  std::string name;

  Start(std::string_view packed, const std::string& path) : bytes(packed), name(path) {
    constexpr std::size_t kEnough = 4096;
    if (!isPacked(packed)) return;
    unpacked = unpackedStart(packed, kEnough);
    bytes = unpacked;
    name = nameOfUnpacked(path);
  }
};

}  // namespace

std::optional<FiberFormat> recognizeFormat(std::string_view bytes, const std::string& name) {
  const Start start(bytes, name);
  return recognizeFibers(start.bytes, start.name);
}

FiberFile parseFibers(std::string_view bytes, const std::string& name, FiberFormat format,
                      const FiberFileOptions& options) {
  requireOptions(options);
  std::string unpacked_bytes;
  if (isPacked(bytes)) {
    unpacked_bytes = unpacked(ByteReader(bytes, name));
    bytes = unpacked_bytes;
  }
  ByteReader file(bytes, name);
  ParsedFibers parsed = parse(file, format, options);
  markClosedFibers(parsed.fibers);
  if (options.radius) {
    parsed.fibers.radius = *options.radius;
    release(parsed.fibers.radii);
    release(parsed.fibers.point_radii);
  }
  const bool has_radius = options.radius.has_value() || hasRadius(parsed.fibers);
  if (parsed.holds_radii && !has_radius) {
    parsed.warnings.push_back("All radii are 0, which stands for none.");
  }
  if (!parsed.fibers.point_radii.empty()) {
    parsed.warnings.push_back("Radii differ; a segment has the larger radius of its two ends.");
  }
  if (parsed.is_float) warnOfCoarseCoordinates(parsed.fibers, parsed.warnings);
  return {format, std::move(parsed.fibers), has_radius, std::move(parsed.warnings),
          std::move(parsed.passed_over)};
}

FiberFile parseFibers(std::string_view bytes, const std::string& name,
                      const FiberFileOptions& options) {
  requireOptions(options);
  if (const std::optional<FiberFormat> format = recognizeFormat(bytes, name)) {
    return parseFibers(bytes, name, *format, options);
  }
  const Start start(bytes, name);
  const std::optional<std::string> foreign = foreignFormat(start.bytes, start.name);
  throw std::runtime_error("readFibers: '" + name + "' " +
                           foreign.value_or("has no known format; pass a .hair, .tfx, .bcc, .vtp, "
                                            ".tck, .trk or .swc file, also packed by gzip, or text "
                                            "with one point x y z per line and # before headings"));
}

FiberFile readFibers(const std::string& path, FiberFormat format, const FiberFileOptions& options) {
  requireOptions(options);
  return parseFibers(readBytes("readFibers", path), path, format, options);
}

FiberFile readFibers(const std::string& path, const FiberFileOptions& options) {
  requireOptions(options);
  return parseFibers(readBytes("readFibers", path), path, options);
}

}  // namespace fcl_fibers::io
