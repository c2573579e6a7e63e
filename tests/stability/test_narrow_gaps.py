# SPDX-License-Identifier: LGPL-2.1-or-later
"""Bodies nearer to an exact surface than its facets are: what lies in between is met, in the order of the surfaces."""

import numpy as np
import pytest

from raymaps.kinds import EventKind
from tests.physics.scenes import Shape, body, disc_source
from tests.physics.scenes_exact import ball, box, lens, traced
from tests.physics.sequential import LensFace
from tests.stability.aiming import clear, lost

BLACK = {"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}}
RAYS = 10_000


def lit(folder, bodies, n):
    """A beam up the z axis, of bodies of glass of index n and black ones."""
    h = traced(
        folder,
        bodies,
        rays=RAYS,
        surfaces=BLACK,
        media=clear(n)["media"],
        sources={"S": disc_source((0, 0, -20), (0, 0, 1), 3)},
    )
    assert lost(h).all == 0
    return h


def arrives_after(crossings, folder, bodies):
    """All light goes through so many faces of bodies of the index around them, and is absorbed."""
    h = lit(folder, bodies, 1.0)
    assert (np.diff(h.offsets) == crossings + 2).all()
    assert (h.kind[h.last] == EventKind.ABSORPTION).all()


def sheet(z, half=15.0):
    corners = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    return Shape(corners, np.array([[0, 1, 2], [0, 2, 3]]), (("Sheet", 2),))


def hollow(outer, inner):
    """Shell of an outer shape, with an inner one as the wall of its hollow."""
    inside_out = inner._replace(
        triangles=inner.triangles[:, ::-1], faces=tuple((f"Inner{name}", n) for name, n in inner.faces)
    )
    return outer._replace(
        vertices=np.concatenate([outer.vertices, inside_out.vertices]),
        triangles=np.concatenate([outer.triangles, inside_out.triangles + len(outer.vertices)]),
        faces=outer.faces + inside_out.faces,
        surfaces=(*outer.surfaces, *({**record, "reversed": True} for record in inner.surfaces)),
    )


@pytest.mark.parametrize("n", [1.0, 1.5])
@pytest.mark.parametrize("gap_mm", [1e-5, 1e-3, 1e-2, 5e-2])
def test_a_sheet_right_behind_a_ball_is_met(tmp_path, gap_mm, n):
    """A black sheet 10 nm to 50 µm behind a ball whose facets lie 90 µm off it.

    Guards: triangles near those that a ray stands on or meets are asked as well (`solids.nearby`).
    """
    h = lit(tmp_path, {"Ball": body(ball(10, 24), "polished", "glass"), "Sheet": body(sheet(10 + gap_mm), "black")}, n)
    up = h.position[h.last][:, 2] > 9.99
    assert up.sum() > 0.8 * RAYS
    assert (h.position[h.last][up, 2] < 10 + 2 * gap_mm + 1e-3).all()


@pytest.mark.parametrize("wall_mm", [1e-3, 1e-2, 5e-2, 0.5])
def test_thin_walls_of_a_bulb_have_two_sides(tmp_path, wall_mm):
    """Into a hollow ball with a wall of 1 µm to 0.5 mm, of facets 90 µm off, on to what is inside.

    Guards: as above, within one body.
    """
    bulb = hollow(ball(10, 24), ball(10 - wall_mm, 24))
    core = box((-4, -4, -4), (4, 4, 4))
    arrives_after(2, tmp_path, {"Bulb": body(bulb, "polished", "glass"), "Core": body(core, "black")})


@pytest.mark.parametrize("glue_mm", [1e-3, 5e-2])
@pytest.mark.parametrize("rings", [(3, 20), (20, 3)])
def test_a_thin_film_of_glue_between_lenses(tmp_path, rings, glue_mm):
    """Two lenses with glue of 1 to 50 µm, triangles of all sizes: in and out of each, on to a board.

    Guards: as above, between bodies that are not in contact all over.
    """
    joint, middle = 1 / 40, 5.0
    first = lens(LensFace(0, 1 / 60), LensFace(middle, joint), 8, rings[0])
    second = lens(LensFace(middle + glue_mm, joint), LensFace(9, -1 / 60), 8, rings[1])
    lenses = {"First": body(first, "polished", "glass"), "Second": body(second, "polished", "glass")}
    arrives_after(4, tmp_path, {**lenses, "Board": body(box((-20, -20, 20), (20, 20, 21)), "black")})
