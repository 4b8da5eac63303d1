#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# benchmarks/fcl_native.sh PREFIX
#
# Builds Debian's source of FCL with -O3 -march=native in the folder PREFIX, and the benchmark
# programs against it: PREFIX/build/benchmarks/fcl_fibers_bench and fcl_fibers_headline. All of
# these are compiled for this machine's processor, because Eigen aligns its types by that.
# Results have the flags in their context. A run for this comparison:
#
#   PREFIX/build/benchmarks/fcl_fibers_bench --measure=frames --against=fcl --benchmark_out=FILE.json
#
# Nothing outside PREFIX changes, but missing packages are installed.
set -euo pipefail

if (($# != 1)) || [[ $1 == -* ]]; then
  echo "usage: benchmarks/fcl_native.sh PREFIX" >&2
  exit 1
fi
mkdir -p "$1"
prefix=$(realpath -e -- "$1")
cd "$(dirname "${BASH_SOURCE[0]}")/.."
.ci/apt_install.sh cmake ninja-build g++ dpkg-dev libfcl-dev libccd-dev liboctomap-dev libeigen3-dev \
  libhwy-dev libtbb-dev libpugixml-dev zlib1g-dev libcli11-dev libboost-dev libbenchmark-dev

# Sources are not among the packages that a machine lists by default.
if [[ ! -d $prefix/source ]]; then
  # shellcheck source=/dev/null
  release=$(. /etc/os-release && echo "$VERSION_CODENAME")
  mkdir -p "$prefix/apt/lists/partial"
  echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg]" \
    "http://deb.debian.org/debian $release main" >"$prefix/apt/sources.list"
  apt=(apt-get -qq -o Dir::Etc::sourcelist="$prefix/apt/sources.list" -o Dir::Etc::sourceparts=-
    -o Dir::State::lists="$prefix/apt/lists" -o APT::Sandbox::User="$(id -un)")
  "${apt[@]}" -o Debug::NoLocking=1 update
  (cd "$prefix/apt" && "${apt[@]}" source --download-only fcl)
  dpkg-source -x "$prefix"/apt/fcl_*.dsc "$prefix/source"
fi

flags=(-G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS=-march=native)
# CMake would take a folder named fcl in the prefix for the installed FCL.
cmake -S "$prefix/source" -B "$prefix/objects" "${flags[@]}" -DCMAKE_INSTALL_PREFIX="$prefix" \
  -DBUILD_TESTING=OFF -DFCL_USE_X64_SSE=OFF -DFCL_NO_DEFAULT_RPATH=OFF
cmake --build "$prefix/objects" --target install
cmake -S . -B "$prefix/build" "${flags[@]}" -DCMAKE_PREFIX_PATH="$prefix" \
  -DFCL_FIBERS_BUILD_TESTS=OFF -DFCL_FIBERS_BUILD_BENCHMARKS=ON -DFCL_FIBERS_BUILD_TOOLS=OFF \
  -DFCL_FIBERS_BUILD_PYTHON=OFF
cmake --build "$prefix/build" --target fcl_fibers_bench fcl_fibers_headline
