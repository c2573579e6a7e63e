# SPDX-License-Identifier: LGPL-2.1-or-later
"""Writes the outputs that pages show anew, where they differ from what the examples print now.

    .venv/bin/python -m tests.docs.refresh [PAGE ...]

Read the changes before you commit them: what a page shows is to be right, not just what was printed.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from tests.docs.blocks import Page, difference, find_blocks
from tests.docs.conftest import make_commands, make_maps, make_page, pages_with_blocks


def refresh(path: Path, page: Page) -> int:
    """Run a page's examples and put in what they print; returns how many outputs changed."""
    text = path.read_text(encoding="utf-8")
    printed, changes = "", []
    for block in find_blocks(text):
        if block.mark != "output":
            printed = page.run(block)
        elif difference(block.text, printed, block.argument != "words"):
            changes.append((block.span, printed.rstrip() + "\n"))
    for (start, end), output in reversed(changes):
        text = text[:start] + output + text[end:]
    path.write_text(text, encoding="utf-8")
    return len(changes)


def main() -> None:
    repository = Path(__file__).resolve().parents[2]
    paths = [Path(name).resolve() for name in sys.argv[1:]] or pages_with_blocks(repository)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        commands = make_commands(folder / "bin", repository)
        make_maps(folder, repository)
        for path in paths:
            n = refresh(path, make_page(folder / path.stem, folder, commands, repository))
            print(f"{path.relative_to(repository)}: {n} outputs changed")


if __name__ == "__main__":
    main()
