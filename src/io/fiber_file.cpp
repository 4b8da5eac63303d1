// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/io/fiber_file.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "arguments.h"
#include "io/file_bytes.h"
#include "io/formats.h"
#include "io/text.h"

namespace fcl_fibers::io {
namespace {

constexpr const char* kCall = "readFibers";
constexpr int kMostSegmentsPerSpan = 1000;

/// Rounding two points can change the distance of two fibers by sqrt(3) spacings of the
/// coordinates. This should stay below a tenth of the radius.
constexpr double kCoarsestSpacing = 0.05;

struct KnownFormat {
  FiberFormat format;
  std::string_view start, ending;  ///< of files; an empty start tells nothing
  Parser* parse;
};
constexpr KnownFormat kFormats[] = {
    {FiberFormat::kHair, "HAIR", ".hair", parseHair},
    {FiberFormat::kBcc, "BCC", ".bcc", parseBcc},
    {FiberFormat::kVtp, "<?xml", ".vtp", parseVtp},
    {FiberFormat::kVtp, "<VTKFile", ".vtp", parseVtp},
    {FiberFormat::kTck, "mrtrix tracks", ".tck", parseTck},
    {FiberFormat::kTrk, "TRACK", ".trk", parseTrk},
    {FiberFormat::kTfx, "", ".tfx", parseTfx},
    {FiberFormat::kSwc, "", ".swc", parseSwc},
    {FiberFormat::kPolylines, "", ".txt", parsePolylines},
    {FiberFormat::kPolylines, "", ".xyz", parsePolylines},
    {FiberFormat::kPolylines, "", ".dat", parsePolylines},
    {FiberFormat::kPolylines, "", ".csv", parsePolylines},
};

/// Files that are not read.
struct ForeignFormat {
  const char* what;                        ///< they are, and what to do
  std::array<std::string_view, 14> signs;  ///< how names end, which have a dot, and bytes start
};
constexpr ForeignFormat kForeignFormats[] = {
    {"a mesh of triangles, which has no fibers; read a Wavefront OBJ file as a mesh, in the "
     "program by --mesh",
     {".obj", ".ply", ".stl", ".off", "ply\n", "ply\r", "solid ", "v ", "mtllib ", "OFF\n"}},
    {"a legacy VTK file; save it as XML (.vtp), as ParaView does", {".vtk", "# vtk DataFile"}},
    {"a TRX file of streamlines; convert it to .tck or .trk", {".trx"}},
    {"a TinyTrack file; export it as .trk from DSI Studio", {".tt"}},
    {"an image of voxels, which has no fibers", {".nii", ".mif", ".nrrd"}},
    {"a scene of a 3D program; export the curves as .vtp, or as text with one point x y z per line",
     {".abc", ".gltf", ".glb", ".usd", ".usda", ".usdc", ".fbx", ".blend", "glTF", "#usda",
      "PXR-USDC", "Ogawa", "Kaydara FBX", "BLENDER"}},
    {"an HDF5 file; export the fibers as .vtp, or as text with one point x y z per line",
     {".h5", ".hdf5", "\x89HDF"}},
    {"a file of NumPy arrays; write it by fcl_fibers.write() of the Python package",
     {".npy", ".npz", "\x93NUMPY"}},
    {"packed by a program other than gzip; unpack it first",
     {".bz2", ".xz", ".zst", ".zip", ".7z", ".tar", ".tgz", "BZh", "\xFD\x37zXZ",
      "\x28\xB5\x2F\xFD", "\x1F\x9D", "PK\x03\x04"}},
    {"packed twice by gzip, or by a method other than deflate; unpack it first", {"\x1F\x8B"}},
};

void requireOptions(const FiberFileOptions& options) {
  if (options.radius) requireRadius<double>(kCall, *options.radius);
  if (options.segments_per_span < 1 || options.segments_per_span > kMostSegmentsPerSpan) {
    refuseArgument(kCall, "segments_per_span", options.segments_per_span,
                   "give a number from 1 to 1000");
  }
  if (options.radius && !options.radius_from.empty()) {
    refuseArgument(kCall, "radius_from", "'" + options.radius_from + "'",
                   "leave it out where a radius is given, which replaces those in the file");
  }
}

ParsedFibers parse(ByteReader& file, FiberFormat format, const FiberFileOptions& options) {
  if (!options.radius_from.empty() && format != FiberFormat::kVtp &&
      format != FiberFormat::kPolylines) {
    refuseArgument(kCall, "radius_from", "'" + options.radius_from + "'",
                   "leave it out, because only .vtp files and text have several numbers that may "
                   "be radii");
  }
  const bool has_types = format == FiberFormat::kSwc && options.groups_from == "type";
  if (!options.groups_from.empty() && format != FiberFormat::kVtp &&
      format != FiberFormat::kPolylines && !has_types) {
    refuseArgument(kCall, "groups_from", "'" + ByteReader::shortened(options.groups_from) + "'",
                   "give the name of an array of a .vtp file, the number of a column of text, or "
                   "`type` for an .swc file; other files tell no groups");
  }
  for (const KnownFormat& known : kFormats) {
    if (known.format == format) return known.parse(file, options);
  }
  refuseArgument(kCall, "format", static_cast<int>(format), "give a value of FiberFormat");
}

/// If the format does not tell, a fiber is closed if it ends at its start. As FiberPolylines
/// requires, `closed` is empty if no fiber is closed.
void markClosedFibers(FiberPolylines& scene) {
  constexpr std::size_t kLeastPoints = 4;
  if (!scene.closed.empty()) {
    if (std::count(scene.closed.begin(), scene.closed.end(), 1) == 0) scene.closed = {};
    return;
  }
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f], end = scene.point_begin[f + 1];
    if (end - begin < kLeastPoints || scene.points[begin] != scene.points[end - 1]) continue;
    const Point& start = scene.points[begin];
    const auto is_start = [&](const Point& point) { return point == start; };
    if (std::all_of(&start, &start + (end - begin), is_start)) continue;  // a point, repeated
    scene.closed.resize(scene.fiberCount());
    scene.closed[f] = 1;
  }
}

/// Numbers the groups by the numbers of the file, and returns these.
std::vector<double> setGroups(const GroupNumbers& read, FiberPolylines& scene) {
  std::vector<double> values = read.numbers;
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  if (values.empty()) return values;
  scene.groups.resize(scene.fiberCount());
  auto number = read.numbers.begin();
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    if (scene.point_begin[f] == scene.point_begin[f + 1]) continue;
    const auto value = std::lower_bound(values.begin(), values.end(), *number++);
    scene.groups[f] = static_cast<std::int32_t>(value - values.begin()) + 1;
  }
  return values;
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

/// The format of a file, or what a file is that is not read, as far as it is known.
std::pair<std::optional<FiberFormat>, const char*> recognized(std::string_view bytes,
                                                              std::filesystem::path name) {
  constexpr std::size_t kEnough = 4096;
  const auto ending = [&] { return lowerCase(name.extension().string()); };
  const auto starts = [&](std::string_view start) { return startsWith(bytes, start); };
  std::string unpacked_start;
  if (isPacked(bytes)) {
    unpacked_start = unpackedStart(bytes, kEnough);
    bytes = unpacked_start;
    if (ending() == ".gz") name.replace_extension();
  }
  const std::string end = ending();
  for (const KnownFormat& known : kFormats) {
    if (!known.start.empty() && starts(known.start)) return {known.format, nullptr};
  }
  if (bytes.size() >= sizeof(float)) {
    // A row of numbers cannot match: the fourth byte of such a float is '@'.
    const float version = decode<float>(bytes.data(), ByteOrder::kLittle);
    if (version >= 3 && version < 5) return {FiberFormat::kTfx, nullptr};
  }
  // Some formats are packed themselves, and only their ending tells which they are.
  for (const bool by_ending : {true, false}) {
    for (const auto& [what, signs] : kForeignFormats) {
      for (const std::string_view sign : signs) {
        if (sign.empty() || (sign.front() == '.') != by_ending) continue;
        if (by_ending ? end == sign : starts(sign)) return {std::nullopt, what};
      }
    }
  }
  // The text of a .swc file would pass for polylines.
  for (const KnownFormat& known : kFormats) {
    if (end == known.ending) return {known.format, nullptr};
  }
  // Marks of UTF-8 and UTF-16 may precede text.
  const std::size_t first = bytes.find_first_not_of(" \t\r\n", starts(kUtf8Mark) ? 3 : 0);
  constexpr std::string_view kNumberOrComment = "+-.0123456789#";
  if (isUtf16(bytes) ||
      (first != bytes.npos && kNumberOrComment.find(bytes[first]) != bytes.npos)) {
    return {FiberFormat::kPolylines, nullptr};
  }
  return {std::nullopt, nullptr};
}

}  // namespace

std::optional<FiberFormat> recognizeFormat(std::string_view bytes, const std::string& name) {
  return recognized(bytes, name).first;
}

FiberFile parseFibers(std::string_view bytes, const std::string& name, FiberFormat format,
                      const FiberFileOptions& options) {
  requireOptions(options);
  std::string room;
  ByteReader file(unpacked(ByteReader(bytes, name), room), name);
  ParsedFibers parsed = parse(file, format, options);
  FiberPolylines& scene = parsed.fibers;
  markClosedFibers(scene);
  if (options.radius) {
    scene.radius = *options.radius;
    std::vector<double>().swap(scene.radii);
  }
  const bool has_radius = options.radius.has_value() || hasRadius(scene);
  if (parsed.holds_radii && !has_radius) {
    parsed.warnings.push_back("All radii are 0, which stands for none.");
  }
  std::vector<double> group_values = setGroups(parsed.groups, scene);
  if (parsed.groups.mixed > 0) {
    parsed.warn("Points of ", parsed.groups.mixed, parsed.groups.mixed == 1 ? " fiber" : " fibers",
                " have several numbers in '", options.groups_from,
                "'; the group of a fiber is that of its last point.");
  }
  if (parsed.is_float) warnOfCoarseCoordinates(scene, parsed.warnings);
  return {format,
          std::move(scene),
          has_radius,
          std::move(parsed.warnings),
          std::move(parsed.passed_over),
          std::move(group_values)};
}

FiberFile parseFibers(std::string_view bytes, const std::string& name,
                      const FiberFileOptions& options) {
  requireOptions(options);
  const auto [format, foreign] = recognized(bytes, name);
  if (format) return parseFibers(bytes, name, *format, options);
  throw std::runtime_error(joinedText(
      kCall, ": '", name, "' ", foreign != nullptr ? "is " : "",
      foreign != nullptr ? foreign
                         : "has no known format; pass a .hair, .tfx, .bcc, .vtp, .tck, .trk or "
                           ".swc file, also packed by gzip, or text with one point x y z per line "
                           "and # before headings"));
}

FiberFile readFibers(const std::string& path, FiberFormat format, const FiberFileOptions& options) {
  requireOptions(options);
  return parseFibers(readBytes(kCall, path), path, format, options);
}

FiberFile readFibers(const std::string& path, const FiberFileOptions& options) {
  requireOptions(options);
  return parseFibers(readBytes(kCall, path), path, options);
}

}  // namespace fcl_fibers::io
