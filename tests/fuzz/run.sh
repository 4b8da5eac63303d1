#!/usr/bin/env bash
# Installs what is missing, builds the fuzzers and runs each of them for some seconds, which are 600
# unless given, from the kept corpus on; all of them or those named:
#   tests/fuzz/run.sh [SECONDS [FUZZER...]]
# Inputs that reach further are added to build/fuzz/corpus; an input that fails is written to
# build/fuzz/failures, and fails again by  build/fuzz/tests/fuzz/FUZZER FILE
# To keep what a long run has found, as few and as short inputs as possible:
#   build/fuzz/tests/fuzz/FUZZER -merge=1 tests/fuzz/corpus/FUZZER build/fuzz/corpus/FUZZER
set -euo pipefail
cd "$(dirname "$0")/../.."

seconds=${1:-600}
shift || true

.ci/apt_install.sh cmake ninja-build clang libclang-rt-dev libfcl-dev libccd-dev libeigen3-dev \
  libhwy-dev libtbb-dev libpugixml-dev zlib1g-dev
cmake --preset fuzz
if (($# == 0)); then
  mapfile -t fuzzers <build/fuzz/tests/fuzz/fuzzers.txt
  set -- "${fuzzers[@]}"
fi
cmake --build --preset fuzz --target "$@"
for fuzzer in "$@"; do
  printf '\n== %s, %s s ==\n' "$fuzzer" "$seconds"
  mkdir -p "build/fuzz/corpus/$fuzzer" "build/fuzz/failures/$fuzzer"
  build/fuzz/tests/fuzz/"$fuzzer" "build/fuzz/corpus/$fuzzer" "tests/fuzz/corpus/$fuzzer" \
    -artifact_prefix="build/fuzz/failures/$fuzzer/" -max_total_time="$seconds" -timeout=10 \
    -len_control=0 -print_final_stats=1 -verbosity=0
done
