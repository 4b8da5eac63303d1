// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/scenes/tfx.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "arguments.h"

namespace fcl_fibers::scenes {
namespace {

// What differs between the versions of the format; all numbers are little endian, sizes in bytes.
//
//     version  0          4        8                  12              144
//     3        float 3.x  strands  points per strand                  offset of the points
//     4        float 4.x  strands  points per strand  same as at 144
struct Layout {
  std::uint64_t header_size;
  std::uint64_t points_field;
  std::uint64_t point_size;
};
constexpr Layout kVersion3 = {148, 144, 12};  // Known up to here; files have points from 296 on.
constexpr Layout kVersion4 = {160, 12, 16};
constexpr std::uint64_t kCountsEnd = 12;
constexpr std::uint64_t kLargestHeader = 160;

std::uint32_t decodeWord(const unsigned char* bytes) {
  std::uint32_t word = 0;
  for (int i = 3; i >= 0; --i) word = word << 8 | bytes[i];
  return word;
}

float decodeFloat(const unsigned char* bytes) {
  static_assert(sizeof(float) == 4);
  const std::uint32_t word = decodeWord(bytes);
  float number = 0;
  std::memcpy(&number, &word, sizeof number);
  return number;
}

class TfxFile {
 public:
  explicit TfxFile(const std::string& path) : path_(path) {
    // Where opening succeeds, a directory would read as empty and a pipe could block.
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (status.type() == std::filesystem::file_type::not_found) refuseFile("does not exist");
    if (!std::filesystem::status_known(status)) refuseFile("cannot be opened: " + error.message());
    if (std::filesystem::is_directory(status)) refuseFile("is a directory");
    if (!std::filesystem::is_regular_file(status)) refuseFile("is not a regular file");
    stream_.open(path, std::ios::binary);
    if (!stream_) refuseFile("cannot be opened");
    stream_.seekg(0, std::ios::end);
    const std::streamoff end = stream_.tellg();
    if (!stream_ || end < 0) refuseFile("has no size");
    size_ = static_cast<std::uint64_t>(end);
  }

  std::uint64_t size() const { return size_; }

  // Fills `bytes` from `offset` on; the range lies inside the file as it was when it was opened.
  void read(std::uint64_t offset, unsigned char* bytes, std::uint64_t count) {
    stream_.seekg(static_cast<std::streamoff>(offset));
    stream_.read(reinterpret_cast<char*>(bytes), static_cast<std::streamsize>(count));
    if (!stream_) refuse(offset, "reading failed");
  }

  template <typename... Reason>
  [[noreturn]] void refuse(std::uint64_t offset, const Reason&... reason) const {
    std::ostringstream message;
    message << "readTfx: '" << path_ << "', byte " << offset << ": ";
    (message << ... << reason);
    throw std::runtime_error(message.str());
  }

 private:
  [[noreturn]] void refuseFile(const std::string& reason) const {
    throw std::runtime_error("readTfx: '" + path_ + "' " + reason);
  }

  std::string path_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;
};

struct Header {
  std::uint64_t strands;
  std::uint64_t points_per_strand;
  std::uint64_t points_offset;
  std::uint64_t point_size;
};

// What it returns is consistent: the points lie behind the header and inside the file.
Header readHeader(TfxFile& file) {
  std::array<unsigned char, kLargestHeader> bytes{};
  const std::uint64_t available = std::min(file.size(), kLargestHeader);
  if (available < kCountsEnd) file.refuse(available, "the file ends inside the header");
  file.read(0, bytes.data(), available);

  const float version = decodeFloat(bytes.data());
  const bool is_version_3 = version >= 3 && version < 4;
  const bool is_version_4 = version >= 4 && version < 5;
  if (!is_version_3 && !is_version_4) {
    file.refuse(0, "version is ", version, ", known are 3 and 4");
  }
  const Layout& layout = is_version_3 ? kVersion3 : kVersion4;
  if (available < layout.header_size) file.refuse(available, "the file ends inside the header");

  Header header;
  header.strands = decodeWord(&bytes[4]);
  header.points_per_strand = decodeWord(&bytes[8]);
  header.points_offset = decodeWord(&bytes[layout.points_field]);
  header.point_size = layout.point_size;
  if (header.strands == 0) file.refuse(4, "there are no strands");
  if (header.points_per_strand < 2) {
    file.refuse(8, "points per strand are ", header.points_per_strand, ", needed are 2");
  }
  if (header.points_offset < layout.header_size) {
    file.refuse(layout.points_field, "points start at byte ", header.points_offset,
                ", inside the header of ", layout.header_size, " bytes");
  }
  if (header.points_offset > file.size()) {
    file.refuse(layout.points_field, "points start at byte ", header.points_offset,
                " of a file of ", file.size(), " bytes");
  }
  // The product of two 32-bit counts fits 64 bits; times the size of a point it might not.
  const std::uint64_t points = header.strands * header.points_per_strand;
  if (points > (file.size() - header.points_offset) / header.point_size) {
    file.refuse(4, header.strands, " strands of ", header.points_per_strand, " points from byte ",
                header.points_offset, " on end beyond the file of ", file.size(), " bytes");
  }
  return header;
}

}  // namespace

FiberScene readTfx(const std::string& path, double radius) {
  FiberScene scene;
  scene.radius = requireRadius<double>("readTfx", radius);

  TfxFile file(path);
  const Header header = readHeader(file);
  scene.points.reserve(static_cast<std::size_t>(header.strands * header.points_per_strand));
  scene.point_begin.reserve(static_cast<std::size_t>(header.strands + 1));

  const std::uint64_t strand_size = header.points_per_strand * header.point_size;
  std::vector<unsigned char> bytes(static_cast<std::size_t>(strand_size));
  for (std::uint64_t strand = 0; strand < header.strands; ++strand) {
    const std::uint64_t offset = header.points_offset + strand * strand_size;
    file.read(offset, bytes.data(), strand_size);
    for (std::uint64_t i = 0; i < header.points_per_strand; ++i) {
      Point point;
      for (std::uint64_t k = 0; k < 3; ++k) {
        const std::uint64_t at = i * header.point_size + 4 * k;
        point[k] = decodeFloat(&bytes[at]);
        if (!std::isfinite(point[k])) {
          file.refuse(offset + at, "strand ", strand, ", point ", i, ": coordinate is ", point[k]);
        }
      }
      scene.points.push_back(point);
    }
    scene.point_begin.push_back(scene.points.size());
  }
  return scene;
}

}  // namespace fcl_fibers::scenes
