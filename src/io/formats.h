// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
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

  /// Makes room for all at once, because growing vectors take three times as much.
  void reserve(std::uint64_t points, std::uint64_t fiber_count) {
    fibers.points.reserve(static_cast<std::size_t>(points));
    fibers.point_begin.reserve(static_cast<std::size_t>(fiber_count) + 1);
  }

  bool isInFiber() const { return fibers.points.size() > fibers.point_begin.back(); }

  /// Ends a fiber, which has the points added since the last one.
  void endFiber() { fibers.point_begin.push_back(fibers.points.size()); }

  template <typename... Parts>
  void warn(const Parts&... parts) {
    warnings.push_back(joinedText(parts...));
  }

  /// @param radii  by point
  void setRadii(std::vector<double> radii) {
    holds_radii = true;
    if (std::adjacent_find(radii.begin(), radii.end(), std::not_equal_to<>()) != radii.end()) {
      fibers.radii = std::move(radii);
      fibers.radii_are = FiberArrays<double>::Radii::kPerPoint;
    } else if (!radii.empty()) {
      fibers.radius = radii.front();
    }
  }

  /// Warns if bytes are left over, because the counts may be wrong.
  void expectEnd(const ByteReader& file) {
    if (file.atEnd()) return;
    warn(file.remaining(), " bytes follow the last array, at byte ", file.offset(),
         "; they are not read.");
  }

  /// Warns if the last line has no end, because the file may have been truncated inside a number.
  void expectLineEnd(const ByteReader& file) {
    if (file.bytes().find_last_of("\r\n") + 1 == file.size()) return;
    warn("The last line has no end; the file may be truncated there.");
  }
};

/// Parses a file from its start.
using Parser = ParsedFibers(ByteReader& file, const FiberFileOptions& options);
Parser parseBcc, parseHair, parsePolylines, parseSwc, parseTck, parseTfx, parseTrk, parseVtp;

}  // namespace fcl_fibers::io
