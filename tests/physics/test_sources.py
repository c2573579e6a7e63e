# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sources: each sampler against its density by chi-square, and what rays of several sources stand for.

Cumulated densities of places and directions: M. Pharr, W. Jakob, G. Humphreys: Physically Based Rendering, 4th ed.,
sections A.5.1 to A.5.4.
"""

import math

import numpy as np
import pytest

from raymaps.ray_numbers import source_of_rays
from raymaps.scene import load_scene
from tests.physics.scenes import (
    agrees,
    ball,
    body,
    box,
    chi_square_agrees,
    disc,
    disc_source,
    follows,
    rectangle,
    share_agrees,
    traced,
    unit,
    write_scene,
)

#: Detectors far away only make the scene large, so that directions are known well.
FAR = {"Above": rectangle((0, 0, 1000), 2000, 2000), "Below": rectangle((0, 0, -1000), 2000, 2000)}
BLACK = {"black": {"kind": "absorber"}}
AXES = [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.3, -2, 0.9), (1e-3, 1e-3, -1)]


def frame_around(axis):
    """Two unit vectors at right angles to an axis and to each other."""
    axis = unit(np.array(axis, float))
    x = unit(np.cross(axis, [0.6, 0.64, 0.48]))
    return x, np.cross(axis, x), axis


def directions(h):
    return unit(h.way[h.first + 1])


def azimuths_are_even(what, vectors, x, y):
    follows(f"{what}, azimuth", np.arctan2(vectors @ y, vectors @ x) / (2 * math.pi) + 0.5, 36)


def test_point_source_is_isotropic(tmp_path):
    """cos(theta) is uniform along every axis, and so is the azimuth; both together."""
    h = traced(
        tmp_path,
        {},
        rays=200_000,
        detectors=FAR,
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": [3, 4, 5]}},
    )
    d = directions(h)
    assert np.allclose(h.position[h.first], [3, 4, 5], atol=h.raymap.manifest.grid_mm)
    for axis in AXES:
        x, y, z = frame_around(axis)
        follows(f"cos around {axis}", (d @ z + 1) / 2)
        azimuths_are_even(f"around {axis}", d, x, y)
    counts = np.histogram2d(d[:, 2], np.arctan2(d[:, 1], d[:, 0]), (20, 20), ((-1, 1), (-math.pi, math.pi)))[0]
    chi_square_agrees("cos and azimuth", counts, np.full((20, 20), h.n_rays / 400))
    agrees("mean direction", d.mean(axis=0), (3 * h.n_rays) ** -0.5, 0)


@pytest.mark.parametrize("half_angle_deg", [0.5, 10, 90, 150, 180])
@pytest.mark.parametrize("axis", AXES)
def test_cone_source_is_uniform_in_solid_angle(tmp_path, axis, half_angle_deg):
    h = traced(
        tmp_path,
        {},
        rays=30_000,
        detectors=FAR,
        sources={
            "S": {
                "kind": "cone",
                "flux_w": 1,
                "position_mm": [0, 0, 0],
                "direction": list(axis),
                "half_angle_deg": half_angle_deg,
            }
        },
    )
    x, y, z = frame_around(axis)
    d = directions(h)
    # 1 - cos from the sine, which keeps its digits in narrow cones
    sine = np.hypot(d @ x, d @ y)
    one_minus_cos = np.where(d @ z > 0, sine**2 / (1 + np.sqrt(np.maximum(0, 1 - sine**2))), 1 - d @ z)
    follows("solid angle", one_minus_cos / (1 - math.cos(math.radians(half_angle_deg))), slack=1e-3)
    azimuths_are_even("cone", d, x, y)


@pytest.mark.parametrize("axis", AXES)
def test_disc_source_is_even_and_collimated(tmp_path, axis):
    """The squared distance from the centre is uniform, the azimuth too; all rays go along the axis."""
    h = traced(tmp_path, {}, rays=50_000, detectors=FAR, sources={"S": disc_source((1, 2, 3), axis, 200)})
    x, y, z = frame_around(axis)
    at = h.position[h.first] - [1, 2, 3]
    grid = h.raymap.manifest.grid_mm
    assert np.abs(at @ z).max() < 2 * grid
    follows("squared radius", ((at @ x) ** 2 + (at @ y) ** 2) / 200**2, slack=1e-4)
    azimuths_are_even("disc", at, x, y)
    length = np.linalg.norm(h.way[h.first + 1], axis=1)
    assert (np.linalg.norm(directions(h) - z, axis=1) <= math.sqrt(3) * grid / length).all()


def test_faces_emit_by_area_and_by_lamberts_law(tmp_path):
    """Places are even over all chosen faces: each triangle by its area, and within a triangle in barycentric
    coordinates; sin² of the angle to the triangle's own outward normal is uniform.
    """
    shape = ball(10, 1)
    stretched = shape._replace(vertices=shape.vertices * [1, 2, 0.3])
    h = traced(
        tmp_path,
        {"Lamp": body(stretched, "black")},
        rays=200_000,
        surfaces=BLACK,
        detectors=FAR,
        sources={"S": {"kind": "faces", "flux_w": 1, "body": "Lamp"}},
    )
    triangle = h.triangle[h.first]
    areas = stretched.areas
    chi_square_agrees("triangles", np.bincount(triangle, minlength=len(areas)), areas / areas.sum() * h.n_rays)

    a, b, c = np.moveaxis(stretched.vertices[stretched.triangles][triangle], 1, 0)
    normal = unit(np.cross(b - a, c - a))
    to_point = h.position[h.first] - a
    assert np.abs((to_point * normal).sum(axis=1)).max() < 2 * h.raymap.manifest.grid_mm

    def double_area(p, q):
        return (np.cross(p, q) * normal).sum(axis=1)

    whole = double_area(b - a, c - a)
    v, w = double_area(to_point, c - a) / whole, double_area(b - a, to_point) / whole
    slack = 1e-3  # of the grid, against the smallest triangle
    assert v.min() > -slack
    assert w.min() > -slack
    assert (v + w).max() < 1 + slack
    follows("barycentric, one", 1 - (1 - np.clip(v, 0, 1)) ** 2)
    follows("barycentric, other", 1 - (1 - np.clip(w, 0, 1)) ** 2)
    follows("barycentric, third", 1 - (np.clip(v + w, 0, 1)) ** 2)

    # directions: rays of a convex body leave without another event
    assert (np.diff(h.offsets) == 2).all()
    d = directions(h)
    cosine = (d * normal).sum(axis=1)
    assert cosine.min() > 0
    follows("sin²", 1 - cosine**2)
    along = unit(b - a)
    follows(
        "azimuth", np.arctan2((d * np.cross(normal, along)).sum(axis=1), (d * along).sum(axis=1)) / (2 * math.pi) + 0.5
    )


def test_only_chosen_faces_emit(tmp_path):
    h = traced(
        tmp_path,
        {"Lamp": body(box((0, 0, 0), (1, 2, 3)), "black")},
        rays=60_000,
        surfaces=BLACK,
        detectors=FAR,
        sources={"S": {"kind": "faces", "flux_w": 1, "body": "Lamp", "faces": ["+x", "+z"]}},
    )
    face = h.face[h.first]
    x, z = h.face_index("Lamp", "+x"), h.face_index("Lamp", "+z")
    assert np.isin(face, [x, z]).all()
    share_agrees("emitted by +x", (face == x).sum(), h.n_rays, 6 / 8)  # 2 x 3 and 1 x 2 mm²


def test_flat_lamp_gives_the_irradiance_of_its_projected_solid_angle(tmp_path):
    """On the axis of a Lambertian disc the irradiance is M r² / (r² + h²) (Boyd: Radiometry, 1983, section 2.4): on a
    small detector of side s it differs by less than (s / h)² = 1e-4.
    """
    radius, height, side = 20.0, 10.0, 0.2
    h = traced(
        tmp_path,
        {"Lamp": body(disc(radius), "black")},
        rays=400_000,
        surfaces=BLACK,
        detectors={"D": rectangle((0, 0, height), side, side, normal=[0, 0, -1])},
        sources={"S": {"kind": "faces", "flux_w": 1000, "body": "Lamp"}},
    )
    exitance = 1000 / (math.pi * radius**2)
    expected = exitance * radius**2 / (radius**2 + height**2) * side**2
    agrees("flux", *h.flux_w(h.crossings_per_ray(h.through("D"))), expected, rounding=1e-3)


def test_sources_share_rays_by_flux_and_keep_their_watts(tmp_path):
    """Any run of rays has each source's share to within a few rays; every source's flux is exact whatever its rays
    are.
    """
    flux = [1.0, 0.02, 3.0, 0.5, 7.25]
    sources = {
        f"S{k}": {"kind": "point", "flux_w": f, "position_mm": [10.0 * k, 0, 0], "rgb": [k + 1, 2, 3]}
        for k, f in enumerate(flux)
    }
    scene = load_scene(write_scene(tmp_path, {}, name="shares", sources=sources))
    share = np.array(flux) / sum(flux)
    for first, n in ((0, 1000), (12_345, 1000), (10**9, 100_000), (7, 10)):
        count = np.bincount(source_of_rays(scene, first, n), minlength=5)
        assert np.abs(count - share * n).max() < 8

    h = traced(tmp_path, {}, rays=20_000, sources=sources)
    assert h.raymap.source_flux_w.tolist() == flux
    for k, f in enumerate(flux):
        mine = h.ray_source == k
        assert mine.sum() * h.raymap.ray_flux_w[k] == pytest.approx(f, rel=1e-12)
        rgb = np.array([k + 1, 2, 3]) / (k + 6)
        assert np.allclose(h.light[h.first[mine]], rgb, atol=2e-7)
        assert (h.light[h.first[mine]].sum(axis=1) == 1).all()
        assert np.allclose(h.position[h.first[mine]], [10 * k, 0, 0], atol=1e-4)


def test_number_of_a_ray_tells_nothing_about_its_direction(tmp_path):
    """Source shares come from the ray's number: the directions of one source's rays are fair all the same."""
    sources = {f"S{k}": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]} for k in range(3)}
    h = traced(tmp_path, {}, rays=150_000, detectors=FAR, sources=sources)
    d = directions(h)
    for k in range(3):
        for axis in range(3):
            follows(f"source {k}, axis {axis}", (d[h.ray_source == k, axis] + 1) / 2)
