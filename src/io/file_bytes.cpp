// SPDX-License-Identifier: BSD-3-Clause
#include "io/file_bytes.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "io/text.h"

namespace fcl_fibers::io {
namespace {

void require(bool done, const char* call, const std::string& path, const std::string& problem) {
  if (!done) throw std::runtime_error(std::string(call) + ": '" + path + "'" + problem);
}

/// Unpacks until `to` has `most` bytes, and takes off `bytes` what was used. Returns zlib's result
/// and message: Z_OK if there may be more, Z_STREAM_END, Z_BUF_ERROR where the input ends too
/// early, and others for damage.
std::pair<int, const char*> unpack(std::string_view& bytes, std::size_t most, std::string& to) {
  constexpr int kGzip = 16;  // see zlib.h
  z_stream stream{};
  if (inflateInit2(&stream, kGzip + MAX_WBITS) != Z_OK) throw std::bad_alloc();
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, &inflateEnd);
  std::string buffer(std::size_t{1} << 16, '\0');
  int status = Z_OK;
  while (to.size() < most && (status == Z_OK || (status == Z_STREAM_END && isPacked(bytes) &&
                                                 inflateReset(&stream) == Z_OK))) {
    const std::size_t given = std::min<std::size_t>(bytes.size(), std::size_t{1} << 30);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(given);
    stream.next_out = reinterpret_cast<Bytef*>(buffer.data());
    stream.avail_out = static_cast<uInt>(std::min(most - to.size(), buffer.size()));
    const uInt room = stream.avail_out;
    status = inflate(&stream, Z_NO_FLUSH);
    to.append(buffer, 0, room - stream.avail_out);
    bytes.remove_prefix(given - stream.avail_in);
  }
  return {status, stream.msg == nullptr ? "unknown" : stream.msg};
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

bool isPacked(std::string_view bytes) {
  return startsWith(bytes, "\x1F\x8B\x08");  // and deflate
}

std::string unpackedStart(std::string_view bytes, std::size_t most) {
  std::string start;
  unpack(bytes, most, start);
  return start;
}

std::string_view unpacked(const ByteReader& file, std::string& room) {
  if (!isPacked(file.bytes())) return file.bytes();
  std::string_view left = file.bytes();
  const std::uint64_t most = 64 * file.size() + (std::uint64_t{16} << 20);
  const auto [status, problem] = unpack(left, static_cast<std::size_t>(most + 1), room);
  const std::uint64_t at = file.size() - left.size();
  if (room.size() > most) {
    file.refuse(at, "the file unpacks to more than ", most,
                " bytes, which is beyond what fibers do; unpack it by gunzip if it is right");
  }
  if (status == Z_BUF_ERROR) file.refuse(at, "the packed file is truncated");
  if (status != Z_STREAM_END) file.refuse(at, "the packed file is damaged: ", problem);
  // Tapes fill a block with zeros.
  if (left.find_first_not_of('\0') != left.npos) {
    file.refuse(at, "bytes follow the end of what is packed");
  }
  return room;
}

}  // namespace fcl_fibers::io
