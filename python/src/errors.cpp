// SPDX-License-Identifier: BSD-3-Clause
#include "errors.h"

#include <exception>
#include <regex>
#include <stdexcept>
#include <string>
#include <typeinfo>

#include <pybind11/pybind11.h>

namespace fcl_fibers::python {
namespace {

/// Returns the text without the function of C++ that it begins with, as a traceback names the one
/// of Python, and with the options as Python writes them.
std::string inPython(const std::string& text) {
  static const std::regex call("^(fcl_fibers: )?(\\w+(::\\w+)*(\\(\\w+\\))?: )?");
  std::string result = std::regex_replace(text, call, "", std::regex_constants::format_first_only);
  const char* const names[][2] = {
      {"Report::kCapsules", "report='capsules'"},
      {"Volumes::kLayeredBoxes", "volumes='boxes'"},
      {"LivePairs::update", "update"},
      {"visit\\(Pairs\\{\\}\\) or visitInParallel\\(\\), which keep", "visit_pairs(), which keeps"},
      {"Order::kFibers", "order='fibers'"},
      {"\\b([ab])\\.fiber\\b", "fiber_$1"}};
  for (const auto& [cpp, python] : names) {
    result = std::regex_replace(result, std::regex(cpp), python);
  }
  return result;
}

void translate(std::exception_ptr error) {
  try {
    std::rethrow_exception(error);
  } catch (const std::invalid_argument& e) {
    PyErr_SetString(PyExc_ValueError, inPython(e.what()).c_str());
  } catch (const std::length_error& e) {
    PyErr_SetString(PyExc_ValueError, inPython(e.what()).c_str());
  } catch (const std::runtime_error& e) {
    // Others are errors of Python already, or derived types with translations of their own.
    if (typeid(e) != typeid(std::runtime_error)) throw;
    PyErr_SetString(PyExc_RuntimeError, inPython(e.what()).c_str());
  }
}

}  // namespace

void translateErrors() { pybind11::register_local_exception_translator(&translate); }

}  // namespace fcl_fibers::python
