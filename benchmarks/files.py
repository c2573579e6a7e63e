# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a segment costs on disk, by file and column."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import pyarrow.parquet as pq

from raymaps.run import simulate
from raymaps.scene import Scene
from raymaps.store import RayMap

__all__ = ["Size", "measure_size", "size_of"]


@dataclass(frozen=True)
class Size:
    """Bytes of a map; ``columns``: (file, column) to compressed bytes, with what is around them as "(other)"."""

    scene: str
    bands: int
    detectors: int
    rays: int
    events: int
    segments: int
    crossings: int
    bytes: int
    columns: dict[tuple[str, str], int]

    def per_segment(self, n_bytes: int) -> float:
        return n_bytes / max(self.segments, 1)


def measure_size(scene: Scene, rays: int, path: Path) -> Size:
    """Simulate a scene into a map and weigh it."""
    return size_of(simulate(scene, path, rays=rays))


def size_of(raymap: RayMap) -> Size:
    """Weigh a map: all files of its portions as they lie on disk."""
    columns: Counter[tuple[str, str]] = Counter()
    for portion in raymap.portions:
        for file in sorted(portion.folder.iterdir()):
            left = file.stat().st_size
            if file.suffix == ".parquet":
                metadata = pq.ParquetFile(file).metadata
                for group in range(metadata.num_row_groups):
                    for index in range(metadata.num_columns):
                        column = metadata.row_group(group).column(index)
                        columns[file.stem, column.path_in_schema] += column.total_compressed_size
                        left -= column.total_compressed_size
            columns[file.stem, "(other)"] += left
    return Size(
        scene=raymap.scene.name,
        bands=raymap.bands.n,
        detectors=len(raymap.names.detectors),
        rays=raymap.n_rays,
        events=raymap.n_events,
        segments=raymap.n_events - raymap.n_rays,
        crossings=sum(portion.n_crossings for portion in raymap.portions),
        bytes=sum(columns.values()),
        columns=dict(columns),
    )
