#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# What benchmarks/run.sh --paper [--full] does: measures again what the paper measured, part by
# part, and writes build/benchmarks/results/paper.html. Takes a quarter of an hour on 2 quiet cores,
# and up to twenty minutes more for one part, the paper's own boxes on the half scalp, and 6 GB
# of memory. --full takes hours: finer curves and, up to an hour each phase, spheres and FCL's tree on
# the half scalp. Each part keeps its results in build/benchmarks/results/paper; when
# interrupted, the parts that are there make build/benchmarks/results/paper_interrupted.html.
# --hair FILE [--radius R]: a file's fibers alone, in Table I, as paper_hair.html. Once more from
# kept results:
#
#   /usr/bin/python3 benchmarks/paper/report.py build/benchmarks/results/paper
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/../.."
build=build/benchmarks
results=$build/results
data=$results/paper
program=$build/benchmarks/paper/fcl_fibers_paper

command="benchmarks/run.sh --paper"
full=0
hair=()
while (($# > 0)); do
  case $1 in
    --full) full=1 ;;
    --hair=* | --radius=*) hair+=("$1") ;;
    --hair | --radius)
      hair+=("$1" "${2-}")
      command+=" $1"
      shift
      ;;
    *)
      echo "benchmarks/run.sh --paper: there are --full and --hair FILE [--radius R] beside it," \
        "not $1" >&2
      exit 1
      ;;
  esac
  command+=" ${1-}"
  shift || true
done

if ((${#hair[@]} > 0)); then data=${data}_hair; fi

.ci/apt_install.sh cmake ninja-build g++ libfcl-dev libccd-dev libeigen3-dev libhwy-dev \
  libtbb-dev libpugixml-dev zlib1g-dev libbenchmark-dev python3-matplotlib libcli11-dev \
  libfmt-dev nlohmann-json3-dev libjs-three

cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DFCL_FIBERS_BUILD_TESTS=OFF -DFCL_FIBERS_BUILD_BENCHMARKS=ON -DFCL_FIBERS_BUILD_TOOLS=ON >&2
cmake --build "$build" --target fcl_fibers_paper fcl_fibers_program >&2

FCL_FIBERS_COMMIT=$(git describe --always --dirty 2>/dev/null || echo unknown)
export FCL_FIBERS_COMMIT

# Of an earlier run, which may have been of another commit. What has never been made into the page
# does not replace what has.
if [[ -d $data ]]; then
  if [[ -e $data/complete || ! -d $data.previous ]]; then
    rm -rf "$data.previous"
    mv "$data" "$data.previous"
  else
    rm -rf "$data"
  fi
fi
mkdir -p "$data"
echo "$command" >"$data/command.txt"

# A process group of its own for each part, so that what it started ends with it.
child=
stopped=0
failed=0
stop() {
  stopped=1
  if [[ -n $child ]]; then kill -TERM -- "-$child" 2>/dev/null || true; fi
}
trap stop INT TERM

parts=0
# part NAME FLAG...
part() {
  local name=$1
  shift
  if ((stopped)); then return 0; fi
  parts=$((parts + 1))
  printf '%4d s  part %d: %s\n' "$SECONDS" "$parts" "$name" >&2
  setsid "$program" "$@" --benchmark_out="$data/$name.json" --benchmark_out_format=json &
  child=$!
  wait "$child" || failed=1
  child=
}

if ((${#hair[@]} > 0)); then
  part hair --part=scene "${hair[@]}" --all_of_fcl
else
  part radii --part=radii
  part rods --part=rods
  part pictures --part=pictures --out_dir="$data"
  if ((!stopped)); then
    printf '%4d s  interactive view\n' "$SECONDS" >&2
    "$build/tools/fcl_fibers" view strand-paper:fibers=500 dynamic half-scalp --points 300000 \
      --fragment -o "$data/view.html" || failed=1
  fi
  for chain in random snake; do
    edges="8 12 16 24 32 48"
    if ((full)); then edges+=" 64"; fi
    for edge in $edges; do
      part "chain_${chain}_$edge" --part=chain --chain="$chain" --edge="$edge"
    done
  done
  part dynamic --part=dynamic

  fibers="50 100 200 350 500 700 1000"
  if ((full)); then fibers=$(seq 50 50 1000); fi
  for count in $fibers; do
    part "static_$count" --part=scene --scene=static --fibers="$count" --all_of_fcl --limit=2
  done
  for scene in axis_parallel axis_turned; do
    part "${scene}_1000" --part=scene --scene="$scene" --fibers=1000
  done

  part strand_1000 --part=scene --scene=strand --fibers=1000
  boxes=LayeredAABBTree
  part strand_2000 --part=scene --scene=strand --fibers=2000 \
    --only="$boxes/super_thread,$boxes/bundle,$boxes/bundle_capsules,DynamicAABBTree/tight"
  part half_scalp --part=scene --scene=half_scalp
  # The paper's boxes take minutes, its spheres longer. Each by itself, for the sake of the others if
  # it is interrupted.
  part half_scalp_long_0 --part=scene --scene=half_scalp --only="$boxes/super_thread" --limit=600
  if ((full)); then
    number=0
    for name in DynamicAABBTree/tight WrappedSphereTree/bundle WrappedSphereTree/super_thread; do
      number=$((number + 1))
      part "half_scalp_long_$number" --part=scene --scene=half_scalp --only="$name" --limit=3600
    done
  fi
fi
page=$data.html
if ((stopped)); then
  page=${data}_interrupted.html
  echo "Interrupted: the page is made of what there is" >&2
fi

((failed || stopped)) || touch "$data/complete"
printf '%4d s  page\n' "$SECONDS" >&2
/usr/bin/python3 benchmarks/paper/report.py "$data" "$page" >&2
echo "$page"
exit "$((failed || stopped))"
