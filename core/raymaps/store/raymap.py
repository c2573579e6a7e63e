# SPDX-License-Identifier: LGPL-2.1-or-later
"""A Ray Map on disk: a folder with a manifest, the scene as it was simulated, and portions."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.bands import RGB_BANDS, Bands
from raymaps.errors import MapError, OutputError
from raymaps.exact.faces import ExactFaces, exact_faces
from raymaps.formats.ray_file import write_rays
from raymaps.formats.ray_set import RaySet
from raymaps.geometry import BodyMesh, load_bodies, write_ply
from raymaps.names import Names
from raymaps.ray_numbers import n_replicates, ranks, ranks_before
from raymaps.scene import CrossingsSource, FaceGroup, Geometry, RaysSource, Scene, load_scene
from raymaps.store.lights import Stored
from raymaps.store.portion import Portion
from raymaps.store.sealed import seal, unseal
from raymaps.store.summary import PortionSummary, folder_name
from raymaps.store.writing import write_portion
from raymaps.traced import FaceIndex, TracedPortion

__all__ = ["MAP_FORMAT", "MAP_VERSION", "Manifest", "MapWriter", "RayMap"]

MAP_FORMAT = "raymaps-map"
MAP_VERSION = 2
MANIFEST_FILE, SCENE_FILE, PORTIONS_FOLDER = "manifest.json", "scene.json", "portions"
#: Held by the run that writes to the map; never replaced, so that two runs can't hold two of it.
LOCK_FILE = ".lock"


@dataclass(frozen=True)
class Manifest:
    """What holds for a whole map; stored as ``manifest.json``.

    Attributes
    ----------
    seed : int
    scene_hash : str
    names : Names
    rays_asked : int
        Number of rays that the simulation was asked for; fewer are present if it was interrupted.
    portion_rays : int
        Rays of a portion, as a run that goes on should make them.
    grid_mm : float
        Positions of events are multiples of it.
    program : str
        Version of Ray Maps that made the map.
    bands : Bands
        Bands of its light.
    version : int
        Version of the format.
    target : dict or None
        What error the run was to reach and how its number of rays was chosen, as `raymaps.target.Course.to_dict` says;
        None if the number was given.
    """

    seed: int
    scene_hash: str
    names: Names
    rays_asked: int
    portion_rays: int
    grid_mm: float
    program: str
    bands: Bands = RGB_BANDS
    version: int = MAP_VERSION
    target: dict[str, Any] | None = None

    def to_json(self) -> str:
        """As text."""
        data = {**self.__dict__, "names": self.names.to_dict(), "bands": self.bands.to_dict()}
        if self.target is None:
            del data["target"]
        return seal({"format": MAP_FORMAT, **data})

    @classmethod
    def read(cls, folder: Path) -> Manifest:
        """Read a map's manifest; raises `MapError`."""
        if not os.path.lexists(folder):
            raise MapError(f"Ray Map '{folder}': there is no such folder.")
        damaged = MapError(f"Ray Map '{folder}' has a damaged {MANIFEST_FILE}; trace the scene again.")
        try:
            data = json.loads((folder / MANIFEST_FILE).read_text(encoding="utf-8"))
        except (FileNotFoundError, NotADirectoryError):
            raise MapError(f"'{folder}' is not a Ray Map: it has no {MANIFEST_FILE}.") from None
        except PermissionError:
            raise MapError(f"Ray Map '{folder}' can't be read: permission denied.") from None
        except (OSError, ValueError, RecursionError) as error:
            raise damaged from error
        version = data.get("version") if isinstance(data, dict) else None
        if isinstance(version, int) and version > MAP_VERSION:
            raise MapError(
                f"Ray Map '{folder}' has version {version}, this program reads up to version {MAP_VERSION}: "
                "update Ray Maps."
            )
        try:
            data = unseal(data)
            if data["format"] != MAP_FORMAT or type(version) is not int or version < 1:
                raise ValueError("another format")
            return cls(
                seed=int(data["seed"]),
                scene_hash=str(data["scene_hash"]),
                names=Names.from_dict(data["names"]),
                rays_asked=int(data["rays_asked"]),
                portion_rays=int(data["portion_rays"]),
                grid_mm=float(data["grid_mm"]),
                program=str(data["program"]),
                bands=RGB_BANDS if version == 1 else Bands.from_dict(data["bands"]),
                version=version,
                target=None if data.get("target") is None else dict(data["target"]),
            )
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise damaged from error

    def write(self, folder: Path) -> None:
        """Write or replace a map's manifest, by one rename."""
        making = folder / f".{MANIFEST_FILE}-{os.getpid()}"
        making.write_text(self.to_json(), encoding="utf-8")
        making.replace(folder / MANIFEST_FILE)


class RayMap:
    """A Ray Map to be asked; opening it reads the manifest and the portions' summaries, nothing else.

    Attributes
    ----------
    path : Path
    manifest : Manifest
    names : Names
    bands : Bands
    portions : tuple of Portion, by their first rays
    """

    def __init__(self, path: Path, manifest: Manifest, portions: Sequence[Portion]):
        self.path = path
        self.manifest = manifest
        self.names = manifest.names
        self.bands = manifest.bands
        self.portions = tuple(portions)

    @classmethod
    def open(cls, path: str | Path) -> RayMap:
        """Open a map; raises `MapError` if it is missing, damaged, or newer than this program."""
        path = Path(path)
        manifest = Manifest.read(path)
        return cls(
            path, manifest, [Portion.open(folder, manifest.names, manifest.bands) for folder in _portion_folders(path)]
        )

    def of_portions(self, portions: Sequence[Portion]) -> RayMap:
        """The same map with other portions; what was read of its scene is not read again."""
        other = RayMap(self.path, self.manifest, portions)
        shared = ("scene", "meshes", "exact_faces", "source_flux_w")
        other.__dict__.update({name: self.__dict__[name] for name in shared if name in self.__dict__})
        return other

    @cached_property
    def scene(self) -> Scene:
        """The scene as it was simulated; raises `MapError` if it is not the one that the manifest speaks of."""
        scene = load_scene(self.path / SCENE_FILE)
        named = (tuple(scene.sources), tuple(scene.bodies), tuple(scene.surfaces), tuple(scene.detectors))
        if named != (self.names.sources, self.names.bodies, self.names.surfaces, self.names.detectors):
            raise MapError(
                f"Ray Map '{self.path}': its {SCENE_FILE} is not the scene that was simulated; trace it again."
            )
        return scene

    @cached_property
    def meshes(self) -> tuple[BodyMesh, ...]:
        """Triangles of the bodies; events count triangles through all of them in this order."""
        return load_bodies(self.scene)

    @cached_property
    def exact_faces(self) -> ExactFaces:
        """Exact surfaces that light met in place of triangles; maps of times before that don't say, and have none."""
        settings = self.scene.settings
        surfaces = settings.surfaces if "surfaces" in settings.model_fields_set else "faceted"
        scene = self.scene.model_copy(update={"settings": settings.model_copy(update={"surfaces": surfaces})})
        return exact_faces(scene, self.meshes)

    @property
    def n_rays(self) -> int:
        """Number of rays present."""
        return sum(portion.n_rays for portion in self.portions)

    @property
    def n_events(self) -> int:
        """Number of events present."""
        return sum(portion.n_events for portion in self.portions)

    @property
    def n_bytes(self) -> int:
        """Size of the portions on disk."""
        return sum(sum(portion.summary.file_bytes.values()) for portion in self.portions)

    @cached_property
    def rays_of_source(self) -> NDArray[np.int64]:
        """Rays present of each source, (n_sources,)."""
        counts = [portion.summary.rays_of_source for portion in self.portions]
        return np.sum(counts, axis=0) if counts else np.zeros(len(self.names.sources), np.int64)

    @property
    def n_replicates(self) -> int:
        """Independent sets R that the rays of each source are in, 1 where each ray is independent."""
        return n_replicates(self.scene)

    @cached_property
    def rays_of_replicate(self) -> NDArray[np.int64]:
        """Rays present of each source and replicate, (n_sources, R)."""
        if self.n_replicates == 1:
            return self.rays_of_source[:, None]
        last = self.n_replicates - 1 - np.arange(self.n_replicates)
        found = np.zeros((len(self.names.sources), self.n_replicates), np.int64)
        for portion in self.portions:
            before = self._ranks_before[portion.first_ray]
            up_to = before + portion.summary.rays_of_source
            found += (up_to[:, None] + last) // self.n_replicates - (before[:, None] + last) // self.n_replicates
        return found

    def group_of_rays(self, portion: Portion) -> NDArray[np.integer]:
        """Source s and replicate r of each ray of a portion as one number, s R + r: (n_rays,)."""
        source = portion.signatures.ray_source[portion.ray_signature]
        if self.n_replicates == 1:
            return source
        rank = ranks(source, self._ranks_before[portion.first_ray])
        return source * np.int64(self.n_replicates) + rank % self.n_replicates

    @cached_property
    def _ranks_before(self) -> dict[int, NDArray[np.int64]]:
        """Rays of each source before a portion, (n_sources,), by the portion's first ray."""
        found: dict[int, NDArray[np.int64]] = {}
        end, before = 0, np.zeros(len(self.names.sources), np.int64)
        for portion in self.portions:
            if portion.first_ray != end:
                before = ranks_before(self.scene, portion.first_ray)
            found[portion.first_ray] = before
            end, before = portion.first_ray + portion.n_rays, before + portion.summary.rays_of_source
        return found

    @cached_property
    def source_flux_w(self) -> NDArray[np.float64]:
        """Radiant flux of each source, (n_sources,)."""
        return np.array([source.flux_w for source in self.scene.sources.values()])

    @cached_property
    def ray_flux_w(self) -> NDArray[np.float64]:
        """Flux that a ray of each source was emitted with, (n_sources,); 0 where the map has no ray of it."""
        return np.where(self.rays_of_source > 0, self.source_flux_w / np.maximum(self.rays_of_source, 1), 0.0)

    @property
    def content_hash(self) -> str:
        """Hash of the stored rays alone: not of how they are split into portions, nor of when they were traced."""
        low = sum(portion.summary.content[0] for portion in self.portions) % 2**64
        high = sum(portion.summary.content[1] for portion in self.portions) % 2**64
        return f"{high:016x}{low:016x}"

    def missing_rays(self, n_rays: int) -> Iterator[tuple[int, int]]:
        """Runs of rays (first, number) below ``n_rays`` that are not present, a portion long at most."""
        at = 0
        ends = [(p.first_ray, p.first_ray + p.n_rays) for p in self.portions] + [(n_rays, n_rays)]
        for start, end in ends:
            while at < min(start, n_rays):
                n = min(self.manifest.portion_rays, min(start, n_rays) - at)
                yield at, n
                at += n
            at = max(at, end)


def _portion_folders(path: Path) -> list[Path]:
    """Folders of committed portions in the order of their first rays."""
    try:
        entries = sorted((path / PORTIONS_FOLDER).iterdir())
    except OSError as error:
        raise MapError(f"Ray Map '{path}' has no folder '{PORTIONS_FOLDER}' that can be read.") from error
    return [entry for entry in entries if entry.name.isdigit()]


class MapWriter:
    """Adds portions to a map; `write` may be called from several threads at once.

    Parameters
    ----------
    path : Path
        Of a map that exists (see `create`).
    faces : FaceIndex
    """

    def __init__(self, path: Path, faces: FaceIndex):
        self.path = path
        self._manifest = Manifest.read(path)
        self._faces = faces

    @staticmethod
    def create(
        path: Path,
        manifest: Manifest,
        scene: Scene,
        meshes: Sequence[BodyMesh],
        ray_sets: Mapping[str, RaySet] | None = None,
    ) -> None:
        """Make a map without portions; nothing is left if that fails. ``ray_sets`` are those of its sources, by name.

        Raises
        ------
        OutputError
            If the path exists already or can't be written.
        """
        if os.path.lexists(path):
            raise OutputError(f"'{path}' exists already: name another output, delete it, or go on with it by --resume.")
        making = path.with_name(f".{path.name}-making-{os.getpid()}")
        try:
            (making / PORTIONS_FOLDER).mkdir(parents=True)
            stored = _scene_in_map(scene, meshes)
            text = json.dumps(stored.model_dump(mode="json"), indent=1, ensure_ascii=False)
            (making / SCENE_FILE).write_text(text, encoding="utf-8")
            for body, mesh in zip(stored.bodies.values(), meshes, strict=True):
                write_ply(making / body.geometry.file, mesh)
            for name, rays in (ray_sets or {}).items():
                write_rays(making / _ray_file(stored, name), rays)
            manifest.write(making)
            making.rename(path)
        except OSError as error:
            raise OutputError(
                f"Ray Map '{path}' can't be written: {(error.strerror or str(error)).lower()}."
            ) from error
        finally:
            shutil.rmtree(making, ignore_errors=True)  # once renamed it is not there any more

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """Hold the map against other runs and clear away what killed ones left; raises `OutputError` if one is busy."""
        try:
            lock = open(self.path / LOCK_FILE, "ab")  # noqa: SIM115  held by the with below
        except OSError as error:
            raise OutputError(
                f"Ray Map '{self.path}' can't be written: {(error.strerror or str(error)).lower()}."
            ) from error
        with lock:
            if not _locked(lock.fileno()):
                raise OutputError(f"Ray Map '{self.path}' is being written by another run: wait for it or stop it.")
            for left in (self.path / PORTIONS_FOLDER).glob(".making-*"):
                shutil.rmtree(left, ignore_errors=True)
            for left in self.path.glob(f".{MANIFEST_FILE}-*"):
                left.unlink(missing_ok=True)
            yield

    def write(self, history: TracedPortion, stored: Stored = "rgb") -> PortionSummary:
        """Commit a portion: compressed here, visible by one rename; light of a spectral simulation as asked for.

        Raises
        ------
        OutputError
            If it can't be written, for instance because the disk is full; what was committed before stays valid.
        """
        try:
            return self._write(self.path / PORTIONS_FOLDER, history, stored)
        except OSError as error:
            raise OutputError(
                f"Ray Map '{self.path}': the rays from {history.first_ray} on can't be written "
                f"({(error.strerror or str(error)).lower()}); make room and go on with --resume: what was stored is "
                "kept."
            ) from error

    def portion(self, summary: PortionSummary) -> Portion:
        """A portion that was written."""
        folder = self.path / PORTIONS_FOLDER / folder_name(summary.first_ray)
        return Portion(folder, self._manifest.names, self._manifest.bands, summary)

    def apart(self, history: TracedPortion, stored: Stored, folder: Path) -> Portion:
        """Write a portion that is not the map's to another folder; raises `OutputError`."""
        try:
            summary = self._write(folder, history, stored)
        except OSError as error:
            raise OutputError(f"'{folder}' can't be written: {(error.strerror or str(error)).lower()}.") from error
        place = folder / folder_name(summary.first_ray)
        return Portion(place, self._manifest.names, self._manifest.bands, summary)

    def _write(self, folder: Path, history: TracedPortion, stored: Stored) -> PortionSummary:
        return write_portion(folder, history, self._manifest.names, self._faces, self._manifest.bands, stored)


def _scene_in_map(scene: Scene, meshes: Sequence[BodyMesh]) -> Scene:
    """The scene with its files as the map holds them: one PLY in mm a body, faces named, and one file a set of rays."""
    bodies: dict[str, Any] = {}
    for i, ((name, body), mesh) in enumerate(zip(scene.bodies.items(), meshes, strict=True)):
        counts = np.bincount(mesh.triangle_face, minlength=len(mesh.face_names))
        exact = {group.name: group.surface for group in body.geometry.faces or ()}
        faces = tuple(
            FaceGroup(name=face, triangles=int(n), surface=exact.get(face))
            for face, n in zip(mesh.face_names, counts, strict=True)
        )
        geometry = Geometry(file=f"geometry/{i:04d}.ply", faces=faces, smooth_faces=body.geometry.smooth_faces)
        bodies[name] = body.model_copy(update={"geometry": geometry})
    sources = {
        name: source.as_rays(_ray_file(scene, name)) if isinstance(source, RaysSource | CrossingsSource) else source
        for name, source in scene.sources.items()
    }
    return scene.model_copy(update={"bodies": bodies, "sources": sources})


def _ray_file(scene: Scene, source: str) -> str:
    """Where a map keeps the rays of a source."""
    return f"rays/{list(scene.sources).index(source):04d}.parquet"


def _locked(descriptor: int) -> bool:
    """Lock a file until it is closed; False if another process holds it. Where the system has no locks: True."""
    try:
        import fcntl
    except ImportError:
        return True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
