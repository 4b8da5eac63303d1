// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fstream>
#include <string>
#include <string_view>

namespace fcl_fibers::tools {

/// A file that appears whole or not at all: a draft is written beside it and renamed. A draft that
/// is not committed is removed, even if SIGINT, SIGTERM or SIGHUP ends the program. Anything except
/// a regular file, such as /dev/stdout, is written in place.
class OutputFile {
 public:
  /// Throws std::runtime_error if nothing can be written there.
  explicit OutputFile(const std::string& path);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  /// The path to write to before commit(). It has the same ending.
  const std::string& draft() const { return draft_; }

  /// Appends to the draft. Throws std::runtime_error if that fails.
  void write(std::string_view text);

  /// Renames the draft. Throws std::runtime_error if that fails.
  void commit();

 private:
  void requireWritten() const;

  std::string path_;
  std::string draft_;
  std::ofstream stream_;  ///< opened by write()
  bool in_place_ = false;
};

}  // namespace fcl_fibers::tools
