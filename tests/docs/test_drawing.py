# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pictures of the page on optics are those that `docs.drawing` draws, and it still draws."""

from __future__ import annotations

import re
from pathlib import Path

import pytest


def test_each_picture_of_optics_has_its_drawing(repository: Path) -> None:
    text = "".join(path.read_text(encoding="utf-8") for path in (repository / "docs" / "drawing").glob("*.py"))
    drawn = set(re.findall(r"^def draw_(\w+)\(folder", text, re.M))
    stored = {path.stem.removeprefix("optics_") for path in (repository / "docs" / "pictures").glob("optics_*.png")}
    assert drawn == stored
    shown = re.findall(r"pictures/optics_(\w+)\.png", (repository / "docs" / "optics.md").read_text(encoding="utf-8"))
    assert sorted(shown) == sorted(stored)


def test_a_picture_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    from PIL import Image

    from docs.drawing import look, spectra

    monkeypatch.setattr(look, "FOLDER", tmp_path)
    look.save(spectra.draw_prism(tmp_path), "prism")
    with Image.open(tmp_path / "optics_prism.png") as picture:
        assert picture.width > 800
        assert len(picture.convert("RGB").getcolors(100_000)) > 30
