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

/// The file formats of fibers. Points, radii, closed curves and branches are read. Radii are those
/// of points, so segments taper where they differ. If no radius is above 0, the file has none.
enum class FiberFormat {
  /// Cem Yuksel's .hair. A radius is half the thickness.
  kHair,

  /// TressFX .tfx, versions 3 and 4.
  kTfx,

  /// Cem Yuksel's binary curve collection (.bcc) with numbers of 4 bytes. Its uniform Catmull-Rom
  /// splines (`C0`) and uniform cubic B-splines (`BS`) become straight segments. An open curve runs
  /// from its first control point to its last, as if another one lay mirrored beyond each. A closed
  /// curve has one span for each of its control points, and at least three of them.
  kBcc,

  /// Text with one point `x y z` per line and a blank line between fibers. Spaces, tabs, commas or
  /// semicolons separate the columns of a line. Lines that start with '#' and a UTF-8 byte order
  /// mark are skipped. So are further columns, with a warning; FiberFileOptions::radius_from takes
  /// the radii from one of them.
  kPolylines,

  /// VTK's XML format of polygonal data (.vtp). Every line of every piece is a fiber. The data may
  /// be ASCII, base64 inline or appended, or raw appended; uncompressed, or compressed by zlib.
  /// Points are Float32 or Float64, indices have 32 or 64 bits. The point data `radius` of any type
  /// are radii, or the array that FiberFileOptions::radius_from names. A line without
  /// points is a fiber without points, as it is in the formats of streamlines.
  ///
  /// A fiber starts or ends at another one (FiberPolylines::starts_at) if the first or the last
  /// point of its line is also a point of another line. If several lines have this point, the other
  /// one is the first line that has it between its ends, or else the first that ends there, or else
  /// the first that begins there. Lines that cross without an end have no branch. Arrays that
  /// exportFibers() writes come before this rule. A filter that renumbers the points leaves these
  /// arrays as they were. If one of them then names a point of no line, at another place or the
  /// fiber's own end, none of them is read, with a warning.
  ///
  /// These are refused: LZ4 and LZMA compression; the parallel format (.pvtp); arrays that together
  /// are longer than the file, or more than 64 times as long when decompressed; and XML with more
  /// tags than 256 plus one per 16 bytes.
  kVtp,

  /// MRtrix's tracks (.tck), of 4-byte or 8-byte numbers in either byte order. Coordinates are the
  /// scanner's in millimetres, as in the file.
  kTck,

  /// TrackVis's tracks (.trk), versions 1 and 2, in either byte order. Points are given in the
  /// scanner's millimetres to the right, to the front and up (RAS+), as nibabel gives them: the
  /// corner of a voxel is moved to its centre, the voxel order is compared with `vox_to_ras`, and
  /// this is applied. If the header has no `vox_to_ras`, the identity takes its place. If it has no
  /// voxel order, LPS does. Arithmetic is in double, so nibabel's points, which are floats, differ
  /// by rounding.
  kTrk,

  /// Neurons (.swc): `id type x y z radius parent` on each line, in any order; the parent of a root
  /// is -1. Further columns and lines that start with '#' are skipped. A neuron is split where it
  /// branches. Each of its fibers begins at a root or a branching point and ends at the next one or
  /// at a tip. It starts at the fiber that ends where it begins, or at the first one that begins at
  /// its root (FiberPolylines::starts_at). A root without children is a sphere: a fiber of one
  /// segment of length zero.
  kSwc,
};

/// Options of readFibers() and parseFibers().
///
///     FiberFileOptions options;
///     options.radius = 0.005;  // for a file without radii, or in place of its own
///     const FiberFile file = readFibers("scalp.hair", options);
struct FiberFileOptions {
  /// Radius of all fibers in the file's unit. Finite, not negative; 0 is accepted. Without this the
  /// file's own radii count, if it has any; see FiberFile::has_radius.
  std::optional<double> radius;

  /// Number of straight segments for each span of a .bcc spline, 1 to 1000.
  int segments_per_span = 4;

  /// Where the radii of the points are. In a .vtp file it is the name of an array with one number
  /// for each point, or else for each cell, in place of the point data `radius`. In text it is the
  /// number of a column, counted from 1; the first three are x, y and z. Refused for other formats,
  /// and beside `radius`. If it is empty, .vtp files have their radii in `radius`, and text has
  /// none.
  std::string radius_from{};

  /// Where the numbers are that put fibers into groups (FiberPolylines::groups): fibers of the same
  /// number are one group. In a .vtp file this is the name of an array with one number for each
  /// point, or else for each cell. In text it is the number of a column, from 4 on. In an .swc file
  /// it is `type`. If there is a number for each point, that of the fiber's last point counts.
  /// Refused for other formats. If it is empty, no fiber has a group.
  std::string groups_from{};
};

/// The content of a file, in the file's unit of length and frame.
struct FiberFile {
  FiberFormat format = FiberFormat::kPolylines;  ///< as given, or as recognized

  /// The fibers. In a .bcc file the file says which are closed. In other formats a fiber is closed
  /// if its last point is its first, it has at least three segments and its points are not all the
  /// same. Segments of length zero are kept.
  FiberPolylines fibers;

  /// Whether the options gave a radius, or the file one above 0. If not, all are 0, and capsules
  /// touch only if their axes intersect. Set FiberPolylines::radius then, before any query for
  /// collisions.
  bool has_radius = false;

  /// What a user of the fibers should know, one sentence each. For example, coordinates kept as
  /// floats are too coarse for the radius, the file may be truncated, bytes follow the last array,
  /// or an array of another name may hold the radii.
  std::vector<std::string> warnings;

  /// Names of what the file holds for its points or fibers and is not read, such as "colour" or
  /// "point data 'FA'". At most nine for points and fibers together; the last one is "others" if
  /// there are more.
  std::vector<std::string> passed_over;

  /// The numbers that FiberFileOptions::groups_from has found, ascending: that of group g is
  /// group_values[g - 1]. A fiber without points may be in no group.
  std::vector<double> group_values{};
};

/// Reads a file of fibers. Its first bytes tell its format; if they do not, its extension does. A
/// file that gzip packed is unpacked first, and its name is taken without .gz.
///
///     const FiberFile file = readFibers("scalp.hair");
///     tree.build(fiberArrays(file.fibers));
///
/// Throws std::runtime_error with the file's name and the reason if the file cannot be read or is
/// malformed. If it is malformed, the text also has the byte offset or the line. Throws
/// std::invalid_argument if an option is out of range.
///
/// Reading takes memory for the file's bytes, some kilobytes, and at most this multiple of the
/// file's size, whatever the file contains:
///
///     .hair, .tfx, .tck, .trk  3         text  5, and 1 for each of radii and groups
///     .bcc  2 segments_per_span + 2      .swc  12
///     .vtp  29; 16 times the size of its decompressed arrays, which is at most 64 times the file
///
/// For a packed file, the size of the unpacked one counts, and three times that size comes in
/// addition. A file that unpacks to more than 64 times its size and 16 MiB is refused.
///
/// The reason is that a point takes 24 bytes in memory. In a text file it may take as few as 6, or
/// 2 if an index of a .vtp file repeats it. A neuron's branching points are repeated.
FCL_FIBERS_IO_EXPORT FiberFile readFibers(const std::string& path,
                                          const FiberFileOptions& options = {});

/// Reads a file of the given format, whatever its name is.
FCL_FIBERS_IO_EXPORT FiberFile readFibers(const std::string& path, FiberFormat format,
                                          const FiberFileOptions& options = {});

/// Reads the bytes of a file that is already in memory. `name` stands for the path in messages.
FCL_FIBERS_IO_EXPORT FiberFile parseFibers(std::string_view bytes, const std::string& name,
                                           FiberFormat format,
                                           const FiberFileOptions& options = {});

/// Reads the bytes of a file that is already in memory, and recognizes its format by the bytes or
/// the extension of `name`.
FCL_FIBERS_IO_EXPORT FiberFile parseFibers(std::string_view bytes, const std::string& name,
                                           const FiberFileOptions& options = {});

/// Returns the format of a file with this name that starts with these bytes, if it is recognized.
/// For a packed file it is the format of what is packed.
FCL_FIBERS_IO_EXPORT std::optional<FiberFormat> recognizeFormat(std::string_view bytes,
                                                                const std::string& name);

/// Writes Cem Yuksel's .hair. Coordinates are rounded to floats. The thickness is twice the radius;
/// it is written by point if the scene has `radii`. The format has no radii of segments: a point
/// then gets the larger one of its two segments. The format has no branches, groups, samples or
/// types. A closed fiber is recognizable only by its repeated last point.
///
/// Throws std::invalid_argument, before it opens the file, if the scene is empty, not as
/// FiberPolylines requires, or too large for the format. The format has coordinates and thickness
/// of floats, 1 to 65,536 points per fiber and at most 2^32 - 1 points in all. Throws
/// std::runtime_error with the file's name if the file cannot be written.
FCL_FIBERS_IO_EXPORT void writeHair(const std::string& path, const FiberPolylines& scene);

}  // namespace fcl_fibers::io
