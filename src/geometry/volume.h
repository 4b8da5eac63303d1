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
//   nearer(pack, v, limit, out)       a bit for each lane whose volume may be no farther from v
//   than
//                                     limit, and a lower bound of its distance (overlap-inl.h)
//
// A cleared lane overlaps nothing and is near nothing, not even an unbounded volume: lanes hold NaN
// then, which no comparison accepts. Boxes and spheres differ in nothing else.
