// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/specimen.h"

#include <algorithm>
#include <iterator>
#include <unordered_map>
#include <utility>

#include "support/exact_geometry.h"
#include "support/managers_under_test.h"
#include "support/pair_queries.h"
#include "support/promise.h"
#include "support/scene.h"
#include "support/tree_kinds.h"

namespace fcl_fibers::test {
namespace {

using Volumes = FiberTreeOptions::Volumes;

/// Diagonal of the box around all capsules.
Real extentOf(const TouchOracle& truth) {
  if (truth.size() == 0) return 0;
  ExactBox all = boxOf(roundedCapsule(truth[0]));
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const ExactBox box = boxOf(roundedCapsule(truth[i]));
    all = {all.min.cwiseMin(box.min), all.max.cwiseMax(box.max)};
  }
  return (all.max - all.min).norm();
}

/// Partner is an object or a manager; none for the query of a manager's own objects.
template <typename S, typename... Partner>
Calls<S> callsOf(Query query, const fcl::BroadPhaseCollisionManager<S>& manager,
                 Partner*... partner) {
  PairCollector<S> collector;
  if (query == Query::kCollide) {
    manager.collide(partner..., &collector, &PairCollector<S>::collide);
  } else {
    manager.distance(partner..., &collector, [](auto* a, auto* b, void* data, S&) {
      return PairCollector<S>::collide(a, b, data);
    });
  }
  return collector.calls;
}

}  // namespace

std::vector<FiberTreeOptions> allKinds(double margin) {
  std::vector<FiberTreeOptions> kinds;
  for (const Report report : {Report::kCapsules, Report::kVolumes}) {
    for (FiberTreeOptions options : allKinds(report)) {
      options.margin = margin;
      kinds.push_back(options);
    }
  }
  return kinds;
}

std::string describe(Form form, const FiberTreeOptions& options) {
  return std::string(form == Form::kArrays ? "arrays, " : "objects, ") +
         (options.volumes == Volumes::kLayeredBoxes ? "boxes, " : "spheres, ") +
         (options.topology == Topology::kBundle ? "bundle, " : "super thread, ") +
         (options.report == Report::kCapsules ? "capsules" : "volumes");
}

template <typename S>
struct Specimen<S>::Objects {
  Scene<S> scene;

  explicit Objects(const Assembly<S>& fibers) {
    for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
      std::vector<Eigen::Vector3d> points;
      for (std::size_t i = fibers.point_begin[f]; i < fibers.point_begin[f + 1]; ++i) {
        const auto p = fibers.point(i);
        points.emplace_back(p[0], p[1], p[2]);
      }
      const std::size_t first = scene.size();
      scene.addFiber(points, 0);
      for (std::size_t k = first; k < scene.size(); ++k) {
        scene.capsule(k).radius = fibers.radii[fibers.point_begin[f] + (k - first)];
      }
    }
  }

  std::vector<GivenCapsule> capsules() {
    std::vector<GivenCapsule> capsules;
    for (std::size_t k = 0; k < scene.size(); ++k) {
      const auto center = scene[k]->getTranslation();
      const auto pose = scene[k]->getTransform();
      GivenCapsule capsule;
      for (int i = 0; i < 3; ++i) {
        const auto axis = static_cast<std::size_t>(i);
        capsule.a[axis] = capsule.b[axis] = static_cast<double>(center[i]);
        capsule.axis[axis] = static_cast<double>(pose.linear()(i, 2));
      }
      capsule.radius = static_cast<double>(scene.capsule(k).radius);
      capsule.length = static_cast<double>(scene.capsule(k).lz);
      capsules.push_back(capsule);
    }
    return capsules;
  }

  using Manager = FiberCollisionManager<S>;

  static std::unique_ptr<Manager> makeManager(const FiberTreeOptions& options) {
    const FiberManagerOptions same{options};
    if (options.volumes == Volumes::kLayeredBoxes) return makeLayeredAabbTree<S>(same);
    return makeWrappedSphereTree<S>(same);
  }

  std::unique_ptr<Manager> manager(const FiberTreeOptions& options, History history) const {
    std::unique_ptr<Manager> manager = makeManager(options);
    const auto& fibers = scene.fibers();
    switch (history) {
      case History::kNew:
        for (const auto& fiber : fibers) manager->registerFiber(fiber);
        break;
      case History::kUpdated: {
        std::vector<fcl::Transform3<S>> poses;
        for (auto* object : scene.objects()) poses.push_back(object->getTransform());
        // Each where another one is to be.
        for (std::size_t k = 0; k < scene.size(); ++k) {
          scene[k]->setTransform(poses[scene.size() - 1 - k]);
        }
        for (const auto& fiber : fibers) manager->registerFiber(fiber);
        selfPairs(*manager);
        for (std::size_t k = 0; k < scene.size(); ++k) scene[k]->setTransform(poses[k]);
        manager->update();
        break;
      }
      case History::kGrown:
        for (std::size_t f = 0; f < fibers.size() / 2; ++f) manager->registerFiber(fibers[f]);
        selfPairs(*manager);
        for (std::size_t f = fibers.size() / 2; f < fibers.size(); ++f) {
          for (auto* object : fibers[f]) manager->registerObject(object);
        }
        break;
      case History::kLate: {
        const auto& objects = scene.objects();
        const auto late = objects.end() - 8;
        manager->registerObjects({objects.begin(), late});
        selfPairs(*manager);
        std::for_each(late, objects.end(), [&](auto* object) { manager->registerObject(object); });
      }
    }
    return manager;
  }

  /// Pairs of objects of this scene with those of `other`, by their numbers.
  std::vector<NumberPair> numbered(const Calls<S>& calls, const Objects& other) const {
    const std::unordered_map<const void*, std::int32_t> first = numbers(), second = other.numbers();
    std::vector<NumberPair> pairs;
    for (const auto& [a, b] : calls) pairs.push_back({first.at(a), second.at(b)});
    return pairs;
  }

 private:
  std::unordered_map<const void*, std::int32_t> numbers() const {
    std::unordered_map<const void*, std::int32_t> numbers;
    for (std::size_t k = 0; k < scene.size(); ++k) {
      numbers.emplace(scene[k], static_cast<std::int32_t>(k));
    }
    return numbers;
  }
};

namespace {

template <typename S>
FiberTree treeOf(const Assembly<S>& fibers, const FiberTreeOptions& options, History history) {
  FiberTree tree(options);
  std::vector<SegmentPair> pairs;
  if (history == History::kUpdated) {
    Assembly<S> elsewhere = fibers;
    std::reverse(elsewhere.points.begin(), elsewhere.points.end());
    tree.build(elsewhere.view());
    tree.find(Pairs{}, pairs);
    tree.update(fibers.view());
    return tree;
  }
  if (history == History::kGrown || history == History::kLate) {
    Assembly<S> half = fibers;
    half.point_begin.resize(fibers.fiberCount() / 2 + 1);
    half.radii.resize(half.point_begin.back());
    tree.build(half.view());
    tree.find(Pairs{}, pairs);
  }
  tree.build(fibers.view());
  return tree;
}

}  // namespace

template <typename S>
Specimen<S>::Specimen(const Assembly<S>& fibers, Form form)
    : fibers_(fibers),
      number_of_point_(fibers.radii.size(), -1),
      objects_(form == Form::kObjects ? std::make_unique<Objects>(fibers) : nullptr),
      truth_(objects_ ? objects_->capsules() : fibers.capsules()) {
  std::int32_t number = 0;
  fibers.visitCapsules([&](std::size_t, std::size_t i) { number_of_point_[i] = number++; });
}

template <typename S>
Specimen<S>::~Specimen() = default;

template <typename S>
std::vector<fcl::CollisionObject<S>*> Specimen<S>::objects() const {
  return objects_->scene.objects();
}

template <typename S>
std::vector<GivenCapsule> Specimen<S>::capsules() const {
  return objects_->capsules();
}

template <typename S>
std::int32_t Specimen<S>::numberOf(std::int32_t point) const {
  return number_of_point_[static_cast<std::size_t>(point)];
}

template <typename S>
std::vector<NumberPair> Specimen<S>::pairs(const FiberTreeOptions& options, History history,
                                           Query query) const {
  if (objects_) {
    return objects_->numbered(callsOf(query, *objects_->manager(options, history)), *objects_);
  }
  std::vector<NumberPair> pairs;
  treeOf(fibers_, options, history).visit(Pairs{}, [&](SegmentPair pair) {
    pairs.push_back({numberOf(pair.a), numberOf(pair.b)});
  });
  return pairs;
}

template <typename S>
std::vector<NumberPair> Specimen<S>::pairsWith(const Specimen& other,
                                               const FiberTreeOptions& options,
                                               const FiberTreeOptions& other_options,
                                               Partner partner, Query query) const {
  if (objects_) {
    const auto first = objects_->manager(options, History::kNew);
    Calls<S> calls;
    if (partner == Partner::kManager) {
      const auto second = other.objects_->manager(other_options, History::kNew);
      calls = callsOf(query, *first, second.get());
    } else {
      for (auto* object : other.objects_->scene.objects()) {
        for (const auto& call : callsOf(query, *first, object)) calls.push_back(call);
      }
    }
    return objects_->numbered(calls, *other.objects_);
  }
  const FiberTree second = treeOf(other.fibers_, other_options, History::kNew);
  std::vector<NumberPair> pairs;
  treeOf(fibers_, options, History::kNew).visit(Pairs{}, second, [&](SegmentPair pair) {
    pairs.push_back({numberOf(pair.a), other.numberOf(pair.b)});
  });
  return pairs;
}

template class Specimen<float>;
template class Specimen<double>;

std::vector<NumberPair> touchingPairs(const TouchOracle& truth, double margin) {
  std::vector<NumberPair> touching;
  truth.visitNearPairs(
      margin, [&](std::size_t i, std::size_t j, const TouchOracle::Verdict& verdict) {
        if (!verdict.touching) return;
        touching.push_back({static_cast<std::int32_t>(i), static_cast<std::int32_t>(j)});
      });
  return touching;
}

Findings examine(const TouchOracle& truth, const std::vector<NumberPair>& touching,
                 const FiberTreeOptions& options, std::vector<NumberPair> reported) {
  Findings findings;
  findings.reported = reported.size();
  findings.touching = touching.size();
  const auto complain = [&](const char* what, const NumberPair& pair) {
    if (!findings.first_wrong.empty()) return;
    findings.first_wrong =
        std::string(what) + " (" + std::to_string(pair.a) + ", " + std::to_string(pair.b) + ")";
  };

  for (NumberPair& pair : reported) {
    if (pair.a > pair.b) std::swap(pair.a, pair.b);
  }
  std::sort(reported.begin(), reported.end());
  std::vector<NumberPair> pairs;  // those of two capsules, each once
  for (const NumberPair& pair : reported) {
    const bool is_pair =
        0 <= pair.a && pair.a < pair.b && static_cast<std::size_t>(pair.b) < truth.size();
    if (is_pair && (pairs.empty() || !(pairs.back() == pair))) {
      pairs.push_back(pair);
      continue;
    }
    ++findings.repeated;
    complain(is_pair ? "repeated" : pair.a == pair.b ? "self" : "unknown", pair);
  }

  std::vector<NumberPair> difference;
  std::set_difference(touching.begin(), touching.end(), pairs.begin(), pairs.end(),
                      std::back_inserter(difference));
  findings.missed = difference.size();
  if (!difference.empty()) complain("missed", difference.front());

  difference.clear();
  std::set_difference(pairs.begin(), pairs.end(), touching.begin(), touching.end(),
                      std::back_inserter(difference));
  const LeafVolume volume =
      options.volumes == Volumes::kLayeredBoxes ? LeafVolume::kBox : LeafVolume::kSphere;
  const Real extent = difference.empty() ? Real(0) : extentOf(truth);
  for (const NumberPair& pair : difference) {
    if (isPromised(truth[static_cast<std::size_t>(pair.a)], truth[static_cast<std::size_t>(pair.b)],
                   options.report, volume, options.margin, extent)) {
      continue;
    }
    ++findings.unpromised;
    complain("unpromised", pair);
  }
  return findings;
}

}  // namespace fcl_fibers::test
