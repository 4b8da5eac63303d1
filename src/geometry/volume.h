// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "simd/always_inline.h"
#include "simd/lanes.h"

// A bounding volume `V` is a plain value over floats with
//
//   V::around(segment, padding)       the volume around a capsule thickened by padding, rounded
//                                     outward
//   v.size()                          a length that orders volumes by how much they cover
//   V::Pack<N>                        N volumes as a structure of arrays
//   pack.set(lane, v), pack.get(lane), pack.clear(lane)
//   overlaps(pack, v)                 a bit for each lane whose volume overlaps v (overlap-inl.h)
//   nearer(pack, v, limit, out)       a bit for each lane whose volume may be no farther than
//                                     limit from v, and lower bounds of the distances
//                                     (overlap-inl.h)
//
// A cleared lane overlaps nothing and is near nothing, not even an unbounded volume: it holds NaN,
// which no comparison accepts. For boxes LayeredBoxes also needs pack.replace(), replaceAll(),
// unite() and boxesAround(). For spheres WrappedSpheres also needs V::around(ball).
