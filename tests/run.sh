#!/usr/bin/env bash
# Builds Release and runs the library's tests. Installs missing packages by apt first, as root or by
# sudo. `.ci/run program benchmark` runs all other tests: scenes, readers of files, the program, the
# examples, contacts, boxes and motions of single objects, memory that runs out, random calls against a
# model, and the benchmarks.
#
#   tests/run.sh [--full] [CTEST ARGUMENTS]
#
# --full also runs every step of tests/full.sh, which takes hours. Other arguments go to ctest, in which
# a test is a whole executable. Filters of GoogleTest work too:
#   tests/run.sh -R broadphase
#   GTEST_FILTER='*WrappedSphere*' tests/run.sh
#   build/release/tests/tree_test --gtest_filter='CageTest/*'     (once it is built)
set -euo pipefail
cd "$(dirname "$0")/.."

full=false
if [[ ${1:-} == --full ]]; then
  full=true
  shift
fi

.ci/apt_install.sh cmake ninja-build g++ libfcl-dev libccd-dev libeigen3-dev libhwy-dev \
  libtbb-dev libpugixml-dev zlib1g-dev libcli11-dev libboost-dev libgtest-dev libgmock-dev \
  librapidcheck-dev libbenchmark-dev libfmt-dev nlohmann-json3-dev libjs-three python3
cmake --preset release
cmake --build --preset release --target fcl_fibers_tests
status=0
tests/run_tests.sh release -LE 'long|other|program|benchmarks' "$@" || status=$?
if $full; then
  tests/full.sh || status=$?
fi
exit "$status"
