# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading text files of others."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from raymaps.errors import FormatError

__all__ = ["numbers_of", "read_text", "split_lines"]

#: No text file that describes a material, a luminaire or a surface is larger.
LARGEST_BYTES = 256 * 2**20


def read_text(path: Path, encoding: str = "utf-8", largest_bytes: int = LARGEST_BYTES) -> str:
    """A file as text; UTF-16 is recognised, and bytes that are not of the encoding are read as Latin-1.

    Raises
    ------
    FormatError
        If the file is missing, can't be read, is too large, or is not text.
    """
    try:
        if path.stat().st_size > largest_bytes:
            raise FormatError(
                f"File '{path}' is larger than {largest_bytes // 2**20} MiB: it is not what is asked for."
            )
        data = path.read_bytes()
    except FileNotFoundError:
        raise FormatError(
            f"File '{path}': there is no such file; a relative path counts from the scene file's folder."
        ) from None
    except OSError as error:
        raise FormatError(f"File '{path}' can't be read: {(error.strerror or str(error)).lower()}.") from error
    except ValueError:  # a name that no file can have
        raise FormatError(f"File {str(path)!r}: there is no such file.") from None
    encoding = _utf_16(data) or encoding
    if b"\0" in data and not encoding.startswith("utf-16"):
        raise FormatError(f"File '{path}' is not a text file.")
    try:
        text = data.decode(encoding).removeprefix("\ufeff")
    except UnicodeDecodeError:
        if encoding.startswith("utf-16"):
            raise FormatError(f"File '{path}' is not a text file, or was cut short.") from None
        return data.decode("latin-1")
    if "\0" in text:
        raise FormatError(f"File '{path}' is not a text file.")
    return text


def _utf_16(data: bytes) -> str | None:
    """Which UTF-16 the bytes are, by their mark or, without one, by the zeros beside Latin letters."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    start = data[:400]
    if len(start) >= 4 and 0 not in start[0::2] and not any(start[1::2]):
        return "utf-16-le"
    if len(start) >= 4 and 0 not in start[1::2] and not any(start[0::2]):
        return "utf-16-be"
    return None


def numbers_of(words: Iterable[str], where: str) -> list[float]:
    """Words as finite numbers.

    Raises
    ------
    FormatError
        With the first word that is no finite number.
    """
    numbers = []
    for word in words:
        try:
            number = float(word if word.isascii() and "_" not in word else "")
        except ValueError:
            raise FormatError(f"{where}: '{word[:40]}' is not a number{_hint(word)}.") from None
        if not abs(number) < float("inf"):
            raise FormatError(f"{where}: '{word[:40]}' is not a finite number.")
        numbers.append(number)
    return numbers


def _hint(word: str) -> str:
    return " (decimals follow a point, not a comma)" if word.replace(",", "").lstrip("+-").isdigit() else ""


def split_lines(text: str) -> list[str]:
    """Lines as all systems end them; other characters that `str.splitlines` breaks at are left within their line."""
    return re.split(r"\r\n|\n|\r", text)
