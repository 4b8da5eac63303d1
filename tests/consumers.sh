#!/usr/bin/env bash
# Programs outside the tree that use an installed copy in every way it is meant for: gcc and clang,
# shared and static; find_package, pkg-config, add_subdirectory; what is left out of a build; and
# what must not compile or run.
#
#   tests/consumers.sh [--installed PREFIX] [STEP...]    these steps alone, functions below
#
# --installed PREFIX   gcc's shared libraries, with all parts, are there: no step builds them
# COMPILERS, KINDS and WAYS in the environment: of what is in `linked`, these alone, as in
#   COMPILERS=g++ KINDS=static WAYS="pkg_config add_subdirectory" tests/consumers.sh linked
# COMPILERS is heeded by `flags`, `standards`, `lto` and `hidden` too.
#
# Everything is built under build/consumers; the step `deb` installs a package and removes it again.
set -euo pipefail
cd "$(dirname "$0")/.."

.ci/apt_install.sh cmake ninja-build g++ clang pkg-config binutils dpkg-dev file libfcl-dev \
  libccd-dev libeigen3-dev libhwy-dev libtbb-dev libpugixml-dev zlib1g-dev libcli11-dev \
  libfmt-dev nlohmann-json3-dev libjs-three

work=$PWD/build/consumers
mkdir -p "$work"
compilers=${COMPILERS:-g++ clang++}
kinds=${KINDS:-shared static}
ways=${WAYS:-find_package pkg_config add_subdirectory}
given=
if [[ ${1:-} == --installed ]]; then
  given=$(realpath -- "$2")
  shift 2
fi

fail() {
  echo "tests/consumers.sh: $1" >&2
  exit 1
}

# configure COMPILER BUILD_DIR SOURCE_DIR ARGUMENTS...
configure() {
  local compiler=$1 build=$2 source=$3
  shift 3
  cmake -S "$source" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_CXX_COMPILER="$compiler" "$@" >/dev/null
}

# build NAME COMPILER shared|static [ARGUMENTS...]: builds and installs; sets `built` and `prefix`.
build() {
  local name=$1 compiler=$2 kind=$3
  shift 3
  built=$work/$name/library
  [[ $kind == shared ]] && local shared=ON || local shared=OFF
  configure "$compiler" "$built" . -DBUILD_SHARED_LIBS=$shared -DFCL_FIBERS_BUILD_IO=ON \
    -DFCL_FIBERS_BUILD_{TESTS,BENCHMARKS,TOOLS,PYTHON}=OFF "$@"
  cmake --build "$built"
  rm -rf "$work/$name/installed"
  cmake --install "$built" --prefix "$work/$name/installed" >/dev/null
  use "$work/$name/installed"
}

use() {  # PREFIX
  prefix=$1
  PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name fcl_fibers_tree.pc)")
  export PKG_CONFIG_PATH
}

# library COMPILER KIND: the same with all parts but the program, or what was given.
library() {
  if [[ -n $given && $1-$2 == g++-shared ]]; then
    use "$given"
  else
    build "$1-$2" "$1" "$2"
  fi
}

run_consumer() {
  cmake --build "$1"
  ctest --test-dir "$1" --output-on-failure
}

by_find_package() {  # COMPILER KIND
  configure "$1" "$work/$1-$2/find_package" tests/consumer -DCMAKE_PREFIX_PATH="$prefix"
  run_consumer "$work/$1-$2/find_package"
}

by_pkg_config() {  # COMPILER KIND
  local flags program
  mkdir -p "$work/$1-$2"
  flags=$(pkg-config --cflags --libs fcl_fibers fcl_fibers_io)
  ! grep -qE -- '-std=|-m[a-z]' <<<"$flags" || fail "pkg-config hands on: $flags"
  for program in main contacts file errors; do
    # shellcheck disable=SC2086
    "$1" -std=c++17 -O1 -Wall -Wextra -Werror tests/consumer/$program.cpp \
      -o "$work/$1-$2/$program" $flags
    LD_LIBRARY_PATH=$(pkg-config --variable=libdir fcl_fibers) "$work/$1-$2/$program"
  done
}

by_add_subdirectory() {  # COMPILER KIND
  [[ $2 == shared ]] && local shared=ON || local shared=OFF
  configure "$1" "$work/$1-$2/add_subdirectory" tests/consumer -DFCL_FIBERS_SOURCE_DIR="$PWD" \
    -DBUILD_SHARED_LIBS=$shared
  run_consumer "$work/$1-$2/add_subdirectory"
}

# --- Steps ---

linked() {
  local compiler kind way
  for compiler in $compilers; do
    for kind in $kinds; do
      for way in $ways; do
        printf -- '-- %s, %s, %s\n' "$compiler" "$kind" "$way"
        [[ $way == add_subdirectory ]] || library "$compiler" "$kind"
        "by_$way" "$compiler" "$kind"
      done
    done
  done
}

private='fcl_fibers::(arrays|broadphase|fibers|geometry|index|parallel|simd|tree)::'

# private_names LETTER LIBRARY: classes and functions that a library defines (T) or calls (U).
private_names() {
  nm -DC "$2" | sed -nE "s/^[0-9a-f]* *$1 ($private\w+).*@FCL_FIBERS_CORE_.*/\1/p" | sort -u
}

# What a shared library shows, and what is installed beside it.
installed() {
  library g++ shared
  local name so symbols
  so=$(find "$prefix" -name libfcl_fibers.so)
  diff <(private_names T "${so/%.so/_tree.so}") <(private_names U "$so") ||
    fail "of its core the tree has to export what the managers call (>), and no more (<)"
  mixed "$(dirname "$so")"
  for name in fcl_fibers_tree fcl_fibers fcl_fibers_io; do
    so=$(find "$prefix" -name "lib$name.so")
    [[ $(objdump -p "$so") == *"SONAME"*"lib$name.so.0.1"* ]] || fail "SONAME of $so"
    symbols=$(nm -DC --defined-only "$so")
    ! grep -E "$private" <<<"$symbols" | grep -v '@@FCL_FIBERS_CORE_' ||
      fail "these are private, and exported by $so"
    # Weak are FCL's and the standard library's templates.
    ! grep -E ' [TDBR] ' <<<"$symbols" | grep -v fcl_fibers || fail "these are not for $so to export"
  done
  ! grep -rnE --include='*.cmake' --include='*.pc' -- '-m(arch|tune|avx|sse|fma)' "$prefix/lib" ||
    fail "flags of an instruction set are exported"
  for file in share/fcl_fibers/package.xml share/ament_index/resource_index/packages/fcl_fibers \
    include/fcl_fibers/{version,export,tree_export,contact}.h; do
    [[ -f $prefix/$file ]] || fail "$file is not installed"
  done
  local version
  version=$(pkg-config --modversion fcl_fibers)
  grep -q "<version>$version</version>" package.xml || fail "package.xml is not of version $version"
  grep -qx "version: $version" CITATION.cff || fail "CITATION.cff is not of version $version"
}

# mixed FOLDER: the managers there do not load with a tree of other sources.
mixed() {
  local both=$work/mixed name
  rm -rf "$both"
  mkdir -p "$both"
  for name in fcl_fibers fcl_fibers_tree; do
    cp "$1/lib$name.so" "$both/lib$name.so.0.1"
  done
  local load=(env LD_LIBRARY_PATH="$both" LD_PRELOAD=libfcl_fibers.so.0.1 true)
  "${load[@]}"
  sed -i 's/FCL_FIBERS_CORE_./FCL_FIBERS_CORE_x/' "$both/libfcl_fibers_tree.so.0.1"
  refused "' not found (required by" "${load[@]}"
}

# The examples, as they are installed.
examples() {
  local said
  library g++ shared
  configure_examples "$prefix"
  run_consumer "$work/examples"
}

# configure_examples PREFIX ARGUMENTS...: sets `said` to what CMake says.
configure_examples() {
  rm -rf "$work/examples"
  said=$(cmake -S "$1/share/doc/fcl_fibers/examples" -B "$work/examples" -G Ninja \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=g++ -DCMAKE_PREFIX_PATH="$1" "${@:2}")
}

# left_out_examples NAMES ARGUMENTS...: leaves out these, each with a line that names what it needs.
left_out_examples() {
  configure_examples "$work/fewer_examples" "${@:2}"
  diff <(sed -nE 's/^-- The example (\w+) is left out, because it needs fcl_fibers::.*/\1/p' \
    <<<"$said" | xargs) <(echo "$1") || fail "leaves out other examples (<) than it has to (>)"
}

# The examples where only some of the libraries are installed, or FCL is not.
fewer_examples() {
  local said config of_managers='swap shadow harness obstacles file_to_manager own_manager'
  local of_io='hair_step hair_head safe_steps gust yarn hair_contacts'
  library g++ shared
  rm -rf "$work/fewer_examples"
  cp -a "$prefix" "$work/fewer_examples"
  config=$(dirname "$(find "$work/fewer_examples" -name fcl_fibers-config.cmake)")
  left_out_examples "$of_managers" -DCMAKE_DISABLE_FIND_PACKAGE_fcl=ON
  grep -qx -- '-- fcl_fibers is found without the component managers, which needs fcl' <<<"$said" ||
    fail "does not say why: $said"
  rm -f "$config"/fcl_fibers-benchmark-targets*
  left_out_examples own_manager
  mv "$config"/fcl_fibers-io-targets* "$work/fewer_examples"
  left_out_examples "$of_io ${of_managers/shadow /}"
  rm "$config"/fcl_fibers-managers-targets*
  left_out_examples "$of_io $of_managers"
  run_consumer "$work/examples"
  mv "$work/fewer_examples"/fcl_fibers-io-targets* "$config"
  left_out_examples "$of_managers"
}

# refused MESSAGE COMMAND...: it fails, and says so.
refused() {
  local message=$1 said
  shift
  if said=$("$@" 2>&1); then fail "succeeds: $*"; fi
  grep -qF -- "$message" <<<"$said" || fail "no '$message' from: $* ... $said"
}

# The library for one instruction set compiles quickly.
sse4_alone='-msse4.2 -mpclmul -maes -DHWY_COMPILE_ONLY_STATIC'

# What is not installed is left out of a build, and is an error if it is asked for.
left_out() {
  local tree=$work/left_out/configured said part
  local without=(-DCMAKE_DISABLE_FIND_PACKAGE_{GTest,benchmark,threejs}"=ON")
  rm -rf "$tree"
  said=$(cmake -S . -B "$tree" -G Ninja "${without[@]}")
  for part in TESTS:GTest BENCHMARKS:benchmark TOOLS:threejs; do
    grep -qx -- "-- FCL_FIBERS_BUILD_${part%:*} is OFF, because CMake has not found ${part#*:}" \
      <<<"$said" ||
      fail "does not leave out $part: $said"
  done
  refused 'FCL_FIBERS_BUILD_TESTS=ON needs what CMake has not found: GTest' \
    cmake -S . -B "$tree" -DFCL_FIBERS_BUILD_TESTS=ON
  cmake -S . -B "$tree" "${without[@]/%ON/OFF}" -DFCL_FIBERS_BUILD_TESTS=AUTO -DBUILD_TESTING=OFF
  ! grep -q geometry_test "$tree/build.ninja" || fail "BUILD_TESTING=OFF builds tests"

  build left_out g++ shared -DCMAKE_BUILD_TYPE=Debug -DFCL_FIBERS_BUILD_IO=AUTO \
    -DCMAKE_DISABLE_FIND_PACKAGE_pugixml=ON
  [[ ! -e $prefix/include/fcl_fibers/io ]] || fail "headers of io are installed without it"
  ! pkg-config --exists fcl_fibers_io || fail "fcl_fibers_io.pc is installed without the library"
  refused 'FCL_FIBERS_BUILD_IO=ON' configure g++ "$work/left_out/consumer" tests/consumer \
    -DCMAKE_PREFIX_PATH="$prefix" -DWITHOUT_FCL=ON
  # shellcheck disable=SC2046
  g++ -std=c++17 tests/consumer/contacts.cpp -o "$work/left_out/contacts" \
    $(pkg-config --cflags --libs fcl_fibers_tree)
  LD_LIBRARY_PATH=$(pkg-config --variable=libdir fcl_fibers) "$work/left_out/contacts"
}

# README's commands build what they install, and nothing else, whatever else is found.
commands() {
  local tree=$work/commands options said line
  options=$(sed -n '/^cmake -S \. -B build/,/[^\\]$/p' README.md | grep -oE -- '-D[A-Z_]+=[A-Z]+')
  rm -rf "$tree"
  # Where CMake would run again, -n ends.
  # shellcheck disable=SC2086
  configure g++ "$tree" . $options -DCMAKE_SUPPRESS_REGENERATION=ON
  said=$(ninja -C "$tree" -n)
  grep -q 'Linking CXX shared library src/libfcl_fibers_tree\.so' <<<"$said" || fail "builds: $said"
  while read -r line; do
    grep -qF "/${line##* }\"" "$tree"/cmake_install.cmake "$tree"/src/cmake_install.cmake ||
      fail "README's commands build what they do not install: $line"
  done < <(sed -nE 's/^\[[0-9/]+\] //p' <<<"$said" |
    grep -vE '^(Building CXX object src/|Creating library symlink )')
}

# Of the libraries that do not need FCL: no header reads one of FCL's, nor of what FCL needs, no library
# is linked with it, and a program finds them as if it were not installed. Hidden from the build, it is
# not needed to build and install them.
tree() {
  local hidden=(-DCMAKE_DISABLE_FIND_PACKAGE_{fcl,ccd,octomap,Eigen3}"=ON") header read name flags
  rm -rf "$work/tree"
  library g++ shared
  for header in contact fiber_options fiber_polylines fiber_tree tree_export triangle_mesh version \
    io/export io/export_geometry io/fiber_file io/sampling; do
    read=$(g++ -std=c++17 -M -I"$prefix/include" "$prefix/include/fcl_fibers/$header.h") ||
      fail "$header.h does not compile by itself"
    ! grep -oE '/(fcl|ccd|octomap|eigen3|Eigen)/[^ ]*' <<<"$read" || fail "$header.h reads these"
  done
  for name in fcl_fibers_tree fcl_fibers_io; do
    ! readelf -d "$(find "$prefix" -name "lib$name.so")" |
      grep -E 'NEEDED.*lib(fcl\.|fcl_fibers\.|ccd|octo)' || fail "lib$name.so needs more than it may"
  done
  configure g++ "$work/tree/of_all" tests/consumer -DWITHOUT_FCL=ON -DCMAKE_PREFIX_PATH="$prefix" \
    "${hidden[@]}"
  run_consumer "$work/tree/of_all"
  configure g++ "$work/tree/optional" tests/consumer -DWITHOUT_FCL=ON -DOPTIONAL=managers \
    -DCMAKE_PREFIX_PATH="$prefix" "${hidden[@]}"

  # Without optimization, which compiles quickly.
  build tree g++ shared -DCMAKE_BUILD_TYPE=Debug "${hidden[@]}" -DCMAKE_CXX_FLAGS="$sse4_alone"
  [[ ! -e $prefix/include/fcl_fibers/export.h ]] || fail "a header of the managers is installed"
  refused 'has no component managers' configure g++ "$work/tree/managers" tests/consumer \
    -DCMAKE_PREFIX_PATH="$prefix" -DCOMPONENTS=managers
  flags=$(pkg-config --cflags --libs fcl_fibers_io)
  # shellcheck disable=SC2086
  g++ -std=c++17 tests/consumer/file.cpp -o "$work/tree/file" $flags
  LD_LIBRARY_PATH=$(pkg-config --variable=libdir fcl_fibers_io) "$work/tree/file"
}

# What Eigen needs to be told beside -march=native, for FCL's objects to have the layout that they have
# in FCL's binary; the messages say so.
mended=-DEIGEN_MAX_ALIGN_BYTES=16

flags() {
  library g++ shared
  local compile compiler
  for compiler in $compilers; do
    # shellcheck disable=SC2207
    compile=("$compiler" -std=c++17 -fsyntax-only tests/consumer/main.cpp
      $(pkg-config --cflags fcl_fibers))
    "${compile[@]}" -msse4.2
    refused "add $mended" "${compile[@]}" -mavx
    refused "add $mended" "${compile[@]}" -mavx512f -mfma
    refused "add $mended" "${compile[@]}" -march=skylake-avx512
    refused "add $mended" "${compile[@]}" -mavx -DEIGEN_MAX_STATIC_ALIGN_BYTES=16
    "${compile[@]}" -march=skylake-avx512 $mended
    refused 'fcl_fibers needs C++17' "${compile[@]/main.cpp/contacts.cpp}" -std=c++11
    # Without FCL's objects there is nothing to be laid out otherwise.
    "${compile[@]/main.cpp/contacts.cpp}" -march=skylake-avx512
  done
  # shellcheck disable=SC2046
  g++ -std=c++17 -O1 -g1 -Wall -Wextra -Werror -march=native $mended -fsanitize=address \
    tests/consumer/native.cpp -o "$work/native" $(pkg-config --cflags --libs fcl_fibers)
  LD_LIBRARY_PATH=$(pkg-config --variable=libdir fcl_fibers) "$work/native"
}

# All public headers, also as newer C++, without a warning.
standards() {
  library g++ shared
  local compiler standard headers
  mapfile -t headers < <(find "$prefix/include" -name '*.h')
  ((${#headers[@]} > 0)) || fail "no header is installed"
  for compiler in $compilers; do
    for standard in c++17 c++20 c++2b; do
      # shellcheck disable=SC2046
      "$compiler" -std=$standard -fsyntax-only -Wall -Wextra -Wpedantic -Wconversion -Werror \
        -isystem /usr/include/eigen3 "${headers[@]/#/-include}" tests/consumer/main.cpp \
        $(pkg-config --cflags fcl_fibers_io fcl_fibers)
    done
  done
}

# consumer_20 COMPILER BUILD_DIR ARGUMENTS...: the programs as C++20, by find_package.
consumer_20() {
  configure "$1" "$2" tests/consumer -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_STANDARD=20 \
    -DCMAKE_CXX_FLAGS='-Wall -Wextra -Werror' "${@:3}"
  run_consumer "$2"
}

# Static libraries and a program, all built for optimization at link time.
lto() {
  .ci/apt_install.sh llvm
  local compiler sections lto=-DCMAKE_INTERPROCEDURAL_OPTIMIZATION=ON
  for compiler in $compilers; do
    build "lto-$compiler" "$compiler" static $lto -DCMAKE_CXX_FLAGS_RELEASE=-O1 \
      -DCMAKE_CXX_FLAGS="$sse4_alone"
    consumer_20 "$compiler" "$work/lto-$compiler/consumer" $lto
    # gcc would fuse the multiply-adds of what is kept for link time, by the program's flags.
    sections=$(readelf -SW "$built"/src/*.a 2>/dev/null) || [[ $compiler == clang* ]]
    [[ $sections != *.gnu.lto_.opts* ]] ||
      fail "gcc can inline functions of the libraries into a program"
  done
}

# The library without optimization, with the assertions of the standard library and hidden symbols,
# and a program with the same; what a project sets for link time is heeded here too.
hidden() {
  local compiler settings=(-DCMAKE_BUILD_TYPE=Debug
    -DCMAKE_CXX_FLAGS_DEBUG='-O0 -D_GLIBCXX_ASSERTIONS'
    -DCMAKE_CXX_VISIBILITY_PRESET=hidden -DCMAKE_VISIBILITY_INLINES_HIDDEN=ON
    -DCMAKE_INTERPROCEDURAL_OPTIMIZATION=ON)
  for compiler in $compilers; do
    build "hidden-$compiler" "$compiler" shared "${settings[@]}" -DCMAKE_CXX_FLAGS="$sse4_alone"
    consumer_20 "$compiler" "$work/hidden-$compiler/consumer" "${settings[@]}"
  done
}

# A compiler for 32 bits gets no further than the message.
bits_32() {
  .ci/apt_install.sh g++-arm-linux-gnueabihf
  library g++ shared
  local compiler=arm-linux-gnueabihf-g++
  # shellcheck disable=SC2046
  refused 'fcl_fibers needs a 64-bit system' $compiler -std=c++17 -fsyntax-only \
    tests/consumer/contacts.cpp $(pkg-config --cflags fcl_fibers_tree)
  rm -rf "$work/bits_32"
  refused 'fcl_fibers needs a 64-bit system' configure $compiler "$work/bits_32" .
}

# No source of the libraries compiles with -ffast-math; a program may, and is linked with it.
fast_math() {
  local tree=$work/fast_math/configured
  rm -rf "$tree"
  configure g++ "$tree" . -DCMAKE_CXX_FLAGS='-ffast-math -Wfatal-errors' -DFCL_FIBERS_BUILD_IO=ON \
    -DFCL_FIBERS_BUILD_{TESTS,BENCHMARKS,TOOLS,PYTHON}=OFF
  refused 'remove -ffast-math' cmake --build "$tree" -- -k 0
  [[ -z $(find "$tree/src" -name '*.o') ]] || fail "compiled with -ffast-math: $(find "$tree/src" -name '*.o')"

  library g++ shared
  # shellcheck disable=SC2046
  g++ -std=c++17 -ffast-math tests/consumer/contacts.cpp -o "$work/fast_math/contacts" \
    $(pkg-config --cflags --libs fcl_fibers_tree)
  LD_LIBRARY_PATH=$(pkg-config --variable=libdir fcl_fibers) "$work/fast_math/contacts"

  # The answers do not depend on the program's flags, nor on what its machine can do.
  local fast=(-O3 -ffast-math) way
  [[ $(uname -m) == x86_64 ]] && grep -qw avx2 /proc/cpuinfo && fast+=(-mavx2 -mfma)
  for way in plain fast; do
    local flags=(-O0)
    [[ $way == fast ]] && flags=("${fast[@]}")
    # shellcheck disable=SC2046
    g++ -std=c++17 "${flags[@]}" tests/consumer/answers.cpp -o "$work/fast_math/$way" \
      $(pkg-config --cflags --libs fcl_fibers_tree)
    LD_LIBRARY_PATH=$(pkg-config --variable=libdir fcl_fibers) "$work/fast_math/$way" \
      >"$work/fast_math/$way.txt"
  done
  [[ $(wc -l <"$work/fast_math/plain.txt") -gt 1000 ]] || fail "the answers are too few"
  cmp "$work/fast_math/"{plain,fast}.txt || fail "${fast[*]} in a program changes the answers"
}

# The library itself laid out as by -march=native on a machine with AVX-512, without its
# instructions; and what the message says to do about it, with the instructions of this machine.
mismatch() {
  local flag=-DEIGEN_MAX_STATIC_ALIGN_BYTES said
  build mismatch g++ shared -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS=$flag=64
  configure g++ "$work/mismatch/consumer" tests/consumer -DCMAKE_PREFIX_PATH="$prefix" \
    -DCMAKE_CXX_FLAGS=$flag=64
  cmake --build "$work/mismatch/consumer"
  if said=$("$work/mismatch/consumer/main" 2>&1); then fail "runs: $said"; fi
  grep -q "does not read back its pose.*add $mended" <<<"$said" || fail "ends by: $said"
  # What needs no object of FCL's works.
  "$work/mismatch/consumer/contacts"
  # shellcheck disable=SC2046
  refused "add $mended" g++ -std=c++17 -fsyntax-only tests/consumer/main.cpp \
    $(pkg-config --cflags fcl_fibers)

  build mended g++ shared -DCMAKE_CXX_FLAGS="-march=native $mended"
  configure g++ "$work/mended/consumer" tests/consumer -DCMAKE_PREFIX_PATH="$prefix"
  run_consumer "$work/mended/consumer"
}

deb() {
  local as_root=() package
  ((EUID == 0)) || as_root=(sudo)
  build g++-shared g++ shared -DFCL_FIBERS_BUILD_TOOLS=ON
  rm -f "$built"/*.deb
  (cd "$built" && cpack -G DEB)
  package=$(echo "$built"/libfcl-fibers-dev_*.deb)
  dpkg-deb --info "$package" | grep -E 'Version|Depends'
  # Of the package itself, for dpkg can be told not to install what is under share/doc.
  dpkg-deb --fsys-tarfile "$package" |
    tar -xO ./usr/share/doc/libfcl-fibers-dev/copyright | cmp - LICENSE ||
    fail "$package has not the licence as its copyright"
  "${as_root[@]}" apt-get install --simulate -qq "$package" >/dev/null ||
    fail "the package's dependencies are not in this release"
  # shellcheck disable=SC2064
  trap "${as_root[*]} dpkg --purge libfcl-fibers-dev" EXIT
  "${as_root[@]}" dpkg -i "$package"
  /usr/bin/fcl_fibers info helix:fibers=2
  configure g++ "$work/deb/find_package" tests/consumer
  run_consumer "$work/deb/find_package"
  unset PKG_CONFIG_PATH
  # shellcheck disable=SC2046
  g++ -std=c++17 tests/consumer/main.cpp -o "$work/deb/main" \
    $(pkg-config --cflags --libs fcl_fibers)
  "$work/deb/main"
}

steps=(
  linked installed commands tree examples fewer_examples left_out flags standards lto hidden bits_32
  fast_math mismatch deb
)
if (($# > 0)); then
  steps=("$@")
fi
for step in "${steps[@]}"; do
  printf '\n== consumers: %s ==\n' "$step"
  "$step"
done
