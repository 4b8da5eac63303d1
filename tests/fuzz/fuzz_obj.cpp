// SPDX-License-Identifier: BSD-3-Clause
//
// The reader of meshes on any bytes: triangles of the file's points, or a short and printable
// refusal that names the line. If the file is one face, its triangles have the area of the face,
// and none is turned over, in the projection that the reader may have cut it in.
#include <fcl_fibers/io/mesh_file.h>

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fuzz_input.h"

namespace {

using boost::multiprecision::cpp_int;
using fcl_fibers::Point;
using fcl_fibers::fuzz::require;
using fcl_fibers::io::MeshFile;

/// In units of the last bit of any double.
cpp_int whole(double x) {
  int exponent = 0;
  const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(x, &exponent), 53));
  return exponent >= -1021 ? cpp_int(mantissa) << (exponent + 1021)
                           : cpp_int(mantissa >> (-1021 - exponent));
}

using Area = std::array<cpp_int, 3>;

/// Twice the area of a triangle as it projects along each axis.
Area areaOf(const Point& a, const Point& b, const Point& c) {
  std::array<cpp_int, 3> u, v;
  for (std::size_t k = 0; k < 3; ++k) {
    u[k] = whole(b[k]) - whole(a[k]);
    v[k] = whole(c[k]) - whole(a[k]);
  }
  return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

/// The points of the one face, if the file has no other and its words are all numbers.
std::vector<std::size_t> onlyFace(std::string_view bytes, std::size_t points) {
  const std::size_t at = bytes.rfind("\nf ");
  std::vector<std::size_t> face;
  if (at == bytes.npos || bytes.find('f') != at + 1) return face;
  for (std::size_t i = at + 3; i < bytes.size();) {
    if (bytes[i] == ' ') {
      ++i;
      continue;
    }
    std::size_t number = 0;
    const std::size_t begin = i;
    for (; i < bytes.size() && bytes[i] >= '0' && bytes[i] <= '9' && number <= points; ++i) {
      number = 10 * number + static_cast<std::size_t>(bytes[i] - '0');
    }
    if (bytes.substr(i) == "\n" && i > begin) i = bytes.size();
    if (i == begin || number == 0 || number > points) return {};
    if (i < bytes.size() && bytes[i] != ' ') return {};
    face.push_back(number - 1);
  }
  return face;
}

/// Whether the triangles are a face's along the axis.
bool fits(const MeshFile& mesh, const std::vector<std::size_t>& face, std::size_t axis) {
  cpp_int area = 0, sum = 0;
  for (std::size_t i = 1; i + 1 < face.size(); ++i) {
    area += areaOf(mesh.points[face[0]], mesh.points[face[i]], mesh.points[face[i + 1]])[axis];
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const auto at = [&](std::size_t k) -> const Point& {
      return mesh.points[static_cast<std::size_t>(mesh.triangles[i + k])];
    };
    const cpp_int part = areaOf(at(0), at(1), at(2))[axis];
    if (part * area < 0) return false;
    sum += part;
  }
  return sum == area;
}

/// A face that a program may have repeated, or that is narrower than rounding, is cut otherwise.
bool isPlain(const MeshFile& mesh, const std::vector<std::size_t>& face) {
  const std::set<std::size_t> points(face.begin(), face.end());
  for (const std::size_t i : face) {
    for (const double x : mesh.points[i]) {
      if (x != std::floor(x) || std::fabs(x) > 1000) return false;
    }
  }
  return points.size() == face.size();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    const MeshFile mesh = fcl_fibers::io::parseMesh(bytes, "the input");
    require(!mesh.triangles.empty() && mesh.triangles.size() % 3 == 0);
    for (const std::int32_t point : mesh.triangles) {
      require(point >= 0 && static_cast<std::size_t>(point) < mesh.points.size());
    }
    for (const Point& point : mesh.points) {
      for (const double coordinate : point) require(std::isfinite(coordinate));
    }
    const std::vector<std::size_t> face = onlyFace(bytes, mesh.points.size());
    if (face.size() > 3 && face.size() < 40 && isPlain(mesh, face)) {
      require(mesh.triangles.size() == 3 * (face.size() - 2));
      require(fits(mesh, face, 0) || fits(mesh, face, 1) || fits(mesh, face, 2));
    }
  } catch (const std::runtime_error& error) {
    const std::string what = error.what();
    // What is packed has no lines where it is damaged.
    const bool is_packed = bytes.substr(0, 3) == "\x1F\x8B\x08";
    require(what.find("readMesh: 'the input', line ") == 0 ||
            (is_packed && what.find("readMesh: 'the input', byte ") == 0));
    require(what.size() < 300);
    require(std::all_of(what.begin(), what.end(), [](char c) { return c >= ' ' && c <= '~'; }));
  }
  return 0;
}
