#!/usr/bin/env bash
# What takes too long for every day; tests/run.sh --full runs all of it behind the quick tests.
#
#   tests/full.sh [STEP...]    these steps alone, of a tree that tests/run.sh has built
#
# A step is a function below and a name in `steps`; it ends with an error where it finds one.
set -euo pipefail
cd "$(dirname "$0")/.."

# The library's assertions, which Release leaves out.
assertions() {
  cmake --preset debug
  cmake --build --preset debug
  ctest --preset debug -j "$(nproc)"
}

steps=(
  assertions
)

if (($# > 0)); then
  steps=("$@")
fi
for step in "${steps[@]}"; do
  printf '\n== %s ==\n' "$step"
  "$step"
done
