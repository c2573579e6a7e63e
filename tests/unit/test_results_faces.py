# SPDX-License-Identifier: LGPL-2.1-or-later
"""How faces are divided into cells and patches."""

import numpy as np
import pytest

from raymaps.geometry import BodyMesh
from raymaps.results.face_cells import MOST_PATCHES, divided
from tests.face_maps import tube


def mesh_of(triangles_mm, faces=None):
    """Triangles, (n, 3, 3), as a body; ``faces`` counts triangles of each face."""
    triangles_mm = np.asarray(triangles_mm, float)
    n = len(triangles_mm)
    counts = faces or [n]
    names = tuple(f"F{i}" for i in range(len(counts)))
    of_triangle = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
    return BodyMesh("B", triangles_mm.reshape(-1, 3), np.arange(3 * n).reshape(n, 3), names, of_triangle)


def random_mesh(seed, n=40, faces=None):
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-2, 1, (n, 1, 1))
    return mesh_of(rng.normal(0, 5, (n, 1, 3)) + size * rng.normal(0, 1, (n, 3, 3)), faces)


def areas(corners):
    a, b, c = np.moveaxis(corners, 1, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


@pytest.mark.parametrize("n_cells", [1, 35, 1000, 20_000])
def test_cells_cover_their_triangles(n_cells):
    mesh = random_mesh(1)
    cells = divided(mesh, np.array([0]), n_cells)
    whole = areas(mesh.corners_mm)
    assert areas(cells.corners_mm) == pytest.approx(cells.area_mm2, rel=1e-9)
    assert np.bincount(cells.triangle, cells.area_mm2) == pytest.approx(whole, rel=1e-12)
    assert cells.area_mm2.max() <= whole.sum() / n_cells * (1 + 1e-9)
    assert cells.patch_area_mm2.sum() == pytest.approx(whole.sum(), rel=1e-12)
    # the parts lie on the triangle that they are of: their middle is that of the triangle
    middle = np.zeros((len(whole), 3))
    np.add.at(middle, cells.triangle, cells.corners_mm.mean(axis=1) * cells.area_mm2[:, None])
    assert middle / whole[:, None] == pytest.approx(mesh.corners_mm.mean(axis=1), abs=1e-9)


@pytest.mark.parametrize("n_cells", [1, 50, 3000])
def test_places_are_found_in_their_cells(n_cells):
    mesh = random_mesh(2)
    cells = divided(mesh, np.array([0]), n_cells)
    rng = np.random.default_rng(3)
    shares = rng.dirichlet((1, 1, 1), len(cells.triangle))
    places = np.einsum("ns,nsx->nx", shares, cells.corners_mm)
    found = cells.cell_of(mesh, cells.triangle, places)
    assert (found == np.arange(len(found))).mean() > 0.999  # rounding may decide at a border
    assert (cells.triangle[found] == cells.triangle).all()


def test_places_beside_a_triangle_count_to_its_border():
    mesh = mesh_of([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    cells = divided(mesh, np.array([0]), 100)
    places = np.array([[-0.1, -0.1, 0], [1.1, 0, 0], [0, 1.1, 0], [0.6, 0.6, 0], [2, 2, 5]])
    found = cells.cell_of(mesh, np.zeros(5, np.int64), places)
    assert ((found >= 0) & (found < 100)).all()
    corner = cells.corners_mm[found[:3]].reshape(3, -1, 3)
    assert np.linalg.norm(corner - [[[0, 0, 0]], [[1, 0, 0]], [[0, 1, 0]]], axis=2).min(axis=1) == pytest.approx(0)


def test_only_chosen_faces():
    mesh = random_mesh(4, 30, [5, 10, 15])
    cells = divided(mesh, np.array([2, 0]))
    assert set(cells.triangle) == {*range(5), *range(15, 30)}
    assert (cells.first[5:15] == -1).all()


@pytest.mark.parametrize("n_cells", [1000, 200_000])
def test_patches_have_about_one_area_and_stay_on_a_face(n_cells):
    square = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], float)
    mesh = mesh_of(np.concatenate([square * 10, square + 20, square * 0.1 - 5]), [2, 2, 2])
    cells = divided(mesh, np.arange(3), n_cells)
    n_patches = min(n_cells // 10, MOST_PATCHES)
    target = 101.01 / n_patches
    face_of_patch = [
        set(mesh.triangle_face[cells.triangle[cells.patch == p]]) for p in range(len(cells.patch_area_mm2))
    ]
    assert all(len(faces) == 1 for faces in face_of_patch)
    large = np.array([faces == {0} for faces in face_of_patch])
    assert cells.patch_area_mm2[large].min() > 0.8 * target
    assert cells.patch_area_mm2[large].max() < 2.05 * target
    assert large.sum() == pytest.approx(n_patches, rel=0.1)
    small = np.array([faces == {2} for faces in face_of_patch])
    if n_cells == 1000:  # a face of a hundredth of a patch sets no extreme
        assert cells.is_whole.tolist() == (~small).tolist()


def test_triangles_without_area():
    flat = [[[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 0, 0], [0, 0, 0], [0, 0, 0]]]
    cells = divided(mesh_of(flat), np.array([0]))
    assert cells.area_mm2.tolist() == [0, 0]
    assert not cells.is_whole.any()
    assert cells.cell_of(mesh_of(flat), np.array([0, 1]), np.ones((2, 3))).tolist() == [0, 1]


@pytest.mark.parametrize("steep", [0.0, 1.5])
def test_light_on_an_exact_surface_beside_its_triangle_counts_to_the_next_one(steep):
    """Even light on a round mantle falls evenly into cells, though light comes through facets beside its places."""
    n, radius = 18, 10.0
    mesh = tube("Tube", radius, 5.0, n)
    cells = divided(mesh, np.array([0]), 2000)
    rng = np.random.default_rng(5)
    angle = rng.uniform(0, 2 * np.pi, 400_000)
    places = np.stack([radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0, 5.0, angle.size)], axis=1)
    # the facet is that over the place from which slanted light came, before it met the surface
    sagitta = 1 - np.cos(np.pi / n)
    through = np.floor((angle + steep * sagitta) / (2 * np.pi / n)).astype(np.int64) % n
    found = cells.cell_of(mesh, through, places)
    share = np.bincount(found, minlength=len(cells.area_mm2)) / len(found)
    even = cells.area_mm2 / cells.area_mm2.sum()
    # a facet's cells hold up to 1 % more or less of the arc over them
    assert np.abs(share / even - 1).max() < 0.02 + 5 / np.sqrt(len(found) * even.min())


def test_places_move_on_within_their_face_only():
    """Two squares side by side are two faces: a place beyond the border stays with its own."""
    square = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], float)
    beside = square + [1, 0, 0]
    place = np.array([[1.25, 0.5, 0.1]])
    apart = mesh_of(np.concatenate([square, beside]), [2, 2])
    cells = divided(apart, np.array([0, 1]), 4)
    assert cells.triangle[cells.cell_of(apart, np.array([0]), place)].tolist() == [0]
    joined = mesh_of(np.concatenate([square, beside]), [4])
    cells = divided(joined, np.array([0]), 4)
    assert cells.triangle[cells.cell_of(joined, np.array([0]), place)].tolist() == [3]


def test_places_far_off_and_slivers_are_no_trouble():
    plain, flat = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0], [1, 0, 0], [0.5, 1e-160, 0]]
    thin = [[0, 0, 5], [1, 1e-9, 5], [2, 0, 5]]
    mesh = mesh_of([plain, flat, thin])
    cells = divided(mesh, np.array([0]), 50)
    for place in ([1e100, -1e100, 1e100], [-1e100, 1e100, 0.0], [5.0, 7.0, -3.0]):
        found = cells.cell_of(mesh, np.arange(3), np.array([place] * 3))
        assert ((found >= 0) & (found < len(cells.area_mm2))).all()
