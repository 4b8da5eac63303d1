// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "harness/runs.h"
#include "measures.h"
#include "scenes/ball.h"
#include "scenes/cap.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr int kRuns = 5, kFibers = 5000;
constexpr int kTriangles = 102400, kFinest = 409600;

using Segments = std::vector<std::int32_t>;

TriangleMesh headOf(int triangles) {
  constexpr double r = scenes::kHeadRadius;
  return TriangleMesh(scenes::makeBall({r, r, r}, triangles).arrays());
}

/// What a FiberTree finds with a setting.
class Setting {
 public:
  Setting(const FiberPolylines& hair, double root_length, double margin, TriangleMesh head)
      : head_(std::move(head)) {
    FiberArrays<double> arrays = fiberArrays(hair);
    const std::vector<std::int32_t> roots = rootSegments(arrays, root_length);
    arrays.root_segments = roots.data();
    tree_ = makeTree(arrays, {touchingOptions(0, 1, margin)});
  }

  double find() {
    return seconds([&] { tree_->find(TouchingSegments{}, head_, found_); });
  }
  Segments found() {
    find();
    std::sort(found_.begin(), found_.end());
    return found_;
  }

 private:
  TriangleMesh head_;
  std::shared_ptr<FiberTree> tree_;
  Segments found_;
};

void registerSetting(const std::string& name, const std::shared_ptr<Setting>& setting,
                     const Segments& truth, double error = 0) {
  const Segments found = setting->found();
  const Numbers counts = {{"touching", static_cast<double>(truth.size())},
                          {"reported", static_cast<double>(found.size())},
                          {"missed", static_cast<double>(countWithout(truth, found))},
                          {"extra", static_cast<double>(countWithout(found, truth))},
                          {"error", error}};
  registerRuns("Dials/" + name, kRuns, [=](Numbers& numbers) {
    numbers = counts;
    return setting->find();
  });
}

bool measureDials(const Request&) {
  tools::progress("dials: make the scene");
  scenes::CapParameters parameters;
  parameters.fibers = kFibers;
  const double radius = parameters.radius;
  const FiberPolylines combed = scenes::makeCombed(parameters);
  const TriangleMesh head = headOf(kTriangles);

  const Segments touching = Setting(combed, 0, 0, head).found();
  for (const std::string radii : {"0", "0.1", "0.2", "0.5", "1", "2"}) {
    registerSetting("margin/" + radii,
                    std::make_shared<Setting>(combed, 0, std::stod(radii) * radius, head),
                    touching);
  }
  for (const std::string length : {"0", "0.1", "0.6", "3"}) {
    registerSetting("roots/" + length,
                    std::make_shared<Setting>(combed, std::stod(length), 0, head), touching);
  }
  const Segments truth = Setting(combed, 0, 0, headOf(kFinest)).found();
  for (const int triangles : {1600, 6400, 25600, 102400, kFinest}) {
    const double error = scenes::depthOfTriangles(scenes::kHeadRadius, triangles);
    for (const bool with_margin : {false, true}) {
      registerSetting(
          "mesh/" + std::to_string(triangles) + (with_margin ? "/margin" : "/plain"),
          std::make_shared<Setting>(combed, 0, with_margin ? error : 0, headOf(triangles)), truth,
          error / radius);
    }
  }
  return runRegistered();
}

const AddMeasure kMeasure("dials", measureDials);

}  // namespace

}  // namespace fcl_fibers::benchmarks
