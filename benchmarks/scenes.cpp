// SPDX-License-Identifier: BSD-3-Clause
#include "scenes.h"

#include <algorithm>
#include <utility>

#include "measures/paper/row_order.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

template <typename S>
BasicMovingFibers<S> movingFibers(const tools::SceneSource& source, bool rows,
                                  const std::vector<int>& frames) {
  tools::progress(source.title + ": make the scene");
  const FiberPolylines first = source.make(frames.at(0));
  std::vector<std::size_t> order;
  if (rows) order = rowsOfRoots(first);
  const auto inOrder = [&](const FiberPolylines& scene) {
    return rows ? reordered(scene, order) : scene;
  };
  BasicMovingFibers<S> fibers(source.title, inOrder(first), inOrder(source.make(frames.at(1))));
  for (std::size_t i = 2; i < frames.size(); ++i) fibers.addFrame(inOrder(source.make(frames[i])));
  return fibers;
}

std::vector<int> twoFrames(const tools::SceneSource& source) {
  const bool has_next = source.is_file || source.frame + 1 < source.frame_count;
  return {source.frame, has_next ? source.frame + 1 : source.frame - 1};
}

}  // namespace

std::array<FiberPolylines, 2> twoFrames(const SceneRequest& request) {
  const tools::SceneSource source = openScene(request.text, request.radius);
  const std::vector<int> frames = twoFrames(source);
  return {source.make(frames[0]), source.make(frames[1])};
}

template <typename S>
BasicMovingFibers<S> movingFibers(const tools::SceneSource& source, bool rows) {
  return movingFibers<S>(source, rows, twoFrames(source));
}

template <typename S>
BasicMotion<S> makeMotion(const SceneRequest& request, int part) {
  const tools::SceneSource source = openScene(request.text, request.radius, part);
  if (source.name != "paper-dynamic" || source.playable.size() == 1) {
    BasicMotion<S> motion = {movingFibers<S>(source, request.rows), false, {}};
    if (source.is_file && part > 1) {
      const std::size_t fibers = motion.fibers.fiberCount() / static_cast<std::size_t>(part);
      motion.fibers.keepFirst(std::max<std::size_t>(1, fibers));
    }
    return motion;
  }
  const int last = source.frame_count - 1;
  std::vector<int> frames;
  for (int i = 0; i <= request.steps; ++i) frames.push_back(i * last / request.steps);
  BasicMotion<S> motion = {movingFibers<S>(source, request.rows, frames), true, {}};
  motion.checked.push_back(movingFibers<S>(source, request.rows, {0, last / 4}));
  motion.checked.push_back(movingFibers<S>(source, request.rows, {last / 2, last}));
  const auto middle = frames.begin() + request.steps / 2;
  motion.tried = movingFibers<S>(source, request.rows, {middle[0], middle[1]});
  return motion;
}

template BasicMovingFibers<float> movingFibers(const tools::SceneSource&, bool);
template BasicMovingFibers<double> movingFibers(const tools::SceneSource&, bool);
template BasicMotion<float> makeMotion(const SceneRequest&, int);
template BasicMotion<double> makeMotion(const SceneRequest&, int);

}  // namespace fcl_fibers::benchmarks
