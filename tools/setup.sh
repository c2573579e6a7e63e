#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
#
# Makes what the targets of the Makefile need, where it is missing:
#
#   tools/setup.sh environment       .venv: the locked packages and the command raymaps
#   tools/setup.sh graphics          the system's OpenGL, for pictures without a display
#   tools/setup.sh freecad           FreeCAD
#   tools/setup.sh workbench-tests   FreeCAD and a virtual display
#
# Each does nothing where all is there. What fails ends with one sentence that says what to do.
set -euo pipefail
cd "$(dirname "$0")/.."

VENV=.venv
LOCK=requirements-dev.lock
OLDEST_PYTHON=10 # 3.10
NEWEST_PYTHON=14 # 3.14
GRAPHICS_PACKAGES=(libegl1 libgl1-mesa-dri)
DISPLAY_PACKAGES=(xvfb xauth "${GRAPHICS_PACKAGES[@]}")

log_file=$(mktemp)
trap 'rm -f "$log_file"' EXIT

say() { printf '%s\n' "$*"; }

fail() {
    printf 'raymaps: %s\n' "$*" >&2
    exit 1
}

# Runs a command silently; where it fails, shows the end of what it said and then the sentence.
#   quietly SENTENCE COMMAND...
quietly() {
    local sentence=$1
    shift
    if ! "$@" >"$log_file" 2>&1; then
        tail -n 20 "$log_file" >&2
        fail "$sentence"
    fi
}

# ---------------------------------------------------------------------------------------------------------------------
# The system's packages, Debian and Ubuntu

# Installs packages with apt-get, as root or with sudo, else says the command.
#   install_packages WHAT_FOR PACKAGE...
install_packages() {
    local purpose=$1
    shift
    local command="apt-get install -y --no-install-recommends $*"
    if ! command -v apt-get >/dev/null; then
        fail "$purpose: please install what Debian calls '$*' with your system's package manager, then try again."
    fi

    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        as_root=(sudo)
        # Without a terminal sudo cannot ask for a password.
        if ! command -v sudo >/dev/null || { [ ! -t 0 ] && ! sudo -n true 2>/dev/null; }; then
            fail "$purpose: please run, as root: apt-get update && $command"
        fi
    fi

    say "$purpose: installing $* with apt-get ..."
    # A stale list is no reason to stop: the installation itself tells.
    "${as_root[@]}" apt-get update >"$log_file" 2>&1 || true
    quietly "apt-get failed, see above. Please run, as root: apt-get update && $command" \
        "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y --no-install-recommends -o DPkg::Lock::Timeout=300 "$@"
}

# ---------------------------------------------------------------------------------------------------------------------
# .venv

minor_version() { "$1" -c 'import sys; print(sys.version_info.minor if sys.version_info.major == 3 else 0)' 2>/dev/null; }

is_supported() {
    local minor
    minor=$(minor_version "$1") || return 1
    [ "$minor" -ge "$OLDEST_PYTHON" ] && [ "$minor" -le "$NEWEST_PYTHON" ]
}

# The interpreter that .venv is made with: $PYTHON, else python3, else the newest supported one in the PATH.
find_python() {
    local candidate minor
    if [ -n "${PYTHON:-}" ]; then
        is_supported "$PYTHON" ||
            fail "PYTHON=$PYTHON is not a Python 3.$OLDEST_PYTHON to 3.$NEWEST_PYTHON. Name one that is."
        command -v "$PYTHON"
        return
    fi
    for candidate in python3 $(seq -f 'python3.%.0f' "$NEWEST_PYTHON" -1 "$OLDEST_PYTHON"); do
        if is_supported "$candidate"; then
            command -v "$candidate"
            return
        fi
    done
    fail "Python 3.$OLDEST_PYTHON to 3.$NEWEST_PYTHON is needed and none is in the PATH." \
        "Install one, or name it: make PYTHON=/path/to/python3"
}

has_venv() { "$1" -c 'import ensurepip, venv' 2>/dev/null; }

# Debian and Ubuntu ship venv apart from Python.
ensure_venv_module() {
    local python=$1 real
    has_venv "$python" && return
    real=$("$python" -c 'import os, sys; print(os.path.realpath(sys.executable))')
    case $real in
        /usr/bin/*) install_packages "Making the Python environment" "python3.$(minor_version "$python")-venv" ;;
    esac
    has_venv "$python" ||
        fail "$python has no venv and ensurepip modules. Install them, or name another one: make PYTHON=/path/to/python3"
}

# What .venv was made from; it is made again where that changed. It cannot be moved, so its place counts.
environment_stamp() {
    "$1" -c '
import hashlib, os, sys
with open(sys.argv[1], "rb") as lock:
    digest = hashlib.sha256(lock.read()).hexdigest()
print(digest, "%d.%d.%d" % sys.version_info[:3], os.getcwd())
' "$LOCK"
}

make_environment() {
    local python stamp
    python=$(find_python)
    stamp=$(environment_stamp "$python")
    if [ -x "$VENV/bin/raymaps" ] && [ "$(cat "$VENV/stamp" 2>/dev/null)" = "$stamp" ]; then
        return
    fi

    [ "$(uname -s) $(uname -m)" != "Linux aarch64" ] ||
        fail "Embree's Python package exists for Linux on x86-64 only, not on ARM: please use another machine."
    ensure_venv_module "$python"
    say "Making $VENV with $("$python" -V) ..."
    rm -rf "$VENV"
    quietly "$python could not make the environment $VENV, see above." "$python" -m venv "$VENV"
    say "Installing the packages of $LOCK (about 400 MB to download the first time) ..."
    quietly "The packages could not be installed, see above. Check the network and the free disk space, then try again." \
        "$VENV/bin/python" -m pip install --quiet --disable-pip-version-check --no-input \
        --require-hashes --only-binary :all: -r "$LOCK"
    # The project itself, as it stands in core/; needs no network.
    quietly "The command raymaps could not be installed into $VENV, see above." \
        "$VENV/bin/python" -m pip install --quiet --disable-pip-version-check --no-input \
        --no-index --no-deps --no-build-isolation --editable .
    printf '%s\n' "$stamp" >"$VENV/stamp"
    say "$VENV is ready: $VENV/bin/raymaps"
}

# ---------------------------------------------------------------------------------------------------------------------
# Pictures without a display

# vtk ends the process where it finds no OpenGL: so the trial runs in a process of its own.
can_draw() {
    VTK_DEFAULT_OPENGL_WINDOW=vtkEGLRenderWindow "$VENV/bin/python" -c '
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere(), color="red")
image = plotter.screenshot(return_img=True)
raise SystemExit(int(image.min() == image.max()))
' >"$log_file" 2>&1
}

ensure_graphics() {
    # The shell's own word on a crash of the trial belongs to the log too.
    if { can_draw; } 2>/dev/null; then
        return
    fi
    [ "$(uname -s)" = Linux ] || fail "vtk cannot draw a picture: $(tail -n 1 "$log_file")"
    install_packages "Drawing pictures without a display" "${GRAPHICS_PACKAGES[@]}"
    if ! { can_draw; } 2>/dev/null; then
        tail -n 20 "$log_file" >&2
        fail "vtk still cannot draw a picture, see above. Check the installation of ${GRAPHICS_PACKAGES[*]}."
    fi
}

# ---------------------------------------------------------------------------------------------------------------------
# FreeCAD

has_freecad() {
    { command -v freecadcmd || command -v FreeCADCmd; } >/dev/null
}

has_virtual_display() {
    command -v xvfb-run >/dev/null && command -v xauth >/dev/null &&
        { ! command -v dpkg >/dev/null || dpkg -s libgl1-mesa-dri >/dev/null 2>&1; }
}

ensure_freecad() {
    has_freecad || install_packages "Running FreeCAD" freecad
    has_freecad || fail "FreeCAD is installed but neither freecadcmd nor FreeCADCmd is in the PATH."
    if ! freecad_is_recent; then
        cat "$log_file" >&2
        fail "The workbench needs a working FreeCAD 0.20 or later, see above. Install one and put it in the PATH."
    fi
}

ensure_workbench_tests() {
    if ! has_freecad || ! has_virtual_display; then
        local packages=("${DISPLAY_PACKAGES[@]}")
        has_freecad || packages=(freecad "${packages[@]}")
        install_packages "Testing the workbench in a real FreeCAD" "${packages[@]}"
    fi
    ensure_freecad
}

# Asked through a script: FreeCAD 0.20 crashes on the option --version.
freecad_is_recent() {
    local home status=0
    home=$(mktemp -d)
    cat >"$home/version.py" <<'SCRIPT'
import sys

import FreeCAD

version = [int(part) for part in FreeCAD.Version()[:2]]
print("FreeCAD", ".".join(map(str, version)))
sys.exit(version < [0, 20])
SCRIPT
    HOME=$home timeout 120 "$(command -v freecadcmd || command -v FreeCADCmd)" "$home/version.py" \
        </dev/null >"$log_file" 2>&1 || status=1
    rm -rf "$home"
    return "$status"
}

case ${1:-} in
    environment) make_environment ;;
    graphics) ensure_graphics ;;
    freecad) ensure_freecad ;;
    workbench-tests) ensure_workbench_tests ;;
    *) fail "usage: tools/setup.sh environment|graphics|freecad|workbench-tests" ;;
esac
