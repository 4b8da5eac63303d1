# SPDX-License-Identifier: BSD-3-Clause
import numpy as np

import fcl_fibers

points = np.array([[-1, 0, 0], [0, 0, 0], [1, 0, 0], [0.5, -1, 0.15], [0.5, 1, 0.15]])
offsets = [0, 3, 5]  # where fibers begin, and the end

tree = fcl_fibers.FiberTree()
tree.build(points, offsets, radii=0.1)
for c in tree.contacts():
    print(f"fiber {c['fiber_a']} and fiber {c['fiber_b']} overlap by {-c['distance']:.2f}")

points[3:, 0] = -0.5  # the second fiber moves along the first
tree.update(points)
print(f"segments that touch: {tree.pairs().tolist()}")
