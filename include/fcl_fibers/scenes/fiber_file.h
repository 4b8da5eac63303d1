// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fcl_fibers/scenes/export.h>
#include <fcl_fibers/scenes/fiber_polylines.h>

namespace fcl_fibers::scenes {

/// Files that fibers are kept in. What a format holds beside points and radii is not read.
enum class FiberFormat {
  /// Cem Yuksel's .hair. Radii are half the thickness; a segment has the larger one of its ends. A
  /// default thickness of 0 is none.
  kHair,

  /// TressFX .tfx, versions 3 and 4.
  kTfx,

  /// Cem Yuksel's binary curve collection (.bcc) of 4-byte numbers: uniform Catmull-Rom splines
  /// (`C0`) and uniform cubic B-splines (`BS`), tessellated. An open curve goes from its first
  /// control point to its last one, as if a further one lay mirrored beyond each; a closed one has
  /// a span for each control point, and at least three.
  kBcc,

  /// Text, a point `x y z` a line, and a blank line between fibers. Further columns and lines that
  /// start with '#' are skipped.
  kPolylines,

  /// VTK's legacy format (.vtk), versions 1 to 5, ASCII and binary: DATASET POLYDATA, a fiber for
  /// each cell of LINES. Points are float or double and precede the lines. Not read: other data
  /// sets, and arrays of strings before the lines.
  kVtk,

  /// VTK's XML format of polygonal data (.vtp), a fiber for each line of each piece: ASCII, base64
  /// inline or appended, raw appended; as it is, or compressed by zlib. Points are Float32 or
  /// Float64, indices 32 or 64 bits wide. Point data `radius`, Float32 or Float64, are radii; a
  /// segment has the larger one of its ends. Not read: LZ4, LZMA, the parallel format (.pvtp),
  /// arrays that together are longer than the file, or when compressed become more than 64 times as
  /// long, and XML with more tags than some and one for 16 bytes.
  kVtp,
};

/// How a file is to be read.
struct FiberFileOptions {
  /// Radius of all fibers in the file's unit, finite, not negative; 0 may be meant. None: the
  /// file's own radii, if it holds any; see FiberFile::has_radius.
  std::optional<double> radius;

  /// Straight segments that a span of a .bcc spline becomes, 1 to 1000.
  int segments_per_span = 4;
};

/// What was read, in the file's unit of length and frame.
struct FiberFile {
  FiberFormat format = FiberFormat::kPolylines;  ///< asked for, or recognized

  /// A fiber is closed where the file says so (.bcc); of other formats, where its last point is its
  /// first one and it has three segments or more. Segments of length zero stay.
  FiberScene scene;

  /// Whether the options or the file gave the radii. Else they are 0, which nobody meant: capsules
  /// without thickness touch only where axes meet. Give one, or set FiberScene::radius, before
  /// collisions are asked for.
  bool has_radius = false;

  /// What a reader of the scene ought to know, a sentence each: coordinates kept as float are too
  /// coarse for the radius, the file may have been cut off, something follows the last array.
  std::vector<std::string> warnings;
};

/// Reads a file whose format is known by its first bytes or else by the extension of its name.
///
/// Throws std::runtime_error naming file, byte offset or line, and reason where the file is
/// malformed, and file and reason where it cannot be read; std::invalid_argument if an option is
/// not as FiberFileOptions says.
///
/// Memory taken is at most so many times the file's size, whatever the file says, beside the file's
/// bytes themselves and some kilobytes; a point takes 24 bytes, and in text as little as 6, or 2
/// for the index of one that is there already:
///
///     .hair, .tfx  3        text  5      .vtk  6 if binary, 12 if ASCII
///     .bcc  2 segments_per_span + 2      .vtp  17; 9 times what its compressed arrays become,
///                                              which is at most 64 times the file
FCL_FIBERS_SCENES_EXPORT FiberFile readFibers(const std::string& path,
                                              const FiberFileOptions& options = {});

/// The same for a file of that format, whatever its name.
FCL_FIBERS_SCENES_EXPORT FiberFile readFibers(const std::string& path, FiberFormat format,
                                              const FiberFileOptions& options = {});

/// The same for the bytes of a file in memory; `name` stands for the path in messages.
FCL_FIBERS_SCENES_EXPORT FiberFile parseFibers(std::string_view bytes, const std::string& name,
                                               FiberFormat format,
                                               const FiberFileOptions& options = {});

/// The format of a file that starts with these bytes and has this name, if it is known.
FCL_FIBERS_SCENES_EXPORT std::optional<FiberFormat> recognizeFormat(std::string_view bytes,
                                                                    const std::string& name);

/// Writes Cem Yuksel's .hair: coordinates rounded to float, thickness the double radius, by point
/// if the scene has radii; a segment thicker than both of its neighbours makes the one before it as
/// thick, which the format cannot say otherwise. That a fiber is closed shows by its last point
/// only.
///
/// Throws std::invalid_argument, before the file is touched, where the scene is not as FiberScene
/// says, empty, or beyond the format: coordinates and thickness of float, 65,536 points a fiber and
/// 2^32 - 1 points; and std::runtime_error naming the file where it cannot be written.
FCL_FIBERS_SCENES_EXPORT void writeHair(const std::string& path, const FiberScene& scene);

}  // namespace fcl_fibers::scenes
