// SPDX-License-Identifier: BSD-3-Clause
#include "io/file_bytes.h"

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace fcl_fibers::io {
namespace {

void require(bool done, const char* call, const std::string& path, const std::string& problem) {
  if (!done) throw std::runtime_error(std::string(call) + ": '" + path + "'" + problem);
}

}  // namespace

std::string readBytes(const char* call, const std::string& path) {
  namespace fs = std::filesystem;
  // Opening may succeed for other files, but a directory would read as empty, and a pipe could
  // block.
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  require(status.type() != fs::file_type::not_found, call, path, " does not exist");
  require(fs::status_known(status), call, path, " cannot be opened: " + error.message());
  require(!fs::is_directory(status), call, path, " is a directory; give a file in it");
  require(fs::is_regular_file(status), call, path, " is not a regular file");
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  require(stream.is_open(), call, path, " cannot be opened; check that you may read it");
  const std::streamoff size = stream.tellg();
  require(size >= 0, call, path, " has a size that cannot be read");
  std::string bytes(static_cast<std::size_t>(size), '\0');
  stream.seekg(0);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  require(stream.good(), call, path, " could not be read to its end");
  return bytes;
}

void writeBytes(const char* call, const std::string& path, const std::string& bytes) {
  std::ofstream stream(path, std::ios::binary);
  require(stream.is_open(), call, path,
          " cannot be opened; check that its folder exists and may be written to");
  stream << bytes;
  stream.close();
  require(stream.good(), call, path, ": writing failed; check that the disk has room");
}

}  // namespace fcl_fibers::io
