# SPDX-License-Identifier: LGPL-2.1-or-later
"""How ``raymaps trace`` tells how far it is: a bar for people, lines of JSON for programs, or nothing."""

from __future__ import annotations

import sys
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from raymaps.runner import Progress

__all__ = ["ProgressStyle", "Teller", "choice_tellers", "teller_of"]


class ProgressStyle(str, Enum):
    """How a run tells how far it is."""

    bar = "bar"
    json = "json"
    none = "none"


class Teller:
    """Tells nothing but remembers the time; the base of those that tell how far a run is."""

    def __init__(self) -> None:
        self.elapsed_s = 0.0

    def __enter__(self) -> Teller:
        return self

    def __exit__(self, *exception: object) -> None:
        pass

    def progress(self, at: Progress) -> None:
        """After each portion."""
        self.elapsed_s = at.elapsed_s

    def note(self, text: str) -> None:
        """A sentence worth telling."""
        print(text, file=sys.stderr)


class _JsonTeller(Teller):
    """One JSON object a line on standard output."""

    def __init__(self, output: Path, print_json: Callable[[dict[str, Any]], None]):
        super().__init__()
        self._output = output
        self._print = print_json
        self._started = False

    def progress(self, at: Progress) -> None:
        super().progress(at)
        error = {} if at.error is None else {"error_percent": 100 * at.error}
        elapsed = {"elapsed_s": round(at.elapsed_s, 3)}
        if at.pilot_rays is not None:
            self._say({"event": "pilot", "rays": at.pilot_rays, "hits": at.pilot_hits, **elapsed, **error})
            return
        if not self._started:
            self._started = True
            self._say({"event": "start", "map": str(self._output), "rays": at.of, "done_rays": at.rays})
        remaining = None if at.remaining_s is None else round(at.remaining_s, 3)
        self._say(
            {"event": "progress", "rays": at.rays, "of": at.of, **elapsed, "remaining_s": remaining, **error}
        )  # fmt: skip

    def note(self, text: str) -> None:
        self._say({"event": "note", "text": text})

    def _say(self, data: dict[str, Any]) -> None:
        self._print(data)
        sys.stdout.flush()


class _BarTeller(Teller):
    """A bar on standard error; of a run to a target with the error so far."""

    def __enter__(self) -> _BarTeller:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        self._bar = Progress(
            TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("rays"),
            TimeRemainingColumn(), TextColumn("{task.fields[error]}"), console=Console(stderr=True),
        )  # fmt: skip
        self._task = self._bar.add_task("tracing", total=None, error="")
        self._bar.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._bar.stop()

    def progress(self, at: Progress) -> None:
        super().progress(at)
        error = "" if at.error is None else f"± {100 * at.error:.2g} %"
        if at.pilot_rays is not None:
            self._bar.update(self._task, description="pilot", completed=at.pilot_rays, error=error)
        else:
            self._bar.update(self._task, description="tracing", completed=at.rays, total=at.of, error=error)

    def note(self, text: str) -> None:
        self._bar.console.print(text, markup=False, highlight=False)


def teller_of(style: ProgressStyle, output: Path, print_json: Callable[[dict[str, Any]], None]) -> Teller:
    """What tells in a style; ``print_json`` prints one JSON object."""
    if style is ProgressStyle.json:
        return _JsonTeller(output, print_json)
    return _BarTeller() if style is ProgressStyle.bar else Teller()


def choice_tellers(
    style: ProgressStyle, print_json: Callable[[dict[str, Any]], None]
) -> tuple[Callable[[int, int, str], None] | None, Callable[[str], None] | None]:
    """What tells in a style which choice ``raymaps accuracy`` tries, and what tells a sentence."""
    if style is ProgressStyle.none:
        return None, None
    if style is ProgressStyle.bar:
        return lambda number, of, words: print(words, file=sys.stderr), lambda text: print(text, file=sys.stderr)

    def say(data: dict[str, Any]) -> None:
        print_json(data)
        sys.stdout.flush()

    return (
        lambda number, of, words: say({"event": "choice", "number": number, "of": of, "choice": words}),
        lambda text: say({"event": "note", "text": text}),
    )
