# SPDX-License-Identifier: LGPL-2.1-or-later
"""Detectors on faces whose exact surfaces light meets: a beam from the side onto a cylinder of a few facets."""

from __future__ import annotations

import math

import numpy as np
import pytest

from raymaps.results.detector import evaluate_detector
from raymaps.results.report import report
from raymaps.run import simulate
from tests.face_maps import tube
from tests.store.small_scenes import geometry, write_scene

RADIUS_MM, HEIGHT_MM, BEAM_MM, FACETS = 10.0, 8.0, 12.0, 18
#: Irradiance across the beam of 1 W.
BEAM_W_PER_MM2 = 1.0 / (math.pi * BEAM_MM**2)


@pytest.fixture(scope="module")
def raymap(tmp_path_factory):
    folder = tmp_path_factory.mktemp("exact")
    shape = geometry(folder, tube("Tube", RADIUS_MM, HEIGHT_MM, FACETS))
    shape["faces"][0]["surface"] = {
        "type": "cylinder",
        "point_mm": [0, 0, 0],
        "axis": [0, 0, 1],
        "radius_mm": RADIUS_MM,
    }
    data = {
        "format": "raymaps-scene",
        "version": 1,
        "surfaces": {"black": {"kind": "absorber"}},
        "bodies": {"Tube": {"geometry": shape, "surface": "black"}},
        "sources": {
            "Beam": {
                "kind": "disc", "flux_w": 1.0, "position_mm": [30, 0, HEIGHT_MM / 2], "direction": [-1, 0, 0],
                "radius_mm": BEAM_MM,
            }
        },
        "detectors": {"Mantle": {"kind": "face", "body": "Tube", "faces": ["Mantle"]}},
        "settings": {"rays": 400_000, "seed": 4},
    }  # fmt: skip
    return simulate(write_scene(folder, data), folder / "tube.raymap", threads=1)


def test_cells_get_the_light_of_the_arc_over_them(raymap):
    """Irradiance goes with the cosine of the angle on the cylinder, cell by cell, though light comes beside facets."""
    found = evaluate_detector(raymap, "Mantle", resolution=(20, 25))
    corners = found.cells.corners_mm.mean(axis=1)
    angle = np.arctan2(corners[:, 1], corners[:, 0])
    lit = np.abs(angle) < math.radians(80)
    arc_mm2 = found.cells.area_mm2 * (math.pi / FACETS) / math.sin(math.pi / FACETS)
    expected = (BEAM_W_PER_MM2 * np.cos(angle) * arc_mm2)[lit]
    chi2 = (((found.cell_flux_w[lit] - expected) / found.cell_stderr_w[lit]) ** 2).sum()
    n = lit.sum()
    assert n > 200
    assert abs(chi2 - n) < 5 * math.sqrt(2 * n) + 0.05 * n  # cells of a facet share its arc unevenly by up to 1 %


@pytest.mark.parametrize("largest_deg", [5, 30, 60])
def test_the_angle_of_incidence_is_that_on_the_cylinder(raymap, largest_deg):
    """Light up to an angle covers twice the radius times its sine; facets of 20 degrees would take all or nothing."""
    found = evaluate_detector(raymap, "Mantle", max_angle_deg=largest_deg)
    expected = 2 * RADIUS_MM * math.sin(math.radians(largest_deg)) * HEIGHT_MM * BEAM_W_PER_MM2
    assert abs(found.flux_w.value - expected) < 5 * found.flux_w.stderr


def test_the_report_tells_the_angle_on_the_cylinder(raymap):
    checked = 0
    for ray in report(raymap, "hit(Tube)", limit=300).rays:
        before, event = ray.events[0], ray.events[1]
        x, y, _ = event.position_mm
        way = np.subtract(event.position_mm, before.position_mm)
        cosine = abs(x * way[0] + y * way[1]) / (math.hypot(x, y) * np.linalg.norm(way))
        assert event.incidence_deg == pytest.approx(math.degrees(math.acos(min(cosine, 1.0))), abs=1e-5)
        checked += 1
    assert checked == 300
