#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Installs what is missing, builds Release, times all managers scene by scene and prints one table
# for each. Takes 18 minutes and the build on 2 cores, and 6 GB of memory. Google Benchmark's JSON and
# the tables are kept in build/benchmarks/results. What the numbers mean: benchmarks/main.cpp.
#
# With --hair FILE [--radius R]: the fibers of that file alone, in its unit; also after the next
# three.
# With --paper [--full]: what the paper measured, as one page; see benchmarks/paper/run.sh.
# With --trade: every manager's speed against its accuracy, as one page; see benchmarks/trade/run.sh.
# With --full: ours against FCL and Embree beside the targets; see benchmarks/full/run.sh.
set -euo pipefail

# The file's path is one from where the caller is.
arguments=()
previous=
for argument in "$@"; do
  case $previous@$argument in
    --hair@*) argument=$(realpath -- "$argument") ;;
    *@--hair=*) argument=--hair=$(realpath -- "${argument#--hair=}") ;;
  esac
  arguments+=("$argument")
  previous=$argument
done
set -- "${arguments[@]}"

cd "$(dirname "${BASH_SOURCE[0]}")/.."
if [[ ${1-} == --paper ]]; then
  shift
  exec benchmarks/paper/run.sh "$@"
fi
if [[ ${1-} == --full ]]; then
  shift
  exec benchmarks/full/run.sh "$@"
fi
if [[ ${1-} == --trade ]]; then
  shift
  exec benchmarks/trade/run.sh "$@"
fi

# Checked before anything is built; the flags themselves are fcl_fibers_benchmark's.
if (($# > 0)) && [[ $1 != --hair* && $1 != --radius* ]]; then
  echo "benchmarks/run.sh: there are --hair FILE [--radius R], --paper, --trade and --full, not $1" >&2
  exit 1
fi
build=build/benchmarks
results=$build/results
data=${FCL_FIBERS_DATA:-../shared/data}

.ci/apt_install.sh cmake ninja-build g++ libfcl-dev libccd-dev libeigen3-dev libhwy-dev \
  libtbb-dev libpugixml-dev zlib1g-dev libcli11-dev libbenchmark-dev

cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DFCL_FIBERS_BUILD_TESTS=OFF -DFCL_FIBERS_BUILD_BENCHMARKS=ON -DFCL_FIBERS_BUILD_TOOLS=OFF >&2
cmake --build "$build" >&2

FCL_FIBERS_COMMIT=$(git describe --always --dirty 2>/dev/null || echo unknown)
export FCL_FIBERS_COMMIT

# scene NAME FLAG...
scene() {
  local name=$1
  shift
  echo "Scene $name" >&2
  "$build/benchmarks/fcl_fibers_benchmark" "$@" \
    --benchmark_out="$results/$name.json" --benchmark_out_format=json | tee "$results/$name.md"
}

mkdir -p "$results"
failed=0
if (($# > 0)); then
  scene hair "$@" || failed=1
  exit "$failed"
fi
scene strand_1000x100 --scene=strand --fibers=1000 --segments=100 --largest || failed=1
scene strand_1000x2000 --scene=strand --fibers=1000 --segments=2000 || failed=1
for file in "$data"/*.tfx; do
  [[ -e $file ]] || {
    echo "No hair files in $data: the strands only" >&2
    break
  }
  # In the files' units of length, which only their authors know.
  case $(basename "$file") in
    *ponytail*) radius=0.05 ;;
    *mohawk*) radius=1e-4 ;;
    *)
      echo "Skipping $file: no radius is known for it" >&2
      continue
      ;;
  esac
  scene "$(basename "$file" .tfx)" --hair="$file" --radius="$radius" || failed=1
done
exit "$failed"
