# SPDX-License-Identifier: LGPL-2.1-or-later
"""See `docs.drawing`."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from matplotlib import rc_context

from docs.drawing import detectors, exact, media, scatter, sources, spectra, surfaces
from docs.drawing.look import LOOK, save

FIGURES = {
    name.removeprefix("draw_"): getattr(module, name)
    for module in (spectra, media, surfaces, exact, scatter, sources, detectors)
    for name in module.__all__
    if name.startswith("draw_")
}


def main() -> None:
    """Draw the pictures named, or all."""
    for name in sys.argv[1:] or FIGURES:
        with tempfile.TemporaryDirectory() as folder, rc_context(LOOK):
            save(FIGURES[name](Path(folder)), name)


if __name__ == "__main__":
    main()
