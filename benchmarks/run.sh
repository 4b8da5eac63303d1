#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Installs and builds what a set of measures needs, measures it, and prints its tables; see --help.
set -euo pipefail
folder=$(dirname "${BASH_SOURCE[0]}")
[[ -x /usr/bin/python3 ]] || "$folder/../.ci/apt_install.sh" python3
exec /usr/bin/python3 -B "$folder/run.py" "$@"
