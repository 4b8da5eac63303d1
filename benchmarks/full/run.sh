#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# What benchmarks/run.sh --full does: measures ours against FCL and Embree on four scenes, and
# prints each ratio beside the one that it is to reach. Takes 20 to 30 minutes on 2 quiet cores,
# and 6 GB of memory. --hair FILE [--radius R]: a file's fibers alone, which have no targets. Google
# Benchmark's JSON and the tables are kept in build/benchmarks/results/full. What the numbers mean:
# benchmarks/full/main.cpp. The tables once more from kept results:
#
#   python3 benchmarks/full/report.py build/benchmarks/results/full
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/../.."
if (($# > 0)) && [[ $1 != --hair* && $1 != --radius* ]]; then
  echo "benchmarks/run.sh --full: there is only --hair FILE [--radius R] beside it, not $1" >&2
  exit 1
fi
build=build/benchmarks
results=$build/results/full
program=$build/benchmarks/full/fcl_fibers_full

.ci/apt_install.sh cmake ninja-build g++ libfcl-dev libccd-dev libeigen3-dev libhwy-dev \
  libtbb-dev libpugixml-dev zlib1g-dev libcli11-dev libbenchmark-dev python3
.ci/apt_install.sh libembree-dev libbullet-dev ||
  echo "What of Embree and Bullet is not installed is left out" >&2

cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DFCL_FIBERS_BUILD_TESTS=OFF -DFCL_FIBERS_BUILD_BENCHMARKS=ON -DFCL_FIBERS_BUILD_TOOLS=OFF >&2
cmake --build "$build" --target fcl_fibers_full >&2

FCL_FIBERS_COMMIT=$(git describe --always --dirty 2>/dev/null || echo unknown)
export FCL_FIBERS_COMMIT

# Of an earlier run, which may have been of another commit.
rm -rf "$results"
mkdir -p "$results"
failed=0

# part NAME FLAG...
part() {
  local name=$1
  shift
  printf '%4d s  %s\n' "$SECONDS" "$name" >&2
  "$program" "$@" --benchmark_out="$results/$name.json" --benchmark_out_format=json || failed=1
}

if (($# > 0)); then
  part hair --part=scene "$@"
else
  for scene in static strand half_scalp dynamic; do
    part "$scene" --part=scene --scene="$scene"
  done
  part queries --part=queries
  part growth --part=growth
fi
printf '%4d s  tables\n' "$SECONDS" >&2
python3 benchmarks/full/report.py "$results" | tee "$results/tables.md" || failed=1
exit "$failed"
