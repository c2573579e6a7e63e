# SPDX-License-Identifier: LGPL-2.1-or-later
"""The pictures of the pages on optics and accuracy are those that `docs.drawing` draws, and it still draws."""

from __future__ import annotations

import json
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


def test_each_picture_of_accuracy_has_its_drawing(repository: Path) -> None:
    stored = {path.stem for path in (repository / "docs" / "pictures").glob("accuracy_*.png")}
    shown = re.findall(
        r"pictures/(accuracy_\w+)\.png", (repository / "docs" / "accuracy.md").read_text(encoding="utf-8")
    )
    assert stored
    assert sorted(shown) == sorted(stored)


def test_pictures_of_accuracy_are_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, repository: Path) -> None:
    pytest.importorskip("matplotlib")
    from docs.drawing import accuracy, look

    def point(scene: str, choice: str, sampling: str, rays: int) -> dict:
        own = {"scene": scene, "choice": choice, "sampling": sampling, "rays": rays}
        return {**own, "error": rays**-0.5, "error_stderr": 0.1 * rays**-0.5, "run_s": 1e-6 * rays}

    names = (("lamp", ""), ("singlet and pinhole", "exact"), ("dye in daylight", "RGB"))
    points = [point(*name, s, n) for name in names for s in ("random", "sobol") for n in (1000, 10_000)]
    median = {"median": 0.1}
    store = {"scene": "box", "light": "RGB", "segments": 1000, "raw_bytes": 60_000, "bytes": 12_000}
    work = {"precisions": points, "stores": [{**store, "raw_write": median, "write": median}]}
    (tmp_path / "results.json").write_text(json.dumps({"work_precision": work}))
    monkeypatch.setattr(look, "FOLDER", tmp_path)
    accuracy.draw(tmp_path / "results.json")
    drawn = {path.name for path in tmp_path.glob("*.png")}
    assert drawn == {path.name for path in (repository / "docs" / "pictures").glob("accuracy_*.png")}


def test_a_picture_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    from PIL import Image

    from docs.drawing import look, spectra

    monkeypatch.setattr(look, "FOLDER", tmp_path)
    look.save(spectra.draw_prism(tmp_path), "prism")
    with Image.open(tmp_path / "optics_prism.png") as picture:
        assert picture.width > 800
        assert len(picture.convert("RGB").getcolors(100_000)) > 30
