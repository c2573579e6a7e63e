# SPDX-License-Identifier: LGPL-2.1-or-later
"""Radiant intensity of light that left the scene, against closed forms."""

import math

import numpy as np
import pytest

from raymaps import evaluate_detector, query
from raymaps.formats.photometry_out import Photometry, eulumdat_text, ies_text
from raymaps.results.info import map_info
from tests.physics.scenes import agrees, body, box, chi_square_agrees, disc_source, revolved, traced

SURFACES = {"black": {"kind": "absorber"}, "clear": {"kind": "fresnel"}}
FAR = {"kind": "far_field", "axis": [0, 0, 1], "resolution": [12, 18]}


def cell_edges(n_gamma):
    """Borders in gamma of the cells around 0, 180/n, ... degrees, (n_gamma + 2,) in radians."""
    return np.clip((np.arange(n_gamma + 2) - 0.5) * math.pi / n_gamma, 0, math.pi)


def cells_agree(what, found, expected_share, n_rays):
    """Chi-square of the rays in each cell, those around the axis taken together."""
    caps = np.arange(found.flux_of_cell_w.shape[1]) % found.resolution[1] == 0
    counts = [*(found.flux_of_cell_w[:, caps].sum(axis=0)), *found.flux_of_cell_w[:, ~caps].ravel()]
    shares = [*(expected_share[:, caps].sum(axis=0)), *expected_share[:, ~caps].ravel()]
    counts, shares = np.array(counts) * n_rays / found.emitted_w, np.array(shares)
    assert counts[shares == 0].sum() == 0
    lit = shares > 0
    assert (shares[lit] * n_rays).min() > 10
    chi_square_agrees(what, counts[lit], shares[lit] * n_rays)


def test_isotropic_point(tmp_path):
    """I = flux / 4 pi in all directions; the solid angles of all cells are 4 pi."""
    h = traced(
        tmp_path, {}, rays=100_000, sources={"S": {"kind": "point", "flux_w": 2, "position_mm": [1, 2, 3]}},
        detectors={"Far": FAR},
    )  # fmt: skip
    far = evaluate_detector(h.raymap, "Far")
    assert far.solid_angle_sr.sum() == pytest.approx(4 * math.pi, rel=1e-12)
    assert far.flux_w.value == pytest.approx(2, rel=1e-12)
    assert far.flux_of_cell_w.sum() == pytest.approx(2, rel=1e-12)
    assert far.mean_w_per_sr.value == pytest.approx(2 / (4 * math.pi), rel=1e-12)
    cells_agree("isotropic", far, far.solid_angle_sr / (4 * math.pi), 100_000)
    for level, plane in ((0.5, "c0"), (0.1, "c90")):
        assert far.beam_deg[level, plane] == 360


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0)], ids=["along", "across"])
def test_lambertian_emitter(tmp_path, axis):
    """I = flux cos(theta) / pi: sin² of the angle to the normal is even; seen along the normal and from the side."""
    h = traced(
        tmp_path, {"Lamp": body(box((0, 0, -1), (10, 10, 0)), "black")}, rays=200_000, surfaces=SURFACES,
        sources={"S": {"kind": "faces", "flux_w": 1, "body": "Lamp", "faces": ["+z"]}},
        detectors={"Far": {**FAR, "axis": axis, "x_axis": [0, 1, 0]}},
    )  # fmt: skip
    far = evaluate_detector(h.raymap, "Far")
    if axis == (0, 0, 1):
        ring = np.diff(np.sin(np.minimum(cell_edges(18), math.pi / 2)) ** 2)
        cells_agree("Lambertian", far, np.tile(ring / 12, (12, 1)), 200_000)
        # around the axis: the mean of the intensity over the cap of 5 degrees
        peak = ring[0] / (2 * math.pi * (1 - math.cos(math.radians(5))))
        assert peak == pytest.approx(1 / math.pi, rel=0.002)
        agrees("peak", far.intensity_w_per_sr[0, 0], far.intensity_stderr_w_per_sr[0, 0], peak)
        # cos falls to one half at 60 degrees, to a tenth at 84.3; profiles are straight between steps of 5 degrees
        round_ = evaluate_detector(h.raymap, "Far", resolution=(1, 36))
        assert round_.beam_deg[0.5, "c0"] == pytest.approx(120, abs=2)
        assert round_.beam_deg[0.1, "c90"] == pytest.approx(2 * math.degrees(math.acos(0.1)), abs=2)
    else:
        # x = Lamp's normal lies in the half plane C = 90: cos(theta) = sin(gamma) sin(C)
        edges, half = cell_edges(18), math.pi / 12
        of_gamma = np.diff(edges / 2 - np.sin(2 * edges) / 4)  # integral of sin²
        c = np.arange(12) * math.pi / 6
        low, high = np.clip(c - half, 0, math.pi), np.clip(c + half, 0, math.pi)
        of_c = np.where(high > low, np.cos(low) - np.cos(high), 0.0)
        share = np.outer(of_c, of_gamma) / math.pi
        far_flux = far.flux_of_cell_w
        rows = share[:, 1:-1].ravel()
        counts = np.append(far_flux[:, 1:-1].ravel(), far_flux[:, [0, -1]].sum())
        expected = np.append(rows, 1 - rows.sum())
        assert counts[expected <= 1e-12].sum() == 0
        lit = expected > 1e-12
        chi_square_agrees("Lambertian from the side", counts[lit] * 200_000, expected[lit] * 200_000)


def test_cone(tmp_path):
    """Constant intensity flux / (2 pi (1 - cos a)) within the half angle a, none outside; full width 2 a."""
    direction = np.array([2.0, -1.0, 3.0])
    h = traced(
        tmp_path, {}, rays=100_000,
        sources={"S": {"kind": "cone", "flux_w": 3, "position_mm": [0, 0, 0], "direction": list(direction),
                       "half_angle_deg": 25}},
        detectors={"Far": {"kind": "far_field", "axis": list(direction), "x_axis": [0, 0, 1], "resolution": [6, 180]}},
    )  # fmt: skip
    far = evaluate_detector(h.raymap, "Far", resolution=(8, 18))  # cells reach to 5, 15, 25 degrees
    inside = 3 / (2 * math.pi * (1 - math.cos(math.radians(25))))
    lit = far.gamma_deg <= 20
    agrees("in the cone", far.intensity_w_per_sr[:, lit], far.intensity_stderr_w_per_sr[:, lit], inside)
    assert far.intensity_w_per_sr[:, ~lit].max() <= 1e-3 * inside  # directions are known to a thousandth of a degree
    assert evaluate_detector(h.raymap, "Far").beam_deg[0.5, "c0"] == pytest.approx(50, abs=1.0)
    # light within an angle to the axis
    half = evaluate_detector(h.raymap, "Far", max_angle_deg=12.5)
    share = (1 - math.cos(math.radians(12.5))) / (1 - math.cos(math.radians(25)))
    agrees("within 12.5 degrees", half.flux_w.value, half.flux_w.stderr, 3 * share)
    assert half.solid_angle_sr.sum() == pytest.approx(2 * math.pi * (1 - math.cos(math.radians(12.5))), rel=1e-9)
    agrees("mean there", half.mean_w_per_sr.value, half.mean_w_per_sr.stderr, inside)


def test_lens_collimated_beam(tmp_path):
    """A plano-convex lens, n = 1.5, R = 20 mm, and a point in its focus 40 mm from its curved side's vertex.

    The front focal length of a thin lens with the flat side towards the source is R / (n - 1) less d / n for the
    thickness d (E. Hecht: Optics, 5th edition, section 6.1). Of normal incidence (1 - 0.04)² gets through.
    """
    index, radius, thickness = 1.5, 20.0, 4.0
    r = np.linspace(0, 10, 201)
    z = thickness - (radius - np.sqrt(radius**2 - r**2))
    profile = np.array([*zip(r, z, strict=True), (10.0, 0.0), (0.0, 0.0)])
    focus = radius / (index - 1) - thickness / index
    h = traced(
        tmp_path, {"Lens": body(revolved(profile, 180), "clear", "glass")}, rays=60_000, surfaces=SURFACES,
        media={"glass": {"refractive_index": index}},
        sources={"S": {"kind": "cone", "flux_w": 1, "position_mm": [0.01, 0.02, -focus], "direction": [0, 0, 1],
                       "half_angle_deg": 5}},
        detectors={"Far": {**FAR, "resolution": [4, 720]}},
    )  # fmt: skip
    narrow = evaluate_detector(h.raymap, "Far", max_angle_deg=0.5)
    agrees("collimated", narrow.flux_w.value, narrow.flux_w.stderr, 0.96**2, rounding=2e-3)
    far = evaluate_detector(h.raymap, "Far")
    assert far.beam_deg[0.5, "c0"] < 1.0  # of 10 degrees before the lens


def test_all_that_leaves_is_what_the_ledger_says(tmp_path):
    """And the rays are those of the criteria ended(left) and detector(Far)."""
    h = traced(
        tmp_path, {"Plate": body(box((-5, -5, -1), (5, 5, 0)), "grey")}, rays=20_000,
        surfaces={"grey": {"kind": "lambertian", "reflectance": [0.8, 0.3, 0.1]}},
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 1]},
                 "T": {"kind": "point", "flux_w": 2, "position_mm": [0, 0, 5]}},
        detectors={"Far": FAR},
    )  # fmt: skip
    far = evaluate_detector(h.raymap, "Far")
    assert far.flux_w.value == pytest.approx(map_info(h.raymap).ledger.escaped_w, rel=1e-9)
    assert far.rays == query(h.raymap, "ended(left)").rays == query(h.raymap, "detector(Far)").rays
    per_ray = h.per_ray(h.last, h.light[h.last].sum(axis=1))
    left = (h.kind[h.last] == 14)[:, None].ravel()
    assert far.flux_w.stderr == pytest.approx(h.flux_w(per_ray * left)[1], rel=1e-6)
    parts = [evaluate_detector(h.raymap, "Far", source=name).flux_w.value for name in ("S", "T")]
    assert math.fsum(parts) == pytest.approx(far.flux_w.value, rel=1e-12)
    some = evaluate_detector(h.raymap, "Far", where="hit(Plate)")
    assert some.rays == query(h.raymap, "hit(Plate) & ended(left)").rays


def test_told_precision_of_directions_is_the_true_one(tmp_path):
    """Stored places are rounded: the direction of a beam, known exactly, comes back with the error that is told."""
    direction = np.array([0.36, 0.48, 0.8])
    h = traced(tmp_path, {}, rays=20_000, sources={"S": disc_source((0, 0, 0), direction, 10)}, detectors={"Far": FAR})
    way = h.position[h.last] - h.position[h.first]
    sine = np.linalg.norm(np.cross(way / np.linalg.norm(way, axis=1)[:, None], direction), axis=1)
    true_deg = math.degrees(math.sqrt((sine**2).mean()))
    told_deg = evaluate_detector(h.raymap, "Far").direction_error_deg
    assert told_deg == pytest.approx(true_deg, rel=0.1)
    # all there is is wrapped in a twentieth of its size, so no last segment is shorter: that bounds the error
    assert np.linalg.norm(way, axis=1).min() > 0.05 * 20 * 0.99
    assert told_deg < 0.001


@pytest.mark.parametrize("write", [ies_text, eulumdat_text], ids=["ies", "ldt"])
def test_half_planes_stand_where_a_luminaire_has_them(tmp_path, write):
    """A luminaire that shines most towards C = 30 and gamma = 60 degrees: no half plane is turned or mirrored."""
    gamma, c = np.radians(np.arange(0, 181, 5)), np.radians(np.arange(0, 360, 10))[:, None]
    peak = math.radians(60)
    towards = np.cos(gamma) * math.cos(peak) + np.sin(gamma) * math.sin(peak) * np.cos(c - math.radians(30))
    table = Photometry("Lamp", 2 + towards**3, 1000.0, 1000.0, "2026-01-31")
    suffix = ".ies" if write is ies_text else ".ldt"
    (tmp_path / f"lamp{suffix}").write_text(write(table))
    axes = {"direction": [1, 2, -3], "c0_direction": [0, 1, 1]}
    h = traced(
        tmp_path, {}, rays=200_000,
        sources={"L": {"kind": "luminaire", "flux_w": 1, "position_mm": [0, 0, 0], **axes,
                       "intensity": {"file": f"lamp{suffix}"}}},
        detectors={"Far": {"kind": "far_field", "axis": axes["direction"], "x_axis": axes["c0_direction"]}},
    )  # fmt: skip
    found = evaluate_detector(h.raymap, "Far", resolution=(12, 12))
    nodes = table.candela[::3, ::3]
    scale = (nodes * found.solid_angle_sr).sum()
    agrees("intensity", found.intensity_w_per_sr, found.intensity_stderr_w_per_sr, nodes / scale, rounding=0.04)
    assert np.unravel_index(np.argmax(found.intensity_w_per_sr), (12, 13)) == (1, 4)


@pytest.mark.parametrize("suffix", [".ies", ".ldt"])
def test_a_far_field_written_as_a_luminaire_and_traced_again(tmp_path, suffix):
    """A Lambertian emitter, written, read as a source, traced: the intensities of both agree."""
    first = traced(
        tmp_path / "a", {"Lamp": body(box((0, 0, 0), (10, 10, 1)), "black")}, rays=200_000, surfaces=SURFACES,
        sources={"S": {"kind": "faces", "flux_w": 4, "body": "Lamp", "faces": ["-z"]}},
        detectors={"Far": {"kind": "far_field"}},
    )  # fmt: skip
    (tmp_path / "b").mkdir()
    far = evaluate_detector(first.raymap, "Far", resolution=(8, 36))
    far.write(tmp_path / "b" / f"lamp{suffix}")
    again = traced(
        tmp_path / "b", {}, rays=200_000, detectors={"Far": {"kind": "far_field"}},
        sources={"L": {"kind": "luminaire", "flux_w": 4, "position_mm": [0, 0, 0],
                       "intensity": {"file": f"lamp{suffix}"}}},
    )  # fmt: skip
    found = evaluate_detector(again.raymap, "Far", resolution=(8, 36))
    stderr = np.hypot(found.intensity_stderr_w_per_sr, far.intensity_stderr_w_per_sr)
    # where the intensity is straight over a cell; the last steps before 90 degrees round off its edge
    steady = far.gamma_deg <= 80
    agrees("traced again", found.intensity_w_per_sr[:, steady], stderr[:, steady], far.intensity_w_per_sr[:, steady],
           rounding=0.01)  # fmt: skip
