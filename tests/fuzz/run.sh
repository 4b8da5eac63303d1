#!/usr/bin/env bash
# Installs what is missing, builds the fuzzers and runs each of them for some seconds, which are 600
# unless given, from the kept corpus on; all of them or those named:
#   tests/fuzz/run.sh [--tree TREE] [SECONDS [FUZZER...]]
# 0 seconds: the kept inputs alone.
# --tree takes those of a tree that is built already with FCL_FIBERS_BUILD_FUZZERS=ON; in build/fuzz,
# the one that is built here, the library counts what they reach.
# Inputs that reach further are added to TREE/corpus; an input that fails is written to
# TREE/failures, and fails again by  TREE/tests/fuzz/FUZZER FILE
# To keep what a long run has found, as few and as short inputs as possible:
#   build/fuzz/tests/fuzz/FUZZER -merge=1 tests/fuzz/corpus/FUZZER build/fuzz/corpus/FUZZER
set -euo pipefail
cd "$(dirname "$0")/../.."

tree=build/fuzz
if [[ ${1:-} == --tree ]]; then
  tree=$2
  shift 2
else
  .ci/apt_install.sh cmake ninja-build clang libclang-rt-dev libfcl-dev libccd-dev libeigen3-dev \
    libhwy-dev libtbb-dev libpugixml-dev zlib1g-dev libboost-dev
  cmake --preset fuzz
  cmake --build --preset fuzz --target fuzzers
fi
seconds=${1:-600}
shift || true

if (($# == 0)); then
  mapfile -t fuzzers <"$tree/tests/fuzz/fuzzers.txt"
  set -- "${fuzzers[@]}"
fi
until=(-max_total_time="$seconds" -len_control=0)
((seconds > 0)) || until=(-runs=0)
for fuzzer in "$@"; do
  printf '\n== %s, %s s ==\n' "$fuzzer" "$seconds"
  mkdir -p "$tree/corpus/$fuzzer" "$tree/failures/$fuzzer"
  "$tree/tests/fuzz/$fuzzer" "$tree/corpus/$fuzzer" "tests/fuzz/corpus/$fuzzer" \
    -artifact_prefix="$tree/failures/$fuzzer/" "${until[@]}" -timeout=10 \
    -print_final_stats=1 -verbosity=0
done
