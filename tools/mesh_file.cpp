// SPDX-License-Identifier: BSD-3-Clause
#include "mesh_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fcl_fibers/fiber_tree.h>
#include <fmt/format.h>
#include <tiny_obj_loader.h>

#include "messages.h"

namespace fcl_fibers::tools {
namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw std::invalid_argument("'" + path + "': " + why);
}

std::string readText(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) refuse(path, "there is no such file");
  if (std::filesystem::is_directory(path, error)) refuse(path, "it is a folder; give a file in it");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) refuse(path, "it cannot be opened; check that you may read it");
  std::string text(std::istreambuf_iterator<char>(stream), {});
  if (stream.bad()) refuse(path, "it could not be read to its end");
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.compare(0, kByteOrderMark.size(), kByteOrderMark) == 0) {
    text.erase(0, kByteOrderMark.size());
  }
  return text;
}

std::string_view takeWord(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(" \t"));
  line.remove_prefix(word.size());
  return word;
}

/// The lines of an OBJ file, read before tinyobjloader cuts the faces. In silence it takes 0 for
/// what is no number, rounds numbers twice, and leaves out faces whose points are not there.
class Lines {
 public:
  Lines(const std::string& path, std::string_view text) : path_(path) {
    while (!text.empty()) {
      const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
      ++number_;
      read(text.substr(0, end));
      text.remove_prefix(end);
      text.remove_prefix(text.substr(0, 2) == "\r\n" ? 2 : std::min<std::size_t>(1, text.size()));
    }
    if (triangles_ == 0) refuse(path_, "there is no face; give a Wavefront OBJ file with faces");
    if (largest_ > pointCount()) {
      number_ = line_of_largest_;
      refuseLine(fmt::format("the face has point {}, and the file has {}", largest_, pointCount()));
    }
  }

  std::size_t triangles() const { return triangles_; }
  std::vector<Point> takePoints() { return std::move(points_); }

 private:
  long long pointCount() const { return static_cast<long long>(points_.size()); }

  void read(std::string_view line) {
    const std::string_view keyword = takeWord(line);
    if (keyword == "v") {
      Point point;
      for (double& x : point) x = coordinate(takeWord(line));
      points_.push_back(point);
    } else if (keyword == "f") {
      long long corners = 0;
      for (auto word = takeWord(line); !word.empty(); word = takeWord(line)) {
        readCorner(word);
        ++corners;
      }
      if (corners < 3) refuseLine(fmt::format("the face has {} points; it needs 3", corners));
      triangles_ += static_cast<std::size_t>(corners - 2);
    }
  }

  double coordinate(std::string_view word) const {
    if (word.empty()) refuseLine("the point has fewer than three coordinates");
    const std::string_view digits = word.substr(word[0] == '+' ? 1 : 0);
    double number = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(number)) {
      refuseLine(fmt::format("'{}' is not a finite number", word));
    }
    return number;
  }

  /// A number counts from 1, or if it is negative from the last point so far. `/` ends it.
  void readCorner(std::string_view word) {
    const std::string_view digits = word.substr(0, word.find('/'));
    long long point = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), point);
    if (error != std::errc() || end != digits.data() + digits.size() || point == 0) {
      refuseLine(fmt::format("'{}' does not name a point; points count from 1", word));
    }
    if (point + pointCount() < 0) {
      refuseLine(fmt::format("the face has point {}, and {} are before it", point, pointCount()));
    }
    if (point <= largest_) return;
    largest_ = point;
    line_of_largest_ = number_;
  }

  [[noreturn]] void refuseLine(const std::string& why) const {
    refuse(path_, fmt::format("line {}: {}", number_, why));
  }

  const std::string& path_;
  long long number_ = 0;  ///< of the line
  std::vector<Point> points_;
  long long largest_ = 0, line_of_largest_ = 0;
  std::size_t triangles_ = 0;
};

}  // namespace

MeshFile readMesh(const std::string& path, TriangleMesh::Kind kind) {
  const std::string text = readText(path);
  Lines lines(path, text);
  tinyobj::attrib_t attributes;
  std::vector<tinyobj::shape_t> shapes;
  std::vector<tinyobj::material_t> materials;
  std::string warnings, errors;
  std::istringstream stream(text);
  if (!tinyobj::LoadObj(&attributes, &shapes, &materials, &warnings, &errors, &stream,
                        /*readMatFn=*/nullptr, /*triangulate=*/true,
                        /*default_vcols_fallback=*/false)) {
    refuse(path, errors);
  }
  std::vector<Point> points = lines.takePoints();
  std::vector<std::int32_t> triangles;
  for (const tinyobj::shape_t& shape : shapes) {
    for (const tinyobj::index_t& corner : shape.mesh.indices) {
      triangles.push_back(corner.vertex_index);
    }
  }
  if (triangles.size() != 3 * lines.triangles()) {
    refuse(path,
           "a face of more than four points cannot be cut into triangles; have the program that "
           "wrote the file cut it");
  }
  const MeshArrays<double> arrays = {points.front().data(), points.size(), triangles.data(),
                                     lines.triangles()};
  try {
    TriangleMesh mesh(arrays, kind);
    return {readable(std::filesystem::path(path).filename().string()), std::move(points),
            std::move(triangles), std::move(mesh)};
  } catch (const std::invalid_argument& error) {
    refuse(path, error.what());
  }
}

std::vector<MeshFile> MeshOptions::read() const {
  std::vector<MeshFile> meshes;
  for (const std::string& path : paths) {
    meshes.push_back(
        readMesh(path, solid ? TriangleMesh::Kind::kSolid : TriangleMesh::Kind::kSurface));
  }
  return meshes;
}

std::vector<std::int32_t> MeshOptions::roots(const FiberPolylines& scene) const {
  if (paths.empty() && root_length == 0 && root_segments == 0) return {};
  std::vector<std::int32_t> counts = rootSegments(fiberArrays(scene), root_length);
  for (std::int32_t& count : counts) count = std::max(count, root_segments);
  return counts;
}

}  // namespace fcl_fibers::tools
