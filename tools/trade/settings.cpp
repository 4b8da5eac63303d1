// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>

#include <fcl_fibers/contact.h>
#include <fmt/format.h>

#include "tools/found_pairs.h"
#include "tools/messages.h"
#include "tools/seconds.h"
#include "tools/step_impacts.h"
#include "tools/trade/coarser.h"
#include "tools/trade/trial.h"

namespace fcl_fibers::tools::trade {
namespace {

using Volumes = FiberTreeOptions::Volumes;

/// @param c  a Contact or a MeshContact
template <class AnyContact>
Touch touchOf(const SegmentPair& pair, const AnyContact& c, double time = 1) {
  Touch touch{pair.a, pair.b, c.distance, c.normal, {}, true, time};
  for (std::size_t k = 0; k < 3; ++k) touch.place[k] = (c.point_a[k] + c.point_b[k]) / 2;
  return touch;
}

/// Of those of one pair the first stays.
void sortAndUnite(std::vector<Touch>& touches) {
  std::sort(touches.begin(), touches.end(), [](const Touch& a, const Touch& b) {
    return std::tie(a.a, a.b, a.time) < std::tie(b.a, b.b, b.time);
  });
  const auto isSame = [](const Touch& a, const Touch& b) { return a.a == b.a && a.b == b.b; };
  touches.erase(std::unique(touches.begin(), touches.end(), isSame), touches.end());
}

/// A scene's arrays in S.
template <typename S>
class Numbers {
 public:
  explicit Numbers(const FiberPolylines& fibers) : arrays_{} {
    for (const Point& point : fibers.points) {
      for (const double x : point) points_.push_back(static_cast<S>(x));
    }
    for (const double r : fibers.radii) radii_.push_back(static_cast<S>(r));
    if (radii_.empty()) radii_.push_back(static_cast<S>(fibers.radius));
    using Radii = typename FiberArrays<S>::Radii;
    arrays_ = {points_.data(),      fibers.points.size(), fibers.point_begin.data(),
               fibers.fiberCount(), radii_.data(),        Radii::kOne};
    if (!fibers.radii.empty()) {
      arrays_.radii_are = fibers.hasRadiiOfPoints() ? Radii::kPerPoint : Radii::kPerFirstPoint;
    }
    const FiberArrays<double> given = fiberArrays(fibers);
    arrays_.closed = given.closed;
    arrays_.starts_at = given.starts_at;
    arrays_.ends_at = given.ends_at;
  }
  Numbers(const Numbers&) = delete;
  Numbers& operator=(const Numbers&) = delete;

  const FiberArrays<S>& arrays() const { return arrays_; }

 private:
  std::vector<S> points_, radii_;
  FiberArrays<S> arrays_;
};

/// Pairs of segments at rest.
template <typename S>
class PairTrial : public Trial {
 public:
  /// @param fibers  outlive it, as the others do
  PairTrial(const FiberPolylines& fibers, const FiberPolylines& before,
            const FiberTreeOptions& options)
      : numbers_(fibers), before_(before), tree_(options) {
    tree_.build(numbers_.arrays());
  }

  double frame(Deadline& deadline) override {
    pairs_.clear();
    tree_.update(before_.arrays());
    return timed(deadline, [&] {
      tree_.update(numbers_.arrays());
      tree_.visit(Pairs{}, [&](const SegmentPair& pair) {
        pairs_.push_back(pair);
        return deadline.isOver(pairs_.size());
      });
    });
  }

  std::vector<Touch> found() const override {
    std::vector<Touch> touches;
    touches.reserve(pairs_.size());
    for (const SegmentPair& pair : pairs_) {
      touches.push_back(touchOf(pair, capsuleContact(numbers_.arrays(), pair)));
    }
    sortAndUnite(touches);
    return touches;
  }

  std::size_t bytes() const override { return tree_.memoryUsage(); }

 private:
  Numbers<S> numbers_, before_;
  FiberTree tree_;
  std::vector<SegmentPair> pairs_;
};

/// PairTrial of fibers that it owns.
struct CoarserTrial : Trial {
  using Coarser = std::shared_ptr<const CoarserFibers>;
  CoarserTrial(Coarser coarser, Coarser before, const FiberTreeOptions& options)
      : coarser_(std::move(coarser)),
        before_(std::move(before)),
        trial_(coarser_->fibers, before_->fibers, options) {}
  double frame(Deadline& deadline) override { return trial_.frame(deadline); }
  std::vector<Touch> found() const override { return trial_.found(); }
  std::size_t bytes() const override { return trial_.bytes(); }

 private:
  Coarser coarser_, before_;
  PairTrial<double> trial_;
};

/// Segments that touch meshes.
template <typename S>
class MeshTrial : public Trial {
 public:
  MeshTrial(const Scene& scene, std::vector<TriangleMesh> meshes, const FiberTreeOptions& options,
            double root_length = 0)
      : numbers_(scene.fibers),
        before_(scene.before),
        arrays_(numbers_.arrays()),
        meshes_(std::move(meshes)),
        tree_(options) {
    if (root_length > 0) {
      roots_ = rootSegments(arrays_, root_length);
      arrays_.root_segments = roots_.data();
    }
    tree_.build(arrays_);
  }

  double frame(Deadline& deadline) override {
    segments_ = 0;
    tree_.update(before_.arrays());
    return timed(deadline, [&] {
      tree_.update(arrays_);
      for (const TriangleMesh& mesh : meshes_) {
        tree_.visit(TouchingSegments{}, mesh, [&](std::int32_t) {
          ++segments_;
          return deadline.isOver(segments_);
        });
      }
    });
  }

  /// Of each segment the deepest contact.
  std::vector<Touch> found() const override {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    std::vector<double> least(arrays_.point_count, kNone);
    std::vector<Touch> deepest(arrays_.point_count), touches;
    for (const TriangleMesh& mesh : meshes_) {
      tree_.visit(Pairs{}, mesh, [&](const TrianglePair& pair) {
        const MeshContact contact = meshContact(arrays_, mesh, pair);
        const auto segment = static_cast<std::size_t>(pair.segment);
        if (!(contact.distance < least[segment])) return;
        least[segment] = contact.distance;
        deepest[segment] = touchOf({pair.segment, kAMesh}, contact);
      });
    }
    for (std::size_t i = 0; i < least.size(); ++i) {
      if (least[i] < kNone) touches.push_back(deepest[i]);
    }
    return touches;
  }

  std::size_t bytes() const override {
    std::size_t sum = tree_.memoryUsage();
    for (const TriangleMesh& mesh : meshes_) sum += mesh.memoryUsage();
    return sum;
  }

 private:
  Numbers<S> numbers_, before_;
  std::vector<std::int32_t> roots_;
  FiberArrays<S> arrays_;
  std::vector<TriangleMesh> meshes_;
  FiberTree tree_;
  std::size_t segments_ = 0;
};

/// Pairs that touch in a step.
class StepTrial : public Trial {
 public:
  StepTrial(const Scene& scene, const FiberTreeOptions& options)
      : step_{"", "", scene.fibers, scene.end.front()}, tree_(options) {
    tree_.build(fiberArrays(step_.start));
  }
  std::size_t bytes() const override { return tree_.memoryUsage(); }

 protected:
  StepScene step_;
  FiberTree tree_;
};

/// Fibers whose numbers are those of S.
template <typename S>
FiberPolylines rounded(FiberPolylines fibers) {
  const auto round = [](double& x) { x = static_cast<double>(static_cast<S>(x)); };
  for (Point& point : fibers.points) std::for_each(point.begin(), point.end(), round);
  std::for_each(fibers.radii.begin(), fibers.radii.end(), round);
  round(fibers.radius);
  return fibers;
}

/// @tparam S  of the points that the tree is given
template <typename S>
class LinearTrial : public StepTrial {
 public:
  LinearTrial(const Scene& scene, const FiberTreeOptions& options)
      : StepTrial({rounded<S>(scene.fibers), {}, {}, {rounded<S>(scene.end.front())}}, options),
        start_(step_.start),
        end_(step_.end) {}

  double frame(Deadline& deadline) override {
    impacts_.clear();
    tree_.update(end_.arrays());
    return timed(deadline, [&] {
      tree_.update(start_.arrays(), end_.arrays());
      tree_.visit(Impacts{}, [&](const Impact& impact) {
        impacts_.push_back(impact);
        return deadline.isOver(impacts_.size());
      });
    });
  }

  std::vector<Touch> found() const override {
    std::vector<Touch> touches;
    for (const Impact& impact : impacts_) {
      touches.push_back(touchOf(impact.pair, contactOf(step_, impact), impact.time));
    }
    sortAndUnite(touches);
    return touches;
  }

 private:
  Numbers<S> start_, end_;
  std::vector<Impact> impacts_;
};

/// Asks what touches at some instants. To make them is not timed.
class InstantTrial : public StepTrial {
 public:
  InstantTrial(const Scene& scene, const FiberTreeOptions& options, std::vector<double> times)
      : StepTrial(scene, options), times_(std::move(times)) {}

  double frame(Deadline& deadline) override {
    pairs_.clear();
    double taken = 0;
    for (const double time : times_) {
      const FiberPolylines instant = step_.at(time);
      taken += timed(deadline, [&] {
        tree_.update(fiberArrays(instant));
        tree_.visit(Pairs{}, [&](const SegmentPair& pair) {
          pairs_.emplace_back(pair, time);
          return deadline.isOver(pairs_.size());
        });
      });
      if (deadline.wasOver()) break;
    }
    return taken;
  }

  std::vector<Touch> found() const override {
    std::vector<Touch> touches;
    std::size_t i = 0;
    for (const double time : times_) {
      const FiberPolylines instant = step_.at(time);
      for (; i < pairs_.size() && pairs_[i].second == time; ++i) {
        const SegmentPair& pair = pairs_[i].first;
        touches.push_back(touchOf(pair, capsuleContact(fiberArrays(instant), pair), time));
      }
    }
    sortAndUnite(touches);
    return touches;
  }

 private:
  std::vector<double> times_;
  std::vector<std::pair<SegmentPair, double>> pairs_;  ///< at their times
};

/// Lines that set options and make a tree.
struct Code {
  explicit Code(const FiberTreeOptions& options) {
    const FiberTreeOptions plain;
    std::string words;
    const auto set = [&](bool differs, const std::string& line, const std::string& word) {
      if (!differs) return;
      cpp += "options." + line + ";\n";
      words += (words.empty() ? "" : ", ") + word;
    };
    cpp = "FiberTreeOptions options;\n";
    set(options.report != plain.report, "report = Report::kVolumes", "report=\"volumes\"");
    set(options.volumes != plain.volumes, "volumes = FiberTreeOptions::Volumes::kWrappedSpheres",
        "volumes=\"spheres\"");
    set(options.topology != plain.topology, "topology = Topology::kSuperThread",
        "topology=\"super_thread\"");
    // All digits, because a margin that is rounded down would miss contacts.
    const auto number = [&](const char* name, double value, double usual) {
      set(value != usual, fmt::format("{} = {}", name, value), fmt::format("{}={}", name, value));
    };
    number("ignored_neighbors", options.ignored_neighbors, plain.ignored_neighbors);
    number("ignored_arc_length", options.ignored_arc_length, plain.ignored_arc_length);
    number("margin", options.margin, plain.margin);
    number("threads", options.threads, plain.threads);
    cpp += "FiberTree tree(options);\n";
    python = "tree = fcl_fibers.FiberTree(" + words + ")\n";
  }
  std::string cpp, python;
};

class Dials {
 public:
  Dials(const Scene& scene, const Verdict& verdict)
      : scene_(scene), usual_(defaultOptions(scene, verdict)) {
    const auto count = static_cast<double>(scene.fibers.segmentCount());
    for (std::size_t f = 0; f < scene.fibers.fiberCount(); ++f) {
      most_segments_ = std::max(most_segments_, scene.fibers.segmentCount(f));
      for (std::size_t n = 0; n < scene.fibers.segmentCount(f); ++n) {
        const std::size_t i = scene.fibers.point_begin[f] + n;
        const Point &p = scene.fibers.points[i], &q = scene.fibers.points[i + 1];
        lengths_.push_back(std::hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]));
        radius_ += scene.fibers.radiusAt(i) / count;
      }
    }
    const auto middle = lengths_.begin() + static_cast<std::ptrdiff_t>(lengths_.size() / 2);
    std::nth_element(lengths_.begin(), middle, lengths_.end());
    length_ = lengths_[lengths_.size() / 2];
  }

  std::vector<Setting> all() {
    if (scene_.isStep()) {
      addStep();
    } else if (!scene_.meshes.empty()) {
      addMeshes();
    } else {
      addTrees();
    }
    return std::move(settings_);
  }

 private:
  template <class Change>
  FiberTreeOptions with(Change change) const {
    FiberTreeOptions options = usual_;
    change(options);
    return options;
  }

  void add(const std::string& dial, const std::string& value, const FiberTreeOptions& options,
           std::function<std::unique_ptr<Trial>()> make, const std::string& cpp = "",
           const std::string& python = "") {
    const Code code(options);
    settings_.push_back({dial, value, code.cpp + cpp, code.python + python, std::move(make)});
  }

  template <typename S>
  std::function<std::unique_ptr<Trial>()> makePairs(const FiberTreeOptions& options) const {
    return [&scene = scene_, options] {
      return std::make_unique<PairTrial<S>>(scene.fibers, scene.before, options);
    };
  }

  // What scenes of all kinds are asked about.

  using AddOptions =
      std::function<void(const std::string&, const std::string&, const FiberTreeOptions&)>;
  static constexpr char kFloatCpp[] = "// Build it from FiberArrays<float>.\n";
  static constexpr char kFloatPython[] = "# Build it from points in float32.\n";

  void addThreads(const AddOptions& add) {
    add("threads", "2", with([](FiberTreeOptions& options) { options.threads = 2; }));
  }
  void addMargins(const AddOptions& add) {
    for (const double radii : {0.1, 1.0}) {
      add("margin", fmt::format("{:g} radii", radii),
          with([&](FiberTreeOptions& options) { options.margin += radii * radius_; }));
    }
  }
  void addNeighbours(const AddOptions& add) {
    for (const int n : {0, 2, 5, 20}) {
      if (static_cast<std::size_t>(n) >= most_segments_) continue;
      add("neighbours", fmt::format("{} segments", n), with([&](FiberTreeOptions& options) {
            options.ignored_arc_length = 0;
            options.ignored_neighbors = n;
          }));
    }
    for (const int n : {1, 4, 19}) {
      if (static_cast<std::size_t>(n) >= most_segments_) continue;
      const double length = n * length_;
      add("neighbours", fmt::format("length {:.3g}", length),
          with([&](FiberTreeOptions& options) { options.ignored_arc_length = length; }));
    }
  }

  /// What the scene has and is left out: tapers of segments, and where fibers meet.
  void addLeftOut() {
    const auto addChanged = [this](const std::string& dial, const std::string& value,
                                   const std::string& cpp, const std::string& python,
                                   const std::function<void(FiberPolylines&)>& change) {
      const auto changed = std::make_shared<Scene>(scene_);
      change(changed->fibers);
      change(changed->before);
      for (FiberPolylines& end : changed->end) change(end);
      add(
          dial, value, usual_,
          [changed, options = usual_]() -> std::unique_ptr<Trial> {
            if (changed->isStep()) return std::make_unique<LinearTrial<double>>(*changed, options);
            if (changed->meshes.empty()) {
              return std::make_unique<PairTrial<double>>(changed->fibers, changed->before, options);
            }
            return std::make_unique<MeshTrial<double>>(*changed, meshesOf(*changed), options);
          },
          cpp, python);
    };
    const auto isAny = [this](const auto& has) {
      return has(scene_.fibers) || (scene_.isStep() && has(scene_.end.front()));
    };
    if (isAny([](const FiberPolylines& fibers) { return fibers.hasRadiiOfPoints(); })) {
      for (const bool is_mean : {false, true}) {
        const std::string which = is_mean ? "mean" : "larger";
        addChanged("tapers", "left out, " + which + " radii",
                   "// radii[i]: the " + which +
                       " radius of points i and i + 1.\n"
                       "fibers.radii_are = FiberArrays<double>::Radii::kPerFirstPoint;\n",
                   std::string("# No PointRadii: of each segment, at its first point.\n") +
                       "radii = np.asarray(radii)\n" +
                       (is_mean ? "radii = (radii + np.roll(radii, -1)) / 2\n"
                                : "radii = np.maximum(radii, np.roll(radii, -1))\n"),
                   [is_mean](FiberPolylines& fibers) { leaveOutTapers(fibers, is_mean); });
      }
    }
    const auto branch = [](const FiberPolylines& fibers) {
      return !fibers.starts_at.empty() || !fibers.ends_at.empty();
    };
    if (scene_.meshes.empty() && isAny(branch)) {
      addChanged("branches", "left out", "fibers.starts_at = fibers.ends_at = nullptr;\n",
                 "tree.build(points, offsets, radii)  # without starts_at and ends_at\n",
                 [](FiberPolylines& fibers) { fibers.starts_at = fibers.ends_at = {}; });
    }
  }
  static void leaveOutTapers(FiberPolylines& fibers, bool is_mean) {
    if (!fibers.hasRadiiOfPoints()) return;
    for (std::size_t i = 0; i + 1 < fibers.points.size(); ++i) {
      fibers.radii[i] = is_mean ? fibers.radiusAt(i, 0.5) : fibers.radiusAt(i);
    }
    fibers.radii_are = FiberArrays<double>::Radii::kPerFirstPoint;
  }

  void addTrees() {
    for (const Topology topology : {Topology::kBundle, Topology::kSuperThread}) {
      for (const Volumes volumes : {Volumes::kLayeredBoxes, Volumes::kWrappedSpheres}) {
        for (const Report report : {Report::kCapsules, Report::kVolumes}) {
          std::string value = volumes == Volumes::kLayeredBoxes ? "boxes" : "spheres";
          value += report == Report::kCapsules ? ", capsules" : ", volumes";
          if (topology == Topology::kSuperThread) value += ", super thread";
          const FiberTreeOptions options = with([=](FiberTreeOptions& changed) {
            changed.topology = topology;
            changed.volumes = volumes;
            changed.report = report;
          });
          add("tree", value, options, makePairs<double>(options));
        }
      }
    }
    const AddOptions add_tree = [this](const auto& dial, const auto& value, const auto& options) {
      add(dial, value, options, makePairs<double>(options));
    };
    addThreads(add_tree);
    addLeftOut();
    add("input", "float", usual_, makePairs<float>(usual_), kFloatCpp, kFloatPython);
    addMargins(add_tree);
    addNeighbours(add_tree);
    for (const std::size_t n : {std::size_t{2}, std::size_t{4}, std::size_t{8}}) {
      if (n >= most_segments_) continue;
      addSampling(n);
    }
  }

  void addSampling(std::size_t n) {
    const auto coarser = std::make_shared<const CoarserFibers>(everyNth(scene_.fibers, n));
    const auto before = std::make_shared<const CoarserFibers>(everyNth(scene_.before, n));
    for (const bool with_margin : {false, true}) {
      const double margin = with_margin ? 2 * coarser->error : 0;
      const FiberTreeOptions options =
          with([&](FiberTreeOptions& changed) { changed.margin += margin; });
      const char* const ordinal = n == 2 ? "2nd" : n == 4 ? "4th" : "8th";
      std::string value = fmt::format("every {} point, e of {:.2g} radii", ordinal,
                                      radius_ > 0 ? coarser->error / radius_ : 0);
      if (with_margin) value += ", margin 2 e";
      add(
          "sampling", value, options,
          [=] { return std::make_unique<CoarserTrial>(coarser, before, options); },
          fmt::format("// Build it from every {} point of each fiber, and the last.\n", ordinal),
          fmt::format("# Build it from every {} point of each fiber, and the last.\n", ordinal));
      settings_.back().segment_of = {coarser, &coarser->segment_of};
    }
  }

  static std::vector<TriangleMesh> meshesOf(const Scene& scene) {
    std::vector<TriangleMesh> meshes;
    for (const MeshFile& mesh : scene.meshes) meshes.push_back(mesh.mesh);
    return meshes;
  }

  template <typename S = double>
  void addMeshTrial(const std::string& dial, const std::string& value,
                    const FiberTreeOptions& options, double root_length = 0,
                    const std::string& cpp = "", const std::string& python = "") {
    add(
        dial, value, options,
        [this_scene = &scene_, meshes = meshesOf(scene_), options, root_length] {
          return std::make_unique<MeshTrial<S>>(*this_scene, meshes, options, root_length);
        },
        cpp, python);
  }

  void addMeshes() {
    for (const Topology topology : {Topology::kBundle, Topology::kSuperThread}) {
      for (const Volumes volumes : {Volumes::kLayeredBoxes, Volumes::kWrappedSpheres}) {
        std::string value = volumes == Volumes::kLayeredBoxes ? "boxes" : "spheres";
        if (topology == Topology::kSuperThread) value += ", super thread";
        addMeshTrial("tree", value, with([=](FiberTreeOptions& options) {
                       options.topology = topology;
                       options.volumes = volumes;
                     }));
      }
    }
    const AddOptions add_trial = [this](const auto& dial, const auto& value, const auto& options) {
      addMeshTrial(dial, value, options);
    };
    addThreads(add_trial);
    addLeftOut();
    addMeshTrial<float>("input", "float", usual_, 0, kFloatCpp, kFloatPython);
    addMargins(add_trial);
    for (const int n : {1, 4}) {
      if (static_cast<std::size_t>(n) >= most_segments_) continue;
      const double length = (n - 0.5) * length_;
      addMeshTrial("roots", fmt::format("of {:.3g}", length), usual_, length,
                   fmt::format("const auto roots = rootSegments(fibers, {:.6g});\n"
                               "fibers.root_segments = roots.data();\n",
                               length),
                   fmt::format("roots = fcl_fibers.root_segments(points, offsets, {:.6g})\n"
                               "tree.build(points, offsets, radii, root_segments=roots)\n",
                               length));
    }
    for (const double edges : {2.0, 4.0, 8.0}) addResolution(edges);
  }

  void addResolution(double edges) {
    std::vector<TriangleMesh> coarse;
    std::size_t triangles = 0;
    double error = 0;
    for (const MeshFile& mesh : scene_.meshes) {
      const CoarserMesh coarser = clusterPoints(mesh, edges);
      coarse.push_back(coarser.mesh.mesh);
      triangles += coarser.mesh.triangles.size() / 3;
      error = std::max(error, coarser.error);
    }
    for (const bool with_margin : {false, true}) {
      const FiberTreeOptions options =
          with([&](FiberTreeOptions& changed) { changed.margin += with_margin ? error : 0; });
      std::string value = fmt::format("cells of {:g} edges, {} triangles, e of {:.2g} radii", edges,
                                      countText(triangles), radius_ > 0 ? error / radius_ : 0);
      if (with_margin) value += ", margin e";
      const std::string what =
          fmt::format("Simplify the mesh by a grid of {:g} mean edges to {} triangles.\n", edges,
                      countText(triangles));
      add(
          "mesh", value, options,
          [this_scene = &scene_, coarse, options] {
            return std::make_unique<MeshTrial<double>>(*this_scene, coarse, options);
          },
          "// " + what, "# " + what);
    }
  }

  void addStep() {
    const Scene& scene = scene_;
    const AddOptions add_tree = [this](const auto& dial, const auto& value, const auto& options) {
      addTreeOfStep<double>(dial, value, options);
    };
    add_tree("step", "linear bounds", usual_);
    add_tree("step", "linear bounds, super thread",
             with([](FiberTreeOptions& options) { options.topology = Topology::kSuperThread; }));
    addThreads(add_tree);
    addLeftOut();
    addTreeOfStep<float>("input", "float", usual_, kFloatCpp, kFloatPython);
    addMargins(add_tree);
    addNeighbours(add_tree);
    for (const int n : {1, 4, 16, 64}) {
      std::vector<double> times;
      for (int i = 1; i <= n; ++i) times.push_back(static_cast<double>(i) / n);
      add(
          "step", n == 1 ? "the end alone" : fmt::format("{} substeps", n), usual_,
          [&scene, options = usual_, times] {
            return std::make_unique<InstantTrial>(scene, options, times);
          },
          n == 1 ? "tree.update(end);\n" : fmt::format("// Ask at {} instants.\n", n),
          n == 1 ? "tree.update(end)\n" : fmt::format("# Ask at {} instants.\n", n));
    }
    double motion = 0;
    for (std::size_t i = 0; i < scene.fibers.points.size(); ++i) {
      const Point &p = scene.fibers.points[i], &q = scene.end.front().points[i];
      motion += std::hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]) /
                static_cast<double>(scene.fibers.points.size());
    }
    for (const int times : {1, 2}) {
      const FiberTreeOptions options =
          with([&](FiberTreeOptions& changed) { changed.margin += times * motion; });
      add(
          "step", fmt::format("the start, margin of {} mean motion{}", times, times > 1 ? "s" : ""),
          options,
          [&scene, options] {
            return std::make_unique<InstantTrial>(scene, options, std::vector<double>{0});
          },
          "tree.update(start);\n", "tree.update(start)\n");
    }
  }

  template <typename S>
  void addTreeOfStep(const std::string& dial, const std::string& value,
                     const FiberTreeOptions& options, const std::string& cpp = "",
                     const std::string& python = "") {
    const Scene& scene = scene_;
    add(
        dial, value, options,
        [&scene, options] { return std::make_unique<LinearTrial<S>>(scene, options); },
        cpp + "tree.update(start, end);  // then ask for Impacts\n",
        python + "tree.update(start, end)\n");
  }

  const Scene& scene_;
  const FiberTreeOptions usual_;
  std::vector<double> lengths_;
  double length_ = 0;  ///< of a segment, median
  double radius_ = 0;  ///< mean
  std::size_t most_segments_ = 0;
  std::vector<Setting> settings_;
};

}  // namespace

void Deadline::start() { end_ = secondsNow() + seconds_; }

void Deadline::pause() { seconds_ = end_ - secondsNow(); }

bool Deadline::isOver(std::size_t found, std::size_t seen) {
  constexpr std::size_t kBetweenLooks = 1024;
  was_over_ =
      was_over_ || found >= kPairLimit || (seen % kBetweenLooks == 0 && secondsNow() > end_);
  return was_over_;
}

FiberTreeOptions defaultOptions(const Scene& scene, const Verdict& verdict) {
  FiberTreeOptions options;
  if (!verdict.has_pairs_along) return options;
  double least = std::numeric_limits<double>::infinity();
  const auto addRadii = [&](const FiberPolylines& fibers) {
    for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
      for (std::size_t n = 0; n < fibers.segmentCount(f); ++n) {
        least = std::min(least, fibers.radiusAt(fibers.point_begin[f] + n));
      }
    }
  };
  addRadii(scene.fibers);
  for (const FiberPolylines& end : scene.end) addRadii(end);
  // Half a circle whose diameter is the sum of the least radii, and a little less, so that no
  // contact is left out. Pairs along thicker parts are reported then.
  constexpr double kHalfCircle = 1.5707963;
  options.ignored_arc_length = kHalfCircle * 2 * least;
  return options;
}

std::vector<Setting> settingsOf(const Scene& scene, const Verdict& verdict) {
  return Dials(scene, verdict).all();
}

}  // namespace fcl_fibers::tools::trade
