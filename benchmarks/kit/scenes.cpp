// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/benchmark/scenes.h>

#include <stdexcept>

#include "scenes/generated_scenes.h"

namespace fcl_fibers::benchmarks {

Scene namedScene(const std::string& text, std::optional<double> radius) {
  constexpr int kFramesOfFile = 1000;  // as many as of most generated scenes
  const SceneSource source = openScene(text, radius);
  const int count = source.is_file ? kFramesOfFile : source.frame_count;
  return {source.title, source.frame, count, [source, count](int frame) {
            if (frame >= 0 && frame < count) return source.make(frame);
            throw std::invalid_argument("'" + source.title + "' has no frame " +
                                        std::to_string(frame) + "; give one from 0 to " +
                                        std::to_string(count - 1));
          }};
}

std::string sceneHelp() { return generatedScenes().help; }

}  // namespace fcl_fibers::benchmarks
