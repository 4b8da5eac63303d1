#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# What benchmarks/run.sh --trade does: measures what accuracy costs, every manager and every dial on
# five scenes, and writes build/benchmarks/results/trade.html. Takes 13 minutes on 2 quiet
# cores, and 6 GB of memory. --hair FILE [--radius R]: that file for the scene of real hair. Each
# part's numbers are kept in build/benchmarks/results/trade, as are the page's as CSV. The page once
# more from kept results:
#
#   /usr/bin/python3 benchmarks/trade/page.py build/benchmarks/results/trade
#
# and with --costs docs/costs.md the table of that file with it.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/../.."
build=build/benchmarks
results=$build/results
data=$results/trade
ponytail=${FCL_FIBERS_DATA:-../shared/data}/tressfx31_ponytail_tail.tfx

hair=("$@")
if ((${#hair[@]} == 0)) && [[ -e $ponytail ]]; then hair=(--hair="$ponytail" --radius=0.05); fi
if ((${#hair[@]} > 0)) && [[ ${hair[0]} != --hair* && ${hair[0]} != --radius* ]]; then
  echo "benchmarks/run.sh --trade: there is only --hair FILE [--radius R] beside it, not $1" >&2
  exit 1
fi

.ci/apt_install.sh cmake ninja-build g++ libfcl-dev libccd-dev libeigen3-dev libhwy-dev \
  libtbb-dev libpugixml-dev zlib1g-dev libcli11-dev libbenchmark-dev python3-matplotlib

cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DFCL_FIBERS_BUILD_TESTS=OFF -DFCL_FIBERS_BUILD_BENCHMARKS=ON -DFCL_FIBERS_BUILD_TOOLS=OFF >&2
cmake --build "$build" --target fcl_fibers_trade fcl_fibers_benchmark >&2

FCL_FIBERS_COMMIT=$(git describe --always --dirty 2>/dev/null || echo unknown)
export FCL_FIBERS_COMMIT

# Of an earlier run, which may have been of another commit.
rm -rf "$data"
mkdir -p "$data"
failed=0

# part NAME PROGRAM FLAG...
part() {
  local name=$1 program=$2
  shift 2
  printf '%4d s  %s\n' "$SECONDS" "$name" >&2
  "$build/benchmarks/$program" "$@" --benchmark_out="$data/$name.json" \
    --benchmark_out_format=json >"$data/$name.txt" || failed=1
}
# managers SCENE SECONDS FLAG...: what takes longer in any phase is no choice
managers() {
  local scene=$1 limit=$2
  shift 2
  part "managers_$scene" fcl_fibers_benchmark "$@" --limit="$limit" --benchmark_filter=^Frame/
}

managers static 2 --scene=strand --fibers=1000 --segments=100
managers strand 10 --scene=strand --fibers=1000 --segments=2000
managers half_scalp 2 --scene=scalp --fibers=5000
managers dynamic 2 --scene=dynamic
if ((${#hair[@]} > 0)); then
  managers hair 2 "${hair[@]}"
else
  echo "No file of hair: benchmarks/run.sh --trade --hair FILE --radius R" >&2
fi

# dial NAME: on every scene
dial() {
  local scene
  for scene in static strand half_scalp dynamic; do
    part "$1_$scene" trade/fcl_fibers_trade --part="$1" --scene="$scene"
  done
  if ((${#hair[@]} > 0)); then part "$1_hair" trade/fcl_fibers_trade --part="$1" "${hair[@]}"; fi
}

dial leaves
dial kdops
dial bounds
dial spheres
part costs trade/fcl_fibers_trade --part=costs
part lazy trade/fcl_fibers_trade --part=lazy
part sampling trade/fcl_fibers_trade --part=sampling

printf '%4d s  page\n' "$SECONDS" >&2
/usr/bin/python3 benchmarks/trade/page.py "$data" "$results/trade.html" || failed=1
exit "$failed"
