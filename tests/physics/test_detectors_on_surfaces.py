# SPDX-License-Identifier: LGPL-2.1-or-later
"""Detectors where rounding could decide: in the plane of a face, at the limit of acceptance, small in a large scene, in
a medium that tints.
"""

import math

import numpy as np
import pytest

from raymaps import evaluate_detector
from tests.physics.scenes import Shape, body, box, chi_square_agrees, disc_source, rectangle, traced

FLAT = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
TILTED = ((0.0, math.sin(0.7), math.cos(0.7)), (1.0, 0.0, 0.0))
SURFACES = {
    "black": {"kind": "absorber"},
    "white": {"kind": "lambertian", "reflectance": 1.0},
    "opal": {"kind": "lambertian", "transmittance": 1.0},
    "clear": {"kind": "fresnel"},
}


def plate(normal, x_axis):
    """A square sheet of 20 mm through the origin, two triangles."""
    n, x = np.array(normal), np.array(x_axis)
    y = np.cross(n, x)
    corners = np.array([-x - y, x - y, x + y, -x + y]) * 10
    return Shape(corners, np.array([[0, 1, 2], [0, 2, 3]]), (("Face1", 2),))


@pytest.mark.parametrize(("normal", "x_axis"), [FLAT, TILTED], ids=["flat", "tilted"])
@pytest.mark.parametrize("surface", ["black", "white", "opal"])
def test_a_detector_in_the_plane_of_a_face_sees_what_arrives(tmp_path, normal, x_axis, surface):
    """All 1 W of a beam arrives once, on the front; what the face reflects or transmits does not count again."""
    h = traced(
        tmp_path,
        {"Plate": body(plate(normal, x_axis), surface)},
        rays=5_000,
        surfaces=SURFACES,
        sources={"Beam": disc_source((0.3, 0.2, 30), (0, 0, -1), 3)},
        detectors={
            side: rectangle((0, 0, 0), 19, 19, normal=list(normal), x_axis=list(x_axis), side=side)
            for side in ("front", "back")
        },
    )
    assert evaluate_detector(h.raymap, "front").flux_w.value == pytest.approx(1, abs=1e-12)
    assert evaluate_detector(h.raymap, "back").flux_w.value == 0
    assert len(h.crossing_ray) == 2 * 5_000  # each ray once on each detector


def test_a_detector_in_an_interface_sees_what_arrives_from_either_side(tmp_path):
    """The front of a detector in a glass block's first face sees the beam; the back only what comes back inside."""
    h = traced(
        tmp_path,
        {"Block": body(box((-10, -10, -20), (10, 10, 0)), "clear", "glass")},
        rays=20_000,
        media={"glass": {"refractive_index": 1.5}},
        surfaces=SURFACES,
        sources={"Beam": disc_source((0.3, 0.2, 30), (0, 0, -1), 3)},
        detectors={side: rectangle((0, 0, 0), 19, 19, side=side) for side in ("front", "back")},
    )
    front = evaluate_detector(h.raymap, "front").flux_w
    assert front.value == pytest.approx(1, abs=1e-12)
    back = evaluate_detector(h.raymap, "back").flux_w
    r = 0.04  # ((n - 1) / (n + 1))² at normal incidence; inside: (1 - r) r (1 + r² + ...)
    expected = (1 - r) * r / (1 - r * r)
    assert abs(back.value - expected) < 5 * back.stderr


@pytest.mark.parametrize("angle_deg", [10, 20, 30, 40, 45, 60])
def test_light_at_the_very_limit_is_accepted(tmp_path, angle_deg):
    angle = math.radians(angle_deg)
    direction = (math.sin(angle), 0, -math.cos(angle))
    h = traced(
        tmp_path,
        {},
        rays=1_000,
        sources={"Beam": disc_source([-20 * x for x in direction], direction, 1)},
        detectors={"D": rectangle((0, 0, 0), 20, 20, max_angle_deg=angle_deg)},
    )
    assert evaluate_detector(h.raymap, "D").flux_w.value == pytest.approx(1, abs=1e-12)
    assert evaluate_detector(h.raymap, "D", max_angle_deg=angle_deg).flux_w.value == pytest.approx(1, abs=1e-12)
    assert evaluate_detector(h.raymap, "D", max_angle_deg=angle_deg - 0.001).flux_w.value == 0


@pytest.mark.parametrize("scene_mm", [200, 10_000])
def test_a_small_detector_in_a_large_scene_is_evenly_lit(tmp_path, scene_mm):
    """Cells of a sensor 1 mm wide under an even beam: counts agree with equal expectations (chi-square)."""
    far = float(scene_mm)
    h = traced(
        tmp_path,
        {"Wall": body(box((far, -1, -1), (far + 1, 1, 1)), "black")},
        rays=400_000,
        surfaces=SURFACES,
        sources={"Beam": disc_source((0, 0, 10), (0, 0, -1), 1.0)},
        detectors={"D": rectangle((0, 0, 0), 1, 1, resolution=[100, 1])},
    )
    cell = np.floor((h.crossing_xy[:, 0] + 0.5) * 100).astype(int)
    counts = np.bincount(np.clip(cell, 0, 99), minlength=100)
    chi_square_agrees("cells", counts, np.full(100, counts.sum() / 100))


@pytest.mark.parametrize("way_mm", [1.0, 10.0])
def test_colour_on_a_detector_in_a_medium_that_tints(tmp_path, way_mm):
    """Band b arrives with exp(-a_b d), Beer-Lambert's law; 1 W a band sets out."""
    absorption = np.array([0.0, 0.1, 1.0])
    h = traced(
        tmp_path,
        {},
        rays=100_000,
        ambient="tint",
        media={"tint": {"refractive_index": 1.0, "absorption_per_mm": list(absorption)}},
        sources={"Beam": disc_source((0, 0, way_mm), (0, 0, -1), 1.0, flux_w=3.0)},
        detectors={"D": rectangle((0, 0, 0), 4, 4, resolution=[1, 1]), "Far": rectangle((0, 0, -30), 1, 1)},
    )
    found = evaluate_detector(h.raymap, "D")
    bands = found.cell_flux_rgb_w.reshape(-1, 3).sum(axis=0)
    # all bands share the error of the number of rays that arrive
    relative = found.flux_w.stderr / found.flux_w.value
    expected = np.exp(-absorption * way_mm)
    assert (np.abs(bands - expected) <= 5 * relative * expected + 1e-6).all()


def test_a_very_narrow_cone_keeps_its_angle(tmp_path):
    """sin² of the angle is uniform up to sin² of the half angle; its mean is half of that."""
    half_angle_deg = 1e-5
    h = traced(
        tmp_path,
        {},
        rays=20_000,
        sources={
            "Cone": {
                "kind": "cone", "flux_w": 1, "position_mm": [0, 0, 0], "direction": [0, 0, 1],
                "half_angle_deg": half_angle_deg,
            }
        },
        detectors={"D": rectangle((0, 0, 1e6), 1, 1, side="both")},
    )  # fmt: skip
    radius = np.hypot(*h.crossing_xy.T) / (1e6 * math.radians(half_angle_deg))
    assert radius.max() <= 1.001
    assert abs((radius**2).mean() - 0.5) < 5 * math.sqrt(1 / 12 / 20_000) + 0.001
