#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
#
# Resolves the packages of pyproject.toml into the lock files, for Python 3.10 to 3.14 on Linux, Windows and
# macOS (the list is in pyproject.toml, tool.uv):
#
#   requirements-dev.lock   all of it: .venv, the demo, the tests, the benchmarks
#   requirements.lock       its part that the tracer needs: what the workbench's "Set up tracer" installs
#
# The files hold versions and hashes, and no address to download from.
set -euo pipefail
cd "$(dirname "$0")/.."

resolve() {
    "${UV:-uv}" pip compile --quiet --universal --python-version 3.10 --generate-hashes --upgrade \
        --only-binary :all: --no-header --no-annotate --no-emit-index-url --no-emit-find-links pyproject.toml "$@"
}

# Adds what a reader should know on top. Drops the upper bound of Python: with a newer one pip shall say that a package
# does not exist for it, rather than install nothing.
finish() {
    local file=$1
    shift
    {
        printf '# %s\n' "$@" "Made by 'make lock' from pyproject.toml. Do not edit."
        sed -E "s/ and python_full_version < '3\.15'//; s/python_full_version < '3\.15' and //; s/ ; python_full_version < '3\.15'//" "$file"
    } >"$file.new"
    mv "$file.new" "$file"
    if grep -n '://' "$file"; then
        echo "raymaps: $file holds an address, see above" >&2
        exit 1
    fi
}

resolve --extra dev --output-file requirements-dev.lock
resolve --constraint requirements-dev.lock --output-file requirements.lock
finish requirements-dev.lock "Everything that the demo, the tests, the checks and the benchmarks need."
finish requirements.lock "What the tracer needs; a part of requirements-dev.lock, in the same versions."
