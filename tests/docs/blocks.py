# SPDX-License-Identifier: LGPL-2.1-or-later
"""Examples in the documentation: found, run, and compared with the output that the page shows.

A page marks its examples with HTML comments, which no reader sees:

    <!-- run -->            the code block below is run: python, sh, or sql (DuckDB)
    <!-- run: fails -->     the same, of a command that ends with an error
    <!-- file: NAME -->     the code block below is saved under this name
    <!-- output -->         the code block below is what the last run printed, numbers within their statistical errors
    <!-- output: words -->  the same, whatever the numbers are (times, sizes)

The blocks of a page run one after the other in one folder; each is complete in itself but for the files and, in sql,
the tables that earlier ones made. In an output "…" stands for anything on a line, and alone on a line for any lines.
Numbers of a line that ends in "..." are the first of many, and not compared.
"""

from __future__ import annotations

import contextlib
import io
import itertools
import math
import os
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

__all__ = ["Block", "Page", "difference", "find_blocks"]

_MARKED = re.compile(
    r"^<!-- (?P<mark>run|file|output)(?:: (?P<argument>[^>]+?))? -->\n```(?P<language>\w+)\n(?P<text>.*?)^```$",
    re.M | re.S,
)


@dataclass(frozen=True)
class Block:
    """A marked code block; ``line`` is where its text begins in the page, ``span`` the text's characters."""

    mark: str
    argument: str | None
    language: str
    text: str
    line: int
    span: tuple[int, int]


def find_blocks(markdown: str) -> list[Block]:
    """All marked code blocks of a page, in order."""
    return [
        Block(
            m["mark"],
            m["argument"],
            m["language"],
            m["text"],
            markdown.count("\n", 0, m.start("text")) + 1,
            m.span("text"),
        )
        for m in _MARKED.finditer(markdown)
    ]


class Page:
    """Runs the blocks of one page in a folder.

    Parameters
    ----------
    folder : Path
        Where the page's examples find and make their files.
    commands : Path
        Folder with the command ``raymaps``.
    """

    def __init__(self, folder: Path, commands: Path):
        self._folder = folder
        self._environment = {**os.environ, "PATH": f"{commands}{os.pathsep}{os.environ['PATH']}", "COLUMNS": "120"}
        self._database: Any = None

    def run(self, block: Block) -> str:
        """Run a block, or save it; returns what it printed."""
        if block.mark == "file":
            (self._folder / str(block.argument)).write_text(block.text, encoding="utf-8")
            return ""
        if block.language == "sh":
            return self._sh(block.text, fails=block.argument == "fails")
        with _working_in(self._folder):
            return {"python": self._python, "sql": self._sql}[block.language](block.text)

    def _python(self, text: str) -> str:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(text, "example", "exec"), {"__name__": "__main__"})
        return printed.getvalue()

    def _sh(self, text: str, fails: bool) -> str:
        done = subprocess.run(
            ["bash", "-ec", text], env=self._environment, cwd=self._folder, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True, timeout=300,
        )  # fmt: skip
        assert (done.returncode != 0) == fails, done.stdout
        assert "Traceback" not in done.stdout, done.stdout
        return done.stdout

    def _sql(self, text: str) -> str:
        """Run statements; the last one's rows as comma-separated values."""
        import duckdb

        self._database = self._database or duckdb.connect()
        cursor = self._database.execute(text)
        if not cursor.description or cursor.description[0][0] in ("Count", "Success"):
            return ""
        lines = [[column[0] for column in cursor.description], *cursor.fetchall()]
        return "".join(",".join(_cell(value) for value in line) + "\n" for line in lines)


def _cell(value: Any) -> str:
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


@contextlib.contextmanager
def _working_in(folder: Path) -> Iterator[None]:
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def difference(expected: str, printed: str, numbers: bool = True) -> str:
    """Where two outputs differ, in words; empty if they agree."""
    want, got = expected.rstrip().splitlines(), printed.rstrip().splitlines()
    while want:
        if want[0].strip() == "…":
            rest = want[1:]
            if not rest:
                return ""
            starts = (i for i in range(len(got)) if not _line_difference(rest[0], got[i], numbers))
            got = got[next(starts, len(got)) :]
            want = rest
            continue
        if not got:
            return f"the page shows {want[0]!r}, the example printed no more"
        told = _line_difference(want[0], got[0], numbers)
        if told:
            return told
        want, got = want[1:], got[1:]
    return f"the example printed {got[0]!r}, the page shows no more" if got else ""


_NUMBER = re.compile(r"(?<![\w.])[+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?(?![\d])")


def _line_difference(want: str, got: str, numbers: bool) -> str:
    told = f"the page shows {want!r}, the example printed {got!r}"
    head, dots, tail = want.partition("…")
    if dots:
        return "" if got.startswith(head) and got.endswith(tail.rpartition("…")[2]) else told
    if _words(want) != _words(got):
        return told
    if not numbers or want.endswith("..."):
        return ""
    for (a, error_a), (b, error_b) in zip(_values(want), _values(got), strict=True):
        if not abs(a - b) <= _tolerance(a, b, math.hypot(error_a, error_b)):
            return told
    return ""


def _words(line: str) -> list[str]:
    return _NUMBER.sub(" 0 ", line).split()


def _values(line: str) -> list[tuple[float, float]]:
    """Numbers of a line, each with the error that follows it after ±, or 0; an error itself has half of itself."""
    found = list(_NUMBER.finditer(line))
    values = [(float(m[0]), 0.0) for m in found]
    for i, (before, after) in enumerate(itertools.pairwise(found)):
        if "±" in line[before.end() : after.start()]:
            values[i] = (values[i][0], values[i + 1][0])
            values[i + 1] = (values[i + 1][0], values[i + 1][0] / 10)
    return values


def _tolerance(a: float, b: float, error: float) -> float:
    """Five standard errors; of a count, of its square root; of any other number, a thousandth."""
    if error > 0:
        return 5 * error
    counted = a.is_integer() and b.is_integer() and a > 100
    return 5 * math.sqrt(abs(a) + abs(b)) if counted else 1e-3 * max(abs(a), abs(b), 1e-9)
