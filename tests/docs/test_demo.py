# SPDX-License-Identifier: LGPL-2.1-or-later
"""The demo: what it leaves, what it replaces, and how it fails."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def run_demo(repository: Path, folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(repository / "examples" / "demo.py"), "--out", str(folder), "--rays", "5000", *words]
    environment = {"PYTHONPATH": str(repository / "core"), "PATH": "/usr/bin:/bin", "HOME": str(folder.parent)}
    return subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment, check=False)


def test_demo_leaves_its_results_and_nothing_else_is_lost(repository: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "mine.txt").write_text("mine")
    for _ in range(2):  # the second replaces what the first left
        done = run_demo(repository, folder)
        assert done.returncode == 0, done.stderr
    assert (folder / "mine.txt").read_text() == "mine"
    left = {path.name for path in folder.iterdir()} - {"mine.txt"}
    pictures = {"led_rays.png", "led_target.png", "stray_light.png"}
    assert left == {"led_collimator.raymap", "singlet_barrel.raymap", "stray_light.html", *pictures}
    for picture in folder.glob("*.png"):
        assert picture.read_bytes().startswith(b"\x89PNG")
    assert "Ray 221" in (folder / "stray_light.html").read_text(encoding="utf-8")
    for name in left:
        assert name in done.stdout
    assert done.stdout.count(" ± ") > 5


def test_demo_replaces_no_folder_that_is_not_its_own(repository: Path, tmp_path: Path) -> None:
    foreign = tmp_path / "out" / "led_collimator.raymap"
    foreign.mkdir(parents=True)
    (foreign / "thesis.txt").write_text("the only copy")
    done = run_demo(repository, tmp_path / "out")
    assert done.returncode == 1
    assert done.stderr.startswith("demo: ")
    assert "move it away" in done.stderr
    assert "Traceback" not in done.stderr
    assert (foreign / "thesis.txt").exists()


def test_demo_says_where_it_cannot_write(repository: Path, tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file")
    done = run_demo(repository, tmp_path / "out")
    assert done.returncode == 1
    assert done.stderr.startswith("demo: ")
    assert "Traceback" not in done.stderr
