# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rays head-on, grazing, and at the critical angle, traced through a scene; surfaces that reflect nothing or all."""

import math

import numpy as np
import pytest

from raymaps.kinds import EventKind
from raymaps.results.ledger import energy_ledger
from tests.physics import scenes
from tests.physics.scenes import agrees, body, disc, share_agrees, unit
from tests.physics.scenes_exact import box, traced
from tests.stability.aiming import aimed, clear, lost, rotation, some_directions
from tests.stability.exact_reflectance import interface

HALF = 50.0


def slab_top(folder, angles_deg, *, from_inside=False, index=1.5, rays=60_000, turn=None, plain=False):
    """Rays that meet the top of a block (z = 0) at the origin, and the direction of those of each source."""
    turn = np.eye(3) if turn is None else turn
    short = np.radians(90 - np.asarray(angles_deg, float))
    ways = np.column_stack([np.cos(short), 0 * short, np.sin(short) * (1 if from_inside else -1)])
    shape = box((-HALF, -HALF, -HALF), (HALF, HALF, 0)).placed(turn=turn)
    h = traced(
        folder,
        {"Block": body(shape.plain if plain else shape, "polished", "glass")},
        rays=rays,
        settings={"max_events": 3},
        sources={f"S{k:03}": aimed(folder, f"S{k:03}", [-30 * turn @ way], [turn @ way]) for k, way in enumerate(ways)},
        **clear(index),
    )
    assert lost(h).all == 0
    return h, ways @ turn.T


GRAZING_DEG = [80, 85, 89, 89.9, 89.99, 89.999, 89.9999]


@pytest.mark.parametrize("turned", [False, True], ids=["straight", "turned"])
@pytest.mark.parametrize("plain", [False, True], ids=["exact", "faceted"])
def test_grazing_to_a_ten_thousandth_of_a_degree(tmp_path, turned, plain):
    """Each ray meets the face at the origin, to a millionth of the scene, whence a ten-thousandth of a degree leads
    50 nm past it; it is reflected as Fresnel says, and never meets another triangle of the same face.

    Guards: the place is that of the plane in float64, not Embree's distance; START_OFFSET lifts the start of a ray off
    all triangles of its plane.
    """
    h, ways = slab_top(tmp_path, GRAZING_DEG, turn=rotation() if turned else None, plain=plain)
    assert np.abs(h.position[h.first + 1]).max() <= 2 * h.raymap.manifest.grid_mm
    kind = h.kind[h.first + 1]
    n = np.bincount(h.ray_source)
    reflected = np.bincount(h.ray_source[kind == EventKind.FRESNEL_REFLECTION], minlength=len(n))
    exact = [float(interface(math.sin(math.radians(90 - a)), 1.0, 1.5)[0]) for a in GRAZING_DEG]
    share_agrees("reflected", reflected, n, exact)
    # what is reflected leaves at once, on the other side of the normal
    ends = h.first + 2
    gone = np.flatnonzero(kind == EventKind.FRESNEL_REFLECTION)
    assert (h.kind[ends[gone]] == EventKind.LEFT).all()
    way = h.way[ends[gone]]
    up = (rotation() if turned else np.eye(3)) @ [0.0, 0.0, 1.0]
    came = ways[h.ray_source[gone]]
    length = np.linalg.norm(way, axis=1)
    assert (np.abs(way @ up / length + came @ up) <= 4 * h.raymap.manifest.grid_mm / length).all()


@pytest.mark.parametrize("off", [0.0, *(s * 10.0**-e for e in (4, 8, 12) for s in (1, -1))])
def test_at_the_critical_angle(tmp_path, off):
    """Beyond it, by 1e-12, every ray is reflected; before it the others leave along the face, and meet it never again.

    Guards: cos² of refraction below 0 is total reflection; START_OFFSET on the far side of a face.
    """
    angle = math.degrees(math.asin(1 / 1.5) * (1 + off))
    h, ways = slab_top(tmp_path, [angle], from_inside=True, rays=30_000, turn=rotation())
    kind = h.kind[h.first + 1]
    refracted = kind == EventKind.FRESNEL_REFRACTION
    if off >= 1e-12:
        assert not refracted.any()
    elif off < 0:
        c = float(abs(ways[0] @ (rotation() @ [0, 0, 1.0])))
        # 1 - R is 4 to 10 times the root of what is missing to total reflection, which the direction's rounding moves
        share, cos_t = (float(x) for x in interface(c, 1.5, 1.0))
        slack = 10 * 1e-15 / max(cos_t, 1e-7)
        agrees("reflected", 1 - refracted.mean(), math.sqrt(share * (1 - share) / h.n_rays), share, rounding=slack)
        assert refracted.any() or off > -1e-8
    assert (h.kind[h.first[refracted] + 2] == EventKind.LEFT).all()


@pytest.mark.parametrize("index", [1.0, 1 + 1e-12, 1.5])
def test_exactly_head_on(tmp_path, index):
    """Light along the normal, along axes and not, goes straight on and straight back.

    Guards: cos² of refraction is at most 1, and no angle or root of a number beyond is taken.
    """
    for name, turn in (("straight", np.eye(3)), ("turned", rotation()), ("once more", rotation(2.1, (3, -1, 0.2)))):
        folder = tmp_path / name
        folder.mkdir()
        h, ways = slab_top(folder, [90.0 - 90.0], index=index, rays=4_000, turn=turn)
        assert (np.diff(h.offsets) == 3).all()
        along = unit(h.way[h.first + 2]) @ ways[0]
        assert np.abs(np.abs(along) - 1).max() < 1e-11
        off = np.cross(h.position[h.first + 2], ways[0])
        assert np.abs(off).max() <= 2 * h.raymap.manifest.grid_mm
        r = ((index - 1) / (index + 1)) ** 2
        share_agrees("reflected", (h.kind[h.first + 1] == EventKind.FRESNEL_REFLECTION).sum(), h.n_rays, r)


def test_head_on_by_a_table_over_the_angle(tmp_path):
    """A coating that reflects nothing head-on and all at grazing incidence, in forty orientations: nothing.

    Guards: the cosine of incidence is cut at 1. By rounding it is 1 + 1e-16 for every third normal, whose angle is no
    number, and the table would be read at its other end.
    """
    table = {"angle_deg": [0.0, 90.0], "value": [[0.0], [1.0]]}
    coating = {"kind": "coefficients", "specular_reflectance": table, "specular_transmittance": 0.0}
    for k, normal in enumerate(some_directions(40, seed=4)[26:]):
        shape = disc(5.0, 6)
        turn = align(normal)
        h = scenes.traced(
            tmp_path,
            {"Plate": body(shape._replace(vertices=shape.vertices @ turn.T), "coated")},
            rays=20,
            name=f"plate{k}",
            surfaces={"coated": {**coating, "diffuse_reflectance": 0.0, "diffuse_transmittance": 0.0}},
            sources={"S": aimed(tmp_path, f"rays{k}", [10 * turn[:, 2]], [-turn[:, 2]])},
        )
        assert h.count_kind(EventKind.ABSORPTION) == h.n_rays, normal


def align(normal):
    """A turn of the z axis onto a direction, (3, 3)."""
    x = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(normal, x), normal], axis=1)


# ---------------------------------------------------------------------------------------------------------------------
# Nothing and all

ALL_OR_NOTHING = {
    "mirror": (lambda r: {"kind": "mirror", "reflectance": r}),
    "lambertian": (lambda r: {"kind": "lambertian", "reflectance": r}),
    "coefficients": (
        lambda r: {
            "kind": "coefficients", "specular_reflectance": r / 2, "diffuse_reflectance": r / 2,
            "specular_transmittance": 0.0, "diffuse_transmittance": 0.0,
        }
    ),
    "gaussian": (lambda r: {"kind": "gaussian", "reflectance": r, "sigma": 0.1}),
}  # fmt: skip


@pytest.mark.parametrize("kind", ALL_OR_NOTHING)
def test_reflectance_of_exactly_nothing_and_all(tmp_path, kind):
    """In a room that reflects all, nothing is absorbed in two hundred reflections; where it reflects nothing, all at
    once.

    Guards: draws lie between 0 and 1, both excluded, and light is kept to the last bit (`outcome`).
    """
    for reflectance in (1.0, 0.0):
        h = traced(
            tmp_path,
            {"Room": body(box((-5, -5, -5), (5, 5, 5)).inside_out, "tested")},
            rays=2_000,
            name=f"r{reflectance}",
            settings={"max_events": 200},
            surfaces={"tested": ALL_OR_NOTHING[kind](reflectance)},
            sources={"S": {"kind": "point", "flux_w": 1.0, "position_mm": [0.1, 0.2, 0.3]}},
        )
        ledger = energy_ledger(h.raymap)
        if reflectance == 1.0:
            assert ledger.absorbed_w == 0.0
            assert ledger.killed_by_reason_w["depth"] == 1.0
            assert (h.light == h.light[0]).all()
        else:
            assert ledger.absorbed_w == 1.0
            assert (np.diff(h.offsets) == 2).all()


def test_a_metal_that_reflects_all_but_a_millionth_of_a_millionth(tmp_path):
    """A room of a metal of k = 1e6: two thousand reflections cost 8e-9 of the light at most, and make none.

    Guards: the reflectance of a metal is at most 1; losses too small for float32 are drawn.
    """
    h = traced(
        tmp_path,
        {"Ball": body(box((-1, -1, -1), (1, 1, 1)), "polished", "metal"), **mirror_room()},
        rays=200,
        settings={"max_events": 2_000, "store": "spectral"},
        media={"metal": {"refractive_index": {"wavelength_nm": [380, 780], "n": [1.0, 1.0]}, "extinction": 1e6}},
        surfaces={"polished": {"kind": "fresnel"}, "mirror": {"kind": "mirror", "reflectance": 1.0}},
        sources={"S": {"kind": "point", "flux_w": 1.0, "position_mm": [3, 2, 1.5]}},
    )
    assert lost(h).all == 0
    ledger = energy_ledger(h.raymap)
    assert ledger.absorbed_w <= 1e-2  # not one ray
    assert h.light.sum(axis=1).max() <= 1.0
    assert h.count_kind(EventKind.FRESNEL_REFLECTION) > 10_000


def mirror_room():
    return {"Room": body(box((-5, -5, -5), (5, 5, 5)).inside_out, "mirror")}
