#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
#
# Opens FreeCAD with the workbench of this source tree and an example, without touching the user's addons.
set -euo pipefail
cd "$(dirname "$0")/.."

if [ -z "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ] && [ "$(uname -s)" = Linux ]; then
    echo "raymaps: FreeCAD needs a display and there is none. Start it on a desktop; 'make test' needs none." >&2
    exit 1
fi
tools/setup.sh freecad

# FreeCAD's web view refuses to start as root with its sandbox.
[ "$(id -u)" -ne 0 ] || export QTWEBENGINE_DISABLE_SANDBOX=1

# -M stands last: FreeCAD 0.20 crashes where it comes first.
exec "$(command -v freecad || command -v FreeCAD)" examples/open_example.py -M "$PWD"
