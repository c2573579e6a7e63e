# SPDX-License-Identifier: LGPL-2.1-or-later
"""Writing a portion: signatures are numbered, rays hashed, light summed, and all of it made visible by one rename."""

from __future__ import annotations

import hashlib
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.bands import Bands
from raymaps.kinds import EventKind
from raymaps.names import Names
from raymaps.store.codes import bits, step_code
from raymaps.store.columns import COLUMNS, pack_columns
from raymaps.store.identities import Identities
from raymaps.store.ledger import sum_ledger
from raymaps.store.lights import Stored, distinct_lights
from raymaps.store.signatures import NONE, SignatureTable
from raymaps.store.summary import SUMMARY_FILE, PortionSummary, folder_name
from raymaps.traced import FaceIndex, TracedPortion

__all__ = ["write_portion"]


def write_portion(
    folder: Path, history: TracedPortion, names: Names, faces: FaceIndex, bands: Bands, stored: Stored
) -> PortionSummary:
    """Write a portion beside its place and move it there by one rename.

    Parameters
    ----------
    folder : Path
        Folder of all portions; the new one is named by its first ray.
    history : TracedPortion
    names : Names
    faces : FaceIndex
    bands : Bands
        Of the history's light.
    stored : "rgb" or "spectral"
        How light of a spectral simulation is stored.

    Raises
    ------
    OSError
        If it can't be written; then nothing of it is left.
    """
    from raymaps.store.numbering import hash_rays, number_signatures  # compiled: only where it is needed

    n_rays, n_sources = len(history.source), len(names.sources)
    face = np.where(history.triangle >= 0, np.append(faces.triangle_face, NONE)[history.triangle], NONE)
    event_code = step_code(history.kind, face, history.medium, np.zeros(len(face)))
    crossing_code = step_code(
        np.full(len(history.crossing_row), EventKind.CROSSING), history.crossing_detector,
        np.full(len(history.crossing_row), NONE), history.crossing_registered,
    )  # fmt: skip
    signature, source, offsets, codes = number_signatures(
        history.source, n_sources, history.event_offsets, event_code, history.crossing_row, crossing_code
    )
    table = _signature_table(codes, offsets, source, faces)
    ray = history.first_ray + np.arange(n_rays)
    ray_of_event = np.repeat(ray, np.diff(history.event_offsets))
    ray_of_crossing = ray_of_event[history.crossing_row]
    position = history.position_mm
    distinct, light = distinct_lights(history.light, bands)
    lights = distinct.as_stored(stored)
    has_wavelengths = bands.is_spectral or bool(history.wavelength_nm.any())
    wavelength_nm = {"wavelength_nm": history.wavelength_nm} if has_wavelengths else {}
    files: dict[str, dict[str, NDArray[Any]]] = {
        "rays": {"ray": ray, "signature": signature, **wavelength_nm},
        "signatures": {
            "signature": np.repeat(np.arange(len(table)), np.diff(offsets)),
            **{name: getattr(table, name) for name in COLUMNS["signatures"] if name != "signature"},
        },
        "events": {
            "ray": ray_of_event, "triangle": history.triangle,
            "x_mm": position[:, 0], "y_mm": position[:, 1], "z_mm": position[:, 2],
            "light": light,
        },
        "lights": lights.to_columns(),
        "crossings": {
            "ray": ray_of_crossing,
            "event": history.crossing_row - history.event_offsets[ray_of_crossing - history.first_ray],
            "detector": history.crossing_detector,
            "x_mm": history.crossing_xy_mm[:, 0], "y_mm": history.crossing_xy_mm[:, 1],
            "angle_rad": history.crossing_angle_rad,
        },
    }  # fmt: skip
    identities = Identities(names)
    content = hash_rays(
        history.first_ray, identities.of_sources(history.source), history.event_offsets,
        identities.of_events(history.kind, face, history.medium), history.triangle, bits(position),
        light, bits(lights.values), bits(history.wavelength_nm), history.crossing_row,
        identities.of_crossings(history.crossing_detector, history.crossing_registered),
        bits(np.column_stack([history.crossing_xy_mm, history.crossing_angle_rad])),
    )  # fmt: skip
    name = folder_name(history.first_ray)
    making = folder / f".making-{name}-{os.getpid()}"
    try:
        making.mkdir()
        packed = {f"{file}.parquet": pack_columns(file, columns) for file, columns in files.items()}
        for file, data in packed.items():
            (making / file).write_bytes(data)
        summary = PortionSummary(
            history.first_ray, n_rays, len(face), len(crossing_code), len(table),
            tuple(int(n) for n in np.bincount(history.source, minlength=n_sources)),
            (int(content[0]), int(content[1])),
            sum_ledger(
                history.source, n_sources, history.event_offsets, history.kind, face, history.medium, light,
                distinct.power, faces.face_body, history.replicate,
            ),
            {file: len(data) for file, data in packed.items()},
            {file: hashlib.sha256(data).hexdigest() for file, data in packed.items()},
            {stage: round(seconds, 6) for stage, seconds in history.seconds.items()},
            has_wavelengths,
        )  # fmt: skip
        (making / SUMMARY_FILE).write_text(summary.to_json(), encoding="utf-8")
        making.rename(folder / name)
    finally:
        shutil.rmtree(making, ignore_errors=True)  # once renamed it is not there any more
    return summary


def _signature_table(
    codes: NDArray[np.int64], offsets: NDArray[np.int64], sources: NDArray[np.int16], faces: FaceIndex
) -> SignatureTable:
    """Steps as columns."""
    kind = (codes & 0xFF).astype(np.uint8)
    index = ((codes >> 32) - 1).astype(np.int32)
    is_crossing = kind == EventKind.CROSSING
    face = np.where(is_crossing, NONE, index).astype(np.int32)
    on_face = face >= 0
    source = np.full(len(codes), NONE, np.int16)
    source[offsets[:-1]] = sources
    return SignatureTable(
        offsets=offsets,
        kind=kind,
        source=source,
        body=np.where(on_face, np.append(faces.face_body, NONE)[face], NONE).astype(np.int32),
        face=face,
        surface=np.where(on_face, np.append(faces.face_surface, NONE)[face], NONE).astype(np.int16),
        medium=(((codes >> 16) & 0xFFFF) - 1).astype(np.int16),
        detector=np.where(is_crossing, index, NONE).astype(np.int16),
        registered=np.where(is_crossing, (codes >> 8) & 1, NONE).astype(np.int8),
    )
