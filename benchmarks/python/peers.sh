#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# benchmarks/python/peers.sh VENV: makes a virtual environment with the packages of PyPI that
# steps.py compares with, and names those that are absent. It takes 2 minutes and 2.4 GB.
#
# One process has them all: scilpy wants NumPy 1, which the other packages and every pybind11 know.
set -euo pipefail

venv=${1:?the folder of the virtual environment is missing}
packages=(scilpy==2.3.0 pyelastica==1.0.0 python-fcl==0.7.0.11 warp-lang==1.19.0 newton==1.8.0 ipctk==1.6.1)
[[ -x $venv/bin/pip ]] || /usr/bin/python3 -m venv "$venv"
install() { "$venv/bin/pip" install -q numpy==1.26.4 scipy==1.15.3 numba==0.61.2 "$@"; }
install "${packages[@]}" || for package in "${packages[@]}"; do
  install "$package" || echo "benchmarks/python/peers.sh: $package is absent, as pip does not install it" >&2
done
