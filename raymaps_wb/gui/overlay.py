# SPDX-License-Identifier: LGPL-2.1-or-later
"""Many ray segments as one set of lines in the 3D view."""

import os

from pivy import coin

from raymaps_wb.compat import set_coin_values
from raymaps_wb.errors import TracerError

BYTES_PER_SEGMENT = 6 * 4 + 4  # two points in float32, one packed colour


class Overlay:
    """A Coin node with all shown rays: unlit, in their own colours, not pickable."""

    def __init__(self):
        self.node = coin.SoSeparator()
        light = coin.SoLightModel()
        light.model.setValue(coin.SoLightModel.BASE_COLOR)
        pick = coin.SoPickStyle()
        pick.style.setValue(coin.SoPickStyle.UNPICKABLE)
        self._style = coin.SoDrawStyle()
        self._lines = coin.SoLineSet()
        self._vertices = coin.SoVertexProperty()
        self._vertices.materialBinding.setValue(coin.SoVertexProperty.PER_FACE)
        self._lines.vertexProperty.setValue(self._vertices)
        for node in (light, pick, self._style, self._lines):
            self.node.addChild(node)
        self.n_segments = 0

    def set_line_width(self, pixels):
        """Width of the lines."""
        self._style.lineWidth.setValue(max(0.5, float(pixels)))

    def load(self, path, n_segments):
        """Show the segments of a file: n x 6 float32 (start and end in mm), then n packed colours (0xRRGGBBAA).

        Raises
        ------
        TracerError
            If the file is not there or does not hold that many segments.
        """
        try:
            with open(path, "rb") as file:
                data = file.read()
        except OSError as error:
            raise TracerError(f"The rays to draw can't be read from '{path}': {error.strerror}.") from error
        if len(data) != n_segments * BYTES_PER_SEGMENT:
            raise TracerError(
                f"The rays to draw are incomplete: {len(data)} bytes in '{os.path.basename(path)}' for {n_segments} "
                "segments; press Apply again."
            )
        view = memoryview(data)
        split = n_segments * 24
        self._vertices.enableNotify(False)
        set_coin_values(self._vertices.vertex, view[:split], 2 * n_segments)
        set_coin_values(self._vertices.orderedRGBA, view[split:], n_segments)
        self._vertices.enableNotify(True)
        set_coin_values(self._lines.numVertices, (2).to_bytes(4, "little") * n_segments, n_segments)
        self._vertices.touch()
        self.n_segments = n_segments

    def clear(self):
        """Show nothing."""
        self._lines.numVertices.setNum(0)
        self._vertices.vertex.setNum(0)
        self._vertices.orderedRGBA.setNum(0)
        self.n_segments = 0
