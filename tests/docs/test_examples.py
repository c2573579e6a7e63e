# SPDX-License-Identifier: LGPL-2.1-or-later
"""The examples of the documentation run and print what the pages show."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs.blocks import difference, find_blocks
from tests.docs.conftest import make_page, pages_with_blocks

REPOSITORY = Path(__file__).resolve().parents[2]
PAGES = pages_with_blocks(REPOSITORY)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_examples_print_what_the_page_shows(path: Path, maps: Path, commands: Path, tmp_path: Path) -> None:
    page = make_page(tmp_path / "page", maps, commands, REPOSITORY)
    printed, faults = "", []
    for block in find_blocks(path.read_text(encoding="utf-8")):
        if block.mark != "output":
            printed = page.run(block)
            continue
        told = difference(block.text, printed, block.argument != "words")
        if told:
            faults.append(f"{path.name}, line {block.line}: {told}")
    assert not faults, "\n".join(faults)


def test_the_pages_that_promise_examples_have_them() -> None:
    found = {path.name for path in PAGES}
    assert {"README.md", "file-format.md", "scene-format.md", "criterion.md", "user-guide.md"} <= found


def test_differences_are_seen() -> None:
    assert not difference("flux 3.0 ± 0.1 W\n", "flux   3.2 ± 0.1 W\n")
    assert difference("flux 3.0 ± 0.1 W\n", "flux 4.0 ± 0.1 W\n")
    assert difference("flux 3.0 ± 0.1 W\n", "flow 3.0 ± 0.1 W\n")
    assert not difference("5.0 s\n", "7.1 s\n", numbers=False)
    assert not difference("a\n…\nz\n", "a\nb\nc\nz\n")
    assert not difference("hash …\n", "hash 1a2b\n")
    assert difference("a\nb\n", "a\n")
    assert difference("a\n", "a\nb\n")
