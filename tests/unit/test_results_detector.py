# SPDX-License-Identifier: LGPL-2.1-or-later
"""Detectors against a slow calculation, crossing by crossing, that shares no code with the fast one."""

import csv
import json
import math

import numpy as np
import pytest

from raymaps.criterion import Ellipse, Rectangle, bind, matching_rays
from raymaps.errors import CriterionError, OutputError
from raymaps.kinds import EventKind
from raymaps.results.detector import MAX_CELLS, evaluate_detector
from tests.criterion_maps import NAMES, SOURCE_FLUX_W, Crossing, Event, MemoryMap, random_map

WIDTH_MM, HEIGHT_MM = (4.0, 10.0), (2.0, 10.0)


@pytest.fixture(scope="module")
def raymap():
    return random_map(seed=11, n_rays=600, portion_rays=130)


def samples(raymap, detector, n_x, n_y, max_angle_deg=None, source=None, where=None, area=None):
    """Light of every ray in every cell and band, relative to its emission: (n_rays, n_y, n_x, 3)."""
    index = NAMES.detectors.index(detector)
    found = np.zeros((len(raymap.rays), n_y, n_x, 3))
    wanted = range(len(raymap.rays))
    if where is not None:
        bound = bind(where, NAMES)
        wanted = {p.first_ray + int(ray) for p in raymap.portions for ray in matching_rays(p, bound)}
    for number in wanted:
        ray = raymap.rays[number]
        if source is not None and NAMES.sources[ray[0].source] != source:
            continue
        for event in ray:
            for c in event.crossings:
                if c.detector != index or not accepted(c, detector, max_angle_deg) or not inside(c, area):
                    continue
                column = min(int((c.x_mm / WIDTH_MM[index] + 0.5) * n_x), n_x - 1)
                row = min(int((c.y_mm / HEIGHT_MM[index] + 0.5) * n_y), n_y - 1)
                found[number, row, column] += event.light
    return found


def accepted(crossing, detector, max_angle_deg):
    if max_angle_deg is None:
        return crossing.registered
    from_normal = min(crossing.angle_rad, math.pi - crossing.angle_rad)
    on_side = crossing.angle_rad < math.pi / 2 if detector == "Sensor" else True
    return on_side and from_normal <= math.radians(max_angle_deg)


def inside(crossing, area):
    if isinstance(area, Rectangle):
        return area.x0_mm <= crossing.x_mm <= area.x1_mm and area.y0_mm <= crossing.y_mm <= area.y1_mm
    if isinstance(area, Ellipse):
        x, y = (crossing.x_mm - area.cx_mm) / area.rx_mm, (crossing.y_mm - area.cy_mm) / area.ry_mm
        return x * x + y * y <= 1
    return True


def estimate(raymap, values, impossible=()):
    """Sum of a value per ray over the sources in W, and the variance of it; values (n_rays,)."""
    total_w = variance_w2 = 0.0
    for source, flux_w in enumerate(SOURCE_FLUX_W):
        if NAMES.sources[source] in impossible:
            continue
        mine = values[[ray[0].source == source for ray in raymap.rays]]
        total_w += flux_w * mine.mean()
        variance_w2 += flux_w**2 * mine.var(ddof=1) / len(mine)
    return total_w, variance_w2


CONDITIONS = [
    {},
    {"max_angle_deg": 90.0},
    {"max_angle_deg": 25.0},
    {"source": "Beam"},
    {"where": "hit(Lens) | ended(left)"},
    {"area": Rectangle(-1.3, -0.7, 1.1, 0.4)},
    {"area": Ellipse(0.3, 0.1, 1.5, 0.8)},
    {"max_angle_deg": 80.0, "source": "Lamp 2", "where": "~hit(Barrel)", "area": Ellipse(0, 0, 1.5, 1.5)},
]


@pytest.mark.parametrize("detector", ["Sensor", "Wall"])
@pytest.mark.parametrize("conditions", CONDITIONS, ids=lambda conditions: ", ".join(conditions) or "as it is")
@pytest.mark.parametrize("resolution", [(1, 1), (3, 2)])
def test_against_a_slow_calculation(raymap, detector, conditions, resolution):
    n_x, n_y = resolution
    area = conditions.get("area")
    given = {key: value for key, value in conditions.items() if key != "area"}
    if area is not None:
        given[area.word] = area.numbers
    found = evaluate_detector(raymap, detector, resolution=resolution, **given)
    light = samples(raymap, detector, n_x, n_y, **conditions)
    power = light.sum(axis=3)
    of_ray = power.sum(axis=(1, 2))
    others = set(NAMES.sources) - {conditions["source"]} if "source" in conditions else ()
    flux_w, variance_w2 = estimate(raymap, of_ray, others)
    # sums of a few hundred doubles in another order
    assert found.flux_w.value == pytest.approx(flux_w, rel=1e-12)
    assert found.flux_w.stderr == pytest.approx(math.sqrt(variance_w2), rel=1e-9)
    assert found.rays == np.count_nonzero(of_ray)
    assert found.mean_w_per_mm2.value == pytest.approx(flux_w / found.area_mm2, rel=1e-12)
    for row in range(n_y):
        for column in range(n_x):
            cell_w, cell_variance_w2 = estimate(raymap, power[:, row, column], others)
            assert found.cell_flux_w[row, column] == pytest.approx(cell_w, rel=1e-12, abs=1e-15)
            if all(power[[r[0].source == s for r in raymap.rays], row, column].any() for s in range(3)):
                assert found.cell_stderr_w[row, column] == pytest.approx(math.sqrt(cell_variance_w2), rel=1e-9)
            for band in range(3):
                band_w, _ = estimate(raymap, light[:, row, column, band], others)
                assert found.cell_flux_rgb_w[row, column, band] == pytest.approx(band_w, rel=1e-12, abs=1e-15)


def test_crossings_are_counted_one_by_one(raymap):
    registered = sum(c.detector == 0 and c.registered for ray in raymap.rays for e in ray for c in e.crossings)
    found = evaluate_detector(raymap, "Sensor")
    assert found.crossings == registered
    assert found.rays < found.crossings  # the random rays do cross more than once


def test_uniformity_and_its_error(raymap):
    found = evaluate_detector(raymap, "Sensor", resolution=(3, 2))
    power = samples(raymap, "Sensor", 3, 2).sum(axis=3)
    cell_mm2 = 8.0 / 6
    fluxes = np.array([[estimate(raymap, power[:, row, column])[0] for column in range(3)] for row in range(2)])
    row, column = np.unravel_index(np.argmin(fluxes), fluxes.shape)
    least, mean = fluxes[row, column] / cell_mm2, fluxes.sum() / 8.0
    assert found.min_w_per_mm2.value == pytest.approx(least, rel=1e-12)
    assert found.max_w_per_mm2.value == pytest.approx(fluxes.max() / cell_mm2, rel=1e-12)
    assert found.uniformity.value == pytest.approx(least / mean, rel=1e-12)
    # first order: the error of min/mean is that of the mean over rays of (min part - u mean part) / mean
    linear = (power[:, row, column] / cell_mm2 - (least / mean) * power.sum(axis=(1, 2)) / 8.0) / mean
    assert found.uniformity.stderr == pytest.approx(math.sqrt(estimate(raymap, linear)[1]), rel=1e-9)


@pytest.mark.parametrize("resolution", [(1, 1), (7, 5), (100, 3), (640, 480)])
@pytest.mark.parametrize("region", [{}, {"ellipse": (0.2, 0, 1.4, 0.9)}])
def test_resolution_changes_no_flux(raymap, resolution, region):
    own = evaluate_detector(raymap, "Sensor", **region)
    other = evaluate_detector(raymap, "Sensor", resolution=resolution, **region)
    assert other.flux_w == own.flux_w
    assert other.crossings == own.crossings
    assert other.cell_flux_w.sum() == pytest.approx(own.flux_w.value, rel=1e-12)
    assert other.area_mm2 == pytest.approx(own.area_mm2, rel=1e-9)  # a sum over cells


def test_sources_add_up(raymap):
    whole = evaluate_detector(raymap, "Wall")
    parts = [evaluate_detector(raymap, "Wall", source=source) for source in NAMES.sources]
    assert sum(part.flux_w.value for part in parts) == pytest.approx(whole.flux_w.value, rel=1e-12)
    assert math.hypot(*(part.flux_w.stderr for part in parts)) == pytest.approx(whole.flux_w.stderr, rel=1e-12)


def test_portions_make_no_difference():
    whole = evaluate_detector(random_map(5, portion_rays=10**6), "Wall", where="hit(Lens)").to_dict()
    parts = evaluate_detector(random_map(5, portion_rays=17), "Wall", where="hit(Lens)").to_dict()
    assert {key for key, value in whole.items() if isinstance(value, float)} > {"flux_w", "min_stderr_w_per_mm2"}
    for key, value in whole.items():
        assert parts[key] == (pytest.approx(value, rel=1e-12) if isinstance(value, float) else value)


def test_its_own_angle_given_again_changes_nothing(raymap):
    assert (
        evaluate_detector(raymap, "Sensor", max_angle_deg=60).to_dict() == evaluate_detector(raymap, "Sensor").to_dict()
    )


def map_of(*rays_of_crossings, light=(0.5, 0.25, 0.25)):
    """A map of one ray a tuple of crossings of Sensor at (x, y)."""
    rays = []
    for crossings in rays_of_crossings:
        emission = Event(EventKind.EMISSION, source=0, light=light)
        emission.crossings = [Crossing(0, float(x), float(y), 0.1, True) for x, y in crossings]
        rays.append([emission, Event(EventKind.LEFT, light=light)])
    return MemoryMap(rays, 2)


def test_a_ray_that_crosses_twice_is_one_sample():
    # two rays: one crosses twice in the same cell, one not at all; X = 2, 0: mean 1, variance of the mean 1
    found = evaluate_detector(map_of([(0.1, 0.1), (0.2, 0.1)], []), "Sensor", resolution=(2, 1), source="LED")
    assert (found.rays, found.crossings) == (1, 2)
    assert found.flux_w.value == 1.0
    assert found.flux_w.stderr == 1.0
    assert found.cell_stderr_w[0].tolist() == [2.0 / 2, 1.0]  # the empty cell: one ray like the one that arrived


def test_where_every_ray_arrives_the_error_is_that_of_one_ray():
    found = evaluate_detector(map_of(*[[(0.1, 0.1)]] * 10), "Sensor", resolution=(1, 1), source="LED")
    assert found.flux_w.value == pytest.approx(1.0, rel=1e-15)
    assert found.flux_w.stderr == pytest.approx(0.1, rel=1e-12)


def test_a_detector_that_nothing_reaches():
    found = evaluate_detector(map_of([], [], [], []), "Sensor", source="LED")
    assert found.flux_w.value == 0
    assert found.flux_w.stderr == 0.25  # one of four rays with all its light
    assert found.uniformity is None
    assert found.to_dict()["uniformity"] is None


def test_points_on_the_outer_border_belong_to_the_outer_cells():
    found = evaluate_detector(map_of([(2, 1)], [(-2, -1)]), "Sensor", resolution=(4, 2))
    assert found.cell_flux_w[1, 3] == 0.5
    assert found.cell_flux_w[0, 0] == 0.5


def test_a_region_smaller_than_a_cell_has_statistics():
    found = evaluate_detector(map_of([(0.01, 0.01)], []), "Sensor", resolution=(1, 1), rect=(0, 0, 0.1, 0.1))
    assert found.area_mm2 == pytest.approx(0.01, rel=1e-12)
    assert found.min_w_per_mm2.value == pytest.approx(50.0, rel=1e-12)


def test_cells_whose_centre_lies_outside_the_region_set_no_extreme():
    # the rectangle covers cells 0 to 2 and a tenth of cell 3, which is dark
    crossings = [[(-1.75 + 0.5 * i, -0.75)] for i in range(3)]
    found = evaluate_detector(map_of(*crossings), "Sensor", resolution=(8, 4), rect=(-2, -1, -0.45, -0.5))
    assert found.min_w_per_mm2.value > 0


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ({"name": "Eye"}, "Unknown detector 'Eye'; known: 'Sensor', 'Wall', 'Skin', 'Sky'."),
        ({"source": "Sun"}, "Unknown source 'Sun'"),
        ({"where": "hit(Nothing)"}, "Unknown body 'Nothing'"),
        ({"max_angle_deg": 0}, "above 0 and at most 90 degrees, got 0"),
        ({"max_angle_deg": 91}, "at most 90 degrees, got 91"),
        ({"max_angle_deg": math.nan}, "at most 90 degrees"),
        ({"resolution": (0, 5)}, "1x1 or more"),
        ({"resolution": (MAX_CELLS, 2)}, "at most 4000000 cells"),
        ({"rect": (3, 3, 4, 4)}, "outside detector 'Sensor', which reaches 2 mm along x and 1 mm along y"),
        ({"ellipse": (0, 9, 1, 1)}, "outside detector"),
        ({"rect": (0, 0, 1, 1), "ellipse": (0, 0, 1, 1)}, "not both"),
        ({"rect": (0, 0, 1)}, "takes four numbers in mm, got 3"),
        ({"ellipse": (0, 0, 0, 1)}, "radii above 0"),
    ],
)
def test_what_makes_no_sense_is_refused(raymap, arguments, part):
    with pytest.raises(CriterionError, match=part) as caught:
        evaluate_detector(raymap, **{"name": "Sensor", **arguments})
    assert str(caught.value).endswith(".")


def test_figures_for_json(raymap):
    data = json.loads(json.dumps(evaluate_detector(raymap, "Sensor", ellipse=(0, 0, 1, 1)).to_dict()))
    assert data["area"] == {"ellipse": [0, 0, 1, 1]}
    expected = {"flux_w", "flux_stderr_w", "crossings", "rays", "area_mm2", "uniformity", "uniformity_stderr"}
    expected |= {f"{n}_{x}w_per_mm2" for n in ("mean", "min", "max") for x in ("", "stderr_")}
    assert expected <= set(data)


def test_text_tells_every_condition(raymap):
    text = evaluate_detector(
        raymap, "Sensor", source="Lamp 2", where="hit(Lens)", max_angle_deg=30, rect=(-1, -1, 1, 1)
    ).to_text()
    for part in ("Sensor, front side up to 30°", "from Lamp 2", "where hit(Lens)", "rect -1, -1, 1, 1 mm", "flux", "±"):
        assert part in text


def test_csv_holds_the_cells_in_the_region(raymap, tmp_path):
    found = evaluate_detector(raymap, "Sensor", resolution=(8, 4), rect=(-2, -1, 0, 1))
    text = found.write(tmp_path / "map.csv").read_text(encoding="utf-8")
    comments = [line for line in text.splitlines() if line.startswith("#")]
    assert f"# flux_w: {found.flux_w.value!r}" in comments
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    assert len(rows) == 16
    assert sum(float(row["flux_w"]) for row in rows) == pytest.approx(found.flux_w.value, rel=1e-12)
    assert float(rows[0]["x_mm"]) == -1.75
    bands = sum(float(row[band]) for row in rows for band in ("red_w", "green_w", "blue_w"))
    assert bands == pytest.approx(found.flux_w.value, rel=1e-12)


def test_npz_holds_all_arrays(raymap, tmp_path):
    found = evaluate_detector(raymap, "Wall", resolution=(5, 4))
    with np.load(found.write(tmp_path / "map.npz"), allow_pickle=False) as arrays:
        assert np.array_equal(arrays["flux_w"], found.cell_flux_w)
        assert np.array_equal(arrays["flux_stderr_w"], found.cell_stderr_w)
        assert arrays["flux_rgb_w"].shape == (4, 5, 3)
        assert arrays["x_edges_mm"].tolist() == [-5, -3, -1, 1, 3, 5]
        assert json.loads(str(arrays["figures"])) == found.to_dict()


def test_names_of_files_are_checked(raymap, tmp_path):
    found = evaluate_detector(raymap, "Wall")
    with pytest.raises(OutputError, match=r"must end in \.png, \.csv, \.npz"):
        found.write(tmp_path / "map.pdf")
    with pytest.raises(OutputError, match="no such file or directory"):
        found.write(tmp_path / "nowhere" / "map.csv")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("conditions", [{}, {"ellipse": (0, 0, 1, 1)}, {"where": "~true"}])
def test_png_is_a_picture_of_the_cells(raymap, tmp_path, conditions):
    pytest.importorskip("matplotlib")
    from matplotlib.image import imread

    path = evaluate_detector(raymap, "Sensor", **conditions).write(tmp_path / "map.png")
    picture = imread(path)
    assert picture.shape[1] > picture.shape[0] > 300  # as wide as the detector, and a colour bar
    assert len(np.unique(picture.reshape(-1, picture.shape[2]), axis=0)) > (3 if "where" in conditions else 20)
