// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/io/export_geometry.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "bytes.h"
#include "io/point_radii.h"

namespace fcl_fibers::io {
namespace {

/// A type of numbers: its name in VTK and its bytes.
struct NumberType {
  const char* name;
  void (*append)(std::string& bytes, double number);
};

template <typename Number>
constexpr NumberType numberType(const char* name) {
  return {name, [](std::string& bytes, double number) {
            appendLittleEndian(bytes, static_cast<Number>(number));
          }};
}
constexpr NumberType kInt32 = numberType<std::int32_t>("Int32");
constexpr NumberType kInt64 = numberType<std::int64_t>("Int64");
constexpr NumberType kUInt8 = numberType<std::uint8_t>("UInt8");
constexpr NumberType kFloat64 = numberType<double>("Float64");

struct Data {
  std::string name;
  NumberType type;
  std::vector<double> values;  ///< one for each point or cell
};

/// Points, cells of one kind over them, and the data of both.
struct Mesh {
  enum class Cells { kPoints, kLines, kFaces };

  Cells cells;
  std::vector<Point> points;
  std::vector<std::size_t> corners;        ///< indices of points, cell after cell
  std::vector<std::size_t> corners_end{};  ///< by cell
  std::vector<Data> data;                  ///< data of cells
  std::vector<Data> point_data{};

  void endCell() { corners_end.push_back(corners.size()); }
};

// --- VTK's XML PolyData, with arrays in base64 after their sizes in bytes ---

template <typename Values, typename Number>
void addArray(std::string& xml, const char* name, const NumberType& type, int components,
              const Values& values, Number number) {
  std::string bytes;
  for (const auto& value : values) number(bytes, value);
  std::string sized;
  appendLittleEndian(sized, static_cast<std::uint64_t>(bytes.size()));
  xml += std::string("        <DataArray type=\"") + type.name + "\" Name=\"" + name +
         "\" NumberOfComponents=\"" + std::to_string(components) + "\" format=\"binary\">" +
         base64(sized + bytes) + "</DataArray>\n";
}

void addCells(std::string& xml, const char* tag, bool has_cells, const Mesh& mesh) {
  const auto index = [](std::string& bytes, std::size_t i) {
    kInt64.append(bytes, static_cast<double>(i));
  };
  const std::vector<std::size_t> none;
  xml += std::string("      <") + tag + ">\n";
  addArray(xml, "connectivity", kInt64, 1, has_cells ? mesh.corners : none, index);
  addArray(xml, "offsets", kInt64, 1, has_cells ? mesh.corners_end : none, index);
  xml += std::string("      </") + tag + ">\n";
}

std::string vtpText(const Mesh& mesh) {
  using Cells = Mesh::Cells;
  constexpr std::array<std::pair<const char*, Cells>, 3> kTags = {
      {{"Verts", Cells::kPoints}, {"Lines", Cells::kLines}, {"Polys", Cells::kFaces}}};
  std::string xml =
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n"
      "  <PolyData>\n";
  xml += "    <Piece NumberOfPoints=\"" + std::to_string(mesh.points.size()) + "\"";
  for (const auto& [tag, cells] : kTags) {
    xml += std::string(" NumberOf") + tag + "=\"" +
           std::to_string(cells == mesh.cells ? mesh.corners_end.size() : 0) + "\"";
  }
  xml += " NumberOfStrips=\"0\">\n      <Points>\n";
  addArray(xml, "Points", kFloat64, 3, mesh.points, [](std::string& bytes, const Point& point) {
    for (const double x : point) kFloat64.append(bytes, x);
  });
  xml += "      </Points>\n";
  for (const auto& [tag, cells] : kTags) addCells(xml, tag, cells == mesh.cells, mesh);
  const auto addData = [&](const std::string& tag, const std::vector<Data>& all) {
    xml += "      <" + tag + ">\n";
    for (const Data& data : all) {
      addArray(xml, data.name.c_str(), data.type, 1, data.values, data.type.append);
    }
    xml += "      </" + tag + ">\n";
  };
  addData("PointData", mesh.point_data);
  addData("CellData", mesh.data);
  xml += "    </Piece>\n  </PolyData>\n</VTKFile>\n";
  return xml;
}

void write(const char* call, const std::string& path, const Mesh& mesh) {
  if (std::filesystem::path(path).extension() != ".vtp") {
    throw std::invalid_argument(std::string(call) + ": '" + path +
                                "' does not end in .vtp; change the name");
  }
  std::ofstream stream(path, std::ios::binary);
  if (!stream) {
    throw std::runtime_error(
        std::string(call) + ": '" + path +
        "' cannot be opened; check that its folder exists and may be written to");
  }
  stream << vtpText(mesh);
  stream.close();
  if (!stream) {
    throw std::runtime_error(std::string(call) + ": '" + path +
                             "': writing failed; check that the disk has room");
  }
}

// --- Meshes ---

Data radiusData(const FiberPolylines& scene) { return {"radius", kFloat64, pointRadii(scene)}; }

void addBox(Mesh& mesh, const TreeVolume& box) {
  constexpr int kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  const std::size_t first = mesh.points.size();
  for (int corner = 0; corner < 8; ++corner) {
    Point point;
    for (int k = 0; k < 3; ++k) {
      point[static_cast<std::size_t>(k)] =
          box.center[k] + ((corner >> k & 1) != 0 ? box.half[k] : -box.half[k]);
    }
    mesh.points.push_back(point);
  }
  for (const auto& face : kFaces) {
    for (const int corner : face) mesh.corners.push_back(first + static_cast<std::size_t>(corner));
    mesh.endCell();
  }
}

/// An icosahedron on the unit sphere. Its faces are divided into four, and these again.
struct UnitSphere {
  std::vector<Point> points;
  std::vector<std::array<std::size_t, 3>> faces;

  UnitSphere() {
    const double golden = (1 + std::sqrt(5.0)) / 2;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const double sign : {1.0, -1.0}) {
        for (const double length : {golden, -golden}) {
          Point point = {0, 0, 0};
          point[axis] = sign;
          point[(axis + 1) % 3] = length;
          points.push_back(unit(point));
        }
      }
    }
    // Faces are the triples of neighbours; corners run counter-clockwise as seen from outside.
    const double edge = 2 / std::sqrt(1 + golden * golden);
    const auto near = [&](std::size_t i, std::size_t j) {
      return std::hypot(points[i][0] - points[j][0], points[i][1] - points[j][1],
                        points[i][2] - points[j][2]) < 1.1 * edge;
    };
    for (std::size_t i = 0; i < 12; ++i) {
      for (std::size_t j = i + 1; j < 12; ++j) {
        for (std::size_t k = j + 1; k < 12; ++k) {
          if (!near(i, j) || !near(j, k) || !near(i, k)) continue;
          const bool outward = determinant(points[i], points[j], points[k]) > 0;
          faces.push_back({i, outward ? j : k, outward ? k : j});
        }
      }
    }
    for (int cut = 0; cut < 2; ++cut) cutFaces();
  }

 private:
  static double determinant(const Point& a, const Point& b, const Point& c) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  static Point unit(const Point& p) {
    const double length = std::hypot(p[0], p[1], p[2]);
    return {p[0] / length, p[1] / length, p[2] / length};
  }

  void cutFaces() {
    std::map<std::pair<std::size_t, std::size_t>, std::size_t> middles;
    const auto middle = [&](std::size_t i, std::size_t j) {
      const auto [found, is_new] = middles.try_emplace(std::minmax(i, j), points.size());
      if (is_new) {
        const Point &p = points[i], &q = points[j];
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
};

void addSphere(Mesh& mesh, const UnitSphere& unit, const TreeVolume& sphere) {
  const std::size_t first = mesh.points.size();
  for (const Point& p : unit.points) {
    mesh.points.push_back({sphere.center[0] + sphere.half[0] * p[0],
                           sphere.center[1] + sphere.half[1] * p[1],
                           sphere.center[2] + sphere.half[2] * p[2]});
  }
  for (const auto& face : unit.faces) {
    for (const std::size_t corner : face) mesh.corners.push_back(first + corner);
    mesh.endCell();
  }
}

}  // namespace

void exportFibers(const std::string& path, const FiberPolylines& scene) {
  Mesh mesh{Mesh::Cells::kLines, scene.points, {}, {}, {{"fiber", kInt32, {}}}, {}};
  // As in .hair, no thickness stands for an unknown one.
  if (!scene.radii.empty() || scene.radius > 0) mesh.point_data.push_back(radiusData(scene));
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    for (std::size_t i = scene.point_begin[f]; i < scene.point_begin[f + 1]; ++i) {
      mesh.corners.push_back(i);
    }
    mesh.endCell();
    mesh.data[0].values.push_back(static_cast<double>(f));
  }
  write("exportFibers", path, mesh);
}

void exportSegments(const std::string& path, const FiberPolylines& scene,
                    const std::vector<unsigned char>& touching) {
  if (touching.size() != scene.segmentCount()) {
    throw std::invalid_argument("exportSegments: touching has " + std::to_string(touching.size()) +
                                " numbers, but the scene has " +
                                std::to_string(scene.segmentCount()) +
                                " segments; give one for each");
  }
  Mesh mesh{Mesh::Cells::kLines,
            scene.points,
            {},
            {},
            {{"fiber", kInt32, {}},
             {"segment", kInt32, {}},
             {"touching", kUInt8, {touching.begin(), touching.end()}}},
            {radiusData(scene)}};
  for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
    const std::size_t begin = scene.point_begin[f];
    for (std::size_t i = begin; i + 1 < scene.point_begin[f + 1]; ++i) {
      mesh.corners.insert(mesh.corners.end(), {i, i + 1});
      mesh.endCell();
      mesh.data[0].values.push_back(static_cast<double>(f));
      mesh.data[1].values.push_back(static_cast<double>(i - begin));
    }
  }
  write("exportSegments", path, mesh);
}

void exportContacts(const std::string& path, const std::vector<Contact>& contacts) {
  Mesh mesh{Mesh::Cells::kPoints,
            {},
            {},
            {},
            {{"fiber_a", kInt32, {}},
             {"segment_a", kInt32, {}},
             {"s", kFloat64, {}},
             {"fiber_b", kInt32, {}},
             {"segment_b", kInt32, {}},
             {"t", kFloat64, {}},
             {"distance", kFloat64, {}},
             {"normal_x", kFloat64, {}},
             {"normal_y", kFloat64, {}},
             {"normal_z", kFloat64, {}}}};
  for (const Contact& c : contacts) {
    mesh.corners.push_back(mesh.points.size());
    mesh.endCell();
    mesh.points.push_back({(c.point_a[0] + c.point_b[0]) / 2, (c.point_a[1] + c.point_b[1]) / 2,
                           (c.point_a[2] + c.point_b[2]) / 2});
    const double values[] = {static_cast<double>(c.a.fiber),
                             static_cast<double>(c.a.segment),
                             c.s,
                             static_cast<double>(c.b.fiber),
                             static_cast<double>(c.b.segment),
                             c.t,
                             c.distance,
                             c.normal[0],
                             c.normal[1],
                             c.normal[2]};
    for (std::size_t k = 0; k < std::size(values); ++k) mesh.data[k].values.push_back(values[k]);
  }
  write("exportContacts", path, mesh);
}

void exportVolumes(const std::string& path, const std::vector<TreeVolume>& volumes) {
  Mesh mesh{Mesh::Cells::kFaces, {}, {}, {}, {{"volume", kInt32, {}}, {"segments", kInt32, {}}}};
  const UnitSphere unit_sphere;
  for (std::size_t v = 0; v < volumes.size(); ++v) {
    if (volumes[v].kind == FiberTreeOptions::Volumes::kWrappedSpheres) {
      addSphere(mesh, unit_sphere, volumes[v]);
    } else {
      addBox(mesh, volumes[v]);
    }
    mesh.data[0].values.resize(mesh.corners_end.size(), static_cast<double>(v));
    mesh.data[1].values.resize(mesh.corners_end.size(),
                               static_cast<double>(volumes[v].segment_count));
  }
  write("exportVolumes", path, mesh);
}

}  // namespace fcl_fibers::io
