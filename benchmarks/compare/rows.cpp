// SPDX-License-Identifier: BSD-3-Clause
//
// What compare.py measures: calls of the public interface on scenes of hair.
#include <time.h>
#include <valgrind/callgrind.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/triangle_mesh.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

namespace {

using namespace fcl_fibers;

/// What the queries have found since the row was opened, and a hash of it in its order.
std::int64_t found = 0;
std::uint64_t hash = 1;

void keep(std::int32_t a, std::int32_t b = 0) {
  hash = (hash ^ static_cast<std::uint32_t>(a)) * 0x9e3779b97f4a7c15u;
  hash = ((hash ^ static_cast<std::uint32_t>(b)) * 0x9e3779b97f4a7c15u) ^ (hash >> 29);
  ++found;
}
void keep(double number) {
  std::int32_t halves[2];
  std::memcpy(halves, &number, sizeof(number));
  keep(halves[0], halves[1]);
}
struct Keep {
  void operator()(std::int32_t segment) const { keep(segment); }
  void operator()(SegmentPair pair) const { keep(pair.a, pair.b); }
  void operator()(TrianglePair pair) const { keep(pair.segment, pair.triangle); }
  template <class Impact>
  void operator()(const Impact& impact) const {
    (*this)(impact.pair);
    keep(impact.time);
  }
};

/// Wisps of 20 fibers that curl together, in a state of their swing. Some touch their neighbours.
FiberPolylines makeHair(int fibers, double swing) {
  FiberPolylines hair;
  hair.radius = 0.05;
  for (int f = 0; f < fibers; ++f) {
    const int wisp = f / 20, place = f % 20;
    for (int i = 0; i <= 50; ++i) {
      const double z = 0.25 * i, curl = 0.8 * z + 1.1 * wisp;
      const double x = 0.7 * (wisp % 6) + 0.115 * (place % 5) + 0.2 * std::cos(curl);
      const double y = 0.6 * (wisp / 6) + 0.115 * (place / 5) + 0.2 * std::sin(curl);
      hair.points.push_back({x + 0.06 * std::sin(0.3 * z + 2.4 * f) + swing * z * z / 400,
                             y + 0.06 * std::cos(0.35 * z + 1.7 * f), z});
    }
    hair.point_begin.push_back(hair.points.size());
  }
  return hair;
}
/// One for the build, and two between which updates swing.
constexpr double kStates[] = {0, 1, 1.3};

/// A ball of 4,680 triangles in the hair.
TriangleMesh makeBall(double x) {
  constexpr int kRings = 40, kSides = 60;
  std::vector<double> points;
  std::vector<std::int32_t> triangles;
  const auto at = [](int ring, int side) {
    if (ring == 0 || ring == kRings) return ring == 0 ? 0 : 1;
    return 2 + (ring - 1) * kSides + side % kSides;
  };
  points = {0, 0, 1, 0, 0, -1};
  for (int ring = 0; ring < kRings; ++ring) {
    for (int side = 0; side < kSides; ++side) {
      const double up = M_PI * ring / kRings, around = 2 * M_PI * side / kSides;
      const int a = at(ring, side), b = at(ring + 1, side), c = at(ring + 1, side + 1);
      if (b != c) triangles.insert(triangles.end(), {a, b, c});
      if (ring == 0) continue;
      triangles.insert(triangles.end(), {a, c, at(ring, side + 1)});
      for (const double p : {std::cos(around), std::sin(around)})
        points.push_back(std::sin(up) * p);
      points.push_back(std::cos(up));
    }
  }
  TriangleMesh mesh({points.data(), points.size() / 3, triangles.data(), triangles.size() / 3},
                    TriangleMesh::Kind::kSolid);
  mesh.setPose({{0, -1, 0, 1, 0, 0, 0, 0, 1}, {x, 0.5, 6}});
  return mesh;
}

using Volumes = FiberTreeOptions::Volumes;

struct Setting {
  Topology topology = Topology::kBundle;
  Report report = Report::kCapsules;
  int fibers = 200;
  Volumes volumes = Volumes::kLayeredBoxes;
  bool rules = false;  ///< two neighbours are left out, and pairs of one of three groups
  bool moves = false;  ///< an update is a step

  template <class Options>
  Options options() const {
    Options options;
    options.topology = topology;
    options.report = report;
    options.ignored_neighbors = rules ? 2 : 1;
    return options;
  }
};

/// A tree, and another one and a mesh that it meets.
template <typename S>
class TreeScene {
 public:
  explicit TreeScene(const Setting& setting) : setting_(setting) {
    auto options = setting.options<FiberTreeOptions>();
    options.volumes = setting.volumes;
    tree = FiberTree(options);
    other = FiberTree(options);
    for (const double swing : kStates) {
      hair_ = makeHair(setting.fibers, swing);
      std::vector<S>& state = states_.emplace_back();
      for (const Point& p : hair_.points) state.insert(state.end(), p.begin(), p.end());
    }
    for (int f = 0; f < setting.fibers; ++f) groups_.push_back(1 + f % 3);
    std::vector<S> beside = states_[1];
    for (S& coordinate : beside) coordinate += S(0.06);
    other.build(arrays(beside));
    if (setting.moves) other.update(arrays(beside), arrays(beside));
  }

  void build() { tree.build(arrays(states_[0])); }
  void update() {
    const FiberArrays<S> start = fibers();
    state_ = 3 - state_;
    setting_.moves ? tree.update(start, fibers()) : tree.update(fibers());
  }
  FiberArrays<S> fibers() const { return arrays(states_[state_]); }

  FiberTree tree, other;
  const TriangleMesh mesh = makeBall(1.5), moved = makeBall(1.52);

 private:
  FiberArrays<S> arrays(const std::vector<S>& points) const {
    return {points.data(),
            points.size() / 3,
            hair_.point_begin.data(),
            groups_.size(),
            &radius_,
            FiberArrays<S>::Radii::kOne,
            nullptr,
            setting_.rules ? groups_.data() : nullptr};
  }

  Setting setting_;
  FiberPolylines hair_;
  std::vector<std::vector<S>> states_;
  std::vector<std::int32_t> groups_;
  S radius_ = S(0.05);
  std::size_t state_ = 1;
};
using Tree = TreeScene<double>;

/// A manager, and another one and objects that it meets.
template <class Manager>
class ManagerScene {
 public:
  explicit ManagerScene(const Setting& setting)
      : manager(setting.options<FiberManagerOptions>()),
        other(setting.options<FiberManagerOptions>()) {
    for (const double swing : kStates) states_.push_back(makeHair(setting.fibers, swing));
    objects_ = makeObjects<double>(states_[0]);
    const FiberPolylines beside = makeHair(setting.fibers, 2.5);
    others = makeObjects<double>(beside);
    add(beside, others, other);
  }

  void build() {
    moveObjects(states_[0], objects_);
    manager.clear();
    add(states_[0], objects_, manager);
  }
  void update() {
    state_ = 3 - state_;
    moveObjects(states_[state_], objects_);
    manager.update();
  }

  Manager manager;
  mutable Manager other;
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> others;

 private:
  using Objects = decltype(others);
  static void add(const FiberPolylines& hair, const Objects& objects, Manager& to) {
    for (const auto& fiber : objectsByFiber(hair, objects)) to.registerFiber(fiber.objects);
    to.setup();
  }

  std::vector<FiberPolylines> states_;
  Objects objects_;
  std::size_t state_ = 1;
};

bool visitPair(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void*) {
  keep(a->getTranslation()[0]);
  keep(b->getTranslation()[0]);
  return false;
}
/// Lets the search go on for what is nearer than two centers were.
bool visitNear(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void*, double& least) {
  const double distance = (a->getTranslation() - b->getTranslation()).norm();
  if (distance < least) keep(least = distance);
  return false;
}

/// A call of a scene, after an update of what was built.
struct Row {
  using Call = std::function<void()>;
  struct Scene {
    Call build, update, query;
  };
  std::string name;
  Call Scene::*call;
  std::function<Scene()> open;
};
std::vector<Row> rows;

/// Adds the calls of a scene, some of "build update query".
template <class Of>
void add(const std::string& name, const std::string& calls, const Setting& setting,
         void (*query)(const Of&)) {
  const auto open = [=] {
    const auto of = std::make_shared<Of>(setting);
    return Row::Scene{[=] { of->build(); }, [=] { of->update(); }, [=] { query(*of); }};
  };
  const auto addOne = [&](const char* call, Row::Call Row::Scene::*member) {
    if (calls.find(call) != calls.npos) rows.push_back({name + ": " + call, member, open});
  };
  addOne("build", &Row::Scene::build);
  addOne("update", &Row::Scene::update);
  addOne("query", &Row::Scene::query);
}

template <typename S>
void visitPairs(const TreeScene<S>& s) {
  s.tree.visit(Pairs{}, Keep());
}

template <class Of>
void addManagerRows(const std::string& name, const Setting& capsules) {
  Setting volumes = capsules;
  volumes.report = Report::kVolumes;
  add<Of>(name + "collide", "build update query", volumes,
          [](const Of& s) { s.manager.collide(nullptr, visitPair); });
  add<Of>(name + "distance", "query", capsules,
          [](const Of& s) { s.manager.distance(nullptr, visitNear); });
  add<Of>(name + "distance of two", "query", capsules,
          [](const Of& s) { s.manager.distance(&s.other, nullptr, visitNear); });
  add<Of>(name + "distance of objects", "query", volumes, [](const Of& s) {
    for (const auto& one : s.others) s.manager.distance(one.get(), nullptr, visitNear);
  });
}

void addRows() {
  for (const auto topology : {Topology::kBundle, Topology::kSuperThread}) {
    const bool is_bundle = topology == Topology::kBundle;
    const int fibers = is_bundle ? 200 : 100;
    for (const auto volumes : {Volumes::kLayeredBoxes, Volumes::kWrappedSpheres}) {
      const bool is_boxes = volumes == Volumes::kLayeredBoxes;
      const std::string name =
          std::string(is_bundle ? "bundle" : "published") + (is_boxes ? " boxes, " : " spheres, ");
      const Setting setting = {topology, Report::kCapsules, fibers, volumes};
      add<Tree>(name + "volumes", "build update query",
                {topology, Report::kVolumes, fibers, volumes}, visitPairs);
      add<Tree>(name + "capsules", "query", setting, visitPairs);
      add<Tree>(name + "two trees", "query", setting,
                [](const Tree& s) { s.tree.visit(Pairs{}, s.other, Keep()); });
      add<Tree>(name + "mesh", "query", setting,
                [](const Tree& s) { s.tree.visit(Pairs{}, s.mesh, Keep()); });
      add<TreeScene<float>>(name + "float, rules", "build update query",
                            {topology, Report::kCapsules, fibers, volumes, true}, visitPairs);
      add<Tree>(name + "shapes", "query", setting, [](const Tree& s) {
        for (int i = 0; i < 400; ++i) {
          const double x = 0.01 * i, z = 0.03 * i;
          s.tree.visit(Pairs{}, CapsuleShape{{x, 0, z}, {x, 1.5, z + 1}, 0.05}, Keep());
          s.tree.visit(Pairs{}, BoxShape{{x, 0, z}, {x + 0.3, 0.6, z + 0.3}}, Keep());
        }
      });
      const Setting few = {topology, Report::kCapsules, 60, volumes};
      is_boxes ? addManagerRows<ManagerScene<LayeredAABBTreeCollisionManagerd>>(name, few)
               : addManagerRows<ManagerScene<WrappedSphereTreeCollisionManagerd>>(name, few);
    }

    const std::string name = is_bundle ? "bundle boxes, " : "published boxes, ";
    const Setting still = {topology, Report::kCapsules, fibers};
    const Setting step = {topology, Report::kCapsules, fibers, Volumes::kLayeredBoxes, false, true};
    add<Tree>(name + "step", "update query", step,
              [](const Tree& s) { s.tree.visit(Impacts{}, Keep()); });
    add<Tree>(name + "moving boxes", "query", step,
              [](const Tree& s) { s.tree.visit(MovingPairs{}, Keep()); });
    add<Tree>(name + "two steps", "query", step,
              [](const Tree& s) { s.tree.visit(Impacts{}, s.other, Keep()); });
    add<Tree>(name + "moving mesh", "query", step, [](const Tree& s) {
      s.tree.visit(Impacts{}, MeshStep{s.mesh, s.moved}, Keep());
    });
    add<Tree>(name + "safe step", "query", step, [](const Tree& s) { keep(s.tree.safeStep()); });
    add<Tree>(name + "nearest triangles", "query", still, [](const Tree& s) {
      std::vector<TrianglePair> pairs;
      s.tree.find(Nearest{0.3}, s.mesh, pairs);
      for (const TrianglePair pair : pairs) Keep()(pair);
    });
    add<Tree>(name + "contacts", "query", still, [](const Tree& s) {
      std::vector<Contact> contacts;
      s.tree.find(Contacts{s.fibers()}, contacts);
      for (const Contact& contact : contacts) keep(contact.distance);
    });
  }
}

Row::Scene scene;
Row::Call* call = nullptr;

double seconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

#define EXPORTED extern "C" __attribute__((visibility("default")))

/// The name of a row, or null.
EXPORTED const char* row_name(int index) {
  if (rows.empty()) addRows();
  const auto i = static_cast<std::size_t>(index);
  return i < rows.size() ? rows[i].name.c_str() : nullptr;
}

/// Makes the scene of a row, and calls it once. Returns how much its query finds, and sets `order`
/// to the hash of it.
EXPORTED std::int64_t row_open(int index, std::uint64_t* order) {
  const Row& row = rows[static_cast<std::size_t>(index)];
  scene = row.open();
  call = &(scene.*row.call);
  scene.build();
  scene.update();
  found = 0;
  hash = 1;
  scene.query();
  *order = hash;
  const std::int64_t result = found;
  (*call)();
  return result;
}

/// Calls the open row so many times. Returns the seconds of the processor.
EXPORTED double row_time(int times) {
  const double begin = seconds();
  for (int i = 0; i < times; ++i) (*call)();
  return seconds() - begin;
}

/// Calls the open row once, while callgrind counts, and ends a file of callgrind.
EXPORTED void row_count() {
  CALLGRIND_START_INSTRUMENTATION;
  CALLGRIND_ZERO_STATS;
  (*call)();
  CALLGRIND_DUMP_STATS;
  CALLGRIND_STOP_INSTRUMENTATION;
}
