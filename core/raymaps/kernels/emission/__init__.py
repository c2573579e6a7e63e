# SPDX-License-Identifier: LGPL-2.1-or-later
"""Emission: where rays start and where they go, one module a kind of source.

Each has ``run(slots, wave, key, ...)``, which fills position and direction of the slots whose source it is; lengths in
frame units.
"""

from raymaps.kernels.emission.disc import run as emit_disc
from raymaps.kernels.emission.faces import run as emit_faces
from raymaps.kernels.emission.point import run as emit_point

__all__ = ["emit_disc", "emit_faces", "emit_point"]
