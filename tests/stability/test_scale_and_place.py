# SPDX-License-Identifier: LGPL-2.1-or-later
"""The same scene a million times smaller or larger, or far from the origin, behaves the same."""

import numpy as np
import pytest

from raymaps.kinds import EventKind
from raymaps.results.ledger import energy_ledger
from tests.physics import scenes_exact
from tests.physics.scenes import SIGMAS, ball, body, box, disc_source, rectangle, traced
from tests.stability.aiming import aimed, lost, rotation, some_directions

N_RAYS = 40_000


def lens_and_room(folder, scale=1.0, place=(0.0, 0.0, 0.0)):
    """A ball lens with an absorbing core in a translucent room, seen by a detector; all lengths times a scale."""
    place = np.array(place)

    def made(shape):
        return shape.scaled(scale).moved(*place)

    def at(*point):
        return np.array(point) * scale + place

    return traced(
        folder,
        {
            "Lens": body(made(ball(8, 3)), "polished", "glass"),
            "Core": body(made(ball(3, 2).moved(2, 0, 0)), "polished", "ink"),
            "Room": body(made(box((-20, -20, -20), (20, 20, 20)).inside_out), "white", plus_z="mirror"),
        },
        rays=N_RAYS,
        media={
            "glass": {"refractive_index": 1.5, "absorption_per_mm": 0.002 / scale},
            "ink": {"refractive_index": 1.33, "absorption_per_mm": [0.2 / scale, 0.01 / scale, 0]},
        },
        surfaces={
            "polished": {"kind": "fresnel"},
            "mirror": {"kind": "mirror", "reflectance": 0.9},
            "white": {"kind": "lambertian", "reflectance": 0.6, "transmittance": 0.2},
        },
        sources={
            "Beam": disc_source(at(0, 0, 15), (0.1, 0, -1), 5 * scale),
            "Lamp": {"kind": "faces", "flux_w": 1, "body": "Room", "faces": ["+x"]},
        },
        detectors={"D": rectangle(at(0, 0, -12), 20 * scale, 20 * scale, side="both")},
    )


def path_of_rays(h):
    """A word for each ray: its first five events with kind and body, and whether it crosses the detector."""
    words = np.zeros(h.n_rays, np.int64)
    for number in range(5):
        row = np.minimum(h.first + number, h.last)
        words = words * 100 + (h.kind[row].astype(np.int64) * 4 + h.body[row] + 1)
    crosses = np.bincount(h.crossing_ray, minlength=h.n_rays) > 0
    return words * 2 + crosses


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return lens_and_room(tmp_path_factory.mktemp("plain"))


@pytest.mark.parametrize(
    ("scale", "place"),
    [(1e-6, (0, 0, 0)), (1e6, (0, 0, 0)), (1.0, (4e6, -4e6, 4e6)), (0.37, (1e5, 0, 0)), (1e-6, (4.0, 4.0, -4.0))],
    ids=["smaller", "larger", "far away", "odd", "small and far"],
)
def test_scale_and_place_change_nothing(tmp_path, plain, scale, place):
    """Places in the moved scenes are a hundred thousand sizes away: float64 keeps eleven digits of the size. The
    shares of all common paths agree within five standard errors, in fact nearly every ray has the same path; the
    ledger too.
    """
    h = lens_and_room(tmp_path, scale, place)
    ours, theirs = path_of_rays(h), path_of_rays(plain)
    same = (ours == theirs).mean()
    print(f"  scale {scale}, place {place}: {1 - same:.2e} of the rays take another path")
    assert same > 0.99
    words, counts = np.unique(theirs, return_counts=True)
    common = words[counts >= 50]
    share, expected = (np.array([(paths == word).mean() for word in common]) for paths in (ours, theirs))
    assert (np.abs(share - expected) <= SIGMAS * np.sqrt(expected / N_RAYS)).all()

    ledger, reference = energy_ledger(h.raymap), energy_ledger(plain.raymap)
    for name in ("absorbed_w", "escaped_w", "killed_w"):
        assert getattr(ledger, name) == pytest.approx(getattr(reference, name), abs=0.01), name
    assert ledger.absorbed_w + ledger.escaped_w + ledger.killed_w == pytest.approx(ledger.emitted_w, rel=1e-9)
    killed = np.isin(h.kind, [EventKind.KILLED_NUMERICAL, EventKind.KILLED_MEDIUM_MISMATCH])
    assert killed.sum() <= 5


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_rays_stay_where_they_are_known_to_be(tmp_path, scale):
    """Stored places lie on the triangles that are stored with them, to the grid."""
    h = lens_and_room(tmp_path, scale)
    meshes = h.raymap.meshes
    corners = np.concatenate([mesh.corners_mm for mesh in meshes])
    on_surface = (h.triangle >= 0) & ~np.isin(h.kind, [EventKind.MEDIUM_ABSORPTION, EventKind.LEFT])
    a, b, c = np.moveaxis(corners[h.triangle[on_surface]], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    off = np.abs(((h.position[on_surface] - a) * normal).sum(axis=1))
    assert off.max() <= 0.87 * h.raymap.manifest.grid_mm


# ---------------------------------------------------------------------------------------------------------------------
# Ray by ray, on exact surfaces

N_AIMED = 20_000
SIZE_MM = 40.0


def optics(folder, turn=None, factor=1.0, shift=(0.0, 0.0, 0.0), name="scene"):
    """A ball, a rod, a cone and a torus of glass in a mirror room with a black wall: what rays draw there does not
    depend on axes. All is turned, scaled and moved.
    """
    turn, shift = np.eye(3) if turn is None else turn, np.array(shift, float)

    def made(shape, *by):
        return shape.moved(*(by or (0, 0, 0))).placed(turn=turn, factor=factor, shift=shift)

    half = SIZE_MM / 2
    starts = np.array([0.0, 0.0, 17.0]) + np.random.default_rng(1).uniform(-1, 1, size=(2_000, 3))
    ways = some_directions(2_000 - 26, seed=2)
    return scenes_exact.traced(
        folder,
        {
            "Ball": body(made(scenes_exact.ball(6, 24), -9, 2, 3), "polished", "glass"),
            "Rod": body(made(scenes_exact.rod(4, 12, 24), 8, 7, -9), "polished", "glass"),
            "Cone": body(made(scenes_exact.cone(5, 8, 24), 8, -9, -2), "polished", "glass"),
            "Torus": body(made(scenes_exact.torus(6, 2, 32, 16), -8, -8, -10), "polished", "glass"),
            "Room": body(made(scenes_exact.box((-half,) * 3, (half,) * 3).inside_out), "mirror", minus_z="black"),
        },
        rays=N_AIMED,
        name=name,
        settings={"max_events": 60},
        media={"glass": {"refractive_index": 1.5, "absorption_per_mm": 0.01 / factor}},
        surfaces={
            "polished": {"kind": "fresnel"},
            "mirror": {"kind": "mirror", "reflectance": 0.9},
            "black": {"kind": "absorber"},
        },
        sources={"S": aimed(folder, name, factor * starts @ turn.T + shift, ways @ turn.T)},
    )


def signatures(h):
    """(n_rays,) bytes: kind, face and medium of all events of each ray."""
    steps = np.column_stack([h.kind, h.face, h.medium]).astype(np.int32)
    return np.array([steps[a:b].tobytes() for a, b in zip(h.offsets[:-1], h.offsets[1:], strict=True)], object)


@pytest.fixture(scope="module")
def optics_here(tmp_path_factory):
    return optics(tmp_path_factory.mktemp("here"))


FAR = 1e7 * SIZE_MM


@pytest.mark.parametrize(
    ("turned", "factor", "shift", "explained"),
    [
        (False, 1e-6, (0, 0, 0), 1e-4),
        (False, 1e6, (0, 0, 0), 1e-4),
        (True, 1.0, (0, 0, 0), 1e-4),
        (False, 1.0, (FAR, -FAR, FAR), 1e-2),
        (True, 1.0, (-FAR, 0.3 * FAR, 0.1), 1e-2),
        (True, 1e-6, (FAR * 1e-6, FAR * 1e-6, 0.0), 1e-2),
    ],
    ids=["a millionth", "a million", "turned", "far", "far and turned", "a millionth, far and turned"],
)
def test_every_ray_takes_the_same_way(tmp_path, optics_here, turned, factor, shift, explained):
    """Signatures are the same but for the share that float64 explains, and so are the fluxes.

    At the origin coordinates are known to 1e-16 of the scene, ten million sizes away to 1e-9. A ray that is refracted
    and reflected on round faces, eight times in the mean and up to sixty, makes of it about a million times as much;
    where it then lies within that of an edge, it goes another way.

    Guards: `Frame` (the scene is moved to its own centre, and scaled to one, before anything is computed), and no
    length in mm in a kernel.
    """
    h = optics(tmp_path, rotation() if turned else None, factor, shift)
    assert lost(h).all == 0
    other = float((signatures(h) != signatures(optics_here)).mean())
    print(f"  {other:.1e} of the rays take another way")
    assert other <= explained
    ledger, reference = energy_ledger(h.raymap), energy_ledger(optics_here.raymap)
    for name in ("absorbed_w", "escaped_w", "killed_w"):
        assert getattr(ledger, name) == pytest.approx(getattr(reference, name), abs=max(other, 1e-9)), name
