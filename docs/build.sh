#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# The documentation as a site, in build/site, from README.md, docs/ and the comments of include/:
#
#   docs/build.sh    and open build/site/index.html; only excerpts in the search need a web server
#
# Warnings are errors: what is public and undocumented, or missing in docs/api/; a link that leads
# nowhere; a page that is not in the map, or the other way round.
set -euo pipefail
cd "$(dirname "$0")/.."

.ci/apt_install.sh doxygen python3-sphinx furo python3-breathe python3-myst-parser \
  python3-sphinx-copybutton

rm -rf build/docs build/site
mkdir -p build/docs
doxygen docs/Doxyfile
docs/pictures/live.sh build/docs/live
# Debian's Sphinx, whatever else is in the path.
/usr/bin/python3 -m sphinx -W --keep-going -n -q -d build/docs/doctrees -c docs . build/site

# The style sheet and the script of Debian's furo need a web server: the one imports a file by its
# path on that server, the other a module. These make them work in the file system too.
static=build/site/_static
cp /usr/share/javascript/normalize.css/normalize.css "$static/styles"
sed -i 's|/javascript/normalize.css/||' "$static/styles/furo.css"
sed -i '/^import Gumshoe/d' "$static/scripts/furo.js"
cat "$static/scripts/furo.js" >>"$static/scripts/gumshoe-patched.js"
mv "$static/scripts/gumshoe-patched.js" "$static/scripts/furo.js"

# The start page under both of its names.
cp build/site/README.html build/site/index.html
