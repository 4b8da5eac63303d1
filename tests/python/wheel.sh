#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Installs the Python package from a clean clone, as docs/python.md tells, and tests what is installed:
#
#   tests/python/wheel.sh debian    without a network, with Debian's packages
#   tests/python/wheel.sh pypi      with those of PyPI, and NumPy 1 and 2
set -euo pipefail
cd "$(dirname "$0")/../.."

# Without git and python3-pytest these are those of docs/python.md.
.ci/apt_install.sh git cmake g++ make binutils libhwy-dev libtbb-dev libpugixml-dev zlib1g-dev \
  libcli11-dev libfmt-dev nlohmann-json3-dev libjs-three pybind11-dev \
  python3-dev python3-numpy python3-venv python3-hatchling python3-pytest python3-hypothesis

fail() {
  echo "tests/python/wheel.sh: $1" >&2
  exit 1
}

# Both ways build in one clone, so that the second compiles the modules alone.
work=$PWD/build/wheel_test
mkdir -p "$work"
[[ -d $work/clone ]] || git clone -q . "$work/clone"
git -C "$work/clone" fetch -q origin HEAD
git -C "$work/clone" checkout -q --force --detach FETCH_HEAD
git -C "$work/clone" clean -q --force -d  # what is ignored stays
cd "$work"
rm -rf venv
unset PYTHONPATH

install() {  # ARGUMENTS OF PIP...
  venv/bin/pip install "$@" ./clone
  [[ -z $(git -C clone status --porcelain) ]] || fail "a build leaves files beside the sources"
  local package
  package=$(venv/bin/python -c 'import fcl_fibers, os; print(os.path.dirname(fcl_fibers.__file__))')
  [[ $package == "$work"/venv/* ]] || fail "Python imports $package"
  ! ldd "$package"/*.so | grep -E 'not found|libfcl\.so' || fail "a library is missing, or is FCL"
}

tests() {  # ARGUMENTS OF PYTEST...
  venv/bin/python -c 'import numpy, sys; print("NumPy", numpy.__version__, "Python", sys.version)'
  venv/bin/python -m fcl_fibers check clone/examples/crossing.txt --radius 0.06 --exit-zero
  venv/bin/python -m pytest -q -p no:cacheprovider "$@"
}

case $1 in
  debian)
    /usr/bin/python3 -m venv --system-site-packages venv
    install --no-index --no-build-isolation
    # The rest is the same as in the build tree, where all tests run.
    tests clone/tests/python/test_{import,page,files,documentation}.py
    ;;
  pypi)
    /usr/bin/python3 -m venv venv
    install
    venv/bin/pip install -q pytest hypothesis
    for numpy in 'numpy>=2' 'numpy<2'; do
      venv/bin/pip install -q "$numpy"
      tests clone/tests/python
    done
    ;;
esac
