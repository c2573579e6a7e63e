# SPDX-License-Identifier: LGPL-2.1-or-later
"""Closed bodies hold their light: how many rays slip through edges, at a million hits."""

import numpy as np
import pytest

from raymaps.kinds import EventKind
from raymaps.results.ledger import energy_ledger
from tests.physics.scenes import ball, body, box, prism, traced

LOST = {
    "numerical": EventKind.KILLED_NUMERICAL,
    "medium mismatch": EventKind.KILLED_MEDIUM_MISMATCH,
    "escaped": EventKind.LEFT,
}


def losses(what, h):
    """Counts of rays that ended in each way that a closed body excludes, and the number of hits."""
    hits = int((h.number > 0).sum())
    counts = {name: h.count_kind(kind) for name, kind in LOST.items()}
    print(f"  {what}: {hits} hits, " + ", ".join(f"{n} {name}" for name, n in counts.items()))
    return hits, counts


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("shape", ["sphere", "box"])
def test_a_closed_white_room_leaks_nothing(tmp_path, shape, scale):
    """A surface-only body that reflects all diffusely; a million hits."""
    room = ball(10, 4) if shape == "sphere" else box((-10, -7, -4), (10, 7, 4)).turned(0.7, (1, 2, 3))
    h = traced(
        tmp_path,
        {"Room": body(room.scaled(scale), "white")},
        rays=10_000,
        settings={"max_events": 102},
        surfaces={"white": {"kind": "lambertian", "reflectance": 1.0}},
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": [0.1 * scale, 0.2 * scale, 0.3 * scale]}},
    )
    hits, counts = losses(f"white {shape} at {scale}", h)
    assert sum(counts.values()) <= 1e-5 * hits
    ledger = energy_ledger(h.raymap)
    assert ledger.killed_by_reason_w["depth"] == pytest.approx(1 - sum(counts.values()) / h.n_rays, abs=1e-5)


@pytest.mark.parametrize("shape", ["cube", "turned cube", "ball"])
def test_glass_loses_no_ray(tmp_path, shape):
    """Light trapped by total reflection in a closed glass body: no ray may find itself in the wrong medium. Light of a
    point leaves a cube only through six cones; all others stay for ever (in a ball of facets, for long).
    """
    glass = {"cube": box((-10, -10, -10), (10, 10, 10)), "ball": ball(10, 4).moved(0.3, 0, 0)}
    glass["turned cube"] = glass["cube"].turned(0.7, (1, 2, 3))
    position = [0.1, 0.2, 0.3] if shape != "ball" else [9.9, 0, 0]
    h = traced(
        tmp_path,
        {"Glass": body(glass[shape], "polished", "glass")},
        rays=30_000,
        settings={"max_events": 62},
        surfaces={"polished": {"kind": "fresnel"}},
        media={"glass": {"refractive_index": 1.7}},
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": position}},
    )
    hits = int((h.number > 0).sum())
    mismatch, numerical = h.count_kind(EventKind.KILLED_MEDIUM_MISMATCH), h.count_kind(EventKind.KILLED_NUMERICAL)
    # a ray that leaves must be outside, by refraction: one that leaves in glass slipped through
    slipped = (h.kind[h.last] == EventKind.LEFT) & (h.medium[h.last] == h.index("media", "glass"))
    print(f"  glass {shape}: {hits} hits, {mismatch} mismatch, {numerical} numerical, {slipped.sum()} slipped")
    assert mismatch + numerical + slipped.sum() <= 1e-5 * hits


def test_light_never_starts_by_hitting_where_it_stands(tmp_path):
    """Two events that follow each other on surfaces are never on the same flat triangle, and never at the same place
    but in a corner.
    """
    h = traced(
        tmp_path,
        {"Room": body(ball(10, 3), "white")},
        rays=20_000,
        settings={"max_events": 30},
        surfaces={"white": {"kind": "lambertian", "reflectance": 1.0}},
        sources={"S": {"kind": "faces", "flux_w": 1, "body": "Room"}},
    )
    # emission is outwards and leaves at once
    assert (np.diff(h.offsets) == 2).all()
    assert (h.kind[h.last] == EventKind.LEFT).all()

    inside = traced(
        tmp_path,
        {"Room": body(ball(10, 3).inside_out, "white")},
        rays=20_000,
        settings={"max_events": 30},
        name="inside",
        surfaces={"white": {"kind": "lambertian", "reflectance": 1.0}},
        sources={"S": {"kind": "faces", "flux_w": 1, "body": "Room"}},
    )
    follows = inside.number > 0
    same = (inside.triangle == np.roll(inside.triangle, 1)) & follows & (inside.kind != EventKind.LEFT)
    assert not same.any()


@pytest.mark.parametrize("apex_deg", [30, 1, 0.1])
@pytest.mark.parametrize("kind", ["mirror", "fresnel"])
def test_sharp_wedges_hold_their_light(tmp_path, kind, apex_deg):
    """Near an edge as sharp as a knife the two faces are closer than float32 can tell: very few rays slip through."""
    is_glass = kind == "fresnel"
    h = traced(
        tmp_path,
        {"Wedge": body(prism(np.radians(apex_deg), 20, 10), "tested", "glass" if is_glass else None)},
        rays=20_000,
        settings={"max_events": 62},
        surfaces={"tested": {"kind": kind}},
        media={"glass": {"refractive_index": 1.5}},
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, -10]}},
    )
    hits, counts = losses(f"{kind} wedge of {apex_deg} degrees", h)
    escaped = (h.kind[h.last] == EventKind.LEFT) & (not is_glass or h.medium[h.last] == h.index("media", "glass"))
    assert escaped.sum() + counts["numerical"] + counts["medium mismatch"] <= max(1e-5 * hits, 5)
