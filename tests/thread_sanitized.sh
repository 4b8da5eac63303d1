#!/usr/bin/env bash
# What these suites do on several threads, under ThreadSanitizer:
#
#   tests/thread_sanitized.sh SUITE...
set -euo pipefail
cd "$(dirname "$0")/.."

export TSAN_OPTIONS="suppressions=$PWD/tests/thread_sanitizer_suppressed.txt ${TSAN_OPTIONS:-}"
cmake --preset thread-sanitize
cmake --build --preset thread-sanitize --target "$@"
for suite in "$@"; do
  filter='*Threads*:*VisitInParallel*:*PairSearchTest*:BlockPool*:*WithoutMotion*:*HandedOn*:*Named*:*LeastIsRefused*:*TwoManagers*:*MayBeMade*'
  [[ $suite != parallel_test ]] || filter='*'
  test=("build/thread-sanitize/tests/$suite" --gtest_filter="$filter")
  if ! "${test[@]}" --gtest_list_tests | grep '^ ' >/dev/null; then
    echo "tests/thread_sanitized.sh: the filter has no test of $suite" >&2
    exit 1
  fi
  "${test[@]}" --gtest_brief=1
done
