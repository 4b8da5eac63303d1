#!/usr/bin/env bash
# Installs the Python package from a clean clone, as docs/installing.md tells, without a network, and
# runs its tests on what is installed.
set -euo pipefail
cd "$(dirname "$0")/../.."

.ci/apt_install.sh git cmake g++ make binutils libhwy-dev libtbb-dev libpugixml-dev zlib1g-dev \
  libcli11-dev libfmt-dev nlohmann-json3-dev libjs-three pybind11-dev \
  python3-dev python3-numpy python3-pytest python3-hypothesis python3-nibabel python3-venv python3-pip \
  python3-setuptools python3-wheel

fail() {
  echo "tests/python/wheel.sh: $1" >&2
  exit 1
}

work=$PWD/build/wheel
rm -rf "$work"
git clone -q . "$work/clone"
/usr/bin/python3 -m venv --system-site-packages "$work/venv"
cd "$work"
venv/bin/pip wheel --no-index --no-deps --no-build-isolation --wheel-dir . ./clone
[[ -z $(git -C clone status --porcelain) ]] || fail "a build leaves files beside the sources"
wheel=$(echo fcl_fibers-*.whl)
size=$(stat --format=%s "$wheel")
echo "$wheel: $size bytes"
((size < 5000000)) || fail "the wheel is larger than 5 MB"
venv/bin/pip install --no-index "$wheel"

unset PYTHONPATH
package=$(venv/bin/python -c 'import fcl_fibers, os; print(os.path.dirname(fcl_fibers.__file__))')
[[ $package == "$work"/venv/* ]] || fail "Python imports $package"
for module in "$package"/*.so*; do
  needs=$(ldd "$module")
  [[ $needs != *"not found"* ]] || fail "$module: $needs"
  [[ $needs != *libfcl.so* ]] || fail "$module needs FCL"
  # What is no part of glibc or the compiler comes from the wheel itself.
  foreign=$(grep '=> /' <<<"$needs" | grep -v "=> $package/" |
    grep -vE '^\s*lib(c|m|gcc_s|stdc\+\+|dl|pthread)\.so' || true)
  [[ -z $foreign ]] || fail "$module needs of the system: $foreign"
done

venv/bin/python -m fcl_fibers check clone/examples/crossing.txt --radius 0.06 --exit-zero
venv/bin/python -m fcl_fibers view clone/examples/crossing.txt --radius 0.06 -o crossing.html
venv/bin/python -m pytest -q -p no:cacheprovider clone/tests/python
