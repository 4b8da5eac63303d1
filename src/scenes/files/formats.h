// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <fcl_fibers/scenes/fiber_file.h>

#include "byte_reader.h"

namespace fcl_fibers::scenes {

/// What a file of one format says, before options apply.
struct ParsedFibers {
  FiberScene scene;  ///< `closed` is left empty where the format does not tell
  bool has_radius = false;
  bool is_float = false;
  std::vector<std::string> warnings;

  /// The points added since the last one end a fiber.
  void endFiber() { scene.point_begin.push_back(scene.points.size()); }
};

// Each parses a file from its start on.
ParsedFibers parseBcc(ByteReader& file, const FiberFileOptions& options);
ParsedFibers parseHair(ByteReader& file);
ParsedFibers parsePolylines(ByteReader& file);
ParsedFibers parseTfx(ByteReader& file);
ParsedFibers parseVtk(ByteReader& file);
ParsedFibers parseVtp(ByteReader& file);

/// Warns where something follows what was read: the counts may be wrong.
inline void expectEnd(const ByteReader& file, ParsedFibers& parsed) {
  if (file.atEnd()) return;
  parsed.warnings.push_back(std::to_string(file.remaining()) + " bytes follow the last array, at " +
                            "byte " + std::to_string(file.offset()) + "; they are not read.");
}

/// Warns where the last line does not end: it may have been cut off inside a number.
inline void expectLineEnd(const ByteReader& file, ParsedFibers& parsed) {
  const std::string_view bytes = file.bytes();
  if (bytes.empty() || bytes.back() == '\n' || bytes.back() == '\r') return;
  parsed.warnings.push_back("The last line has no end; the file may have been cut off there.");
}

}  // namespace fcl_fibers::scenes
