# SPDX-License-Identifier: LGPL-2.1-or-later
"""Writing a result to the file that the user named: one sentence if it can't be done, and never half a file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from raymaps.errors import OutputError

__all__ = ["check_suffix", "new_file", "write_text"]


def check_suffix(path: str | Path, known: tuple[str, ...], what: str) -> str:
    """The file's suffix in small letters; raises `OutputError` if it is none of the known ones."""
    suffix = Path(path).suffix.lower()
    if suffix not in known:
        raise OutputError(f"{what} can't be written to '{path}': the name must end in {', '.join(known)}.")
    return suffix


@contextmanager
def new_file(path: str | Path) -> Iterator[Path]:
    """A place to write a file, which is moved to its name once it is whole.

    Raises
    ------
    OutputError
        If the folder does not exist or can't be written to, or the disk is full.
    """
    path = Path(path)
    making = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    try:
        if path.is_dir():
            raise IsADirectoryError(None, "it is a folder")
        yield making
        making.replace(path)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise OutputError(f"File '{path}' can't be written: {reason}. Name another place.") from error
    finally:
        with suppress(OSError):
            making.unlink()


def write_text(path: str | Path, text: str) -> Path:
    """Write a text file in UTF-8; raises `OutputError`."""
    with new_file(path) as making:
        making.write_text(text, encoding="utf-8", newline="")
    return Path(path)
