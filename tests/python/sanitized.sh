#!/usr/bin/env bash
# The tests of the Python package under AddressSanitizer and UndefinedBehaviorSanitizer, in a build of
# its own with what the package needs alone:
#
#   tests/python/sanitized.sh [ARGUMENTS OF PYTEST...]
set -euo pipefail
cd "$(dirname "$0")/../.."

python=/usr/bin/python3
tree=$PWD/build/python-sanitize
# One level of instructions, as in the preset `sanitize`. By gcc, whose sanitizers are shared
# libraries, so that an interpreter without them can load them first.
cmake -S . -B "$tree" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_COMPILER=g++ \
  -DCMAKE_CXX_FLAGS="-O1 -g1 -msse4.2 -mpclmul -maes -DHWY_COMPILE_ONLY_STATIC \
-DFCL_FIBERS_ALWAYS_INLINE=inline -fsanitize=address,undefined -fno-sanitize-recover=all" \
  -DFCL_FIBERS_BUILD_MANAGERS=OFF -DFCL_FIBERS_BUILD_IO=ON -DFCL_FIBERS_BUILD_PYTHON=ON \
  -DFCL_FIBERS_BUILD_TESTS=OFF -DFCL_FIBERS_BUILD_BENCHMARKS=OFF -DFCL_FIBERS_BUILD_TOOLS=OFF \
  -DPython3_EXECUTABLE=$python
cmake --build "$tree" --target fcl_fibers_python

# Python's own allocator would hide small blocks from the sanitizer, and the interpreter keeps some
# until its end. An allocation that cannot be fulfilled is an exception here as everywhere.
preload="$(g++ -print-file-name=libasan.so) $(g++ -print-file-name=libubsan.so)"
LD_PRELOAD=$preload PYTHONMALLOC=malloc PYTHONPATH=$tree/python \
  ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1 UBSAN_OPTIONS=print_stacktrace=1 \
  $python -B -m pytest -q -p no:cacheprovider tests/python "$@"
