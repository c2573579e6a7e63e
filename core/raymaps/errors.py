# SPDX-License-Identifier: LGPL-2.1-or-later
"""The exceptions of Ray Maps.

    RayMapsError            every error that a user can cause or meet; its text is one clear sentence
    ├── SceneError          a scene file, its geometry or its optical properties
    │   └── FormatError          a file of another program that a scene speaks of or that is to be imported
    ├── MapError            a Ray Map that is missing, damaged, newer than this program, or of another scene
    ├── CriterionError      the text of a criterion, or a name in it
    ├── OutputError         a place that can't be written: exists, read-only, disk full
    ├── TraceError          the tracer itself gave up
    └── MissingPackageError      an optional package is needed and not installed

    Interrupted             the user stopped a run; what was committed is valid and can be resumed

How a ray ends (a miss, total reflection, a limit) is never an exception.
"""

from __future__ import annotations

from collections.abc import Iterable

__all__ = [
    "CriterionError",
    "FormatError",
    "Interrupted",
    "MapError",
    "MissingPackageError",
    "OutputError",
    "RayMapsError",
    "SceneError",
    "TraceError",
    "decapitalised",
    "listed",
    "shortened",
    "unknown_name",
]


class RayMapsError(Exception):
    """Root of all errors that are told to the user in one sentence."""


class SceneError(RayMapsError):
    """A scene file, its geometry or its optical properties can't be used.

    ``faults`` holds a sentence for each fault where more than one was found.
    """

    def __init__(self, sentence: str, faults: tuple[str, ...] = ()):
        super().__init__(sentence)
        self.faults = faults or (sentence,)


class FormatError(SceneError):
    """A file of another program can't be read: glass data, a BSDF, a luminaire, rays."""


class MapError(RayMapsError):
    """A Ray Map is missing, damaged, newer than this program, or belongs to another scene."""


class CriterionError(RayMapsError):
    """A criterion can't be read, or names something that the map does not hold."""


class OutputError(RayMapsError):
    """A file or folder can't be written."""


class TraceError(RayMapsError):
    """The tracer can't go on."""


class MissingPackageError(RayMapsError):
    """An optional package is needed and not installed."""

    def __init__(self, package: str, extra: str, purpose: str):
        super().__init__(
            f"{purpose} needs the package '{package}', which is not installed: run  make environment  in the source "
            f"tree, or install raymaps with its extra '{extra}'."
        )


class Interrupted(Exception):  # noqa: N818  not an error
    """The user stopped a run; all committed portions are valid and the run can be resumed."""


def unknown_name(what: str, name: str, known: Iterable[str]) -> str:
    """One sentence that says which name is unknown and lists the known ones (at most twelve)."""
    names = list(known)
    if not names:
        return f"Unknown {what} '{name}': there is none here."
    shown = ", ".join(f"'{n}'" for n in names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else "")
    return f"Unknown {what} '{name}'; known: {shown}."


def listed(names: Iterable[str], most: int = 20) -> str:
    """Names with commas between them; of many the first ones, and how many more."""
    names = list(names)
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def decapitalised(text: str) -> str:
    """A sentence as a part of another one: small first letter, no full stop."""
    return (text[:1].lower() + text[1:]).rstrip(".")


def shortened(text: str, length: int) -> str:
    """A text of at most so many letters, with an ellipsis where it was cut."""
    return text if len(text) <= length else text[: length - 1] + "…"
