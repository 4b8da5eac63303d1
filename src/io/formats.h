// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/io/fiber_file.h>

#include "io/byte_reader.h"

namespace fcl_fibers::io {

/// By fiber that has points, the number that its last point has, by which it is in a group.
struct GroupNumbers {
  std::vector<double> numbers;
  std::size_t mixed = 0;  ///< fibers with several numbers; the first point may be that of another
  bool is_mixed = false;  ///< the last fiber

  /// @param place  of the point on its fiber, from 0 on
  void add(double number, std::size_t place) {
    if (place == 0) {
      numbers.push_back(number);
      is_mixed = false;
    } else if (place > 1 && number != numbers.back() && !is_mixed) {
      is_mixed = true;
      ++mixed;
    }
    numbers.back() = number;
  }
};

/// The content of a file, before options are applied.
struct ParsedFibers {
  FiberPolylines fibers;     ///< `closed` is empty if the format does not tell
  bool holds_radii = false;  ///< by point
  bool is_float = false;
  GroupNumbers groups{};
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
