#!/usr/bin/env bash
# Installs what is missing, builds Release and runs all tests. Needs git, a C++17 compiler and apt.
#
#   tests/run.sh [--full] [CTEST ARGUMENTS]
#
# --full   the long run: then also every step of tests/full.sh, which takes hours and ends with a list
#          of what passed, and of what was skipped and why
# Other arguments go to ctest:  tests/run.sh -R WrappedSphere
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
cmake --build --preset release
ctest --preset release -j "$(nproc)" -LE long --output-junit "$PWD/build/quick_tests.xml" "$@"
if $full; then
  tests/full.sh
fi
