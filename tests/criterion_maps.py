# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small random Ray Maps in memory, and the rays in them as plain Python objects for slow, obvious reference code.

The maps are random on purpose: they hold sequences of events that no scene would give, so that a criterion meets every
combination of kind, body, face, surface property, medium and detector.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from types import SimpleNamespace

import numpy as np

from raymaps.bands import RGB_BANDS
from raymaps.kinds import ENDINGS, KILL_REASONS, EventKind
from raymaps.names import Names
from raymaps.scene import Scene
from raymaps.store import LedgerEntry, Lights
from raymaps.store.signatures import NONE, STEP_COLUMNS, SignatureTable

NAMES = Names(
    sources=("LED", "Lamp 2", "Beam"),
    bodies=("Lens", "Barrel", "Plate"),
    surfaces=("polished", "black", "white"),
    media=("air", "glass"),
    detectors=("Sensor", "Wall", "Skin", "Sky"),
    faces=((0, "Face1"), (0, "Face2"), (1, "Face1"), (2, "Face1"), (2, "Top side")),
)
SOURCE_FLUX_W = (1.0, 3.0, 0.5)

_ON_SURFACES = [
    kind for kind in EventKind if EventKind.DIFFUSE_REFLECTION <= kind <= EventKind.BSDF_SPECULAR_REFRACTION
]
_ENDINGS = [kind for kinds in ENDINGS.values() for kind in kinds]


@dataclass
class Crossing:
    detector: int
    x_mm: float
    y_mm: float
    angle_rad: float
    registered: bool


#: Kinds of events that are on no surface, whatever place is stored with them.
OFF_SURFACES = (EventKind.MEDIUM_ABSORPTION, EventKind.MEDIUM_SCATTERING, EventKind.LEFT)


@dataclass
class Event:
    kind: EventKind
    source: int = NONE
    body: int = NONE
    face: int = NONE
    surface: int = NONE
    medium: int = NONE
    light: tuple[float, float, float] = (0.0, 0.0, 0.0)
    position_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    crossings: list[Crossing] = field(default_factory=list)
    wavelength_nm: float = 0.0  # of an emission: to which the ray is narrowed


Ray = list[Event]


def scene() -> Scene:
    """A scene with the names, sources and detectors of the random maps; its geometry files don't exist."""
    bodies = {body: {"geometry": {"file": f"{body}.stl"}, "medium": None, "surface": "white"} for body in NAMES.bodies}
    detector = {"kind": "rectangle", "center_mm": [0, 0, 0], "normal": [0, 0, 1], "x_axis": [1, 0, 0]}
    return Scene.model_validate(
        {
            "media": {name: {"refractive_index": 1.5} for name in NAMES.media},
            "surfaces": {name: {"kind": "absorber"} for name in NAMES.surfaces},
            "bodies": bodies,
            "sources": {
                name: {"kind": "point", "flux_w": flux_w, "position_mm": [0, 0, 0]}
                for name, flux_w in zip(NAMES.sources, SOURCE_FLUX_W, strict=True)
            },
            "detectors": {
                "Sensor": {**detector, "width_mm": 4, "height_mm": 2, "resolution": [8, 4], "max_angle_deg": 60},
                "Wall": {**detector, "width_mm": 10, "height_mm": 10, "resolution": [3, 3], "side": "both"},
                "Skin": {"kind": "face", "body": "Plate", "faces": ["Top side"]},
                "Sky": {"kind": "far_field"},
            },
        }
    )


def is_registered(detector: int, angle_rad: float) -> bool:
    """What `scene`'s detectors accept: Sensor its front up to 60 degrees, Wall both sides."""
    return angle_rad <= math.radians(60) if detector == 0 else True


def random_crossing(rng: np.random.Generator) -> Crossing:
    detector = int(rng.integers(2))
    half = ((2.0, 1.0), (5.0, 5.0))[detector]
    angle_rad = float(rng.uniform(0, math.pi))
    x_mm, y_mm = rng.uniform(-half[0], half[0]), rng.uniform(-half[1], half[1])
    return Crossing(detector, float(x_mm), float(y_mm), angle_rad, is_registered(detector, angle_rad))


def random_ray(rng: np.random.Generator, n_sources: int = len(NAMES.sources), max_events: int = 6) -> Ray:
    """A ray of random events; its light never grows."""

    def place() -> dict[str, int]:
        face = int(rng.integers(len(NAMES.faces)))
        return {"body": NAMES.faces[face][0], "face": face, "surface": int(rng.integers(len(NAMES.surfaces)))}

    def crossings() -> list[Crossing]:
        return [random_crossing(rng) for _ in range(int(rng.choice(3, p=[0.6, 0.3, 0.1])))]

    light = rng.dirichlet((1.0, 1.0, 1.0))
    medium = int(rng.integers(2))
    emission_place = place() if rng.random() < 0.5 else {}
    emission = Event(EventKind.EMISSION, int(rng.integers(n_sources)), medium=medium, **emission_place)
    events = [emission]
    for _ in range(int(rng.integers(0, max_events))):
        scattered = rng.random() < 0.2
        kind = EventKind.MEDIUM_SCATTERING if scattered else _ON_SURFACES[int(rng.integers(len(_ON_SURFACES)))]
        medium = medium if scattered else int(rng.integers(2))
        events.append(Event(kind, medium=medium, **({} if scattered else place())))
    for event in events:
        event.crossings = crossings()
        event.light = tuple(float(x) for x in np.float32(light))
        light = light * rng.uniform(0.3, 1.0, 3)
    ending = _ENDINGS[int(rng.integers(len(_ENDINGS)))]
    gone = ending in ENDINGS["absorbed"]
    # a place also where it means nothing, of the surface ahead of an absorption on the way
    where = place() if rng.random() < 0.7 else {}
    medium = int(rng.integers(2))
    events.append(Event(ending, medium=medium, light=(0.0, 0.0, 0.0) if gone else events[-1].light, **where))
    emission.wavelength_nm = float(np.float32(rng.uniform(400, 700))) if rng.random() < 0.4 else 0.0
    for event in events:
        event.position_mm = tuple(float(x) for x in rng.normal(0, 10, 3))
    return events


def steps_of(ray: Ray) -> tuple[tuple[int, ...], ...]:
    """A ray's signature: one tuple a step, in the order of `STEP_COLUMNS`."""
    steps = []
    for event in ray:
        steps.append((event.kind, event.source, event.body, event.face, event.surface, event.medium, NONE, NONE))
        for crossing in event.crossings:
            steps.append(
                (EventKind.CROSSING, NONE, NONE, NONE, NONE, NONE, crossing.detector, int(crossing.registered))
            )
    return tuple(tuple(int(x) for x in step) for step in steps)


class MemoryPortion:
    """The columns of a portion, made from rays instead of read from files; see `raymaps.store.Portion`."""

    def __init__(self, first_ray: int, rays: list[Ray]):
        self.first_ray = first_ray
        self.rays = rays
        self.n_rays = len(rays)
        self.n_events = sum(len(ray) for ray in rays)
        distinct: dict[tuple[tuple[int, ...], ...], int] = {}
        self.ray_signature = np.array([distinct.setdefault(steps_of(ray), len(distinct)) for ray in rays], np.uint32)
        steps = np.array([step for signature in distinct for step in signature], np.int64).reshape(
            -1, len(STEP_COLUMNS)
        )
        self.signatures = SignatureTable(
            np.concatenate([[0], np.cumsum([len(signature) for signature in distinct], dtype=np.int64)]).astype(
                np.int64
            ),
            **{name: steps[:, i].astype(dtype) for i, (name, dtype) in enumerate(STEP_COLUMNS.items())},
        )
        killed = [LedgerEntry(0, "killed", int(ray[-1].kind), 1.0) for ray in rays if ray[-1].kind in KILL_REASONS]
        self.summary = SimpleNamespace(ledger=killed)
        self.event_offsets = np.concatenate([[0], np.cumsum([len(ray) for ray in rays], dtype=np.int64)]).astype(
            np.int64
        )
        events = [event for ray in rays for event in ray]
        self.triangle = np.full(len(events), NONE, np.int32)
        self.light = self.shown_light = np.array([event.light for event in events], np.float32).reshape(-1, 3)
        self.lights = Lights(self.light, ("r", "g", "b"), RGB_BANDS)
        self.event_light = np.arange(len(events), dtype=np.uint32)
        self.power = self.lights.power
        self.ray_wavelength_nm = np.array([ray[0].wavelength_nm for ray in rays], np.float32)
        self.position_mm = np.array([event.position_mm for event in events], np.float64).reshape(-1, 3)
        crossed = [(row, c) for row, event in enumerate(events) for c in event.crossings]
        crossings = [crossing for _, crossing in crossed]
        self.n_crossings = len(crossed)
        self.crossing_row = np.array([row for row, _ in crossed], np.int64)
        self.crossing_ray = np.searchsorted(self.event_offsets, self.crossing_row, side="right") - 1
        self.crossing_detector = np.array([c.detector for c in crossings], np.int16)
        self.crossing_xy_mm = np.array([(c.x_mm, c.y_mm) for c in crossings], np.float64).reshape(-1, 2)
        self.crossing_angle_rad = np.array([c.angle_rad for c in crossings], np.float64)
        self.crossing_registered = np.array([c.registered for c in crossings], bool)


class MemoryMap:
    """A Ray Map of rays in memory; see `raymaps.store.RayMap`."""

    def __init__(self, rays: list[Ray], portion_rays: int):
        self.path = "memory.raymap"
        self.manifest = SimpleNamespace(grid_mm=0.0)  # positions are exact
        self.names = NAMES
        self.bands = RGB_BANDS
        self.rays = rays
        self.n_rays = len(rays)
        self.n_events = sum(len(ray) for ray in rays)
        self.portions = tuple(
            MemoryPortion(first, rays[first : first + portion_rays]) for first in range(0, len(rays), portion_rays)
        )
        self.source_flux_w = np.array(SOURCE_FLUX_W)
        self.rays_of_source = np.bincount([ray[0].source for ray in rays], minlength=len(NAMES.sources))
        self.n_replicates, self.rays_of_replicate = 1, self.rays_of_source[:, None]
        self.ray_flux_w = np.where(
            self.rays_of_source > 0, self.source_flux_w / np.maximum(self.rays_of_source, 1), 0.0
        )

    def group_of_rays(self, portion):
        return portion.signatures.ray_source[portion.ray_signature]

    @cached_property
    def scene(self) -> Scene:
        return scene()


def random_map(seed: int, n_rays: int = 300, portion_rays: int = 70) -> MemoryMap:
    """A map of random rays; many of them share a signature, as in real maps."""
    rng = np.random.default_rng(seed)
    return MemoryMap([random_ray(rng, max_events=int(rng.integers(1, 6))) for _ in range(n_rays)], portion_rays)
