// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/recorded_object.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <type_traits>

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
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include "broadphase/bvh_triangles.h"
#include "geometry/segment_distance.h"
#include "joined_text.h"

namespace fcl_fibers::broadphase {
namespace {

using Eigen::Affine3d;
using Eigen::Vector3d;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr const char* kNames[fcl::NODE_COUNT - fcl::GEOM_BOX] = {
    "box",    "sphere", "ellipsoid", "capsule",  "cone",  "cylinder",
    "convex", "plane",  "halfspace", "triangle", "octree"};

/// A shape of which only its bounds are known.
template <typename S>
class BoundsOnly final : public fcl::CollisionGeometry<S> {
 public:
  void computeLocalAABB() override {}
};

/// Pointers to what decides a shape of a few sizes; none for another shape.
template <typename S>
std::vector<S*> sizesOf(fcl::CollisionGeometry<S>& shape) {
  const auto list = [](auto& v) { return std::vector<S*>{&v[0], &v[1], &v[2]}; };
  const auto round = [](auto& round) { return std::vector<S*>{&round.radius, &round.lz}; };
  const auto open = [](auto& open) {
    return std::vector<S*>{&open.n[0], &open.n[1], &open.n[2], &open.d};
  };
  switch (shape.getNodeType()) {
    case fcl::GEOM_SPHERE:
      return {&static_cast<fcl::Sphere<S>&>(shape).radius};
    case fcl::GEOM_BOX:
      return list(static_cast<fcl::Box<S>&>(shape).side);
    case fcl::GEOM_ELLIPSOID:
      return list(static_cast<fcl::Ellipsoid<S>&>(shape).radii);
    case fcl::GEOM_CAPSULE:
      return round(static_cast<fcl::Capsule<S>&>(shape));
    case fcl::GEOM_CYLINDER:
      return round(static_cast<fcl::Cylinder<S>&>(shape));
    case fcl::GEOM_CONE:
      return round(static_cast<fcl::Cone<S>&>(shape));
    case fcl::GEOM_PLANE:
      return open(static_cast<fcl::Plane<S>&>(shape));
    case fcl::GEOM_HALFSPACE:
      return open(static_cast<fcl::Halfspace<S>&>(shape));
    default:
      return {};
  }
}

/// Calls visit(number, recorded number) for the bounds of a shape.
template <class Shape, class Bounds, class Visit>
void visitBounds(Shape& shape, Bounds& bounds, Visit visit) {
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    visit(shape.aabb_local.min_[i], bounds[k]);
    visit(shape.aabb_local.max_[i], bounds[3 + k]);
    visit(shape.aabb_center[i], bounds[6 + k]);
  }
  visit(shape.aabb_radius, bounds[9]);
}

template <typename S>
void setBounds(fcl::CollisionGeometry<S>& shape, const std::array<double, 10>& bounds) {
  visitBounds(shape, bounds, [](S& x, double recorded) { x = static_cast<S>(recorded); });
}

void require(bool condition, const char* problem) {
  if (!condition) throw std::invalid_argument(problem);
}

template <typename S>
std::vector<fcl::Vector3<S>> pointsOf(const RecordedShape& shape) {
  const auto& n = shape.numbers;
  require(!n.empty() && n.size() % 3 == 0 && n.size() < (1U << 30), "it needs x, y, z of points");
  std::vector<fcl::Vector3<S>> points;
  for (std::size_t i = 0; i < n.size(); i += 3) {
    points.push_back(Vector3d(n[i], n[i + 1], n[i + 2]).cast<S>());
  }
  return points;
}

template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makeMesh(const RecordedShape& shape) {
  // No manager looks at bounding volumes, and only some are in FCL's binary.
  using Volume = std::conditional_t<std::is_same_v<S, double>, fcl::OBBRSS<S>, fcl::AABB<S>>;
  const std::vector<fcl::Vector3<S>> points = pointsOf<S>(shape);
  const auto& corners = shape.indices;
  require(corners.size() % 3 == 0, "its triangles need three points each");
  std::vector<fcl::Triangle> triangles;
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    triangles.emplace_back(corners[i], corners[i + 1], corners[i + 2]);
  }
  auto mesh = std::make_shared<fcl::BVHModel<Volume>>();
  mesh->beginModel();
  triangles.empty() ? mesh->addSubModel(points) : mesh->addSubModel(points, triangles);
  mesh->endModel();
  return mesh;
}

template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makeConvex(const RecordedShape& shape) {
  auto points = std::make_shared<std::vector<fcl::Vector3<S>>>(pointsOf<S>(shape));
  auto faces = std::make_shared<std::vector<int>>(shape.indices.begin(), shape.indices.end());
  int count = 0;
  for (std::size_t i = 0; i < faces->size(); ++count) {
    const auto corners = static_cast<std::size_t>((*faces)[i]);
    require(corners >= 3 && corners < faces->size() - i, "a face has too few or too many corners");
    for (const std::size_t end = i + corners + 1; ++i < end;) {
      require(static_cast<std::size_t>((*faces)[i]) < points->size(), "an index is of no point");
    }
  }
  return std::make_shared<fcl::Convex<S>>(points, count, faces);
}

Affine3d poseOf(const RecordedState& state) {
  Affine3d pose = Affine3d::Identity();
  pose.affine() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(&state.pose[0]);
  return pose;
}

/// By how much a pose differs from a rotation.
double driftOf(const Affine3d& pose) {
  const Eigen::Matrix3d r = pose.linear();
  return (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
}

const fcl::CollisionGeometry<double>& exactOf(const RecordedShape& shape) {
  if (shape.exact == nullptr) {
    auto made = makeShape<double>(shape);
    made->computeLocalAABB();  // The program's bounds may be of earlier points.
    shape.exact = std::move(made);
  }
  return *shape.exact;
}

/// The ball around a shape in its pose. A plane's is infinite.
struct Ball {
  Vector3d center;
  double radius;

  explicit Ball(const RecordedState& state) {
    const fcl::AABB<double>& box = exactOf(*state.shape).aabb_local;
    const bool is_open = !((box.max_ - box.min_).maxCoeff() < 1e300);
    center = poseOf(state) * (is_open ? Vector3d(0, 0, 0) : Vector3d((box.min_ + box.max_) / 2));
    radius = is_open ? kInfinity : (box.max_ - box.min_).norm() / 2;
  }
};

geometry::Segment segmentOf(const RecordedState& state) {
  const auto& n = state.shape->numbers;
  const Affine3d pose = poseOf(state);
  const Vector3d half = (n.size() > 1 ? n[1] / 2 : 0) * pose.linear().col(2);
  const Vector3d a = pose.translation() - half, b = pose.translation() + half;
  return {{a.x(), a.y(), a.z()}, {b.x(), b.y(), b.z()}, n[0]};
}

/// FCL's narrow phase is iterative, so a pair touches without doubt only if it still does after one
/// shape has been moved away from the other.
Gap gapOfShapes(const RecordedState& a, const RecordedState& b, double doubt) {
  const auto *const p = &exactOf(*a.shape), *const q = &exactOf(*b.shape);
  const fcl::Transform3<double> at(poseOf(a).matrix()), bt(poseOf(b).matrix());
  const auto touches = [&](const Vector3d& moved) {
    fcl::Transform3<double> to = bt;
    to.translation() += moved;
    fcl::CollisionRequest<double> request;
    request.gjk_solver_type = fcl::GST_INDEP;  // libccd does not always end.
    fcl::CollisionResult<double> result;
    return fcl::collide(p, at, q, to, request, result) > 0;
  };
  if (touches(Vector3d::Zero())) {
    const Vector3d away = (Ball(b).center - Ball(a).center).normalized();
    return {-kInfinity, touches(doubt * away) ? 0 : doubt};
  }
  fcl::DistanceRequest<double> request;
  request.gjk_solver_type = fcl::GST_INDEP;
  fcl::DistanceResult<double> result;
  fcl::distance(p, at, q, bt, request, result);
  const double distance = std::max(0.0, result.min_distance);
  return {distance - doubt, distance + doubt};
}

/// The most that a shape reaches along a direction from its origin.
double reachOf(const RecordedShape& shape, const Vector3d& along) {
  const std::string& kind = shape.kind;
  const auto& n = shape.numbers;
  const auto point = [&](std::size_t i) { return Eigen::Map<const Vector3d>(&n[i]); };
  const double across = std::hypot(along.x(), along.y()), up = along.z();
  if (kind == "sphere") return n[0] * along.norm();
  if (kind == "capsule") return n[0] * along.norm() + n[1] / 2 * std::fabs(up);
  if (kind == "cylinder") return n[0] * across + n[1] / 2 * std::fabs(up);
  if (kind == "cone") return std::max(n[1] / 2 * up, n[0] * across - n[1] / 2 * up);
  if (kind == "box") return along.cwiseProduct(point(0)).lpNorm<1>() / 2;
  if (kind == "ellipsoid") return along.cwiseProduct(point(0)).norm();
  double reach = -kInfinity;
  for (std::size_t i = 0; i < n.size(); i += 3) reach = std::max(reach, along.dot(point(i)));
  return reach;
}

/// The least extent of a solid's local box. A mesh may be flat.
double thicknessOf(const RecordedShape& shape) {
  if (shape.kind == "mesh") return kInfinity;
  return (exactOf(shape).aabb_local.max_ - exactOf(shape).aabb_local.min_).minCoeff();
}

/// FCL's narrow phase crashes for some shapes and planes.
Gap gapToPlane(const RecordedState& plane, const RecordedState& other, double doubt) {
  const Eigen::Map<const Eigen::Vector4d> n(plane.shape->numbers.data());
  const Affine3d pose = poseOf(plane), at = poseOf(other);
  const Vector3d normal = (pose.linear() * n.head<3>()).normalized();
  const Vector3d along = at.linear().transpose() * normal;
  const double center =
      normal.dot(at.translation() - pose.translation()) - n[3] / n.head<3>().norm();
  const double above = center - reachOf(*other.shape, -along);
  const double below = -center - reachOf(*other.shape, along);
  const double gap = plane.shape->kind == "plane" ? std::max(above, below) : above;
  return {gap - doubt, gap + doubt};
}

}  // namespace

bool isSame(const RecordedShape& a, const RecordedShape& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() &&
           (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0);
  };
  return a.kind == b.kind && same(a.bounds, b.bounds) && same(a.numbers, b.numbers) &&
         same(a.indices, b.indices);
}

bool isSame(const RecordedState& a, const RecordedState& b) {
  return a.shape == b.shape && std::memcmp(&a.pose, &b.pose, sizeof(a.pose)) == 0 &&
         std::memcmp(&a.box, &b.box, sizeof(a.box)) == 0;
}

template <typename S>
RecordedShape recordedShape(const fcl::CollisionGeometry<S>* shape) {
  RecordedShape recorded{"unknown", {}, {}, {}, 0, nullptr};
  if (shape == nullptr) return recorded;
  visitBounds(*shape, recorded.bounds, [](S x, double& recorded) { recorded = double{x}; });
  const auto append = [&](const fcl::Vector3<S>& point) {
    for (int i = 0; i < 3; ++i) recorded.numbers.push_back(double{point[i]});
  };
  const fcl::NODE_TYPE type = shape->getNodeType();
  if (type >= fcl::GEOM_BOX && type < fcl::NODE_COUNT) recorded.kind = kNames[type - fcl::GEOM_BOX];
  for (const S* size : sizesOf(const_cast<fcl::CollisionGeometry<S>&>(*shape))) {
    recorded.numbers.push_back(double{*size});
  }
  if (type == fcl::GEOM_CONVEX) {
    const auto& convex = static_cast<const fcl::Convex<S>&>(*shape);
    std::for_each(convex.getVertices().begin(), convex.getVertices().end(), append);
    recorded.indices.assign(convex.getFaces().begin(), convex.getFaces().end());
  } else if (isBvhModel(type)) {
    const BvhTriangles<S> mesh = trianglesOf(*shape);
    if (!mesh.is_finished) return recorded;
    recorded.kind = "mesh";
    std::for_each(mesh.points, mesh.points + mesh.point_count, append);
    for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
      const std::size_t* const corners = indicesOf(mesh.triangles[t]);
      recorded.indices.insert(recorded.indices.end(), corners, corners + 3);
    }
  }
  return recorded;
}

template <typename S>
std::shared_ptr<fcl::CollisionGeometry<S>> makeShape(const RecordedShape& recorded) {
  const auto& [kind, numbers, indices, bounds, number, exact] = recorded;
  const auto points = static_cast<std::int64_t>(numbers.size() / 3);
  for (const std::int64_t index : indices) {
    require(index >= 0 && index < points + (kind == "convex"), "an index is of no point");
  }
  std::shared_ptr<fcl::CollisionGeometry<S>> shape = std::make_shared<BoundsOnly<S>>();
  if (kind == "sphere") shape = std::make_shared<fcl::Sphere<S>>(S(0));
  if (kind == "box") shape = std::make_shared<fcl::Box<S>>();
  if (kind == "ellipsoid") shape = std::make_shared<fcl::Ellipsoid<S>>(S(0), S(0), S(0));
  if (kind == "capsule") shape = std::make_shared<fcl::Capsule<S>>(S(0), S(0));
  if (kind == "cylinder") shape = std::make_shared<fcl::Cylinder<S>>(S(0), S(0));
  if (kind == "cone") shape = std::make_shared<fcl::Cone<S>>(S(0), S(0));
  if (kind == "plane") shape = std::make_shared<fcl::Plane<S>>();
  if (kind == "halfspace") shape = std::make_shared<fcl::Halfspace<S>>();
  if (kind == "convex") shape = makeConvex<S>(recorded);
  if (kind == "mesh") shape = makeMesh<S>(recorded);
  const std::vector<S*> sizes = sizesOf(*shape);
  const bool has_points = kind == "convex" || kind == "mesh";
  require(has_points || sizes.size() == numbers.size(),
          "there is no such kind of shape, or it has another count of numbers");
  // Not by FCL's constructors, which would change the last bits of a normal.
  for (std::size_t i = 0; i < sizes.size(); ++i) *sizes[i] = static_cast<S>(numbers[i]);
  setBounds(*shape, bounds);
  return shape;
}

template <typename S>
void RecordedObject<S>::set(const Shape& shape, const RecordedState& state) {
  state_ = state;
  setBounds(*shape, state.shape->bounds);  // FCL's constructor of objects has computed them anew.
  this->cgeom = shape;
  this->cgeom_const = shape;
  this->t.matrix().template topRows<3>() = poseOf(state).affine().cast<S>();
  this->aabb.min_ = Eigen::Map<const Vector3d>(&state.box[0]).cast<S>();
  this->aabb.max_ = Eigen::Map<const Vector3d>(&state.box[3]).cast<S>();
}

Gap gapBetween(const RecordedState& a, const RecordedState& b, bool is_float, double reach) {
  constexpr Gap kUnknown{-kInfinity, kInfinity};
  for (const RecordedState* state : {&a, &b}) {
    const auto isFinite = [](const auto& numbers) {
      return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
    };
    if (!isFinite(state->pose) || !isFinite(state->shape->numbers)) return kUnknown;
  }
  const RecordedShape &s = *a.shape, &t = *b.shape;
  const Ball p(a), q(b);
  const double between = (p.center - q.center).norm();
  const double size = 2 * ((s.isOpen() ? 0 : p.radius) + (t.isOpen() ? 0 : q.radius));
  const double far = std::max(p.center.cwiseAbs().maxCoeff(), q.center.cwiseAbs().maxCoeff());
  const double drift = driftOf(poseOf(a)) + driftOf(poseOf(b));
  if (!(drift < 0.1)) return kUnknown;
  const double eps = is_float ? 0x1p-23 : 0x1p-52;
  // FCL takes a rotation for the identity if its entries are. A plane turns with its matrix about
  // the origin of its pose.
  const double doubt =
      (is_float ? 1e-5 : 1e-12) * size + 32 * eps * (far + size) + 2 * drift * (size + between);
  if (s.isRound() && t.isRound()) {
    const geometry::Segment c = segmentOf(a), d = segmentOf(b);
    const geometry::Vec3d apart = geometry::closestPoints(c, d).apart;
    const double distance = std::hypot(apart.x, apart.y, apart.z) - c.radius - d.radius;
    return {distance - doubt, distance + doubt};
  }
  const Gap balls{between - p.radius - q.radius - doubt, kInfinity};
  const auto isSolid = [](const RecordedShape& shape) {  // A cloud of points is none.
    return !shape.numbers.empty() && (shape.kind != "mesh" || !shape.indices.empty());
  };
  if (balls.low > reach || !isSolid(s) || !isSolid(t)) return balls;
  if (s.isOpen() || t.isOpen()) {
    if (s.isOpen() && t.isOpen()) return kUnknown;
    return s.isOpen() ? gapToPlane(a, b, doubt) : gapToPlane(b, a, doubt);
  }
  // FCL's narrow phase need not end if numbers are far from 1.
  const double thinnest = std::min(thicknessOf(s), thicknessOf(t));
  if (size > 1e5 || far > 1e5 || thinnest < 1e-5) return balls;
  try {
    // FCL's tolerance is 1e-6, whatever the unit.
    const Gap gap = gapOfShapes(a, b, doubt + 1e-4 * size + 4e-6);
    return {std::max(balls.low, gap.low), gap.high};
  } catch (const std::exception&) {  // FCL gives up on some shapes.
    return balls;
  }
}

RecordedBox hullOf(const RecordedState& state) {
  const Ball ball(state);
  RecordedBox hull{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double center = ball.center[static_cast<int>(i)];
    hull[i] = std::fmin(center - ball.radius, state.box[i]);  // The box may be NaN.
    hull[3 + i] = std::fmax(center + ball.radius, state.box[3 + i]);
  }
  return hull;
}

double boxesApart(const RecordedBox& a, const RecordedBox& b) {
  double apart = -kInfinity;
  for (std::size_t i = 0; i < 3; ++i) {
    apart = std::fmax(apart, std::fmax(a[i] - b[3 + i], b[i] - a[3 + i]));
  }
  return apart;
}

void appendNumber(std::string& text, double number) {
  text += std::signbit(number) ? " -" : " ";
  if (!std::isfinite(number)) {
    text += std::isnan(number) ? "nan" : "inf";
    return;
  }
  int exponent = 0;
  const double fraction = std::frexp(std::fabs(number), &exponent);
  auto digits = static_cast<std::int64_t>(std::ldexp(fraction, 53));
  for (exponent -= 53; exponent < 0 && digits % 2 == 0 && digits != 0; digits /= 2) ++exponent;
  text += std::to_string(digits);
  if (digits != 0 && exponent != 0) text += "p" + std::to_string(exponent);
}

bool readNumber(std::string_view word, double& number) {
  const bool is_negative = word.substr(0, 1) == "-";
  word.remove_prefix(is_negative);
  std::uint64_t digits = 0;
  int exponent = 0;
  const char* const end = word.data() + word.size();
  auto read = std::from_chars(word.data(), end, digits);
  if (read.ec == std::errc() && read.ptr != end && *read.ptr == 'p') {
    read = std::from_chars(read.ptr + 1, end, exponent);
  }
  number = std::ldexp(static_cast<double>(digits), std::clamp(exponent, -4000, 4000));
  const bool is_number =
      read.ec == std::errc() && read.ptr == end && digits <= std::uint64_t{1} << 53;
  if (word == "nan") number = std::numeric_limits<double>::quiet_NaN();
  if (word == "inf") number = kInfinity;
  if (is_negative) number = -number;
  return is_number || word == "nan" || word == "inf";
}

std::string describe(const RecordedState& state) {
  const auto& [kind, numbers, indices, bounds, number, exact] = *state.shape;
  const auto list = [](const double* from, std::size_t step) {
    return joinedText(from[0], " ", from[step], " ", from[2 * step]);
  };
  std::string sizes;
  for (const double size : numbers) sizes += joinedText(sizes.empty() ? "" : " ", size);
  if (numbers.size() > 4) sizes = joinedText(numbers.size() / 3, " points");
  return joinedText(kind, " (", sizes, ") at ", list(&state.pose[3], 4), ", its axis ",
                    list(&state.pose[2], 4), ", getAABB() from ", list(&state.box[0], 1), " to ",
                    list(&state.box[3], 1));
}

template RecordedShape recordedShape(const fcl::CollisionGeometry<float>*);
template RecordedShape recordedShape(const fcl::CollisionGeometry<double>*);
template std::shared_ptr<fcl::CollisionGeometry<float>> makeShape(const RecordedShape&);
template std::shared_ptr<fcl::CollisionGeometry<double>> makeShape(const RecordedShape&);
template class RecordedObject<float>;
template class RecordedObject<double>;

}  // namespace fcl_fibers::broadphase
