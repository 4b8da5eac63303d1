// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/io/export_geometry.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <numeric>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "bytes.h"
#include "io/file_bytes.h"
#include "io/point_radii.h"
#include "io/require_scene.h"
#include "io/vectors.h"
#include "io/vtp_file.h"
#include "joined_text.h"

namespace fcl_fibers::io {
namespace {

constexpr const char *kPoints = "Verts", *kLines = "Lines", *kFaces = "Polys";

/// Points, cells of one kind over them, and the data of both.
struct Mesh {
  const char* cells;
  std::vector<Point> points{};
  std::vector<std::size_t> corners{};      ///< indices of points, cell after cell
  std::vector<std::size_t> corners_end{};  ///< by cell
  std::string cell_data{}, point_data{};   ///< arrays as XML

  void endCell() { corners_end.push_back(corners.size()); }
};

// --- VTK's XML PolyData ---

/// Returns the XML of an array of number(item) for each item, which is a number or a point. It is
/// in base64 after its size in bytes.
template <typename Number, typename Items, typename Get>
std::string dataArray(const char* name, const Items& items, Get&& number) {
  using Item = std::decay_t<decltype(number(*items.begin()))>;
  std::string bytes, sized;
  for (const auto& item : items) {
    if constexpr (std::is_arithmetic_v<Item>) {
      appendLittleEndian(bytes, static_cast<Number>(number(item)));
    } else {
      for (const Number x : number(item)) appendLittleEndian(bytes, x);
    }
  }
  appendLittleEndian(sized, static_cast<std::uint64_t>(bytes.size()));
  return "        <DataArray type=\"" + vtp::typeName<Number>() + "\" Name=\"" + name +
         "\" NumberOfComponents=\"" + (std::is_arithmetic_v<Item> ? "1" : "3") +
         "\" format=\"binary\">" + base64(sized + bytes) + "</DataArray>\n";
}

template <typename Number, typename Items>
std::string dataArray(const char* name, const Items& items) {
  return dataArray<Number>(name, items, [](const auto& item) { return item; });
}

void write(const char* call, const std::string& path, const Mesh& mesh) {
  if (std::filesystem::path(path).extension() != ".vtp") {
    throw std::invalid_argument(
        joinedText(call, ": '", path, "' does not end in .vtp; change the name"));
  }
  std::string counts, cells;
  for (const char* const tag : {kPoints, kLines, kFaces}) {
    const bool has_cells = tag == mesh.cells;
    const std::vector<std::size_t> none;
    counts += joinedText(" NumberOf", tag, "=\"", has_cells ? mesh.corners_end.size() : 0, "\"");
    cells += std::string("      <") + tag + ">\n" +
             dataArray<std::int64_t>("connectivity", has_cells ? mesh.corners : none) +
             dataArray<std::int64_t>("offsets", has_cells ? mesh.corners_end : none) + "      </" +
             tag + ">\n";
  }
  const std::string head =
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n"
      "  <PolyData>\n    <Piece NumberOfPoints=\"";
  writeBytes(call, path,
             head + std::to_string(mesh.points.size()) + "\"" + counts +
                 " NumberOfStrips=\"0\">\n      <Points>\n" +
                 dataArray<double>("Points", mesh.points) + "      </Points>\n" + cells +
                 "      <PointData>\n" + mesh.point_data +
                 "      </PointData>\n      <CellData>\n" + mesh.cell_data +
                 "      </CellData>\n    </Piece>\n  </PolyData>\n</VTKFile>\n");
}

// --- Meshes ---

std::string radiusData(const FiberPolylines& scene) {
  return dataArray<double>("radius", pointRadii(scene));
}

template <typename Number>
std::string dataIfAny(const char* name, const std::vector<Number>& numbers) {
  return numbers.empty() ? std::string() : dataArray<Number>(name, numbers);
}

Mesh unitBox() {
  Mesh mesh{kFaces};
  for (int corner = 0; corner < 8; ++corner) {
    const auto side = [&](int bit) { return (corner & bit) != 0 ? 1.0 : -1.0; };
    mesh.points.push_back({side(1), side(2), side(4)});
  }
  mesh.corners = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
  mesh.corners_end = {4, 8, 12, 16, 20, 24};
  return mesh;
}

Point unit(const Point& p) {
  const double length = norm(p);
  return {p[0] / length, p[1] / length, p[2] / length};
}

/// An icosahedron on the unit sphere. Its faces are divided into four, and these again.
Mesh unitSphere() {
  Mesh mesh{kFaces};
  std::vector<Point>& points = mesh.points;
  const double golden = (1 + std::sqrt(5.0)) / 2;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      for (const double length : {golden, -golden}) {
        Point& point = points.emplace_back();
        point[axis] = sign;
        point[(axis + 1) % 3] = length;
        point = unit(point);
      }
    }
  }
  // Faces are the triples of neighbours; corners run counter-clockwise as seen from outside.
  std::vector<std::array<std::size_t, 3>> faces;
  const auto near = [&](std::size_t i, std::size_t j) { return dot(points[i], points[j]) > 0; };
  for (std::size_t i = 0; i < 12; ++i) {
    for (std::size_t j = i + 1; j < 12; ++j) {
      for (std::size_t k = j + 1; k < 12; ++k) {
        if (!near(i, j) || !near(j, k) || !near(i, k)) continue;
        const bool outward = dot(points[i], cross(points[j], points[k])) > 0;
        faces.push_back({i, outward ? j : k, outward ? k : j});
      }
    }
  }
  for (int cut = 0; cut < 2; ++cut) {
    std::map<std::pair<std::size_t, std::size_t>, std::size_t> middles;
    const auto middle = [&](std::size_t i, std::size_t j) {
      const auto [found, is_new] = middles.try_emplace(std::minmax(i, j), points.size());
      if (is_new) {
        const Point p = points[i], q = points[j];
        points.push_back(unit({p[0] + q[0], p[1] + q[1], p[2] + q[2]}));
      }
      return found->second;
    };
    std::vector<std::array<std::size_t, 3>> smaller;
    for (const auto& [i, j, k] : faces) {
      const std::size_t a = middle(i, j), b = middle(j, k), c = middle(k, i);
      smaller.insert(smaller.end(), {{i, a, c}, {a, j, b}, {c, b, k}, {a, b, c}});
    }
    faces = std::move(smaller);
  }
  for (const auto& face : faces) {
    mesh.corners.insert(mesh.corners.end(), face.begin(), face.end());
    mesh.endCell();
  }
  return mesh;
}

void addVolume(Mesh& mesh, const Mesh& unit, const TreeVolume& volume) {
  const std::size_t first = mesh.points.size(), corners = mesh.corners.size();
  for (const Point& p : unit.points) {
    Point& point = mesh.points.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) point[k] = volume.center[k] + volume.half[k] * p[k];
  }
  for (const std::size_t corner : unit.corners) mesh.corners.push_back(first + corner);
  for (const std::size_t end : unit.corners_end) mesh.corners_end.push_back(corners + end);
}

}  // namespace

void exportFibers(const std::string& path, const FiberPolylines& scene) {
  requireScene("exportFibers", scene);
  Mesh mesh{kLines, scene.points};
  mesh.corners.resize(scene.points.size());
  std::iota(mesh.corners.begin(), mesh.corners.end(), std::size_t{0});
  mesh.corners_end.assign(scene.point_begin.begin() + 1, scene.point_begin.end());
  std::vector<std::size_t> fibers(scene.fiberCount());
  std::iota(fibers.begin(), fibers.end(), std::size_t{0});
  mesh.cell_data = dataArray<std::int32_t>("fiber", fibers) +
                   dataIfAny(vtp::kStartsAt, scene.starts_at) +
                   dataIfAny(vtp::kEndsAt, scene.ends_at);
  // As in .hair, no thickness stands for an unknown one.
  if (!scene.radii.empty() || scene.radius > 0) mesh.point_data = radiusData(scene);
  mesh.point_data += dataIfAny(vtp::kSample, scene.samples) + dataIfAny(vtp::kType, scene.types);
  write("exportFibers", path, mesh);
}

void exportSegments(const std::string& path, const FiberPolylines& scene,
                    const std::vector<unsigned char>& touching) {
  requireScene("exportSegments", scene);
  if (touching.size() != scene.points.size()) {
    throw std::invalid_argument(joinedText("exportSegments: touching has ", touching.size(),
                                           " numbers, but the scene has ", scene.points.size(),
                                           " points; give one for each"));
  }
  Mesh mesh{kLines, scene.points};
  std::vector<std::size_t> fibers, numbers;
  std::vector<unsigned char> touched;
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f];
    for (std::size_t i = begin; i + 1 < scene.point_begin[f + 1]; ++i) {
      mesh.corners.insert(mesh.corners.end(), {i, i + 1});
      mesh.endCell();
      fibers.push_back(f);
      numbers.push_back(i - begin);
      touched.push_back(touching[i]);
    }
  }
  mesh.cell_data = dataArray<std::int32_t>("fiber", fibers) +
                   dataArray<std::int32_t>("number", numbers) +
                   dataArray<std::uint8_t>("touching", touched);
  mesh.point_data = radiusData(scene);
  write("exportSegments", path, mesh);
}

void exportContacts(const std::string& path, const std::vector<Contact>& contacts) {
  Mesh mesh{kPoints};
  for (const Contact& c : contacts) {
    mesh.corners.push_back(mesh.points.size());
    mesh.endCell();
    mesh.points.push_back({(c.point_a[0] + c.point_b[0]) / 2, (c.point_a[1] + c.point_b[1]) / 2,
                           (c.point_a[2] + c.point_b[2]) / 2});
  }
  const auto add = [&](const char* name, auto number) {
    using Number = decltype(number(contacts[0]));
    using Stored = std::conditional_t<std::is_integral_v<Number>, std::int32_t, double>;
    mesh.cell_data += dataArray<Stored>(name, contacts, number);
  };
  add("fiber_a", [](const Contact& c) { return c.a.fiber; });
  add("number_a", [](const Contact& c) { return c.a.number; });
  add("s", [](const Contact& c) { return c.s; });
  add("fiber_b", [](const Contact& c) { return c.b.fiber; });
  add("number_b", [](const Contact& c) { return c.b.number; });
  add("t", [](const Contact& c) { return c.t; });
  add("distance", [](const Contact& c) { return c.distance; });
  add("normal_x", [](const Contact& c) { return c.normal[0]; });
  add("normal_y", [](const Contact& c) { return c.normal[1]; });
  add("normal_z", [](const Contact& c) { return c.normal[2]; });
  write("exportContacts", path, mesh);
}

void exportVolumes(const std::string& path, const std::vector<TreeVolume>& volumes) {
  Mesh mesh{kFaces};
  const Mesh box = unitBox(), sphere = unitSphere();
  std::vector<std::size_t> numbers, segments;
  for (std::size_t v = 0; v < volumes.size(); ++v) {
    const bool is_sphere = volumes[v].kind == FiberTreeOptions::Volumes::kWrappedSpheres;
    addVolume(mesh, is_sphere ? sphere : box, volumes[v]);
    numbers.resize(mesh.corners_end.size(), v);
    segments.resize(mesh.corners_end.size(), static_cast<std::size_t>(volumes[v].segment_count));
  }
  mesh.cell_data =
      dataArray<std::int32_t>("volume", numbers) + dataArray<std::int32_t>("segments", segments);
  write("exportVolumes", path, mesh);
}

}  // namespace fcl_fibers::io
