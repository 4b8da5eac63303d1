// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "support/exact_numbers.h"

// What is within reach, in integers of any size.
namespace fcl_fibers::test {

/// Whether the segments from w to w + u and from 0 to v are that near.
bool segmentsWithin(const Vector<Integer>& w, const Vector<Integer>& u, const Vector<Integer>& v,
                    const Integer& reach);

/// Whether the axis from w to w + u crosses the triangle of 0, v1 and v2, or one of its ends is
/// that near and over it. If neither holds, the closest point of the triangle is on an edge.
bool insideWithin(const Vector<Integer>& w, const Vector<Integer>& u, const Vector<Integer>& v1,
                  const Vector<Integer>& v2, const Integer& reach);

}  // namespace fcl_fibers::test
