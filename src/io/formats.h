// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <fcl_fibers/io/fiber_file.h>

#include "io/byte_reader.h"

namespace fcl_fibers::io {

/// The content of a file, before options are applied.
struct ParsedFibers {
  FiberPolylines fibers;     ///< `closed` is empty if the format does not tell
  bool holds_radii = false;  ///< by point
  bool is_float = false;
  std::vector<std::string> passed_over;  ///< see FiberFile
  std::vector<std::string> warnings;

  /// Ends a fiber, which has the points added since the last one.
  void endFiber() { fibers.point_begin.push_back(fibers.points.size()); }
};

// Each parses a file from its start.
ParsedFibers parseBcc(ByteReader& file, const FiberFileOptions& options);
ParsedFibers parseHair(ByteReader& file);
ParsedFibers parsePolylines(ByteReader& file, const FiberFileOptions& options);
ParsedFibers parseSwc(ByteReader& file);
ParsedFibers parseTck(ByteReader& file);
ParsedFibers parseTfx(ByteReader& file);
ParsedFibers parseTrk(ByteReader& file);
ParsedFibers parseVtp(ByteReader& file, const FiberFileOptions& options);

/// Warns if bytes are left over, because the counts may be wrong.
inline void expectEnd(const ByteReader& file, ParsedFibers& parsed) {
  if (file.atEnd()) return;
  parsed.warnings.push_back(std::to_string(file.remaining()) + " bytes follow the last array, at " +
                            "byte " + std::to_string(file.offset()) + "; they are not read.");
}

/// Warns if the last line has no end, because the file may have been truncated inside a number.
inline void expectLineEnd(const ByteReader& file, ParsedFibers& parsed) {
  const std::string_view bytes = file.bytes();
  if (bytes.empty() || bytes.back() == '\n' || bytes.back() == '\r') return;
  parsed.warnings.push_back("The last line has no end; the file may be truncated there.");
}

/// Warns of fibers without points. They are left out, because a fiber has at least one point.
/// @param fiber  what the format calls one
inline void warnOfEmptyFibers(std::uint64_t count, const char* fiber, ParsedFibers& parsed) {
  if (count == 0) return;
  parsed.warnings.push_back(
      count == 1 ? joinedText("1 ", fiber, " has no points and is left out.")
                 : joinedText(count, " ", fiber, "s have no points and are left out."));
}

}  // namespace fcl_fibers::io
