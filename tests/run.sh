#!/usr/bin/env bash
# Installs what is missing, builds Release and runs the library's tests. Needs apt, and root or sudo.
# Scenes, readers of files, the program, the examples, contacts, memory that runs out, random calls against
# the model of a manager, and the benchmarks are tested by
#   .ci/run program benchmark
#
#   tests/run.sh [--full] [CTEST ARGUMENTS]
#
# --full   the long run: then also every step of tests/full.sh, which takes hours
# Other arguments go to ctest, whose tests are whole executables; a filter of GoogleTest's goes on:
#   tests/run.sh -R broadphase
#   GTEST_FILTER='*WrappedSphere*' tests/run.sh
#   build/release/tests/tree_test --gtest_filter='CageTest.*'     (of what is built)
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
