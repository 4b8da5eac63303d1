// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/benchmark/scenes.h>

#include <stdexcept>

#include "generated_scenes.h"

namespace fcl_fibers::benchmarks {

Scene namedScene(const std::string& text) {
  const SceneSource source = openScene(text, {});
  return {source.title, source.frame, source.frame_count, [source](int frame) {
            if (frame >= 0 && frame < source.frame_count) return source.make(frame);
            throw std::invalid_argument("'" + source.title + "' has no frame " +
                                        std::to_string(frame) + "; give one from 0 to " +
                                        std::to_string(source.frame_count - 1));
          }};
}

std::string sceneHelp() { return generatedScenes().help; }

}  // namespace fcl_fibers::benchmarks
