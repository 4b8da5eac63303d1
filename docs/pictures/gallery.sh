#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# docs/pictures/gallery.sh: makes the pages of docs/gallery.md in build/gallery, their stills in
# docs/images/gallery, docs/images/topologies.png and docs/images/hair.png. Prints what each page
# counts. docs/pictures/ponytail.txt.gz is what docs/pictures/live.sh shows.
#
# FCL_FIBERS_DATA names a folder with tressfx31_ponytail_*.tfx, from the folder
# amd_tressfx_viewer/media/ponytail of https://github.com/GPUOpen-Effects/TressFX, version 3.1.1.
# Without it the ponytails and hair.png stay as they are.
set -euo pipefail
data=${FCL_FIBERS_DATA:+$(realpath -e -- "$FCL_FIBERS_DATA")}
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

.ci/apt_install.sh chromium chromium-driver python3-selenium python3-matplotlib python3-pil
cmake --preset release >&2
cmake --build --preset release --target fcl_fibers_program fcl_fibers_topologies >&2

pages=build/gallery images=docs/images
mkdir -p "$pages" "$images/gallery"
/usr/bin/python3 docs/pictures/topologies.py \
  build/release/docs/pictures/fcl_fibers_topologies "$images/topologies.png"
/usr/bin/python3 docs/pictures/scenes.py "$pages" ${data:+"$data"}

# page NAME ARGUMENT...: what `fcl_fibers view` takes
page() { build/release/tools/fcl_fibers view "${@:2}" -o "$pages/$1.html"; }
# still IMAGE NAME KEYS...: of the page NAME, one for each KEYS, side by side
still() {
  local image=$1 page=$pages/$2.html
  echo "$image"
  shift 2
  /usr/bin/python3 docs/pictures/still.py --height "${height:-750}" "${@/#/$page#}" "$images/$image.png"
}

page half_scalp paper-half-scalp
still gallery/half_scalp half_scalp camera=40,14,1
page strand paper-strand
still gallery/strand strand 'up=x&camera=15,12,1'
page loop paper-dynamic:frames=0:100:5
height=480 still gallery/loop loop 'frame=10&camera=0,13,1.1,1.6,-5.2,2.6' \
  'frame=15&camera=0,13,1.7,-2.1,-3,0' 'frame=20&camera=0,13,2,-0.5,-2.4,0'
page knot "$pages/knot.txt" -r 0.101 -a 0.35 --up z
still gallery/knot knot camera=191,50,1
page knit "$pages/tube.txt" -r 0.125 -a 0.4
still gallery/knit knit camera=80,18,1
page parting "$pages/parting.txt" -r 0.05 --mesh "$pages/head.obj" --solid --up z
still gallery/parting parting 'markers=0&camera=40,14,1'
page crossing examples/crossing.txt -r 0.06
still gallery/crossing crossing 'up=z&camera=-70,70,0.9'
if [[ -e $pages/ponytail.txt ]]; then
  page ponytail "$pages/ponytail.txt" -r 0.05 --up y
  still gallery/ponytail ponytail camera=75,8,1
  still hair ponytail 'markers=0&camera=75,8,1' 'camera=75,10,12'
  # Every second strand is enough for live.sh, and small.
  {
    sed 's/^/# /; s/ $//' docs/pictures/ponytail_licence.txt
    awk 'NF { if (!odd) printf "%.2f %.2f %.2f\n", $1, $2, $3; inside = 1; next }
         inside { if (!odd) print ""; odd = !odd; inside = 0 }' "$pages/ponytail.txt"
  } | gzip -9n >docs/pictures/ponytail.txt.gz
else
  echo "There is no ponytail: FCL_FIBERS_DATA names no folder" >&2
fi
