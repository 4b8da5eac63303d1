// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "output_file.h"

namespace fcl_fibers::tools {

/// An answer that is written piece by piece, because a whole one may fill the memory.
class AnswerStream {
 public:
  /// @param path  of the file to write; empty for stdout
  explicit AnswerStream(std::string path) : path_(std::move(path)) {}

  /// Throws std::runtime_error if it cannot be written.
  void write(std::string_view text);

  /// Writes what waits to be written.
  void flush();

  /// Ends the answer. Only then the file appears.
  void finish();

 private:
  std::string path_;
  std::optional<OutputFile> file_;
  std::string waiting_;
};

}  // namespace fcl_fibers::tools
