#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# benchmarks/run.sh [--full [--targets] | --trade | --paper [--full] | --python [--targets] |
#                    --card [--again] | --threads] [--only NAME] [--hair FILE [--radius R]]
#
#   (nothing)  the README's table: this library, FCL and Embree on three scenes. 3 minutes
#   --full     all tables of docs/performance.md: scenes, other queries, small scenes, other shapes, arms, arrays,
#              growth, obstacles, motion, pairs that live. 57 minutes without the last. It takes 6 GB of memory, and up to 20 GB if the machine has it.
#              --targets also lists which ratios reach their targets
#   --trade    docs/trade.md: what options cost and miss on ten kinds of scene, and narrow phases. 20 minutes.
#              It adds real hair if FCL_FIBERS_DATA names the folder of tressfx31_ponytail_tail.tfx
#   --paper    the paper's Table I, figures, pictures and claims. 110 minutes. --full adds finer curves
#   --python   docs/python.md: a step of the Python package, beside other ways and C++. 3 minutes.
#              --targets also lists which targets are met
#   --card     FCL's managers as they are and ours on the paper's scenes, in double and in float. 49 minutes.
#              It goes on where it was ended: each scene in each scalar that was measured of this code is kept, unless
#              --again is given
#   --threads  docs/threads.md: what 2, 4, ... and all cores of the machine gain. 3 minutes
#   --only     only the measures whose names begin with NAME, such as obstacles of --full, 4 minutes,
#              or trade_yarn of --trade. It keeps the other results of the set
#   --hair     the fibers of a file instead of the scenes.
#              --radius is their radius in the file's unit, for a file without radii
#
# It first installs missing packages and builds. All times are of 2 cores and do not include the build.
# Results, tables, picture and page go to build/benchmarks/results. To write the tables into the docs:
#
#   /usr/bin/python3 benchmarks/report/report.py SET build/benchmarks/results/SET --docs .
set -euo pipefail

refuse() { echo "benchmarks/run.sh: $1; see --help" >&2 && exit 1; }
set=headline full=0 only='' again=0 hair=() targets=()
while (($# > 0)); do
  case $1 in
    --full) full=1 ;;
    --trade | --paper | --python | --card | --threads)
      [[ $set == headline ]] || refuse "give only one of --trade, --paper, --python, --card and --threads"
      set=${1#--}
      ;;
    --again) again=1 ;;
    --targets) targets=(--targets) ;;
    --only=*) only=${1#--only=} ;;
    --only)
      only=${2?$1 needs a value}
      shift
      ;;
    --hair=* | --radius=*) hair+=("$1") ;;
    --hair | --radius)
      hair+=("$1=${2?$1 needs a value}")
      shift
      ;;
    --help) sed -n '4,28s/^# \{0,1\}//p' "$0" && exit ;;
    *) refuse "there is no option $1" ;;
  esac
  shift
done
[[ ${#hair[@]} == 0 || ${hair[*]} == *--hair=* ]] || refuse "--radius needs --hair FILE"
case "$full $set ${hair[*]}" in
  '1 trade '* | '1 python '* | '1 card '* | '1 threads '* | '1 paper '?*)
    refuse "--full does not go with --trade, --python, --card or --threads, nor with --paper --hair"
    ;;
  '0 python '?* | '0 card '?* | '0 threads '?* | '0 trade '?*)
    refuse "--hair does not go with --$set"
    ;;
  '1 headline '*) set=full ;;
esac
[[ ${#targets[@]} == 0 || "$set ${hair[*]}" =~ ^(full|python)' '$ ]] ||
  refuse "--targets goes only with --full or --python alone"
[[ -z $only || "$set ${hair[*]}" != *--hair* ]] || refuse "--only does not go with --hair"
((!again)) || [[ $set == card ]] || refuse "--again goes only with --card"
ponytail=${FCL_FIBERS_DATA:+$(realpath -e -- "$FCL_FIBERS_DATA")/tressfx31_ponytail_tail.tfx}
# The path is relative to the folder of the caller.
for i in "${!hair[@]}"; do
  if [[ ${hair[i]} == --hair=* ]]; then hair[i]=--hair=$(realpath -e -- "${hair[i]#--hair=}"); fi
done

cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=build/benchmarks scenes=$set data=build/benchmarks/results/$set
if ((${#hair[@]} > 0)); then scenes=hair data=${data}_hair; fi

.ci/apt_install.sh cmake ninja-build g++ libfcl-dev libccd-dev libeigen3-dev libhwy-dev libtbb-dev \
  libpugixml-dev zlib1g-dev libcli11-dev libboost-dev libbenchmark-dev python3-pandas python3-jinja2 \
  python3-matplotlib
.ci/apt_install.sh libembree-dev libbullet-dev ||
  echo "Embree or Bullet cannot be installed. The benchmarks leave out what is missing" >&2
tools=OFF goals=(fcl_fibers_bench) python=(-DFCL_FIBERS_BUILD_PYTHON=OFF)
if [[ $set == paper || $set == trade ]]; then
  .ci/apt_install.sh libfmt-dev nlohmann-json3-dev libjs-three
  tools=ON goals+=(fcl_fibers_program)
fi
if [[ $set == paper ]]; then goals+=(fcl_fibers_topologies); fi
if [[ $set == headline ]]; then goals=(fcl_fibers_headline); fi
bench=("$build/benchmarks/${goals[0]}")
if [[ $set == python ]]; then
  .ci/apt_install.sh python3-dev pybind11-dev python3-numpy python3-scipy python3-numba libfmt-dev \
    nlohmann-json3-dev libjs-three
  python=(-DFCL_FIBERS_BUILD_PYTHON=ON -DPython3_EXECUTABLE=/usr/bin/python3)
  goals=(fcl_fibers_python fcl_fibers_step_in_cpp)
  export PYTHONPATH=$PWD/$build/python
  bench=(/usr/bin/python3 -B benchmarks/python/steps.py
    --program="$build/benchmarks/fcl_fibers_step_in_cpp")
fi
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DFCL_FIBERS_BUILD_TESTS=OFF \
  -DFCL_FIBERS_BUILD_BENCHMARKS=ON -DFCL_FIBERS_BUILD_TOOLS=$tools \
  "${python[@]}" >&2
cmake --build "$build" --target "${goals[@]}" >&2

FCL_FIBERS_COMMIT=$(git describe --always --dirty 2>/dev/null || echo unknown)
FCL_FIBERS_CODE=$(/usr/bin/python3 -B benchmarks/report/code_hash.py)
export FCL_FIBERS_COMMIT FCL_FIBERS_CODE
# The card takes hours, so what there is of it stays.
if [[ $set != card ]]; then
  rm -rf "$data.previous"
  if [[ -d $data && -z $only ]]; then mv "$data" "$data.previous"; fi
fi
mkdir -p "$data"
failed=0 measured=0 SECONDS=0

# is_measured FILE: of this code.
is_measured() {
  [[ -e $1 ]] && grep -q "\"code\": \"$FCL_FIBERS_CODE\"" "$1"
}

# measure NAME MEASURE FLAG...: a measure that fails or is ended leaves no results.
measure() {
  local file=$data/$1.json part=$data/$1.part
  [[ $1 == "$only"* ]] || return 0
  measured=1
  if [[ $set == card ]] && ((!again)) && is_measured "$file"; then
    printf '%4d s  %s is measured already\n' "$SECONDS" "$1" >&2
    return 0
  fi
  printf '%4d s  %s\n' "$SECONDS" "$1" >&2
  rm -f "$file"
  if "${bench[@]}" --measure="$2" "${@:3}" --benchmark_out="$part"; then
    mv "$part" "$file"
  else
    echo "benchmarks/run.sh: the measure $1 has failed" >&2
    if [[ -e $part ]]; then mv "$part" "$file.failed"; fi
    failed=1
  fi
}

declare -A against=([headline]=headline [full]=full [paper]=paper)
frames() { measure "$1" frames --against="${against[$set]}" "${@:2}"; }
# trade SCENE WORD...: what `fcl_fibers trade` is told.
trade() {
  local bench=(/usr/bin/python3 -B benchmarks/python/trade.py --program="$build/tools/fcl_fibers"
    --context="$data/costs.json")
  measure "trade_$1" trade "${@:2}" --longest=4s --picture="$data/trade_$1.svg"
}
helix=--scene=helix:fibers=1000,segments

case $scenes in
  headline)
    frames frames_helix $helix=100
    frames frames_cap --scene=cap:fibers=10000
    frames frames_paper-dynamic --scene=paper-dynamic --steps=20
    ;;
  full)
    frames frames_helix $helix=100
    frames frames_helix-2000 $helix=2000
    frames frames_cap --scene=cap:fibers=50000
    frames frames_paper-dynamic --scene=paper-dynamic
    measure queries queries
    measure clients clients
    measure shapes shapes
    measure arms arms
    measure arrays_helix arrays $helix=100
    measure arrays_helix-2000 arrays $helix=2000
    measure arrays_cap arrays --scene=cap:fibers=50000
    measure growth growth
    measure obstacles_cap obstacles --scene=cap:fibers=50000
    measure obstacles_combed obstacles --scene=combed:fibers=10000
    measure obstacles_cables cables
    for radii in 5 50 150 480; do measure "motion_$radii" motion --radii="$radii"; done
    live() { measure "live_$1" live --scene="$2" --motion="$3" --steps="$4" --runs="$5"; }
    live helix helix:fibers=1000,segments=100 slow,fast,weather 500 3
    measure live_helix-objects live-objects $helix=100 --motion=fast --steps=500 --runs=1
    live helix-thick helix:fibers=1000,segments=100,radius=0.016 slow,fast 500 1
    live helix-2000 helix:fibers=1000,segments=2000 slow,fast 500 1
    live cap cap:fibers=10000 creeping 500 1
    live cap-frames cap:fibers=10000 frames 100 1
    live paper-dynamic paper-dynamic frames 500 3
    for n in 3,segments=3 10,segments=5 10,segments=20 10,segments=100; do
      live "helix-$((${n%%,*} * ${n#*=}))" "helix:fibers=$n" fast 500 9
    done
    measure safe-distances safe-distances --scene=cap:fibers=50000 --motion=slow --runs=1
    ;;
  trade)
    measure costs costs
    measure unused unused $helix=100
    files=$data/scenes
    mkdir -p "$files"
    /usr/bin/python3 -B docs/pictures/scenes.py "$files"
    trade static paper-static
    trade dynamic paper-dynamic
    trade dynamic-step paper-dynamic:frame=85 --end=paper-dynamic:frame=86
    trade half-scalp paper-half-scalp:straight=1,fibers=4000,length=7,wisp_fibers=300
    trade strand paper-strand:fibers=200,area=0.615,straight=1,turns=2,helix_radius=0.5,deviation=0.3
    trade wind cap:fibers=5000 --end=cap:fibers=5000,frame=1
    trade curls helix:fibers=100,segments=1600
    trade head "$files/parting.txt" --radius=0.05
    trade head-mesh "$files/parting.txt" --radius=0.05 --mesh="$files/head.obj"
    trade yarn "$files/tube.txt" --radius=0.125
    trade cables "$files/cables.txt" --radius=0.004
    trade cables-mesh "$files/cables.txt" --radius=0.004 --mesh="$files/arm.obj"
    trade neuron "$files/neuron.swc"
    trade tract "$files/tract.txt" --radius=0.05
    if [[ -e $ponytail ]]; then trade hair "$ponytail" --radius=0.05; fi
    measure skins live-skins $helix=100 --motion=slow,fast --steps=100 --runs=1
    measure narrow narrow $helix=100
    measure narrow_paper-static narrow --scene=paper-static:fibers=1000 \
      --benchmark_filter=^Narrow/cm/
    ;;
  card)
    for scalar in double float; do
      card() { measure "card_$1_$scalar" card --scene="$2" --scalar="$scalar" --limit=10; }
      card static paper-static
      card dynamic paper-dynamic
      card half-scalp paper-half-scalp
      for n in 1000 2000; do card "strand-$n" "paper-strand:fibers=$n"; done
    done
    ;;
  threads)
    measure threads_helix threads $helix=100 --runs=25
    measure threads_helix-2000 threads $helix=2000
    measure threads_cap threads --scene=cap:fibers=50000 --runs=3
    ;;
  hair) frames frames_hair "${hair[@]}" ;;
  python)
    measure import import
    measure overhead_helix-1000 overhead $helix=100
    measure overhead_bundles-1000 overhead --scene=bundles:1000
    for n in 10 100 1000; do measure "steps_helix-$n" steps --scene="helix:fibers=$n,segments=100"; done
    measure steps_bundles-1000 steps --scene=bundles:1000
    ;;
  paper)
    measure radii radii
    measure rods rods
    measure pictures pictures --out_dir="$data"
    if [[ -z $only ]]; then
      "$build/tools/fcl_fibers" view paper-strand:fibers=500 paper-dynamic \
        paper-half-scalp:straight=1,length=7,wisp_fibers=300 --points 300000 --fragment -o "$data/view.html" &&
        /usr/bin/python3 -B docs/pictures/topologies.py \
          "$build/docs/pictures/fcl_fibers_topologies" "$data/topologies.png" || failed=1
    fi
    edges="8 12 16 24 32 48" fibers="50 100 200 350 500 700 1000"
    if ((full)); then edges+=" 64" fibers=$(seq 50 50 1000); fi
    for edge in $edges; do
      measure "chain_random_$edge" chain --chain=random --edge="$edge"
      measure "chain_snake_$edge" chain --chain=snake --edge="$edge"
    done
    measure chain-claims chain-claims
    measure replay replay --against=paper_all --scene=paper-dynamic
    measure replay_turned replay --against=paper --scene=paper-dynamic:turned=1
    measure replay_recorded replay --against=paper \
      --scene=paper-dynamic:loads=scenes/recorded_loads.txt
    against[paper]=paper_all
    for n in $fibers; do frames "static_$n" --limit=4 --scene="paper-static:fibers=$n"; done
    against[paper]=paper
    frames axis_turned_0 --limit=10 --scene=paper-static:state=1,turned=0
    frames axis_turned_1 --limit=10 --scene=paper-static:state=1

    # Table I: straight rods at the paper's density, except the tight helix, whose rods are curved.
    # A published tree that takes minutes is measured by itself, or estimated from a sample.
    scalp=paper-half-scalp strand=paper-strand cell=5400
    loose=straight=1,turns=2,helix_radius=0.5,deviation=0.3
    table() {
      local name=$1 scene=$2 limit=$3
      against[paper]=paper
      frames "table_$name" --limit=60 --scene="$scene"
      measure "tests_$name" volume-tests --against=paper --limit="$limit" --scene="$scene"
      for tree in "${@:4}"; do
        against[paper]=paper:$tree/super_thread
        frames "long_${name}_$tree" --limit="$cell" --scene="$scene"
      done
    }
    table strand-1000 "$strand:area=3.077,deviation=0.00015" "$cell"
    table strand-2000 "$strand:fibers=2000" "$cell"
    table strand-loose-1000 "$strand:area=3.077,$loose" "$cell"
    table strand-loose-2000 "$strand:fibers=2000,area=6.154,${loose/0.3/0.2}" "$cell"
    table half-scalp-wisps "$scalp:straight=1,length=7,wisp_fibers=300" "$cell" WrappedSphereTree
    table half-scalp "$scalp:straight=1" 60 LayeredAABBTree

    # A sample of each traversal is enough to compare scenes.
    styles() {
      measure "styles_$1" volume-tests "${@:3}" --scene="$2" --limit=10 \
        --against=paper:LayeredAABBTree/super_thread,LayeredAABBTree/capsules
    }
    styles scalp-15 "$scalp"
    styles scalp-15-rows "$scalp" --rows
    styles scalp-15-wisps "$scalp:wisp_fibers=300,tip_deviation=0.2"
    styles scalp-15-hanging "$scalp:wisp_fibers=300,hanging=1"
    styles scalp-7 "$scalp:length=7"
    for length in 7 5; do
      styles "scalp-$length-wisps" "$scalp:wisp_fibers=300,length=$length"
      styles "scalp-$length-hanging" "$scalp:wisp_fibers=300,length=$length,hanging=1"
    done
    styles strand-tight "$strand"
    styles strand-tight-turned "$strand:turned=1"
    styles strand-dense "$strand:area=3.077,deviation=0.00015"
    curved=turns=2,helix_radius=0.5,deviation=0.0034
    styles strand-loose "$strand:$curved"
    styles strand-loose-turned "$strand:$curved,turned=1"
    styles strand-straight "$strand:area=3.077,$loose"
    styles strand-straight-turned "$strand:area=3.077,$loose,turned=1"

    # Enclosing spheres by Welzl's algorithm, and cascade verification as published.
    cascade() { measure "cascade_$1" cascade --runs=3 --scene="$2" "${@:3}"; }
    cascade static paper-static:frames=0:5
    cascade dynamic paper-dynamic:frames=0:100
    # Balls that move to the front take minutes on millions of segments.
    random='--benchmark_filter=exact|/welzl/|boxes'
    cascade strand "$strand:area=3.077,$loose" "$random"
    cascade half-scalp "$scalp:straight=1,length=7,wisp_fibers=300" "$random"
    for n in $(seq 50 50 1000); do cascade "static_$n" "paper-static:fibers=$n"; done

    # What the paper left for later.
    volumes() { measure "volumes_$1" volumes --scene="$2"; }
    volumes static paper-static
    volumes dynamic paper-dynamic:frame=85
    volumes strand "$strand:fibers=200,area=0.615,$loose"
    volumes half-scalp "$scalp:straight=1,fibers=4000,length=7,wisp_fibers=300"
    ;;
esac

((measured)) || [[ -z $only ]] || refuse "--only $only: this set has no measure of that name"

page=$PWD/$data/page.html picture=$PWD/$data/picture.png
/usr/bin/python3 -B benchmarks/report/report.py "$set" "$data" --page "$page" --picture "$picture" \
  "${targets[@]}" | tee "$data/tables.md" || failed=1
printf '\nPage: %s\n' "$page"
if [[ -e $picture ]]; then printf 'Picture: %s\n' "$picture"; fi
exit "$failed"
