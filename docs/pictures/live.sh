#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# docs/pictures/live.sh FOLDER: makes the pages that the site has in docs/gallery.md instead of the
# pictures of the same names. The program of the preset `release` makes them.
set -euo pipefail
folder=$1
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
.ci/apt_install.sh python3-numpy
cmake --preset release >&2
cmake --build --preset release --target fcl_fibers_program >&2

rm -rf "$folder"
mkdir -p "$folder/scenes"
view() { build/release/tools/fcl_fibers view "$@"; }

view docs/pictures/ponytail.txt.gz -r 0.05 --up y -o "$folder/ponytail.html"
{
  echo '<!--'
  cat docs/pictures/ponytail_licence.txt
  echo '-->'
} >>"$folder/ponytail.html"

/usr/bin/python3 -B docs/pictures/scenes.py "$folder/scenes"
# Thinner than in the picture, because a page of 280,000 contacts takes long to load.
view "$folder/scenes/parting.txt" -r 0.02 --mesh "$folder/scenes/head.obj" --solid --up z \
  -o "$folder/parting.html"
rm -r "$folder/scenes"
