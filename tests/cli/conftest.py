# SPDX-License-Identifier: LGPL-2.1-or-later
"""The command, called in this process (fast) or as a process of its own (signals, pipes, exit)."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from raymaps.cli import main
from raymaps.run import simulate
from tests.store.small_scenes import workshop, write_scene

REPOSITORY = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Done:
    """How a command ended."""

    code: int
    out: str
    err: str

    @property
    def data(self) -> dict[str, Any]:
        """The one JSON object that ``--json`` prints."""
        assert self.code == 0, self.err
        (line,) = self.out.splitlines()
        return json.loads(line)

    @property
    def sentence(self) -> str:
        """What a refusal says: one line on standard error, nothing on standard output."""
        assert self.code == 3, (self.code, self.err)
        assert self.out == ""
        (line,) = self.err.splitlines()
        assert line.startswith("raymaps: ")
        assert "Traceback" not in line
        assert len(line) < 600
        return line.removeprefix("raymaps: ")


@pytest.fixture
def raymaps(monkeypatch, capfd) -> Iterator[Callable[..., Done]]:
    """The command in this process: ``raymaps("info", path, "--json")``."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def call(*arguments: object) -> Done:
        monkeypatch.setattr(sys, "argv", ["raymaps", *map(str, arguments)])
        capfd.readouterr()
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capfd.readouterr()
        return Done(int(ended.value.code or 0), out, err)

    yield call
    for number, handler in handlers.items():
        signal.signal(number, handler)


def process(*arguments: object, **options: Any) -> subprocess.Popen[str]:
    """The command as a process."""
    given = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    return subprocess.Popen(
        [sys.executable, "-m", "raymaps", *map(str, arguments)],
        text=True,
        env={**os.environ, "PYTHONPATH": str(REPOSITORY / "core")},
        **given,
    )


@pytest.fixture(scope="session")
def small_scene(tmp_path_factory) -> Path:
    """The workshop's scene file."""
    folder = tmp_path_factory.mktemp("scene")
    return write_scene(folder, workshop(folder))


@pytest.fixture(scope="session")
def small_map(small_scene, tmp_path_factory) -> Path:
    """A map of the workshop, 2000 rays; only to be read."""
    path = tmp_path_factory.mktemp("map") / "small.raymap"
    simulate(small_scene, path, rays=2000, portion_rays=800)
    return path
