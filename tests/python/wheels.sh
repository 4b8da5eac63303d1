#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Makes wheels by python/wheels.sh and runs the tests on each in a Debian that has none of the libraries
# the package is built with, and neither a compiler nor a network:
#
#   tests/python/wheels.sh [PYTHON...]    # by default Debian's
#
# Needs root and PyPI. Each Python is that of the system, or in a folder of its own (pyenv's).
set -euo pipefail
cd "$(dirname "$0")/../.."
.ci/apt_install.sh mmdebstrap git python3-venv

if (($# == 0)); then
  set -- /usr/bin/python3
fi
python/wheels.sh "$@"
if [[ $(find build/wheels -maxdepth 1 -size +5M) ]]; then
  echo "tests/python/wheels.sh: a wheel is larger than 5 MB" >&2
  exit 1
fi

root=$PWD/build/wheels_root
if [[ ! -d $root ]]; then
  rm -rf "$root.part"
  # What pyenv's Pythons need.
  mmdebstrap --variant=minbase \
    --include=python3-venv,libbz2-1.0,libffi8,liblzma5,libreadline8,libsqlite3-0,libssl3,zlib1g \
    bookworm "$root.part"
  mv "$root.part" "$root"
fi
if find "$root/usr/lib" | grep -E 'lib(hwy|tbb|pugixml|fmt)[^/]*\.so'; then
  echo "tests/python/wheels.sh: $root has these libraries" >&2
  exit 1
fi
rm -rf "$root/src" "$root/wheels"
git clone -q . "$root/src"
cp -r build/wheels "$root/wheels"

for python in "$@"; do
  tag=$("$python" -c 'import sys; print("cp%d%d" % sys.version_info[:2])')
  base=$("$python" -c 'import sys; print(sys.base_prefix)')
  name=$("$python" -c 'import sys; print("python%d.%d" % sys.version_info[:2])')
  wheel=$(cd "$root/wheels" && echo fcl_fibers-*-"$tag"-manylinux*.whl)
  "$python" -m venv --clear build/wheels/venv
  build/wheels/venv/bin/pip download -q --dest "$root/wheels/$tag" \
    "build/wheels/$wheel" pytest hypothesis
  echo "== $wheel"
  # shellcheck disable=SC2016
  unshare --mount --net bash -c '
    set -e
    mount -t proc proc "$0/proc"
    mount --rbind /dev "$0/dev"
    if [[ $1 != /usr ]]; then
      mkdir -p "$0$1"
      mount --bind "$1" "$0$1"
    fi
    exec chroot "$0" env -i PATH=/usr/bin:/bin HOME=/root bash -ec "
      cd /tmp
      $1/bin/$2 -m venv --clear venv
      venv/bin/pip install -q --no-index --find-links /wheels/$3 fcl_fibers pytest hypothesis
      venv/bin/python -m fcl_fibers check /src/examples/crossing.txt --radius 0.06 --exit-zero
      venv/bin/python -m pytest -q -p no:cacheprovider /src/tests/python"
    ' "$root" "$base" "$name" "$tag"
done
