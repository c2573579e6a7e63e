# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading text files of others."""

from __future__ import annotations

from pathlib import Path

from raymaps.errors import FormatError

__all__ = ["read_text"]

#: No text file that describes a material, a luminaire or a surface is larger.
LARGEST_BYTES = 256 * 2**20


def read_text(path: Path, encoding: str = "utf-8") -> str:
    """A file as text; bytes that are not of the encoding are read as Latin-1.

    Raises
    ------
    FormatError
        If the file is missing, can't be read, is too large, or is not text.
    """
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise FormatError(f"File '{path}' is larger than {LARGEST_BYTES // 2**20} MiB: it is not what is asked for.")
        data = path.read_bytes()
    except FileNotFoundError:
        raise FormatError(f"File '{path}': there is no such file.") from None
    except OSError as error:
        raise FormatError(f"File '{path}' can't be read: {(error.strerror or str(error)).lower()}.") from error
    if b"\0" in data and not data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise FormatError(f"File '{path}' is not a text file.")
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    try:
        return data.decode(encoding).removeprefix("\ufeff")
    except UnicodeDecodeError:
        return data.decode("latin-1")
