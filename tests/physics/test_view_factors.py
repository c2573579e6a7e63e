# SPDX-License-Identifier: LGPL-2.1-or-later
"""View factors of Lambertian emitters with closed forms."""

import math

import pytest

from raymaps.kinds import EventKind
from tests.physics.scenes import agrees, body, box, disc, share_agrees, traced

BLACK = {"black": {"kind": "absorber"}}


def coaxial_discs(r1, r2, h):
    """From disc 1 to the parallel coaxial disc 2: J. Howell, A Catalog of Radiation Heat Transfer Configuration
    Factors, factor C-41; also F. Incropera, D. DeWitt: Fundamentals of Heat and Mass Transfer, table 13.2.
    """
    a, b = r1 / h, r2 / h
    x = 1 + (1 + b**2) / a**2
    return 0.5 * (x - math.sqrt(x**2 - 4 * (b / a) ** 2))


@pytest.mark.parametrize(
    ("r1", "r2", "distance"), [(1, 1, 1), (1, 1, 0.1), (1, 3, 2), (3, 1, 2), (1, 1, 10), (0.05, 2, 2)]
)
def test_lambertian_disc_onto_parallel_coaxial_disc(tmp_path, r1, r2, distance):
    """Discs are polygons of 256 sides with the area of the circle. To first order a rim that moves in and out by equal
    areas changes nothing; what is left is of the order of the rim's deviation squared, (pi² / 2 / 256²)² = 6e-9.
    """
    h = traced(
        tmp_path,
        {"Lamp": body(disc(r1), "black"), "Target": body(disc(r2, up=False).moved(0, 0, distance), "black")},
        rays=200_000,
        surfaces=BLACK,
        sources={"S": {"kind": "faces", "flux_w": 2.5, "body": "Lamp"}},
    )
    hit = h.on_body("Target") & (h.kind == EventKind.ABSORPTION)
    expected = coaxial_discs(r1, r2, distance)
    share_agrees("share on the disc", hit.sum(), h.n_rays, expected)
    flux, stderr = h.flux_w(h.per_ray(hit, h.light_before[hit].sum(axis=1)))
    agrees("flux on the disc in W", flux, stderr, 2.5 * expected)


def test_faces_of_a_cube(tmp_path):
    """From a face of a cube's inside 0.1998 onto the opposite face and 0.2 on each other (Howell, factors C-11 and
    C-14; the closed form of C-11 for squares at the distance of their side stands below).
    """
    x = math.sqrt(2)
    opposite = 2 / math.pi * (math.log(2 / math.sqrt(3)) + 2 * x * math.atan(1 / x) - math.pi / 2)
    assert opposite == pytest.approx(0.1998, abs=1e-4)
    inside = box((-1, -1, -1), (1, 1, 1)).inside_out
    h = traced(
        tmp_path,
        {"Room": body(inside, "black")},
        rays=200_000,
        surfaces=BLACK,
        sources={"S": {"kind": "faces", "flux_w": 1, "body": "Room", "faces": ["-z"]}},
    )
    for face in ("-x", "+x", "-y", "+y", "-z", "+z"):
        expected = {"+z": opposite, "-z": 0.0}.get(face, (1 - opposite) / 4)
        count = ((h.face == h.face_index("Room", face)) & (h.kind == EventKind.ABSORPTION)).sum()
        share_agrees(f"share on face {face}", count, h.n_rays, expected)
