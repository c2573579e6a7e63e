# SPDX-License-Identifier: LGPL-2.1-or-later
"""Simulates two shipped examples and asks about their rays; `make demo` runs it.

    .venv/bin/python examples/demo.py [--out FOLDER] [--rays N]

Everything is done by the command `raymaps`: each step prints the command, so that it can be repeated by hand. Results
of an earlier demo are replaced; nothing else in the folder is touched.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

EXAMPLES = Path(__file__).resolve().parent
LAMP = "from(LED_red) & hit(Diffuser, diffuse_refraction) & detector(Target)"
STRAY = "from(Stray) & detector(SensorPlane)"


class DemoError(Exception):
    """The demo can't go on; the text is one sentence."""


class Demo:
    """Runs commands and keeps what they left behind.

    Parameters
    ----------
    folder : Path
        Where results go.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self._left: list[tuple[Path, str]] = []
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise DemoError(
                f"The folder '{folder}' can't be made: {(error.strerror or str(error)).lower()}."
            ) from error

    def new(self, name: str, what: str) -> str:
        """Path of a result, with an older one of the same name removed."""
        path = self._folder / name
        try:
            if path.is_dir():
                if not (path / "manifest.json").is_file():
                    raise DemoError(f"'{path}' is not a result of the demo: move it away, or name another --out.")
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)
        except OSError as error:
            raise DemoError(f"The old '{path}' can't be removed: {(error.strerror or str(error)).lower()}.") from error
        self._left.append((path, what))
        return _shown(path)

    def command(self, *words: str, quiet: bool = False) -> str:
        """Run a command and print it with what it says; its progress and errors go to the terminal as they come."""
        print(f"\n$ {_COMMAND} {shlex.join(words)}", flush=True)
        done = subprocess.run(
            [sys.executable, "-m", "raymaps", *words], stdout=subprocess.PIPE, text=True, encoding="utf-8", check=False
        )
        if done.returncode:
            raise DemoError(f"'raymaps {words[0]}' ended with exit code {done.returncode}; its own words stand above.")
        if not quiet:
            print(_indented(done.stdout))
        return done.stdout

    def figures(self, *words: str) -> dict[str, Any]:
        """The figures of a command, without printing them."""
        done = subprocess.run(
            [sys.executable, "-m", "raymaps", *words, "--json"],
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            check=False,
        )
        if done.returncode:
            raise DemoError(f"'raymaps {words[0]}' ended with exit code {done.returncode}; its own words stand above.")
        return json.loads(done.stdout)

    def list_results(self) -> None:
        """Say what is where."""
        width = max(len(_shown(path)) for path, _ in self._left)
        for path, what in self._left:
            print(f"  {_shown(path):<{width}}  {what}")


def luminaire(demo: Demo, rays: list[str]) -> None:
    """An LED luminaire: how much light arrives, where, and what the diffuser does."""
    _title("An LED luminaire: red, green and blue chips, a collimator, a diffuser plate, a work plane")
    raymap = demo.new("led_collimator.raymap", "Ray Map: every ray of the luminaire")
    demo.command("trace", _shown(EXAMPLES / "led_collimator.scene.json"), "-o", raymap, *rays)
    _say("Light of the red chip that the diffuser scattered and that reached the work plane:")
    demo.command("query", raymap, LAMP)
    picture = demo.new("led_rays.png", "picture: sixty of those rays in the luminaire")
    demo.command("view", raymap, "--where", LAMP, "--rays", "60", "-o", picture, quiet=True)
    _say("What arrives on the work plane:")
    irradiance = demo.new("led_target.png", "picture: irradiance on the work plane")
    demo.command("detector", raymap, "Target", "-o", irradiance)
    _say("And inside a circle of 40 mm, in larger cells; nothing is simulated again:")
    demo.command("detector", raymap, "Target", "--resolution", "29x29", "--ellipse=0,0,20,20")


def stray_light(demo: Demo, rays: list[str]) -> None:
    """A lens in a barrel: which stray light reaches the sensor, and how."""
    _title("A lens in a black barrel: light from outside the field of view should not reach the sensor")
    raymap = demo.new("singlet_barrel.raymap", "Ray Map: every ray of the lens in its barrel")
    demo.command("trace", _shown(EXAMPLES / "singlet_barrel.scene.json"), "-o", raymap, *rays)
    _say("It does all the same:")
    demo.command("query", raymap, STRAY)
    _say("This is how, in order of light:")
    demo.command("paths", raymap, "--where", STRAY, "--limit", "3")
    picture = demo.new("stray_light.png", "picture: those rays in the barrel")
    demo.command("view", raymap, "--where", STRAY, "-o", picture, quiet=True)
    report = demo.new("stray_light.html", "report: every event of twenty of them")
    demo.command("report", raymap, "--where", STRAY, "--limit", "20", "-o", report, quiet=True)
    stray, all_light = (demo.figures("query", raymap, text) for text in (STRAY, "detector(SensorPlane)"))
    if all_light["flux_w"] > 0:
        share, error = (100 * stray[key] / all_light["flux_w"] for key in ("flux_w", "flux_stderr_w"))
        _say(f"Of the rays that reach the sensor, {share:.2f} ± {error:.2f} % are stray light.")


def _title(text: str) -> None:
    print(f"\n\n{text}\n{'=' * len(text)}", flush=True)


def _say(text: str) -> None:
    print(f"\n{text}", flush=True)


def _indented(text: str) -> str:
    return "\n".join(f"  {line}" for line in text.rstrip().splitlines())


def _shown(path: Path) -> str:
    """A path as one would type it here."""
    relative = os.path.relpath(path)
    return relative if not relative.startswith("..") else str(path)


#: How one types the command that belongs to this Python.
_INSTALLED = Path(sys.executable).with_name("raymaps")
_COMMAND = _shown(_INSTALLED) if _INSTALLED.exists() else f"{_shown(Path(sys.executable))} -m raymaps"


def main() -> int:
    """Run the demo; returns the exit code."""
    parser = argparse.ArgumentParser(description="Simulate two examples and ask about their rays.")
    parser.add_argument("--out", type=Path, default=EXAMPLES.parent / "out", help="folder of the results")
    parser.add_argument("--rays", type=int, help="rays of each example, by default the scene's")
    chosen = parser.parse_args()
    started = time.monotonic()
    rays = [] if chosen.rays is None else ["--rays", str(chosen.rays)]
    try:
        demo = Demo(chosen.out)
        luminaire(demo, rays)
        stray_light(demo, rays)
    except DemoError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("demo: stopped.", file=sys.stderr)
        return 1
    _title(f"Done in {time.monotonic() - started:.0f} s. The results:")
    demo.list_results()
    print(f"\nPictures and report open in any viewer and browser. To ask more:  {_COMMAND} query MAP CRITERION")
    return 0


if __name__ == "__main__":
    sys.exit(main())
