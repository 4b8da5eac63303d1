#!/usr/bin/env bash
# Runs tests that are built, by ctest, and counts those of GoogleTest within them:
#
#   tests/run_tests.sh PRESET [CTEST ARGUMENTS]
#
# Ends with a line of how many have passed, failed and been skipped, and those skipped and why. Fails
# if no test is there.
set -euo pipefail
cd "$(dirname "$0")/.."

results=$PWD/build/$1/results
rm -rf "$results"
mkdir -p "$results"
status=0
ctest --preset "$1" -j "$(nproc)" --no-tests=error --output-junit "$results/ctest.xml" "${@:2}" ||
  status=$?
tests/count_tests.py "$results"
exit "$status"
