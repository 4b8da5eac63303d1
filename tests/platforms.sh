#!/usr/bin/env bash
# Other processors, standard libraries and systems than this one's: builds and tests the library for
# each, and compares pairs and their order with the recorded ones, bit for bit.
#
#   tests/platforms.sh [STEP...]    these steps alone, functions below
#
# Everything is under build/platforms. QEMU runs the programs of arm64, and Debian 13 is in a chroot.
# Both need root.
set -euo pipefail
cd "$(dirname "$0")/.."

work=$PWD/build/platforms
recorded=tests/data/pair_order/hashes.txt
mkdir -p "$work"

# compare LINES LEVELS PROGRAM...: what the program prints on each of these instruction sets is what was
# recorded, from lines that match. A level in brackets may be missing.
compare() {
  local lines=$1 levels=$2 level
  shift 2
  for level in $levels; do
    if ! FCL_FIBERS_SIMD=${level//[()]/} "$@" >"$work/hashes" 2>"$work/errors"; then
      [[ $level == \(* ]] && grep -q 'is not available here' "$work/errors" && continue
      cat "$work/errors" >&2
      return 1
    fi
    grep "$lines" "$recorded" | diff - "$work/hashes"
    echo "the recorded pairs in their order, with FCL_FIBERS_SIMD=${level//[()]/}"
  done
}
x86='scalar sse4 (avx2) (avx512)'
arm='scalar neon'

# array_order NAME CMAKE_ARGUMENTS...: builds the tree over arrays and the program of its hashes.
array_order() {
  cmake -S tests/platforms -B "$work/$1" -G Ninja -DCMAKE_BUILD_TYPE=Release "${@:2}"
  cmake --build "$work/$1"
}

# sysroot NAME PACKAGE...: unpacks these of arm64 and what they depend on.
sysroot() {
  sysroot=$work/$1
  .ci/apt_install.sh cmake ninja-build g++-aarch64-linux-gnu qemu-user-static mmdebstrap
  [[ ! -d $sysroot ]] || return 0
  rm -rf "$sysroot.part"
  # shellcheck disable=SC1091
  . /etc/os-release
  local packages=("${@:2}" libc6-dev libstdc++-"$(aarch64-linux-gnu-g++ -dumpversion)"-dev)
  mmdebstrap --architectures=arm64 --variant=extract --include="$(IFS=, && echo "${packages[*]}")" \
    "$VERSION_CODENAME" "$sysroot.part"
  # Debian's ccd names this library by its path on a machine of arm64.
  find "$sysroot.part" -name 'ccd-targets*.cmake' \
    -exec sed -i 's#/usr/lib/aarch64-linux-gnu/libm.so#m#' {} +
  # Since Debian 13 this link is no part of the C library's package.
  [[ -e $sysroot.part/lib ]] || ln -s usr/lib "$sysroot.part/lib"
  mv "$sysroot.part" "$sysroot"
}

# --- Steps ---

# This system, in the release tree; not of the default steps.
here() {
  cmake --build --preset release --target fcl_fibers_numerics_run
  compare . "$x86" build/release/tests/fcl_fibers_numerics_run hashes --threads 3
}

# The tree over arrays on 64-bit ARM.
arm64_arrays() {
  sysroot arm64_arrays_root libhwy-dev libtbb-dev
  array_order arm64_arrays --toolchain "$PWD/tests/platforms/arm64.cmake" \
    -DFCL_FIBERS_SYSROOT="$sysroot" -DCMAKE_CXX_FLAGS=-Werror
  compare '^arrays' "$arm" qemu-aarch64-static -L "$sysroot" "$work/arm64_arrays/array_order" 3
}

# With clang's standard library, which sorts and selects otherwise than gcc's.
libcxx() {
  .ci/apt_install.sh cmake ninja-build clang libc++-dev libc++abi-dev libhwy-dev libtbb-dev
  array_order libcxx -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_CXX_FLAGS='-stdlib=libc++ -Werror'
  compare '^arrays' "$x86" "$work/libcxx/array_order" 3
}

# All tests of the library on 64-bit ARM.
arm64() {
  sysroot arm64_root libfcl-dev libccd-dev libeigen3-dev libhwy-dev libtbb-dev libpugixml-dev \
    zlib1g-dev libboost-dev libgtest-dev libgmock-dev librapidcheck-dev libcli11-dev
  cmake -S . -B "$work/arm64" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS=-Werror \
    --toolchain "$PWD/tests/platforms/arm64.cmake" -DFCL_FIBERS_SYSROOT="$sysroot" \
    -DFCL_FIBERS_BUILD_{MANAGERS,IO,TESTS}=ON -DFCL_FIBERS_BUILD_{BENCHMARKS,TOOLS,PYTHON}=OFF
  cmake --build "$work/arm64" --target fcl_fibers_tests io_test fcl_fibers_numerics_run
  compare . "$arm" qemu-aarch64-static -L "$sysroot" "$work/arm64/tests/fcl_fibers_numerics_run" \
    hashes --threads 3
  # These start their own program again, which QEMU does not do.
  export GTEST_FILTER='-SimdEnvironment.*'
  local test=(ctest --test-dir "$work/arm64" -j "$(nproc)" --output-on-failure --no-tests=error
    --timeout 5400)
  "${test[@]}" -R _test -LE 'other|program|long' -E meshes_test  # it takes too long
  "${test[@]}" -R '^io_test'
}

# Debian 13: what is committed, with its compilers, Highway and oneTBB.
debian13() {
  local root=$work/debian13
  .ci/apt_install.sh mmdebstrap
  if [[ ! -d $root ]]; then
    rm -rf "$root.part"
    mmdebstrap --include=git,ca-certificates trixie "$root.part"
    mv "$root.part" "$root"
  fi
  rm -rf "$root/src"
  git clone -q . "$root/src"
  cat >"$root/src/debian13.sh" <<'END'
set -e
cd /src
export HOME=/root
.ci/run packages tests hashes program
tests/full.sh clang
tests/platforms.sh libcxx arm64_arrays
KINDS=shared WAYS=find_package tests/consumers.sh linked standards
END
  # shellcheck disable=SC2016
  unshare --mount bash -c '
    mount -t proc proc "$0/proc"
    mount --rbind /dev "$0/dev"
    chroot "$0" bash /src/debian13.sh' "$root"
}

steps=(arm64_arrays libcxx arm64 debian13)
if (($# > 0)); then
  steps=("$@")
fi
for step in "${steps[@]}"; do
  printf '\n== platforms: %s ==\n' "$step"
  "$step"
done
