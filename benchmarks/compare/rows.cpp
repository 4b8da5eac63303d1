// SPDX-License-Identifier: BSD-3-Clause
#include "rows.h"

#include <time.h>
#include <valgrind/callgrind.h>

#include <cmath>
#include <cstring>
#include <utility>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

namespace compare {

using namespace fcl_fibers;
using Call = Row::Call;

void Hash::add(double number) {
  std::uint32_t halves[2];
  std::memcpy(halves, &number, sizeof(number));
  add(static_cast<std::int32_t>(halves[0]), static_cast<std::int32_t>(halves[1]));
}

void addRows(const std::string& name, const std::vector<Call>& calls,
             const std::function<std::unique_ptr<Scene>()>& open, std::vector<Row>& rows) {
  static const char* const kNames[] = {"build", "update", "query"};
  for (const Call call : calls) {
    rows.push_back({name + " " + kNames[static_cast<int>(call)], call, open});
  }
}

FiberPolylines makeHair(int fibers, int segments, double swing) {
  FiberPolylines hair;
  hair.radius = 0.05;
  for (int f = 0; f < fibers; ++f) {
    const int wisp = f / 20, place = f % 20;
    for (int i = 0; i <= segments; ++i) {
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

namespace {

struct Setting {
  FiberTreeOptions::Volumes volumes = FiberTreeOptions::Volumes::kLayeredBoxes;
  Topology topology = Topology::kBundle;
  Report report = Report::kCapsules;
  int fibers = 200, segments = 50;
  bool rules = false;  ///< ignored neighbours, and groups of fibers
  bool moves = false;  ///< an update is a step
};

FiberTreeOptions optionsOf(const Setting& setting) {
  FiberTreeOptions options;
  options.volumes = setting.volumes;
  options.topology = setting.topology;
  options.report = setting.report;
  options.ignored_neighbors = setting.rules ? 2 : 1;
  return options;
}

/// A ball of 4,600 triangles between the hair.
TriangleMesh ball() {
  constexpr int kRings = 40, kSides = 60;
  std::vector<double> points = {0, 0, 1};
  std::vector<std::int32_t> triangles;
  for (int ring = 1; ring < kRings; ++ring) {
    for (int side = 0; side < kSides; ++side) {
      const double up = M_PI * ring / kRings, around = 2 * M_PI * side / kSides;
      points.insert(points.end(), {std::sin(up) * std::cos(around), std::sin(up) * std::sin(around),
                                   std::cos(up)});
    }
  }
  points.insert(points.end(), {0, 0, -1});
  const int last = 1 + (kRings - 1) * kSides;
  const auto at = [&](int ring, int side) {
    return ring == 0 ? 0 : ring == kRings ? last : 1 + (ring - 1) * kSides + side % kSides;
  };
  for (int ring = 0; ring < kRings; ++ring) {
    for (int side = 0; side < kSides; ++side) {
      const int a = at(ring, side), b = at(ring + 1, side), c = at(ring + 1, side + 1),
                d = at(ring, side + 1);
      if (b != c) triangles.insert(triangles.end(), {a, b, c});
      if (a != d) triangles.insert(triangles.end(), {a, c, d});
    }
  }
  const MeshArrays<double> arrays = {points.data(), points.size() / 3, triangles.data(),
                                     triangles.size() / 3};
  return TriangleMesh(arrays, TriangleMesh::Kind::kSolid);
}

TriangleMesh ballAt(double x) {
  TriangleMesh mesh = ball();
  mesh.setPose({{0, -1, 0, 1, 0, 0, 0, 0, 1}, {x, 0.5, 6}});
  return mesh;
}

/// A tree, another one beside it and a mesh, and one query of them.
template <typename S>
class TreeScene : public Scene {
 public:
  using Query = void (*)(const TreeScene& scene, Hash& found);

  TreeScene(const Setting& setting, Query query)
      : tree(optionsOf(setting)), other(optionsOf(setting)), setting_(setting), query_(query) {
    for (const double swing : {0., 1., 1.3}) {
      hair_ = makeHair(setting.fibers, setting.segments, swing);
      states_.emplace_back();
      for (const Point& p : hair_.points)
        states_.back().insert(states_.back().end(), p.begin(), p.end());
    }
    radius_ = S(hair_.radius);
    for (int f = 0; f < setting.fibers; ++f) groups_.push_back(1 + f % 3);
    std::vector<S> beside = states_[1];
    for (std::size_t i = 0; i < beside.size(); ++i) beside[i] += S(i % 3 == 2 ? 0.01 : 0.06);
    other.build(arrays(beside));
    if (setting.moves) other.update(arrays(beside), arrays(beside));
  }

  void build() override { tree.build(fibers(0)); }
  void update() override {
    const std::size_t from = state_;
    state_ = 3 - state_;
    if (setting_.moves) {
      tree.update(fibers(from), fibers(state_));
    } else {
      tree.update(fibers(state_));
    }
  }
  void query(Hash& found) override { query_(*this, found); }

  FiberArrays<S> fibers() const { return fibers(state_); }

  FiberTree tree, other;
  const TriangleMesh mesh = ballAt(1.5), moved = ballAt(1.52);

 private:
  FiberArrays<S> fibers(std::size_t state) const { return arrays(states_[state]); }
  FiberArrays<S> arrays(const std::vector<S>& points) const {
    FiberArrays<S> result;
    result.points = points.data();
    result.point_count = points.size() / 3;
    result.point_begin = hair_.point_begin.data();
    result.fiber_count = hair_.point_begin.size() - 1;
    result.radii = &radius_;
    if (setting_.rules) result.groups = groups_.data();
    return result;
  }

  Setting setting_;
  Query query_;
  std::vector<std::vector<S>> states_;  ///< one for the build, two for the updates
  FiberPolylines hair_;
  std::vector<std::int32_t> groups_;
  S radius_ = 0;
  std::size_t state_ = 1;
};

using Tree = TreeScene<double>;

/// A visitor that keeps what it is shown.
struct Into {
  void operator()(std::int32_t segment) const { found.add(segment, 0); }
  void operator()(SegmentPair pair) const { found.add(pair.a, pair.b); }
  void operator()(TrianglePair pair) const { found.add(pair.segment, pair.triangle); }
  template <class Impact>
  void operator()(const Impact& impact) const {
    (*this)(impact.pair);
    found.add(impact.time);
  }
  Hash& found;
};

template <typename S = double>
void addTree(std::vector<Row>& rows, const std::string& name, const Setting& setting,
             const std::vector<Call>& calls, typename TreeScene<S>::Query query) {
  addRows(
      name, calls, [=] { return std::make_unique<TreeScene<S>>(setting, query); }, rows);
}

template <typename S>
void pairs(const TreeScene<S>& s, Hash& found) {
  s.tree.visitPairs(Into{found});
}

void overlaps(const Tree& s, Hash& found) {
  for (int i = 0; i < 400; ++i) {
    const double x = 0.01 * i, z = 0.03 * i;
    s.tree.visitOverlaps(CapsuleShape{{x, 0, z}, {x, 1.5, z + 1}, 0.05}, Into{found});
    s.tree.visitOverlaps(BoxShape{{x, 0, z}, {x + 0.3, 0.6, z + 0.3}}, Into{found});
  }
}

void nearest(const Tree& s, Hash& found) {
  std::vector<TrianglePair> pairs;
  s.tree.findNearest(s.mesh, 0.3, pairs);
  for (const TrianglePair pair : pairs) Into{found}(pair);
}

void contacts(const Tree& s, Hash& found) {
  std::vector<Contact> contacts;
  s.tree.findContacts(s.fibers(), contacts);
  for (const Contact& contact : contacts) found.add(contact.distance);
}

std::vector<Row> makeRows() {
  constexpr auto kBoxes = FiberTreeOptions::Volumes::kLayeredBoxes;
  constexpr auto kSpheres = FiberTreeOptions::Volumes::kWrappedSpheres;
  constexpr auto kBundle = Topology::kBundle, kPublished = Topology::kSuperThread;
  constexpr auto kVolumes = Report::kVolumes, kCapsules = Report::kCapsules;
  const std::vector<Call> all = {Call::kBuild, Call::kUpdate, Call::kQuery}, query = {Call::kQuery},
                          step = {Call::kUpdate, Call::kQuery};
  const auto visitOther = [](const Tree& s, Hash& found) {
    s.tree.visitPairs(s.other, Into{found});
  };
  const auto visitImpacts = [](const Tree& s, Hash& found) { s.tree.visitImpacts(Into{found}); };
  const auto visitMesh = [](const Tree& s, Hash& found) { s.tree.visitMesh(s.mesh, Into{found}); };

  std::vector<Row> rows;
  for (const auto topology : {kBundle, kPublished}) {
    const std::string of = topology == kBundle ? "bundle " : "published ";
    const int f = topology == kBundle ? 200 : 100;
    addTree(rows, of + "boxes, volumes:", {kBoxes, topology, kVolumes, f}, all, pairs);
    addTree(rows, of + "boxes, capsules:", {kBoxes, topology, kCapsules, f}, query, pairs);
    addTree(rows, of + "spheres, volumes:", {kSpheres, topology, kVolumes, f / 2}, all, pairs);
    addTree(rows, of + "spheres, capsules:", {kSpheres, topology, kCapsules, f / 2}, query, pairs);
    addTree<float>(rows, of + "boxes, float, rules:", {kBoxes, topology, kCapsules, f, 50, true},
                   all, pairs);
    addTree(rows, of + "boxes, two trees:", {kBoxes, topology, kCapsules, f}, query, visitOther);
    addTree(rows, of + "spheres, two trees:", {kSpheres, topology, kCapsules, f / 2}, query,
            visitOther);
    addTree(rows, of + "boxes, mesh:", {kBoxes, topology, kCapsules, f}, query, visitMesh);
    addTree(rows, of + "spheres, mesh:", {kSpheres, topology, kCapsules, f}, query, visitMesh);
    addTree(rows, of + "boxes, step:", {kBoxes, topology, kCapsules, f, 50, false, true}, step,
            visitImpacts);
    addTree(rows, of + "boxes, shapes:", {kBoxes, topology, kCapsules, f}, query, overlaps);
  }
  const Setting moving = {kBoxes, kBundle, kCapsules, 200, 50, false, true};
  addTree(rows, "bundle boxes, nearest triangles:", {}, query, nearest);
  addTree(rows, "bundle boxes, contacts:", {}, query, contacts);
  addTree(rows, "bundle boxes, moving boxes:", moving, query,
          [](const Tree& s, Hash& found) { s.tree.visitMovingPairs(Into{found}); });
  addTree(rows, "bundle boxes, two steps:", moving, query,
          [](const Tree& s, Hash& found) { s.tree.visitImpacts(s.other, Into{found}); });
  addTree(rows, "bundle boxes, moving mesh:", moving, query,
          [](const Tree& s, Hash& found) { s.tree.visitImpacts(s.mesh, s.moved, Into{found}); });
  addTree(rows, "bundle boxes, safe step:", moving, query, [](const Tree& s, Hash& found) {
    found.add(s.tree.safeStep());
    found.add(s.tree.safeStep(s.other));
    found.add(s.tree.safeStep(s.mesh, s.moved));
  });
  addManagerRows(rows);
  return rows;
}

const std::vector<Row>& rows() {
  static const std::vector<Row> made = makeRows();
  return made;
}

std::unique_ptr<Scene> scene;
const Row* row = nullptr;
Hash found;

void call() {
  switch (row->call) {
    case Call::kBuild:
      return scene->build();
    case Call::kUpdate:
      return scene->update();
    case Call::kQuery:
      return scene->query(found);
  }
}

double seconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace
}  // namespace compare

// What compare.py calls.
#define EXPORTED extern "C" __attribute__((visibility("default")))

/// The name of a row, or null.
EXPORTED const char* row_name(int index) {
  const auto i = static_cast<std::size_t>(index);
  return i < compare::rows().size() ? compare::rows()[i].name.c_str() : nullptr;
}

/// Makes the scene of a row, and calls it once. Returns a hash of what its query finds.
EXPORTED std::uint64_t row_open(int index) {
  using namespace compare;
  scene.reset();
  row = &rows()[static_cast<std::size_t>(index)];
  scene = row->open();
  scene->build();
  scene->update();
  found = Hash();
  scene->query(found);
  const std::uint64_t result = found.value();
  call();
  return result;
}

/// How many things the query of the open row has found.
EXPORTED std::int64_t row_found() { return compare::found.count(); }

/// Calls the open row so many times. Returns the seconds of the processor.
EXPORTED double row_time(int times) {
  const double begin = compare::seconds();
  for (int i = 0; i < times; ++i) compare::call();
  return compare::seconds() - begin;
}

/// Calls the open row once, while callgrind counts, and ends its file.
EXPORTED void row_count() {
  CALLGRIND_START_INSTRUMENTATION;
  CALLGRIND_ZERO_STATS;
  compare::call();
  CALLGRIND_DUMP_STATS;
  CALLGRIND_STOP_INSTRUMENTATION;
}
