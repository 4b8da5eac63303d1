// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <locale>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <typeinfo>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include <fcl/broadphase/broadphase_bruteforce.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "broadphase/mesh_cache.h"
#include "broadphase/object_reader.h"
#include "joined_text.h"

namespace fcl_fibers::broadphase {

// A record is a text with a shape, an object or a call a line, in the order of the program:
//
//     fcl_fibers record 1
//     double
//     fcl::DynamicAABBTreeCollisionManager<double>    the first manager
//     boxes 0 0 0 0 0 1 0                             the second one, with its options
//     capsule 0 BOUNDS 0.125 1                        its number, ten bounds, its sizes
//     object 0 0 POSE BOX                             its number, its shape, twelve and six numbers
//     registerObjects 0 1 2
//     update
//     collideSelf 17                                  the callback ended it at this pair, or 0
//     difference TEXT                                 what it was written for
//     end
//
// Shapes and objects are written again when they have changed.
constexpr char kRecordHead[] = "fcl_fibers record 1";
constexpr char kLimit[] = "limit";  // The last call of a record that has reached its limit.
constexpr std::size_t kSizes = 11;  // Where the sizes of a shape begin.
constexpr std::size_t kPose = 2, kBox = 14, kEnd = 20;  // Places in the line of an object.

inline void require(bool condition, const std::string& problem) {
  if (!condition) throw std::invalid_argument(problem);
}

/// A word and numbers, which come back to the last bit in every locale.
struct RecordLine {
  std::string word;
  std::vector<double> numbers;

  bool operator==(const RecordLine& other) const {  ///< to the last bit
    return word == other.word && numbers.size() == other.numbers.size() &&
           std::memcmp(numbers.data(), other.numbers.data(), numbers.size() * sizeof(double)) == 0;
  }
  std::string text() const {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text.precision(std::numeric_limits<double>::max_digits10);
    text << word;
    for (const double number : numbers) text << ' ' << number;
    return text.str();
  }
  /// Throws std::invalid_argument if it is no such line.
  static RecordLine parse(const std::string& text) {
    std::istringstream words(text);
    RecordLine line;
    require(bool(words >> line.word), "the line is empty");
    for (std::string word; words >> word;) {
      const bool is_negative = word[0] == '-';
      const std::string rest = word.substr(is_negative);
      double number = rest == "inf" ? kInfinity : std::numeric_limits<double>::quiet_NaN();
      if (rest != "inf" && rest != "nan") {
        std::istringstream in(rest);
        in.imbue(std::locale::classic());
        in >> number;
        // Some libraries fail at a subnormal number, but read it.
        const bool is_number = rest[0] >= '0' && rest[0] <= '9' && in.eof();
        require(is_number && (!in.fail() || number != 0), "'" + word + "' is no number");
      }
      line.numbers.push_back(is_negative ? -number : number);
    }
    return line;
  }
};

/// A shape of which only its bounds are known, such as an octree. No broad phase of FCL knows more.
template <typename S>
struct BoundsOnly final : fcl::CollisionGeometry<S> {
  void computeLocalAABB() override {}
};

/// Calls f(name, like, sizesOf) for each kind of shape that a few numbers describe. `like` is a
/// shape of that kind, and sizesOf(shape) returns pointers to the numbers of such a shape.
template <typename S, class F>
void visitKinds(F f) {
  const auto one = [](auto& s) { return std::vector<S*>{&s.radius}; };
  const auto round = [](auto& s) { return std::vector<S*>{&s.radius, &s.lz}; };
  const auto sides = [](auto& s) { return std::vector<S*>{&s.side[0], &s.side[1], &s.side[2]}; };
  const auto radii = [](auto& s) { return std::vector<S*>{&s.radii[0], &s.radii[1], &s.radii[2]}; };
  const auto open = [](auto& s) { return std::vector<S*>{&s.n[0], &s.n[1], &s.n[2], &s.d}; };
  f("capsule", fcl::Capsule<S>(0, 0), round);
  f("sphere", fcl::Sphere<S>(0), one);
  f("box", fcl::Box<S>(), sides);
  f("cylinder", fcl::Cylinder<S>(0, 0), round);
  f("cone", fcl::Cone<S>(0, 0), round);
  f("ellipsoid", fcl::Ellipsoid<S>(0, 0, 0), radii);
  f("plane", fcl::Plane<S>(), open);
  f("halfspace", fcl::Halfspace<S>(), open);
  f("bounds", BoundsOnly<S>(), [](auto&) { return std::vector<S*>(); });
}

template <class Shape, class Visit>
void visitBounds(Shape& shape, Visit visit) {
  for (auto* corner : {&shape.aabb_local.min_, &shape.aabb_local.max_, &shape.aabb_center}) {
    for (int i = 0; i < 3; ++i) visit((*corner)[i]);
  }
  visit(shape.aabb_radius);
}

/// Makes a convex shape or a mesh. Behind the bounds, its line has the number of points, then x, y,
/// z of each point, then three indices for each triangle. Throws std::invalid_argument if the
/// numbers are not of this form.
template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makePoints(const RecordLine& line) {
  const std::vector<double>& n = line.numbers;
  const double count = n.size() > kSizes ? n[kSizes] : 0, left = double(n.size() - kSizes) - 1;
  require(count >= 1 && 3 * count <= left, "it needs x, y, z of points");
  std::vector<fcl::Vector3<S>> points;
  std::size_t at = kSizes + 1;
  for (; double(points.size()) < count; at += 3) {
    points.push_back(Eigen::Vector3d(n[at], n[at + 1], n[at + 2]).cast<S>());
  }
  require((n.size() - at) % 3 == 0 &&
              std::all_of(&n[0] + at, &n[0] + n.size(),
                          [&](double index) { return index >= 0 && index < count; }),
          "its triangles need three points each");
  std::vector<fcl::Triangle> triangles;
  std::vector<int> faces;
  for (; at < n.size(); at += 3) {
    const int a = int(n[at]), b = int(n[at + 1]), c = int(n[at + 2]);
    triangles.emplace_back(std::size_t(a), std::size_t(b), std::size_t(c));
    faces.insert(faces.end(), {3, a, b, c});
  }
  if (line.word == "convex") {
    return std::make_shared<fcl::Convex<S>>(std::make_shared<std::vector<fcl::Vector3<S>>>(points),
                                            int(triangles.size()),
                                            std::make_shared<std::vector<int>>(faces));
  }
  // No manager looks at bounding volumes, and only some are in FCL's binary.
  using Volume = std::conditional_t<std::is_same_v<S, double>, fcl::OBBRSS<S>, fcl::AABB<S>>;
  auto mesh = std::make_shared<fcl::BVHModel<Volume>>();
  mesh->beginModel();
  triangles.empty() ? mesh->addSubModel(points) : mesh->addSubModel(points, triangles);
  mesh->endModel();
  return mesh;
}

/// Returns the line of a shape, with 0 in place of its number, which the caller knows.
template <typename S>
RecordLine readShape(const fcl::CollisionGeometry<S>* shape) {
  static const BoundsOnly<S> none;
  const fcl::CollisionGeometry<S>& from = shape == nullptr ? none : *shape;
  const fcl::NODE_TYPE type = from.getNodeType();
  RecordLine line{"bounds", {0}};
  const auto append = [&](double number) { line.numbers.push_back(number); };
  visitBounds(from, append);
  visitKinds<S>([&](const char* kind, auto like, auto sizesOf) {
    if (type == fcl::BV_UNKNOWN || type != like.getNodeType()) return;
    line.word = kind;
    like = static_cast<const decltype(like)&>(from);
    for (const S* size : sizesOf(like)) append(*size);
  });
  const auto appendPoints = [&](const fcl::Vector3<S>* points, std::size_t count) {
    append(double(count));
    for (std::size_t i = 0; i < 3 * count; ++i) append(points[i / 3][int(i % 3)]);
  };
  if (type == fcl::GEOM_CONVEX) {
    const auto& convex = static_cast<const fcl::Convex<S>&>(from);
    line.word = "convex";
    appendPoints(convex.getVertices().data(), convex.getVertices().size());
    const std::vector<int>& faces = convex.getFaces();
    for (std::size_t at = 0; at < faces.size(); at += 1 + std::size_t(faces[at])) {
      for (std::size_t i = 2; i < std::size_t(faces[at]); ++i) {  // A fan for each face.
        for (const std::size_t corner : {std::size_t{1}, i, i + 1}) append(faces[at + corner]);
      }
    }
  } else if (kindOf(type) == ObjectKind::kMesh) {
    const BvhTriangles<S> mesh = trianglesOf(from);
    if (!mesh.is_finished) return line;
    line.word = "mesh";
    appendPoints(mesh.points, mesh.point_count);
    for (std::size_t i = 0; i < 3 * mesh.triangle_count; ++i) {
      append(double(indicesOf(mesh.triangles[i / 3])[i % 3]));
    }
  }
  return line;
}

/// Makes the shape again; null if there is no such kind. Throws std::invalid_argument if the
/// numbers are not those of such a shape.
template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makeShape(const RecordLine& line) {
  const std::vector<double>& n = line.numbers;
  std::shared_ptr<fcl::CollisionGeometry<S>> shape;
  visitKinds<S>([&](const char* kind, const auto& like, auto sizesOf) {
    if (line.word != kind) return;
    const auto made = std::make_shared<std::decay_t<decltype(like)>>(like);
    const std::vector<S*> sizes = sizesOf(*made);
    require(n.size() == kSizes + sizes.size(), "the shape has another count of numbers");
    // Not by FCL's constructors, which would change the last bits of a normal.
    for (std::size_t i = 0; i < sizes.size(); ++i) *sizes[i] = static_cast<S>(n[kSizes + i]);
    shape = made;
  });
  if (line.word == "convex" || line.word == "mesh") shape = makePoints<S>(line);
  if (shape == nullptr) return nullptr;
  std::size_t at = 1;
  visitBounds(*shape, [&](S& bound) { bound = static_cast<S>(n[at++]); });
  return shape;
}

struct RecordedShape {
  RecordLine line;
  mutable std::shared_ptr<fcl::CollisionGeometry<double>> made = {};

  /// The shape as of now: the program's bounds may be of earlier points.
  const fcl::CollisionGeometry<double>& exact() const {
    if (made == nullptr) (made = makeShape<double>(line))->computeLocalAABB();
    return *made;
  }
  bool isRound() const { return line.word == "capsule" || line.word == "sphere"; }
  bool isLike(const RecordedShape& other) const {
    if (this == &other) return true;
    RecordLine its = other.line;
    its.numbers[0] = line.numbers[0];
    return line == its;
  }
};

/// An object as a manager may read it.
struct RecordedObject {
  std::shared_ptr<const RecordedShape> shape;
  RecordLine line;
  std::array<double, 2> margins = {};  ///< as each manager counts them; NaN if unknown

  bool isFinite() const {
    const auto are = [](const std::vector<double>& numbers, std::size_t from, std::size_t to) {
      return std::all_of(&numbers[0] + from, &numbers[0] + to,
                         [](double x) { return std::isfinite(x); });
    };
    const std::vector<double>& sizes = shape->line.numbers;
    return are(line.numbers, kPose, kBox) && are(sizes, kSizes, sizes.size());
  }

  auto pose() const {
    return Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(&line.numbers[kPose]);
  }
  Eigen::Vector3d low() const { return Eigen::Vector3d::Map(&line.numbers[kBox]); }
  Eigen::Vector3d high() const { return Eigen::Vector3d::Map(&line.numbers[kBox + 3]); }
  /// Whether getAABB() exceeds what FCL or a program puts around a capsule or sphere by the same on
  /// all sides.
  bool isEvenlyWidened(double rounding) const {
    const std::vector<double>& n = shape->line.numbers;
    const double radius = n[kSizes], half = n.size() > kSizes + 1 ? n[kSizes + 1] / 2 : 0;
    const double cube = Eigen::Vector3d(radius, radius, half + radius).norm();
    const Eigen::Array3d size = (high() - low()) / 2, off = (high() + low()) / 2 - pose().col(3);
    const auto isEven = [&](const Eigen::Array3d& excess) {
      return excess.minCoeff() >= -rounding && excess.maxCoeff() - excess.minCoeff() <= rounding;
    };
    return off.abs().maxCoeff() <= rounding &&
           (isEven(size - cube) || isEven(size - radius - half * pose().col(2).array().abs()));
  }
  std::string describe() const {
    return joinedText(shape->line.word, " at ", pose().col(3).transpose(), ", its axis ",
                      pose().col(2).transpose(), ", getAABB() from ", low().transpose(), " to ",
                      high().transpose());
  }
};

template <typename S>
RecordedObject readObject(const fcl::CollisionObject<S>& object, double number,
                          std::shared_ptr<const RecordedShape> shape) {
  const double shape_number = shape->line.numbers[0];
  RecordedObject read{std::move(shape), {"object", {number, shape_number}}};
  const auto& pose = object.getTransform();
  const fcl::AABB<S>& box = object.getAABB();
  for (int i = 0; i < 12; ++i) read.line.numbers.push_back(pose(i / 4, i % 4));
  for (int i = 0; i < 6; ++i) read.line.numbers.push_back((i < 3 ? box.min_ : box.max_)[i % 3]);
  return read;
}

/// Calls visit(option, the largest number of it) for each option on which pairs depend.
template <class Visit>
void visitOptions(FiberManagerOptions& options, Visit visit) {
  visit(options.topology, 1);
  visit(options.report, 1);
  visit(options.ignored_neighbors, std::numeric_limits<int>::max());
  visit(options.ignored_arc_length, kInfinity);
  visit(options.margin, kInfinity);
  visit(options.bounds, 2);
  visit(options.motion, 1);
}

/// A manager in a record: `boxes` or `spheres` with the options, or the name of another class.
template <typename S>
std::string nameOf(const fcl::BroadPhaseCollisionManager<S>& manager) {
  const auto* const ours = dynamic_cast<const FiberCollisionManager<S>*>(&manager);
  if (ours == nullptr) return typeid(manager).name();
  const bool is_boxes = dynamic_cast<const LayeredAABBTreeCollisionManager<S>*>(ours) != nullptr;
  RecordLine line{is_boxes ? "boxes" : "spheres", {}};
  FiberManagerOptions options = ours->options();
  visitOptions(options, [&](auto option, double) { line.numbers.push_back(double(option)); });
  return line.text();
}

/// Makes the manager of a name, FCL's tree if there is none.
template <typename S>
std::unique_ptr<fcl::BroadPhaseCollisionManager<S>> makeManager(const std::string& name) {
  if (name.find("Naive") != name.npos) return std::make_unique<fcl::NaiveCollisionManager<S>>();
  const bool is_boxes = name.substr(0, 6) == "boxes ";
  if (!is_boxes && name.substr(0, 8) != "spheres ") {
    return std::make_unique<fcl::DynamicAABBTreeCollisionManager<S>>();
  }
  const RecordLine line = RecordLine::parse(name);
  require(line.numbers.size() == 7, "the manager has another count of options");
  FiberManagerOptions options;
  std::size_t at = 0;
  visitOptions(options, [&](auto& option, double most) {
    require(line.numbers[at] >= 0 && line.numbers[at] <= most, "an option is out of range");
    option = static_cast<std::decay_t<decltype(option)>>(line.numbers[at++]);
  });
  if (is_boxes) return std::make_unique<LayeredAABBTreeCollisionManager<S>>(options);
  return std::make_unique<WrappedSphereTreeCollisionManager<S>>(options);
}

/// Makes the change of this name in the manager.
template <typename S>
void makeChange(fcl::BroadPhaseCollisionManager<S>& manager, const std::string& call,
                const std::vector<fcl::CollisionObject<S>*>& objects) {
  auto* const one = objects.size() == 1 ? objects[0] : nullptr;
  auto* const fibers = dynamic_cast<FiberCollisionManager<S>*>(&manager);
  const bool is_ring = call == "registerRing", is_fiber = is_ring || call == "registerFiber";
  if (is_fiber && fibers != nullptr) {
    return fibers->registerFiber(objects, is_ring ? FiberEnds::kClosed : FiberEnds::kOpen);
  }
  if (is_fiber || call == "registerObjects") return manager.registerObjects(objects);
  if (call == "registerObject") return manager.registerObject(one);
  if (call == "unregisterObject") return manager.unregisterObject(one);
  if (call == "updateObjects") return manager.update(objects);
  if (call == "updateObject") return manager.update(one);
  if (call == "update") return manager.update();
  if (call == "setup") return manager.setup();
  if (call == "clear") return manager.clear();
  require(call == "beginStep" || call == "endStep", "there is no such call");
  if (fibers != nullptr) call == "beginStep" ? fibers->beginStep() : fibers->endStep();
}

}  // namespace fcl_fibers::broadphase
