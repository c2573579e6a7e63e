# SPDX-License-Identifier: LGPL-2.1-or-later
"""The bounding mesh: all of each exact face lies within it, it has no gaps and does not fold over."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import TypeAdapter

from raymaps.exact.borders import join
from raymaps.exact.bounding import borders, bounding_corners
from raymaps.exact.smooth import smooth_normals
from raymaps.exact.surfaces import exact_surface
from raymaps.geometry import BodyMesh
from raymaps.scene.exact_surfaces import ExactSurface
from tests.physics import scenes, scenes_exact
from tests.physics.scenes_exact import ExactShape
from tests.physics.sequential import LensFace

#: Bodies, and how they are trimmed: which points (radius, z) of a face's surface belong to the face.
SHARP = {deg: scenes_exact.sharp_lens(10, deg, 24) for deg in (1, 5, 30, 90)}
BODIES: dict[str, ExactShape] = {
    "rod of 3": scenes_exact.rod(2, 10, 3),
    "rod": scenes_exact.rod(2, 10, 24),
    "ring of 4": scenes_exact.ring(5, 2, 1, 4),
    "ring": scenes_exact.ring(5, 2, 1, 24),
    "boss": scenes_exact.boss(5, 2, 1, 3, 24),
    "cone of 4": scenes_exact.cone(2, 5, 4),
    "cone": scenes_exact.cone(2, 5, 24),
    "flat cone": scenes_exact.cone(5, 0.5, 24),
    "ball": scenes_exact.ball(3, 24),
    "coarse ball": scenes_exact.ball(3, 8),
    "pill": scenes_exact.pill(3, 5, 24),
    "biconvex": scenes_exact.lens(LensFace(0, 1 / 50), LensFace(8, -1 / 50), 10, 4),
    "meniscus": scenes_exact.lens(LensFace(0, 1 / 50), LensFace(5, 1 / 30), 10, 4),
    "biconcave": scenes_exact.lens(LensFace(0, -1 / 20), LensFace(3, 1 / 30), 10, 4),
    "planoconvex": scenes_exact.lens(LensFace(0, 0), LensFace(6, -1 / 20), 10, 2),
    **{f"edge of {deg}°": shape for deg, shape in SHARP.items()},
}


def surfaces_of(shape: ExactShape):
    return tuple(exact_surface(TypeAdapter(ExactSurface).validate_python(record)) for record in shape.surfaces)


def bounds_of(shape: ExactShape):
    return bounding_corners([shape.mesh], surfaces_of(shape))


def inside(shape: ExactShape, points, apart_from: int):
    """Whether points of a face lie within the body, judged by the other faces at their borders: the trimmed face.

    True for bodies of revolution whose other faces are each in one piece, convex or concave, as all here.
    """
    r, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    corners = shape.mesh.corners_mm[shape.mesh.triangle_face == apart_from].reshape(-1, 3)
    rim = np.hypot(corners[:, 0], corners[:, 1])
    return (r >= rim.min() - 1e-9) & (r <= rim.max() + 1e-9) & (z >= corners[:, 2].min()) & (z <= corners[:, 2].max())


def first_along(points, directions, corners):
    """Signed distance of the triangle that is nearest along each line; infinite where there is none."""
    a, b, c = np.moveaxis(corners, 1, 0)
    nearest = np.full(len(points), np.inf)
    for i, (p, d) in enumerate(zip(points, directions, strict=True)):
        h = np.cross(d, c - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            det = np.einsum("ij,ij->i", b - a, h)
            u = np.einsum("ij,ij->i", p - a, h) / det
            q = np.cross(p - a, b - a)
            v, t = q @ d / det, np.einsum("ij,ij->i", c - a, q) / det
        t = t[(u > -1e-9) & (v > -1e-9) & (u + v < 1 + 1e-9) & np.isfinite(t)]
        if len(t):
            nearest[i] = t[np.abs(t).argmin()]
    return nearest


@pytest.mark.parametrize("name", BODIES)
def test_each_face_lies_within_its_facets_up_to_its_borders(name):
    shape = BODIES[name]
    mesh, surfaces, bounds = shape.mesh, surfaces_of(shape), bounds_of(shape)
    size = np.ptp(mesh.vertices_mm, axis=0).max()
    rng = np.random.default_rng(0)
    for face, surface in enumerate(surfaces):
        of_face = np.flatnonzero(mesh.triangle_face == face)
        weights = rng.dirichlet((0.7, 0.7, 0.7), 300)
        weights += 0.05 * (weights - 1 / 3)  # beyond the facets too, since a chord cuts off a piece of the face
        points = surface.nearest(np.einsum("tc,tcj->tj", weights, mesh.corners_mm[rng.choice(of_face, 300)]))
        points = points[inside(shape, points, face)]
        assert len(points) > 100
        # all surfaces here bulge the way of their own normals; rays that leave by the rim meet facets of the rim
        directions = surface.normal(points)
        ahead = first_along(points, directions, bounds.corners[of_face])
        assert (ahead > -1e-9 * size).all(), face
        assert np.isinf(ahead).mean() < 0.02, face
        met = ahead[np.isfinite(ahead)]
        assert met.max() <= bounds.reach[of_face].max() + 1e-9 * size, face


@pytest.mark.parametrize("name", BODIES)
def test_facets_move_little_and_do_not_fold_over(name):
    shape = BODIES[name]
    mesh, bounds = shape.mesh, bounds_of(shape)
    assert np.isfinite(bounds.corners).all()
    before, after = scenes.Shape(shape.vertices, shape.triangles, shape.faces), bounds.corners
    moved_area = 0.5 * np.cross(after[:, 1] - after[:, 0], after[:, 2] - after[:, 0])
    assert (np.einsum("ij,ij->i", moved_area, mesh.area_vectors_mm2) > 0.1 * before.areas**2).all()
    for face, surface in enumerate(surfaces_of(shape)):  # planes stay planes
        if shape.surfaces[face]["type"] == "plane":
            assert np.abs(surface.height(after[mesh.triangle_face == face].reshape(-1, 3))).max() < 1e-12
            assert (bounds.reach[mesh.triangle_face == face] == 0).all()


@pytest.mark.parametrize("name", ["rod", "cone", "ball", "pill", "biconvex", "planoconvex", "edge of 1°"])
def test_bodies_that_only_bulge_outwards_stay_closed(name):
    shape = BODIES[name]
    corners = bounds_of(shape).corners
    vertex = join([shape.mesh]).vertex
    for v in range(vertex.max() + 1):
        assert (np.ptp(corners[vertex == v], axis=0) == 0).all()
    moved = BodyMesh("Moved", corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3), *_one_face(corners))
    assert moved.is_closed
    assert moved.volume_mm3 > shape.mesh.volume_mm3


def _one_face(corners):
    return ("Face1",), np.zeros(len(corners), np.int32)


def test_a_hole_grows_and_the_plate_around_it_stays():
    shape = scenes_exact.ring(5, 2, 1, 24)
    corners = bounds_of(shape).corners
    r = np.hypot(corners[..., 0], corners[..., 1])
    hole, top = shape.mesh.triangle_face == 3, shape.mesh.triangle_face == 2
    assert r[hole].min() * math.cos(math.pi / 24) > 2  # the middles of its facets lie behind the exact hole
    assert r[top].min() == pytest.approx(2, abs=1e-12)
    assert r[top].max() * math.cos(math.pi / 24) > 5


def test_knife_edges_stay_bounded():
    for deg, shape in SHARP.items():
        moved = bounds_of(shape).corners - shape.mesh.corners_mm
        # a chord of the edge is cut off by r (1 - cos) of its circle; sharper edges do not call for more
        chord = 10 * (1 - math.cos(math.pi / 24))
        assert np.linalg.norm(moved, axis=2).max() < 2.5 * chord, deg


def test_borders_of_a_box_are_convex_and_corners_know_all_faces():
    shape = scenes_exact.box((0, 0, 0), (1, 2, 3))
    found = borders([shape.mesh], surfaces_of(shape))
    faces = np.where(found.neighbour >= 0, shape.mesh.triangle_face[found.neighbour], -1)
    for own, around, bends in zip(shape.mesh.triangle_face, faces, found.bend, strict=True):
        assert (bends == 1)[around >= 0].all()
        assert len(set(around)) == 4  # two edges are borders; the corners touch the other two faces
        assert own not in around
        assert (own ^ 1) not in around


def test_bends_of_borders():
    def bends(shape):
        found = borders([shape.mesh], surfaces_of(shape))
        names = np.array([name for name, _ in shape.faces])
        pairs = {}
        for own, around, bent in zip(shape.mesh.triangle_face, found.neighbour, found.bend, strict=True):
            for other, bend in zip(around[around >= 0], bent[around >= 0], strict=True):
                pairs.setdefault((names[own], names[shape.mesh.triangle_face[other]]), set()).add(int(bend))
        return pairs

    assert bends(BODIES["boss"]) == {
        **{pair: {1} for a, b in [("Bottom", "Rim"), ("Rim", "Top"), ("Pin", "End")] for pair in ((a, b), (b, a))},
        ("Top", "Pin"): {-1},
        ("Pin", "Top"): {-1},
    }
    assert bends(BODIES["edge of 1°"]) == {("Low", "High"): {1}, ("High", "Low"): {1}}
    assert set().union(*bends(BODIES["pill"]).values()) == {0}


def test_vertices_of_different_faces_may_be_rounded_apart():
    shape = BODIES["rod"]
    apart = shape.mesh.corners_mm.reshape(-1, 3).copy()
    apart += np.random.default_rng(1).uniform(-2e-8, 2e-8, apart.shape)
    mesh = BodyMesh(
        "Part", apart, np.arange(len(apart)).reshape(-1, 3), shape.mesh.face_names, shape.mesh.triangle_face
    )
    joined = join([mesh])
    assert joined.n_vertices == len(shape.vertices)
    assert (borders([mesh], surfaces_of(shape)).neighbour >= 0).sum() == (
        borders([shape.mesh], surfaces_of(shape)).neighbour >= 0
    ).sum()
    assert np.abs(bounding_corners([mesh], surfaces_of(shape)).corners - bounds_of(shape).corners).max() < 1e-6


def test_faces_without_an_exact_surface_stay_where_they_are():
    shape = BODIES["rod"]
    bottom, side, top = surfaces_of(shape)
    mesh = shape.mesh
    for surfaces in ((None, None, None), (bottom, None, top)):
        bounds = bounding_corners([mesh], surfaces)
        assert (bounds.corners == mesh.corners_mm).all()
        assert (bounds.reach == 0).all()
    # a plane of which only triangles are known is a plane
    assert np.allclose(bounding_corners([mesh], (None, side, None)).corners, bounds_of(shape).corners, atol=1e-12)


def test_triangles_without_an_area_do_no_harm():
    shape = BODIES["rod"]
    # an edge of the top is split by a triangle in a line, and one has two corners in one place
    first = shape.triangles[shape.mesh.triangle_face == 2][0]
    middle = shape.vertices[first[:2]].mean(axis=0)
    vertices = np.vstack([shape.vertices, middle])
    extra = np.array([[first[0], first[1], len(shape.vertices)], [first[0], first[0], first[1]]])
    mesh = BodyMesh(
        "Part",
        vertices,
        np.concatenate([shape.triangles, extra]),
        shape.mesh.face_names,
        np.concatenate([shape.mesh.triangle_face, [2, 2]]).astype(np.int32),
    )
    with np.errstate(all="raise"):
        bounds = bounding_corners([mesh], surfaces_of(shape))
        found = borders([mesh], surfaces_of(shape))
    assert np.isfinite(bounds.corners).all()
    assert np.isfinite(bounds.reach).all()
    assert np.abs(found.bend).max() == 1
    assert np.allclose(bounds.corners[: len(shape.triangles)], bounds_of(shape).corners, atol=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_slivers_at_uneven_borders_do_not_fold_over(seed):
    """The plane end of a rod whose triangles are cut from one corner, between vertices at random angles."""
    rng = np.random.default_rng(seed)
    n = 40
    angle = np.sort(rng.random(n)) * 2 * math.pi
    low = np.column_stack([2 * np.cos(angle), 2 * np.sin(angle), np.zeros(n)])
    i, k = np.arange(n), np.arange(1, n - 1)
    j = (i + 1) % n
    side = np.concatenate([np.column_stack([i, j, n + j]), np.column_stack([i, n + j, n + i])])
    bottom, top = np.column_stack([0 * k, k + 1, k]), n + np.column_stack([0 * k, k, k + 1])
    faces = np.repeat(np.arange(3, dtype=np.int32), [len(bottom), len(side), len(top)])
    mesh = BodyMesh(
        "Rod", np.vstack([low, low + (0, 0, 10)]), np.concatenate([bottom, side, top]), ("a", "b", "c"), faces
    )
    bounds = bounding_corners([mesh], surfaces_of(BODIES["rod"]))
    a, b, c = np.moveaxis(bounds.corners, 1, 0)
    after = 0.5 * np.cross(b - a, c - a)
    assert (np.einsum("ij,ij->i", after, mesh.area_vectors_mm2) > 0).all()
    middles = bounds.corners[faces == 1].reshape(-1, 3)
    edges = 0.5 * (middles + np.roll(bounds.corners[faces == 1], -1, axis=1).reshape(-1, 3))
    assert np.hypot(edges[:, 0], edges[:, 1]).min() > 2


def test_bodies_are_counted_one_after_the_other():
    one, two = BODIES["rod"], BODIES["biconvex"]
    surfaces = surfaces_of(one) + surfaces_of(two)
    bounds, found = bounding_corners([one.mesh, two.mesh], surfaces), borders([one.mesh, two.mesh], surfaces)
    n = len(one.triangles)
    assert np.allclose(bounds.corners[n:], bounds_of(two).corners, atol=1e-12)
    alone = borders([two.mesh], surfaces_of(two))
    assert (found.neighbour[n:] == np.where(alone.neighbour < 0, -1, alone.neighbour + n)).all()
    assert (found.neighbour[:n] < n).all()


def test_smooth_normals_are_exact_on_a_sphere_and_sharp_at_borders():
    shape = scenes.ball(3, 2)
    mesh = BodyMesh("Ball", shape.vertices, shape.triangles, *_one_face(shape.triangles))
    normals = smooth_normals(mesh, np.array([0]))
    assert np.allclose(normals, mesh.corners_mm / 3, atol=1e-12)

    rod = scenes_exact.rod(2, 10, 12).mesh
    normals = smooth_normals(rod, np.array([1, 2]))
    radial = rod.corners_mm * (0.5, 0.5, 0)
    assert np.allclose(normals[rod.triangle_face == 1], radial[rod.triangle_face == 1], atol=1e-12)
    assert np.allclose(normals[rod.triangle_face == 2], (0, 0, 1))
    flat = smooth_normals(rod, np.array([0]))
    assert np.allclose(flat[:, 0], rod.area_vectors_mm2 / np.linalg.norm(rod.area_vectors_mm2, axis=1)[:, None])


def test_only_triangles_with_all_faces_around_them_over_sharp_edges_are_sharp():
    def sharp(name):
        return borders([BODIES[name].mesh], surfaces_of(BODIES[name])).sharp

    assert sharp("boss").all()
    pill = BODIES["pill"].mesh  # its ends go on smoothly into its side
    at_seam = np.isclose(np.abs(np.hypot(*np.moveaxis(pill.corners_mm[..., :2], -1, 0))), 3).any(axis=1)
    assert (sharp("pill") == ~at_seam).all()
    assert 0 < at_seam.mean() < 1
