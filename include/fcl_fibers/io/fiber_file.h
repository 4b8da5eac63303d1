// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/io/export.h>

/// Fiber files, exports for programs that draw, and sampling of curves.
namespace fcl_fibers::io {

/// File formats for fibers. Only points, radii and closed curves are read.
enum class FiberFormat {
  /// Cem Yuksel's .hair. Radii are half the thickness; a segment has the larger radius of its two
  /// ends. A default thickness of 0 counts as no thickness.
  kHair,

  /// TressFX .tfx, versions 3 and 4.
  kTfx,

  /// Cem Yuksel's binary curve collection (.bcc) of 4-byte numbers: uniform Catmull-Rom splines
  /// (`C0`) and uniform cubic B-splines (`BS`), tessellated. An open curve goes from its first
  /// control point to its last, as if another one lay mirrored beyond each. A closed curve has a
  /// span for each of its control points, of which there are at least three.
  kBcc,

  /// Text with one point `x y z` per line and a blank line between fibers. Further columns and
  /// lines that start with '#' are skipped.
  kPolylines,

  /// VTK's XML format of polygonal data (.vtp), with a fiber for each line of each piece: ASCII,
  /// base64 inline or appended, or raw appended; uncompressed, or compressed by zlib. Points are
  /// Float32 or Float64, indices 32 or 64 bits wide. Point data `radius`, Float32 or Float64, are
  /// radii; a segment has the larger radius of its two ends.
  ///
  /// Not read are LZ4, LZMA, the parallel format (.pvtp), arrays that together are longer than the
  /// file, or more than 64 times as long when decompressed, and XML with more than 256 tags plus
  /// one per 16 bytes.
  kVtp,
};

/// How to read a file.
struct FiberFileOptions {
  /// Radius of all fibers in the file's unit, finite, not negative; 0 is accepted. Without it the
  /// file's own radii count, if it has any; see FiberFile::has_radius.
  std::optional<double> radius;

  /// Number of straight segments per span of a .bcc spline, 1 to 1000.
  int segments_per_span = 4;
};

/// The content of a file, in its unit of length and frame.
struct FiberFile {
  FiberFormat format = FiberFormat::kPolylines;  ///< given or recognized

  /// A fiber is closed if the file says so (.bcc), or in other formats if its last point is its
  /// first and it has at least three segments. Segments of length zero are kept.
  FiberPolylines fibers;

  /// Whether the options or the file gave the radii. If not, they are 0, and capsules touch only if
  /// their axes intersect. Give a radius, or set FiberPolylines::radius, before any query for
  /// collisions.
  bool has_radius = false;

  /// What a user of the fibers should know, one sentence each: coordinates kept as float are too
  /// coarse for the radius, the file may be truncated, or something follows the last array.
  std::vector<std::string> warnings;
};

/// Reads a file whose format is recognized by its first bytes, or else by its extension.
///
/// Throws std::runtime_error, which names file and reason, if the file cannot be read or, then with
/// byte offset or line, is malformed; and std::invalid_argument if an option is out of range.
///
/// Beside the file's bytes and some kilobytes, it takes at most so many times the file's size in
/// memory, whatever the file says. (A point takes 24 bytes in memory; in a text file it may take as
/// few as 6, or 2 if an index repeats it.)
///
///     .hair, .tfx  3                     text  5
///     .bcc  2 segments_per_span + 2      .vtp  17; 9 times the size of its decompressed arrays,
///                                              which is at most 64 times the file
FCL_FIBERS_IO_EXPORT FiberFile readFibers(const std::string& path,
                                          const FiberFileOptions& options = {});

/// Reads a file of this format, whatever its name.
FCL_FIBERS_IO_EXPORT FiberFile readFibers(const std::string& path, FiberFormat format,
                                          const FiberFileOptions& options = {});

/// Reads the bytes of a file in memory. `name` stands for the path in messages.
FCL_FIBERS_IO_EXPORT FiberFile parseFibers(std::string_view bytes, const std::string& name,
                                           FiberFormat format,
                                           const FiberFileOptions& options = {});

/// The format of a file that starts with these bytes and has this name, if it is recognized.
FCL_FIBERS_IO_EXPORT std::optional<FiberFormat> recognizeFormat(std::string_view bytes,
                                                                const std::string& name);

/// Writes Cem Yuksel's .hair. Coordinates are rounded to float. Thickness is twice the radius, by
/// point if the scene has radii. A segment that is thicker than both of its neighbours makes the
/// one before it as thick, because the format has no radii of segments. Only the repeated last
/// point shows that a fiber is closed.
///
/// Throws std::invalid_argument, before it opens the file, if the scene is empty, not as
/// FiberPolylines requires, or too large for the format: coordinates and thickness of float, 65,536
/// points per fiber and 2^32 - 1 points in all. Throws std::runtime_error, which names the file, if
/// it cannot be written.
FCL_FIBERS_IO_EXPORT void writeHair(const std::string& path, const FiberPolylines& scene);

}  // namespace fcl_fibers::io
