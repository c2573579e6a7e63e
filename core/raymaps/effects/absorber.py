# SPDX-License-Identifier: LGPL-2.1-or-later
"""Absorption of all light on a surface."""

from __future__ import annotations

from raymaps.effects.usage import faces_of_kind
from raymaps.scene import Scene

__all__ = ["needed_by"]


def needed_by(scene: Scene) -> tuple[str, ...]:
    """A scene calls for absorbers if a face has one."""
    return faces_of_kind(scene, "absorber")
