// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/always_inline.h"
#include "geometry/lanes.h"

// A bounding volume `V` is a plain value over floats that offers
//
//   V::around(segment, padding)       around one capsule thickened by padding, rounded outward
//   v.size()                          a length that orders volumes by how much they cover
//   V::Pack<N>                        N volumes as a structure of arrays
//   pack.set(lane, v), pack.get(lane), pack.clear(lane)
//   overlaps(pack, v)                 a bit for each lane whose volume overlaps v (overlap-inl.h)
//   pack.distances(v, out)            for each lane a lower bound of the distance to v
//
// A cleared lane overlaps nothing, not even an unbounded volume, and its distance is NaN: lanes
// hold NaN then, which no comparison accepts. Boxes and spheres differ in nothing else.
