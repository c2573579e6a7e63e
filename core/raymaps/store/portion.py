# SPDX-License-Identifier: LGPL-2.1-or-later
"""A portion on disk: written once, made visible by one rename, read column by column as asked for."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.bands import Bands
from raymaps.errors import MapError
from raymaps.kinds import KILL_REASONS, EventKind
from raymaps.names import Names
from raymaps.store.columns import COLUMNS, REMEDY, pack_columns, read_columns
from raymaps.store.identities import Identities
from raymaps.store.lights import Lights, Stored, distinct_lights
from raymaps.store.sealed import seal, unseal
from raymaps.store.signatures import NONE, SignatureTable
from raymaps.traced import FaceIndex, TracedPortion

__all__ = ["LedgerEntry", "Portion", "PortionSummary", "write_portion"]

SUMMARY_FILE = "portion.json"


@dataclass(frozen=True)
class LedgerEntry:
    """Light of a source's rays that ended in one way, as a sum of their relative light.

    ``what`` is "body" or "medium" (absorbed; ``index`` says by which), "escaped", or "killed" (``index`` is the
    `EventKind`).
    """

    source: int
    what: str
    index: int
    light: float


@dataclass(frozen=True)
class PortionSummary:
    """What is known of a portion without opening its columns; stored as ``portion.json``."""

    first_ray: int
    n_rays: int
    n_events: int
    n_crossings: int
    n_signatures: int
    rays_of_source: tuple[int, ...]
    content: tuple[int, int]
    ledger: tuple[LedgerEntry, ...]
    file_bytes: dict[str, int]
    file_sha256: dict[str, str]
    seconds: dict[str, float]

    def to_json(self) -> str:
        """As text."""
        data = {**self.__dict__, "content": [f"{word:016x}" for word in self.content]}
        return seal({**data, "ledger": [entry.__dict__ for entry in self.ledger]})

    @classmethod
    def from_json(cls, text: str) -> PortionSummary:
        """From text; raises `KeyError`, `TypeError` or `ValueError` if it is damaged."""
        data = unseal(json.loads(text))
        return cls(
            first_ray=int(data["first_ray"]),
            n_rays=int(data["n_rays"]),
            n_events=int(data["n_events"]),
            n_crossings=int(data["n_crossings"]),
            n_signatures=int(data["n_signatures"]),
            rays_of_source=tuple(int(n) for n in data["rays_of_source"]),
            content=(int(data["content"][0], 16), int(data["content"][1], 16)),
            ledger=tuple(
                LedgerEntry(int(entry["source"]), str(entry["what"]), int(entry["index"]), float(entry["light"]))
                for entry in data["ledger"]
            ),
            file_bytes={str(name): int(size) for name, size in data["file_bytes"].items()},
            file_sha256={str(name): str(digest) for name, digest in data["file_sha256"].items()},
            seconds={str(stage): float(seconds) for stage, seconds in data.get("seconds", {}).items()},
        )


# Codes of steps: kind, registered, medium + 1 and face (or detector) + 1 in one word of 64 bits.


def _step_code(kind: Any, index: Any, medium: Any, registered: Any) -> NDArray[np.int64]:
    wide = [np.asarray(part).astype(np.int64) for part in (kind, index, medium, registered)]
    return wide[0] | (wide[3] << 8) | ((wide[2] + 1) << 16) | ((wide[1] + 1) << 32)


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
    event_code = _step_code(history.kind, face, history.medium, np.zeros(len(face)))
    crossing_code = _step_code(
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
    wavelength_nm = {"wavelength_nm": history.wavelength_nm} if bands.is_spectral else {}
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
        identities.of_events(history.kind, face, history.medium), history.triangle, _bits(position),
        light, _bits(lights.values), _bits(history.wavelength_nm), history.crossing_row,
        identities.of_crossings(history.crossing_detector, history.crossing_registered),
        _bits(np.column_stack([history.crossing_xy_mm, history.crossing_angle_rad])),
    )  # fmt: skip
    name = _folder_name(history.first_ray)
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
            _ledger(history, light, distinct.power, n_sources, face, faces.face_body),
            {file: len(data) for file, data in packed.items()},
            {file: hashlib.sha256(data).hexdigest() for file, data in packed.items()},
            {stage: round(seconds, 6) for stage, seconds in history.seconds.items()},
        )  # fmt: skip
        (making / SUMMARY_FILE).write_text(summary.to_json(), encoding="utf-8")
        making.rename(folder / name)
    finally:
        shutil.rmtree(making, ignore_errors=True)  # once renamed it is not there any more
    return summary


def _folder_name(first_ray: int) -> str:
    return f"{first_ray:012d}"


def _bits(values: NDArray[np.floating]) -> NDArray[Any]:
    values = np.ascontiguousarray(values)
    return values.view(f"u{values.itemsize}")


def _ledger(
    history: TracedPortion,
    light: NDArray[np.uint32],
    light_power: NDArray[np.float64],
    n_sources: int,
    face: NDArray[np.int32],
    face_body: NDArray[np.int32],
) -> tuple[LedgerEntry, ...]:
    """Where each source's light went, summed over the portion's rays."""
    from raymaps.store.numbering import sum_light

    n_bodies = int(face_body.max()) + 1 if len(face_body) else 0
    n_media = int(history.medium.max()) + 1
    accounts = [
        *(("body", index) for index in range(n_bodies)),
        *(("medium", index) for index in range(n_media)),
        ("escaped", 0),
        *(("killed", int(kind)) for kind in KILL_REASONS),
    ]
    # an event's account follows from its kind: light is lost to a body or a medium, or ends outside or killed
    by_body, by_medium, at_end = np.zeros(256, bool), np.zeros(256, bool), np.zeros(256, np.int32)
    by_body[list(EventKind)] = True
    by_body[EventKind.MEDIUM_ABSORPTION] = False
    by_medium[EventKind.MEDIUM_ABSORPTION] = True
    for index, (what, kind) in enumerate(accounts):
        if what in ("escaped", "killed"):
            end = EventKind.LEFT if what == "escaped" else kind
            by_body[end], at_end[end] = False, -1 - index
    account = at_end[history.kind]
    on_body = by_body[history.kind] & (face >= 0)
    account[on_body] = face_body[face[on_body]]
    # an interface takes no light: what is lost on the way to it is the medium's (rounding of its recolouring)
    lossless = np.flatnonzero(
        np.isin(history.kind, (EventKind.FRESNEL_REFLECTION, EventKind.FRESNEL_REFRACTION, EventKind.MEDIUM_SCATTERING))
    )
    account[lossless] = n_bodies + history.medium[lossless - 1]
    in_medium = by_medium[history.kind]
    account[in_medium] = n_bodies + history.medium[in_medium]
    sums = np.zeros((n_sources, len(accounts)))
    sum_light(history.source, history.event_offsets, light, light_power, account, sums)
    return tuple(
        LedgerEntry(int(source), accounts[index][0], accounts[index][1], float(sums[source, index]))
        for source, index in zip(*np.nonzero(sums), strict=True)
    )


class Portion:
    """A portion of a map; columns are read when first asked for, kept, and read-only.

    Parameters
    ----------
    folder : Path
    names : Names
    bands : Bands
    summary : PortionSummary
    """

    def __init__(self, folder: Path, names: Names, bands: Bands, summary: PortionSummary):
        self.folder = folder
        self.names = names
        self.bands = bands
        self.summary = summary
        self.first_ray = summary.first_ray
        self.n_rays = summary.n_rays
        self.n_events = summary.n_events
        self.n_crossings = summary.n_crossings

    @classmethod
    def open(cls, folder: Path, names: Names, bands: Bands) -> Portion:
        """Read a portion's summary and see that its files have their sizes; raises `MapError`."""
        try:
            summary = PortionSummary.from_json((folder / SUMMARY_FILE).read_text(encoding="utf-8"))
        except (OSError, ValueError, KeyError, TypeError, IndexError, RecursionError) as error:
            raise MapError(f"Ray Map portion '{folder}' has no sound {SUMMARY_FILE}; {REMEDY}.") from error
        if folder.name != _folder_name(summary.first_ray):
            raise MapError(f"Ray Map portion '{folder}' holds the rays from {summary.first_ray} on; {REMEDY}.")
        for name, size in summary.file_bytes.items():
            try:
                found = (folder / name).stat().st_size
            except OSError:
                raise MapError(f"Ray Map file '{folder / name}' is missing; {REMEDY}.") from None
            if found != size:
                raise MapError(f"Ray Map file '{folder / name}' has {found} bytes in place of {size}; {REMEDY}.")
        return cls(folder, names, bands, summary)

    def _read(self, table: str, *names: str) -> dict[str, NDArray[Any]]:
        return read_columns(self.folder / f"{table}.parquet", names or None)

    @cached_property
    def signatures(self) -> SignatureTable:
        """Signatures of this portion."""
        columns = self._read("signatures")
        counts = np.bincount(columns.pop("signature"), minlength=self.summary.n_signatures)
        return SignatureTable(offsets=np.concatenate([[0], np.cumsum(counts)]), **columns)

    @cached_property
    def ray_signature(self) -> NDArray[np.uint32]:
        """Signature of each ray, (n_rays,)."""
        return self._read("rays", "signature")["signature"]

    @cached_property
    def event_offsets(self) -> NDArray[np.int64]:
        """Ray i's events are the rows ``event_offsets[i]`` to ``event_offsets[i + 1] - 1``, (n_rays + 1,)."""
        return np.concatenate([[0], np.cumsum(self.signatures.n_events[self.ray_signature])])

    @cached_property
    def event_step(self) -> NDArray[np.int64]:
        """Row in `signatures` of each event, (n_events,): its kind, face, medium and so on."""
        table = self.signatures
        steps = np.flatnonzero(table.kind != EventKind.CROSSING)  # of all signatures, one after the other
        first = np.concatenate([[0], np.cumsum(table.n_events)])[self.ray_signature]
        within = np.arange(self.n_events) - np.repeat(self.event_offsets[:-1], np.diff(self.event_offsets))
        return steps[np.repeat(first, np.diff(self.event_offsets)) + within]

    @cached_property
    def triangle(self) -> NDArray[np.int32]:
        """Triangle of each event among those of all bodies, (n_events,); -1 none."""
        return self._read("events", "triangle")["triangle"]

    @cached_property
    def position_mm(self) -> NDArray[np.floating]:
        """Place of each event, (n_events, 3)."""
        columns = self._read("events", "x_mm", "y_mm", "z_mm")
        return _read_only(np.stack(list(columns.values()), axis=1))

    @cached_property
    def lights(self) -> Lights:
        """The distinct lights of this portion."""
        if "lights.parquet" not in self.summary.file_bytes:  # version 1: a light for each event
            return Lights.from_columns(self._read("events", "r", "g", "b"), self.bands)
        try:
            return Lights.from_columns(self._read("lights"), self.bands)
        except ValueError as error:
            raise MapError(
                f"Ray Map file '{self.folder / 'lights.parquet'}' is damaged ({error}); {REMEDY}."
            ) from error

    @cached_property
    def event_light(self) -> NDArray[np.uint32]:
        """Row in `lights` of the light after each event, (n_events,)."""
        if "lights.parquet" not in self.summary.file_bytes:
            return _read_only(np.arange(self.n_events, dtype=np.uint32))
        return self._read("events", "light")["light"]

    @cached_property
    def power(self) -> NDArray[np.float64]:
        """Light after each event, all bands together, relative to the ray's emission, (n_events,)."""
        return _read_only(self.lights.power[self.event_light])

    @cached_property
    def light(self) -> NDArray[np.float32]:
        """Light by band after each event relative to the ray's emission, (n_events, n_bands).

        Raises
        ------
        MapError
            If colours were stored in place of spectra.
        """
        spectra = self.lights.spectra
        if spectra is None:
            raise MapError(f"Ray Map portion '{self.folder}' holds colours, not spectra: trace with --store spectral.")
        return _read_only(spectra[self.event_light])

    @cached_property
    def shown_light(self) -> NDArray[np.float32]:
        """Light after each event as it is drawn, (n_events, 3); see `Lights.shown`."""
        return _read_only(self.lights.shown[self.event_light])

    @cached_property
    def ray_wavelength_nm(self) -> NDArray[np.float32]:
        """Wavelength that dispersion narrowed each ray to, (n_rays,); 0 if none."""
        if not self.bands.is_spectral:
            return _read_only(np.zeros(self.n_rays, np.float32))
        return self._read("rays", "wavelength_nm")["wavelength_nm"]

    @cached_property
    def _crossings(self) -> dict[str, NDArray[Any]]:
        return self._read("crossings")

    @cached_property
    def crossing_ray(self) -> NDArray[np.int64]:
        """Ray of each crossing, counted within the portion, (n_crossings,)."""
        return _read_only(self._crossings["ray"] - self.first_ray)

    @cached_property
    def crossing_row(self) -> NDArray[np.int64]:
        """Row of the event that starts each crossing segment, (n_crossings,)."""
        return _read_only(self.event_offsets[self.crossing_ray] + self._crossings["event"])

    @property
    def crossing_detector(self) -> NDArray[np.int16]:
        """Detector of each crossing, (n_crossings,)."""
        return self._crossings["detector"]

    @cached_property
    def crossing_xy_mm(self) -> NDArray[np.float32]:
        """Place of each crossing in the detector's axes, (n_crossings, 2)."""
        return _read_only(np.stack([self._crossings["x_mm"], self._crossings["y_mm"]], axis=1))

    @property
    def crossing_angle_rad(self) -> NDArray[np.float32]:
        """Angle of each crossing, 0 head-on at the front to pi head-on from behind, (n_crossings,)."""
        return self._crossings["angle_rad"]

    @cached_property
    def crossing_registered(self) -> NDArray[np.bool_]:
        """Whether the detector's own side and angle accept each crossing, (n_crossings,)."""
        table = self.signatures
        is_crossing = table.kind == EventKind.CROSSING
        per_signature = np.add.reduceat(is_crossing.astype(np.int64), table.offsets[:-1])
        steps = np.flatnonzero(is_crossing)
        first = np.concatenate([[0], np.cumsum(per_signature)])[self.ray_signature]
        start = np.concatenate([[0], np.cumsum(per_signature[self.ray_signature])])[:-1]
        within = np.arange(self.n_crossings) - start[self.crossing_ray]
        return _read_only(table.registered[steps[first[self.crossing_ray] + within]] == 1)

    def damaged_files(self) -> tuple[str, ...]:
        """Names of files whose bytes are not those that were written; all of them are read."""
        return tuple(
            name
            for name, digest in self.summary.file_sha256.items()
            if hashlib.sha256((self.folder / name).read_bytes()).hexdigest() != digest
        )

    def forget(self) -> None:
        """Let go of the columns read so far; they are read again when asked for."""
        for name in [name for name in self.__dict__ if isinstance(getattr(type(self), name, None), cached_property)]:
            del self.__dict__[name]

    def content(self) -> tuple[int, int]:
        """Hash of the portion's rays, computed from what is stored now; compare with ``summary.content``."""
        from raymaps.store.numbering import hash_rays

        table = self.signatures
        step = self.event_step
        kind, face, medium = table.kind[step], table.face[step], table.medium[step]
        source, detector = table.ray_source[self.ray_signature], self.crossing_detector
        if "lights.parquet" in self.summary.file_bytes:
            identities = Identities(self.names)
            sources = identities.of_sources(source)
            events = identities.of_events(kind, face, medium)
            crossings = identities.of_crossings(detector, self.crossing_registered)
        else:  # version 1 hashed indices
            sources = source
            events = _step_code(kind, face, medium, np.zeros(self.n_events))
            crossings = _step_code(
                np.full(self.n_crossings, EventKind.CROSSING), detector,
                np.full(self.n_crossings, NONE), self.crossing_registered,
            )  # fmt: skip
        low, high = hash_rays(
            self.first_ray, sources, self.event_offsets, events, self.triangle,
            _bits(self.position_mm), self.event_light, _bits(self.lights.values), _bits(self.ray_wavelength_nm),
            self.crossing_row, crossings,
            _bits(np.column_stack([self.crossing_xy_mm, self.crossing_angle_rad])),
        )  # fmt: skip
        return int(low), int(high)


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    array.setflags(write=False)
    return array
