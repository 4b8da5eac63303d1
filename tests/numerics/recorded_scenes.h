// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "support/assembly.h"

namespace fcl_fibers::test {

// Random scenes in files of hexadecimal numbers. Their makers need the C library's functions and
// long double, which differ between platforms.

/// The names of all there are.
std::vector<std::string> recordedNames();

/// Points that S does not hold are rounded.
/// @throws std::runtime_error if there is no such file
template <typename S>
Assembly<S> recordedScene(const std::string& name);

/// Writes a scene for recordedScene(): a line for each point with x, y, z and the radius, and an
/// empty line after each fiber.
void recordScene(const std::string& name, const Assembly<double>& fibers);

extern template Assembly<float> recordedScene(const std::string&);
extern template Assembly<double> recordedScene(const std::string&);

}  // namespace fcl_fibers::test
