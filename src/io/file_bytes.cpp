// SPDX-License-Identifier: BSD-3-Clause
#include "io/file_bytes.h"

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace fcl_fibers::io {

std::string readBytes(const char* call, const std::string& path) {
  const auto refuse = [&](const std::string& reason) {
    throw std::runtime_error(std::string(call) + ": '" + path + "' " + reason);
  };
  // Opening may succeed for other files, but a directory would read as empty, and a pipe could
  // block.
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) refuse("does not exist");
  if (!std::filesystem::status_known(status)) refuse("cannot be opened: " + error.message());
  if (std::filesystem::is_directory(status)) refuse("is a directory; give a file in it");
  if (!std::filesystem::is_regular_file(status)) refuse("is not a regular file");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) refuse("cannot be opened; check that you may read it");
  stream.seekg(0, std::ios::end);
  const std::streamoff size = stream.tellg();
  if (!stream || size < 0) refuse("has a size that cannot be read");
  std::string bytes(static_cast<std::size_t>(size), '\0');
  stream.seekg(0);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!stream) refuse("could not be read to its end");
  return bytes;
}

}  // namespace fcl_fibers::io
