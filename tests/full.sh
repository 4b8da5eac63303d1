#!/usr/bin/env bash
# What takes too long for every day; tests/run.sh --full runs all of it behind the quick tests.
#
#   tests/full.sh [STEP...]    these steps alone, of a tree that tests/run.sh has built
#
# A step is a function below and a name in `steps`; it ends with an error where it finds one. All run,
# and tests/steps.sh lists at the end what passed, what failed, and what was skipped and why.
set -euo pipefail
cd "$(dirname "$0")/.."
. tests/steps.sh

numerics=build/release/tests/fcl_fibers_numerics_run

# build TARGET...: of the release preset, which tests/run.sh has not built.
build() {
  cmake --build --preset release --target "$@"
}

# needs PACKAGE...: ends the step if they are not installed and cannot be.
needs() {
  .ci/apt_install.sh "$@" || skip_step "$*, which cannot be installed here"
}

# has_packages PACKAGE...: the same for a part of a step. Returns 1 where that part is skipped.
has_packages() {
  .ci/apt_install.sh "$@" && return
  skip "$*, which cannot be installed here"
  return 1
}
python_packages=(pybind11-dev python3-dev python3-numpy python3-pytest python3-hypothesis)

# run_tests PRESET ARGUMENTS...: what is skipped is told at the end.
run_tests() {
  local line
  tests/run_tests.sh "$@"
  while IFS= read -r line; do skip "$line"; done < <(
    tests/count_tests.py "build/$1/results" --skipped)
}

# has_simd LEVEL: whether this machine has the instruction set; else it is skipped.
has_simd() {
  local said
  [[ -x build/release/tools/fcl_fibers ]] || build fcl_fibers_program
  # It ends with 1 where capsules touch.
  said=$(FCL_FIBERS_SIMD=$1 build/release/tools/fcl_fibers check helix:fibers=2 2>&1) || true
  [[ $said == *"not available here"* ]] || return 0
  skip "FCL_FIBERS_SIMD=$1, which this machine does not have"
  return 1
}
simd_levels=(scalar sse4 avx2 avx512 neon)

# Every manager, and FCL's own, under the suites that tests/run.sh runs over four of ours; with the
# library's assertions, which Release leaves out; and each file by itself without precompiled
# headers, which hide that an include is missing.
all_managers() {
  cmake --preset debug -DFCL_FIBERS_MANAGERS=all -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON \
    -DCMAKE_UNITY_BUILD=OFF
  cmake --build --preset debug --target fcl_fibers_tests fcl_fibers_other_tests
  run_tests debug -LE 'long|program|benchmarks'
}

# Everything, the benchmarks and the program too, compiles with clang without a warning, and finds the
# recorded pairs in their order.
clang() {
  .ci/apt_install.sh clang pybind11-dev python3-dev
  cmake --preset release -B build/clang -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_CXX_FLAGS=-Werror
  cmake --build build/clang
  build/clang/tests/fcl_fibers_numerics_run hashes | diff tests/data/pair_order/hashes.txt -
}

# The tests of everything that depends on it, on every instruction set of this machine.
simd() {
  local level suite
  for level in "${simd_levels[@]}"; do
    has_simd "$level" || continue
    for suite in geometry_test tree_test index_test arrays_test broadphase_test; do
      FCL_FIBERS_SIMD=$level build/release/tests/$suite --gtest_brief=1
    done
  done
}

# The same tests with subnormals flushed to zero, as in a program that is linked with -ffast-math.
flush_to_zero() {
  local suite
  for suite in geometry_test tree_test index_test arrays_test broadphase_test swap_test; do
    FCL_FIBERS_FLUSH_TO_ZERO=1 build/release/tests/$suite --gtest_brief=1
  done
}

# All tests of the library and the scenes under AddressSanitizer and UndefinedBehaviorSanitizer, of
# which .ci/run leaves some out.
sanitized() {
  .ci/apt_install.sh clang libclang-rt-dev
  cmake --preset sanitize -DFCL_FIBERS_MANAGERS=all
  cmake --build --preset sanitize --target fcl_fibers_tests fcl_fibers_other_tests
  run_tests sanitize -LE 'long|program|benchmarks'
}

# The sanitizers on every instruction set of this machine; elsewhere they are on SSE4 alone.
simd_sanitized() {
  .ci/apt_install.sh clang libclang-rt-dev
  cmake --preset sanitize -B build/sanitize-simd \
    -DCMAKE_CXX_FLAGS="-O1 -g1 -fsanitize=address,undefined -fno-sanitize-recover=all"
  cmake --build build/sanitize-simd --target geometry_test tree_test index_test arrays_test
  local suite level
  for level in "${simd_levels[@]}"; do has_simd "$level" || true; done
  for suite in geometry_test tree_test index_test arrays_test; do
    build/sanitize-simd/tests/$suite --gtest_brief=1
  done
}

# The Python package under the sanitizers.
python_sanitized() {
  needs "${python_packages[@]}"
  tests/python/sanitized.sh
}

# Random calls and scenes of the Python package, other ones at each run.
python_long() {
  needs "${python_packages[@]}"
  cmake --preset release  # It left the package out if these were missing.
  build fcl_fibers_python
  FCL_FIBERS_LONG=1 run_tests release -R '^python_test$'
}

# Wheels for other machines, in a Debian without their libraries, for Debian's Python and pyenv's.
wheels() {
  if ((EUID != 0)); then
    skip_step "wheels are tested in a system of their own, which needs root"
  fi
  needs mmdebstrap python3-dev python3-venv python3-pip
  has_pypi || skip_step "pip does not reach PyPI, which has auditwheel and NumPy"
  local pythons=(/usr/bin/python3) python
  for python in ~/.pyenv/versions/3.{9,10,12,13,14}.*/bin/python3; do
    [[ ! -x $python ]] || pythons+=("$python")
  done
  tests/python/wheels.sh "${pythons[@]}"
}

# PyElastica and scilpy, as PyPI has them, with a class of examples/python in the place of their own.
python_peers() {
  needs "${python_packages[@]}" python3-venv
  has_pypi || skip_step "pip does not reach PyPI, which has PyElastica and scilpy"
  build fcl_fibers_python
  local tree=$PWD/build/peers name
  # scilpy has NumPy 1, which every pybind11 knows.
  /usr/bin/python3 -m venv "$tree"
  "$tree/bin/pip" install -q "pyelastica==1.0.0" "scilpy==2.3.0" ||
    skip_step "pip does not install PyElastica and scilpy here"
  for name in pyelastica_contact scilpy_finder; do
    PYTHONPATH=build/release/python "$tree/bin/python" -B "examples/python/$name.py" |
      diff - "examples/python/$name.out"
  done
}

# All threads' suites, of which .ci/run takes one at a time.
threads() {
  .ci/apt_install.sh clang libclang-rt-dev
  tests/thread_sanitized.sh parallel_test "${thread_suites[@]}"
}

# docs/numerics.md: its rows, a million segments in trees of every kind, and the paper's scenes.
extremes() {
  build fcl_fibers_numerics_run scenes_test
  "$numerics" rows
  build/release/tests/numerics_test --gtest_also_run_disabled_tests --gtest_filter='*Million*'
  build/release/tests/scenes_test --gtest_also_run_disabled_tests --gtest_filter='*Long*'
}

# 10^10 pairs of random scenes, decided by exact brute force.
differential() {
  build fcl_fibers_numerics_run
  "$numerics" differential --decisions 1e10 2>&1 | tee build/differential.log
  ! grep '^no hair' build/differential.log || skip "hair, as FCL_FIBERS_DATA has no .tfx"
}

# 10^8 capsules near contact, half of them with triangles, decided exactly.
touches() {
  build fcl_fibers_numerics_run
  "$numerics" touches --decisions 1e8
}

# 10^8 pairs that move, and 10^6 in integers only.
impacts() {
  build fcl_fibers_numerics_run
  "$numerics" impacts --decisions 1e8
  "$numerics" impacts --decisions 1e6 --seed 2 --exact
}

# 10^6 random scenes of managers, of which each 10^5 cover all triples of features. A run that was
# ended goes on at the next time with the part that it was at.
managers() {
  build fcl_fibers_numerics_run
  local finished first
  finished=build/managers-$(git rev-parse HEAD).done
  first=$(cat "$finished" 2>/dev/null || echo 0)
  for (( ; first < 1000000; first += 100000)); do
    "$numerics" managers --scenes 1e5 --first "$first"
    echo $((first + 100000)) >"$finished"
  done
  rm -f "$finished"
}

# The recorded pairs in their order on every instruction set of this machine, by gcc and clang, with and
# without optimization.
pair_order() {
  .ci/apt_install.sh clang
  local compiler optimization
  tests/platforms.sh here
  for compiler in g++ clang++; do
    for optimization in -O0 -O3; do
      local tree=build/pair_order-$compiler$optimization
      cmake -S . -B "$tree" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=$compiler \
        -DCMAKE_CXX_FLAGS_RELEASE=$optimization -DFCL_FIBERS_BUILD_TESTS=ON \
        -DFCL_FIBERS_BUILD_BENCHMARKS=OFF -DFCL_FIBERS_BUILD_TOOLS=OFF
      cmake --build "$tree" --target fcl_fibers_numerics_run
      "$tree/tests/fcl_fibers_numerics_run" hashes | diff tests/data/pair_order/hashes.txt -
      echo "the same by $compiler $optimization"
    done
  done
}

# Other processors, standard libraries and systems. Debian 13 takes an hour, and needs root.
platforms() {
  tests/platforms.sh libcxx
  if ((EUID != 0)); then
    skip "arm64 and Debian 13, which need root"
  else
    has_packages mmdebstrap qemu-user-static g++-aarch64-linux-gnu || return 0
    tests/platforms.sh arm64 debian13
  fi
}

# A browser shows the site's tables and code whole.
site() {
  needs chromium chromium-driver python3-selenium
  docs/build.sh
  /usr/bin/python3 -B tests/readme/site_test.py
}

# Tests of the program and of the label `long`, among them the page of `fcl_fibers view` in Chromium.
long() {
  .ci/apt_install.sh chromium chromium-driver python3-selenium python3-pil
  build fcl_fibers_program_tests
  run_tests release -L 'long|program'
  tests/count_tests.py build/release/results --skipped >build/long-skipped.txt
  ! grep '^page_test' build/long-skipped.txt
}

# More than a million calls of each scalar against the model of a manager.
stateful() {
  local results=build/stateful.xml counts count
  build stateful_test
  RC_PARAMS="seed=${RANDOM} max_success=11000 max_size=400" \
    build/release/tests/stateful_test --gtest_brief=1 --gtest_output=xml:$results
  mapfile -t counts < <(grep -o 'name="commands" value="[0-9]*"' $results | grep -o '[0-9]*')
  ((${#counts[@]} == 2))
  for count in "${counts[@]}"; do
    echo "$count calls"
    ((count > 1000000))
  done
}

# Ten minutes for each fuzzer.
fuzz() {
  tests/fuzz/run.sh 600
}

# FCL_FIBERS_PART=I/N: part I of N alone.
mutation() {
  tests/mutation.py ${FCL_FIBERS_PART:+--part "$FCL_FIBERS_PART"}
}

# A file's fibers by the benchmark program.
hair() {
  build fcl_fibers_bench
  build/release/benchmarks/fcl_fibers_bench --measure=frames --hair=examples/crossing.txt \
    --radius=0.06 --benchmark_out=build/hair.json
  grep -q '"name"' build/hair.json
}

# Every way to build, install and link the library. Installs a Debian package, and removes it.
consumers() {
  tests/consumers.sh
}

# Whether package.xml is one, and colcon builds and installs the library by it, so that a package
# behind it finds it. Debian's packages of both are for /usr/bin/python3.
ros() {
  needs python3-catkin-pkg
  /usr/bin/python3 -c '
import sys
from catkin_pkg.package import parse_package
warnings = []
package = parse_package("package.xml", warnings=warnings)
package.evaluate_conditions({})
sys.exit("\n".join(warnings) or package.get_build_type() != "cmake" and "package.xml: not cmake")'

  has_packages colcon python3-colcon-ros ninja-build || return 0
  local tree=$PWD/build/colcon
  rm -rf "$tree"
  colcon --log-base "$tree/log" build --paths . --event-handlers console_direct+ \
    --build-base "$tree/build" --install-base "$tree/installed" --cmake-args -G Ninja \
    -DCMAKE_BUILD_TYPE=Release -DBUILD_TESTING=OFF -DFCL_FIBERS_BUILD_IO=ON \
    -DFCL_FIBERS_BUILD_BENCHMARKS=OFF -DFCL_FIBERS_BUILD_TOOLS=OFF
  (
    set +u  # setup.sh reads variables that are not set
    # shellcheck disable=SC1091
    . "$tree/installed/setup.sh"
    cmake -S tests/consumer -B "$tree/consumer" -G Ninja -DCMAKE_BUILD_TYPE=Release
    grep -q "^fcl_fibers_DIR:PATH=$tree/installed/" "$tree/consumer/CMakeCache.txt"
    cmake --build "$tree/consumer"
    ctest --test-dir "$tree/consumer" --output-on-failure
  )
}

# DART from its package steps a world with our managers in the place of FCL's tree.
dart() {
  needs libdart-dev pkg-config
  local tree=$PWD/build/dart
  build fcl_fibers fcl_fibers_io fcl_fibers_program
  rm -rf "$tree"
  cmake --install build/release --prefix "$tree/installed" >/dev/null
  cmake -S tests/clients/dart -B "$tree/program" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_CXX_FLAGS=-Werror -DCMAKE_PREFIX_PATH="$tree/installed"
  cmake --build "$tree/program"
  "$tree/program/dart_ropes"
}

# VTK reads what the program writes for it.
vtk() {
  needs python3-vtk9
  build fcl_fibers_program
  FCL_FIBERS_PROGRAM=build/release/tools/fcl_fibers /usr/bin/python3 -B tests/tools/vtk_test.py
}

steps=(
  clang
  simd
  flush_to_zero
  all_managers
  threads
  sanitized
  simd_sanitized
  python_sanitized
  python_long
  wheels
  python_peers
  extremes
  differential
  touches
  impacts
  managers
  pair_order
  platforms
  stateful
  fuzz
  mutation
  consumers
  ros
  dart
  hair
  vtk
  site
  long
)

if (($# > 0)); then
  steps=("$@")
fi
run_steps "${steps[@]}"
if ((skipped_steps == ${#steps[@]})); then
  echo "Nothing has run." >&2
  exit 1
fi
