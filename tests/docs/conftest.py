# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the tests of the documentation share: a folder as its examples expect it."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

import pytest

from tests.docs.blocks import Page, find_blocks

#: Maps that the pages may ask, and the examples that they are made from.
MAPS = {"led.raymap": "led_collimator", "barrel.raymap": "singlet_barrel"}


def make_commands(folder: Path, repository: Path) -> Path:
    """A folder with a command ``raymaps`` that runs this source tree with this Python."""
    folder.mkdir()
    command = folder / "raymaps"
    core = shlex.quote(str(repository / "core"))
    command.write_text(f'#!/bin/sh\nPYTHONPATH={core} exec {shlex.quote(sys.executable)} -m raymaps "$@"\n')
    command.chmod(0o755)
    return folder


def make_maps(folder: Path, repository: Path) -> None:
    """Trace the maps that the pages ask."""
    import raymaps

    for name, example in MAPS.items():
        raymaps.simulate(repository / "examples" / f"{example}.scene.json", folder / name)


def make_page(folder: Path, maps: Path, commands: Path, repository: Path) -> Page:
    """A folder as the examples of a page expect it: the maps, and the examples' scenes."""
    folder.mkdir()
    for name in MAPS:
        (folder / name).symlink_to(maps / name)
    (folder / "examples").symlink_to(repository / "examples")
    return Page(folder, commands)


def pages_with_blocks(repository: Path) -> list[Path]:
    """Pages that have examples."""
    pages = [repository / "README.md", *sorted((repository / "docs").glob("*.md"))]
    return [page for page in pages if find_blocks(page.read_text(encoding="utf-8"))]


@pytest.fixture(scope="session")
def commands(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_commands(tmp_path_factory.mktemp("documentation") / "bin", repository)


@pytest.fixture(scope="session")
def maps(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("maps")
    make_maps(folder, repository)
    return folder
