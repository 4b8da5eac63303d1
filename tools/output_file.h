// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace fcl_fibers::tools {

/// A file that is there whole or not at all: it is written beside its place and renamed. What has
/// not been committed is removed, also where SIGINT, SIGTERM or SIGHUP end the program. What is no
/// regular file, such as /dev/stdout, is written in place.
class OutputFile {
 public:
  /// Throws std::runtime_error if nothing can be written there.
  explicit OutputFile(const std::string& path);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  /// Where to write until it is committed; ends as the path does.
  const std::string& draft() const { return draft_; }

  /// Replaces the content of the draft.
  void write(const std::string& text);

  /// Throws std::runtime_error if it cannot be put in its place.
  void commit();

 private:
  std::string path_;
  std::string draft_;
  bool in_place_ = false;
};

}  // namespace fcl_fibers::tools
