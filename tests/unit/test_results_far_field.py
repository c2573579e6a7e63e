# SPDX-License-Identifier: LGPL-2.1-or-later
"""The far field against a slow calculation, ray by ray, that shares no code with the fast one; widths of beams."""

import csv
import json
import math

import numpy as np
import pytest

from raymaps.errors import CriterionError, OutputError
from raymaps.kinds import EventKind
from raymaps.results.beam import beam_angle_deg, plane_profile
from raymaps.results.detector import evaluate_detector
from raymaps.results.goniometer import Goniometer
from tests.criterion_maps import NAMES, SOURCE_FLUX_W, Event, MemoryMap, random_map


@pytest.fixture(scope="module")
def raymap():
    return random_map(seed=12, n_rays=900, portion_rays=130)


def direction_deg(ray):
    """C and gamma of the last segment; Sky's axis is -z and its x axis x, so y' = z' cross x' = -y."""
    x, y, z = np.subtract(ray[-1].position_mm, ray[-2].position_mm)
    return math.degrees(math.atan2(-y, x)) % 360, math.degrees(math.acos(-z / math.hypot(x, y, z)))


def slow_cells(raymap, n_c, n_gamma, source=None, largest_deg=180.0):
    """Light of each ray by nearest half plane and gamma: (n_rays, n_c, n_gamma + 1); at the axis shared by all."""
    light = np.zeros((len(raymap.rays), n_c, n_gamma + 1))
    for number, ray in enumerate(raymap.rays):
        if ray[-1].kind != EventKind.LEFT or (source is not None and NAMES.sources[ray[0].source] != source):
            continue
        c, gamma = direction_deg(ray)
        if gamma > largest_deg:
            continue
        step = round(gamma * n_gamma / 180)
        together = n_c if step in (0, n_gamma) else most_together(n_c, n_gamma, step)
        # the half plane in the middle of those that share the cell, and those around it
        middle = round(c * n_c / 360 / together) * together
        for k in range(together):
            light[number, (middle + k - together // 2) % n_c, step] = math.fsum(ray[-1].light) / together
    return light


def most_together(n_c, n_gamma, step):
    """Half planes that share a cell: the largest odd divisor of their number that leaves it no wider than high."""
    height, width = math.pi / n_gamma, math.sin(step * math.pi / n_gamma) * 2 * math.pi / n_c
    return max([n for n in range(1, n_c + 1, 2) if n_c % n == 0 and n * width <= height * (1 + 1e-6)], default=1)


def estimate(raymap, values, impossible=()):
    """Flux of a value per ray and its variance, (n_rays,)."""
    flux_w = variance_w2 = 0.0
    for source, emitted_w in enumerate(SOURCE_FLUX_W):
        if NAMES.sources[source] in impossible:
            continue
        mine = values[[ray[0].source == source for ray in raymap.rays]]
        flux_w += emitted_w * mine.mean()
        variance_w2 += emitted_w**2 * mine.var(ddof=1) / len(mine)
    return flux_w, variance_w2


@pytest.mark.parametrize("resolution", [(1, 1), (4, 3), (7, 6), (1, 5), (45, 6)])
@pytest.mark.parametrize("conditions", [{}, {"source": "Beam"}, {"max_angle_deg": 70.0}], ids=str)
def test_against_a_slow_calculation(raymap, resolution, conditions):
    found = evaluate_detector(raymap, "Sky", resolution=resolution, **conditions)
    light = slow_cells(raymap, *resolution, conditions.get("source"), conditions.get("max_angle_deg", 180.0))
    others = set(NAMES.sources) - {conditions["source"]} if "source" in conditions else ()
    flux_w, variance_w2 = estimate(raymap, light.sum(axis=(1, 2)), others)
    assert found.flux_w.value == pytest.approx(flux_w, rel=1e-12)
    assert found.flux_w.stderr == pytest.approx(math.sqrt(variance_w2), rel=1e-9)
    assert found.rays == np.count_nonzero(light.sum(axis=(1, 2)))
    for c in range(resolution[0]):
        for gamma in range(resolution[1] + 1):
            cell_w, cell_variance = estimate(raymap, light[:, c, gamma], others)
            assert found.flux_of_cell_w[c, gamma] == pytest.approx(cell_w, rel=1e-9, abs=1e-15)
            if cell_w > 0 and "source" in conditions:
                assert found.stderr_of_cell_w[c, gamma] == pytest.approx(math.sqrt(cell_variance), rel=1e-9)
    solid = found.solid_angle_sr
    assert solid.sum() == pytest.approx(2 * math.pi * (1 - math.cos(math.radians(found.max_angle_deg))), rel=1e-9)
    assert found.mean_w_per_sr.value == pytest.approx(flux_w / solid.sum(), rel=1e-9)
    measured = np.nan_to_num(found.intensity_w_per_sr) * solid
    assert measured == pytest.approx(found.flux_of_cell_w, rel=1e-12)
    assert found.max_w_per_sr.value == pytest.approx(np.nanmax(found.intensity_w_per_sr), rel=1e-12)
    assert found.min_w_per_sr.value == pytest.approx(np.nanmin(found.intensity_w_per_sr), rel=1e-12, abs=1e-15)


def test_solid_angles_of_cells(raymap):
    found = evaluate_detector(raymap, "Sky", resolution=(8, 6))
    # around 30 degrees: from 15 to 45, an eighth of all around
    ring = 2 * math.pi * (math.cos(math.radians(15)) - math.cos(math.radians(45)))
    assert found.solid_angle_sr[0, 1] == pytest.approx(ring / 8, rel=1e-12)
    cap = 2 * math.pi * (1 - math.cos(math.radians(15)))
    assert found.solid_angle_sr[:, 0].sum() == pytest.approx(cap, rel=1e-12)
    fine = evaluate_detector(raymap, "Sky", resolution=(1, 10_000)).solid_angle_sr
    assert fine[0, 0] == pytest.approx(math.pi * (math.pi / 20_000) ** 2, rel=1e-6)  # a small cap is flat


def test_cells_near_the_axis_are_shared():
    """At 5 degrees nine of 72 half planes share a cell, three at 10 and 15; C = 0 is in the middle of its cell."""
    goniometer = Goniometer(72, 36)
    assert goniometer.together[:6].tolist() == [72, 9, 3, 3, 1, 1]
    assert goniometer.together[::-1].tolist() == goniometer.together.tolist()
    measure = goniometer.solid_angle_sr
    assert measure.sum() == pytest.approx(4 * math.pi, rel=1e-12)
    assert len(measure) == goniometer.first[-1] == 2 + 2 * (8 + 24 + 24) + 29 * 72
    grid = goniometer.on_grid(np.arange(len(measure), dtype=float), shared=False)
    assert (grid[[-4, -3, 0, 4], 1] == grid[0, 1]).all()
    assert grid[5, 1] == grid[0, 1] + 1
    assert goniometer.on_grid(measure, shared=True).sum() == pytest.approx(4 * math.pi, rel=1e-12)
    # directions at the nodes are found in their cells
    c, gamma = np.meshgrid(np.arange(72) * math.radians(5), np.arange(37) * math.radians(5), indexing="ij")
    assert goniometer.cell_of(gamma.ravel(), c.ravel()).tolist() == grid.ravel().tolist()
    assert Goniometer(64, 36).together.tolist() == [64, *[1] * 35, 64]  # 64 has no odd divisor


def test_rays_that_leave_where_they_are_have_no_direction():
    """One of four rays has a last segment without length: it counts to the flux, but in no cell."""
    ends = [(0, 0, -5), (0, 0, -5), (3, 0, 0), (0, 0, 0)]
    rays = [[Event(EventKind.EMISSION, 0, light=(0.5, 0.25, 0.25)), Event(EventKind.LEFT, light=(0.5, 0.25, 0.25))]
            for _ in ends]  # fmt: skip
    for ray, end in zip(rays, ends, strict=True):
        ray[1].position_mm = end
    found = evaluate_detector(MemoryMap(rays, 3), "Sky", source="LED", resolution=(4, 2))
    assert (found.rays, found.rays_without_direction) == (4, 1)
    assert found.flux_w.value == 1.0
    assert found.flux_of_cell_w.sum() == pytest.approx(0.75)
    assert found.flux_of_cell_w[:, 0] == pytest.approx(0.5 / 4)  # straight along the axis
    assert found.flux_of_cell_w[0, 1] == pytest.approx(0.25)
    assert "undirected  1 rays" in found.to_text()


# ------------------------------------------------------------------------------------------------------- widths


def around_axis(profile, n_c=8, n_gamma=180):
    """Intensity that depends on gamma alone, in degrees."""
    return np.tile(profile(np.arange(n_gamma + 1) * (180 / n_gamma)), (n_c, 1))


@pytest.mark.parametrize("level", [0.5, 0.1])
@pytest.mark.parametrize("reverse", [False, True], ids=["down", "up"])
def test_full_width_of_a_gaussian(level, reverse):
    sigma = 12.0
    intensity = around_axis(lambda gamma: np.exp(-((180 - gamma if reverse else gamma) ** 2) / (2 * sigma**2)))
    expected = 2 * sigma * math.sqrt(-2 * math.log(level))
    for c_deg in (0, 90, 33):
        assert beam_angle_deg(intensity, level, c_deg) == pytest.approx(expected, abs=0.05)


def test_a_batwing_is_measured_from_wing_to_wing():
    """Two wings at 50 degrees, dark between them: linear flanks make the width exact."""
    intensity = around_axis(lambda gamma: np.maximum(0, 1 - np.abs(gamma - 50) / 20))
    assert beam_angle_deg(intensity, 0.5, 0) == pytest.approx(120, abs=1e-9)
    assert beam_angle_deg(intensity, 0.1, 90) == pytest.approx(136, abs=1e-9)


def test_a_beam_beside_the_axis():
    intensity = around_axis(lambda gamma: np.zeros_like(gamma))
    intensity[0] = np.maximum(0, 1 - np.abs(np.arange(181) - 40) / 10)
    assert beam_angle_deg(intensity, 0.5, 0) == pytest.approx(10, abs=1e-9)
    assert beam_angle_deg(intensity, 0.5, 180) == pytest.approx(10, abs=1e-9)  # the same plane
    assert beam_angle_deg(intensity, 0.5, 90) is None  # that plane is dark


def test_widths_of_even_light_and_of_none():
    assert beam_angle_deg(np.ones((4, 19)), 0.5, 0) == 360
    assert beam_angle_deg(np.zeros((4, 19)), 0.5, 0) is None


def test_profile_goes_around_and_between_half_planes():
    intensity = np.arange(3)[:, None] + np.array([0.0, 10, 20])
    angle, values = plane_profile(intensity, 60)  # between C = 0 and 120; beyond the axis C = 240
    assert angle.tolist() == [0, 90, 180, 270]
    assert values.tolist() == [0.5, 10.5, 20.5, 12.0]


# -------------------------------------------------------------------------------------------------------- files


def test_figures_for_json(raymap):
    data = json.loads(json.dumps(evaluate_detector(raymap, "Sky").to_dict()))
    expected = {"flux_w", "flux_stderr_w", "crossings", "beam_50_c0_deg", "beam_10_c90_deg", "direction_error_deg"}
    expected |= {f"{n}_{x}w_per_sr" for n in ("mean", "min", "max") for x in ("", "stderr_")}
    assert expected <= set(data)
    # scripts that ask every detector for these find that there is no such thing
    assert [data[key] for key in ("mean_w_per_mm2", "min_w_per_mm2", "max_w_per_mm2", "uniformity")] == [None] * 4
    assert "flux_lm" not in data


def test_csv_and_npz(raymap, tmp_path):
    found = evaluate_detector(raymap, "Sky", resolution=(6, 4))
    text = found.write(tmp_path / "far.csv").read_text(encoding="utf-8")
    assert f"# flux_w: {found.flux_w.value!r}" in text
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    assert len(rows) == 6 * 5
    assert math.fsum(float(row["flux_w"]) for row in rows) == pytest.approx(found.flux_w.value, rel=1e-12)
    assert (rows[7]["c_deg"], rows[7]["gamma_deg"]) == ("60.0", "90.0")
    with np.load(found.write(tmp_path / "far.npz"), allow_pickle=False) as arrays:
        assert np.array_equal(arrays["intensity_w_per_sr"], found.intensity_w_per_sr)
        assert arrays["gamma_deg"].tolist() == [0, 45, 90, 135, 180]
        assert "intensity_cd" not in arrays


@pytest.mark.parametrize(
    "conditions", [{}, {"max_angle_deg": 20.0}, {"where": "~true"}, {"resolution": (1, 1)}], ids=str
)
def test_png(raymap, tmp_path, conditions):
    pytest.importorskip("matplotlib")
    from matplotlib.image import imread

    picture = imread(evaluate_detector(raymap, "Sky", **conditions).write(tmp_path / "far.png"))
    assert picture.shape[1] > picture.shape[0] > 500


def test_what_is_refused(raymap, tmp_path):
    for region in ({"rect": (-1, -1, 1, 1)}, {"ellipse": (0, 0, 1, 1)}):
        with pytest.raises(CriterionError, match="one of the far field: a rect or ellipse"):
            evaluate_detector(raymap, "Sky", **region)
        with pytest.raises(CriterionError, match="one of faces: a rect or ellipse"):
            evaluate_detector(raymap, "Skin", **region)
    with pytest.raises(OutputError, match=r"must end in \.png, \.csv, \.npz, \.ies, \.ldt"):
        evaluate_detector(raymap, "Sky").write(tmp_path / "far.pdf")
    for suffix in ("ies", "ldt"):
        with pytest.raises(OutputError, match="no light left in any direction"):
            evaluate_detector(raymap, "Sky", where="~true").write(tmp_path / f"far.{suffix}")
    assert list(tmp_path.iterdir()) == []
