// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace fcl_fibers::test {

/// A file that goes with the test. Tests of several builds may run at once, so the name is drawn.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& extension, const std::string& bytes = "")
      : path_(testing::TempDir() + "fcl_fibers_" + std::to_string(std::random_device()()) + "_" +
              std::to_string(std::random_device()()) + extension) {
    std::ofstream stream(path_, std::ios::binary);
    stream << bytes;
    stream.close();
    if (!stream) throw std::logic_error("the test cannot write " + path_);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() { std::filesystem::remove(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace fcl_fibers::test
