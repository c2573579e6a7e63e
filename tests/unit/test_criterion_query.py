# SPDX-License-Identifier: LGPL-2.1-or-later
import json
import math

import numpy as np
import pytest

from raymaps.criterion import From, Happened, parse_criterion, query
from raymaps.errors import CriterionError
from raymaps.kinds import EventKind
from tests.criterion_maps import SOURCE_FLUX_W, Crossing, Event, MemoryMap, random_map


def simple_map(pattern, portion_rays, source=0):
    """One ray a letter: L leaves, A is absorbed."""
    rays = [
        [
            Event(EventKind.EMISSION, source=source, light=(0.25, 0.5, 0.25)),
            Event(EventKind.LEFT if letter == "L" else EventKind.ABSORPTION, body=1, face=2, surface=1),
        ]
        for letter in pattern
    ]
    return MemoryMap(rays, portion_rays)


def test_all_of_a_map():
    result = query(simple_map("LALLA" * 4, portion_rays=3), "ended(left)")
    assert (result.rays, result.scanned) == (12, 20)
    assert result.ids.tolist() == [i for i in range(20) if "LALLA"[i % 5] == "L"]
    assert not result.ids.flags.writeable
    assert result.criterion == "ended(left)"


def test_scanning_stops_after_the_portion_in_which_enough_are_found():
    raymap = simple_map("AAAAALAALLLLLLLL", portion_rays=4)
    result = query(raymap, "ended(left)", limit=2)
    assert result.ids.tolist() == [5, 8]
    assert (result.rays, result.scanned) == (5, 12)
    assert query(raymap, "ended(left)", limit=1).scanned == 8
    assert query(raymap, "ended(left)", limit=100).scanned == 16
    assert query(raymap, "ended(left)", limit=0).ids.tolist() == []


def test_no_portion_is_read_past_the_limit():
    raymap = simple_map("LLLLLLLL", portion_rays=4)
    del raymap.portions[1].ray_signature
    assert query(raymap, "true", limit=4).scanned == 4


def test_a_search_that_stopped_early_tells_no_flux():
    """Rays scanned until enough are found hold too many of them: no fair sample (inverse binomial sampling)."""
    raymap = simple_map("LLAAAAAA", portion_rays=4)
    part = query(raymap, "ended(left)", limit=1)
    assert (part.rays, part.flux_w, part.flux_stderr_w) == (2, None, None)
    assert query(raymap, "ended(left)").flux_w == SOURCE_FLUX_W[0] * 2 / 8
    assert query(raymap, "ended(left)", limit=100).flux_w == SOURCE_FLUX_W[0] * 2 / 8


def test_a_source_without_rays_is_uncertain_by_all_its_light():
    raymap = simple_map("LA", portion_rays=2)
    assert query(raymap, "true").flux_stderr_w == pytest.approx(math.hypot(*SOURCE_FLUX_W[1:]))


def test_standard_error_is_binomial():
    result = query(simple_map("LALLA" * 40, portion_rays=30, source=1), 'ended(left) & from("Lamp 2")')
    share, n = 0.6, 200
    assert result.flux_w == pytest.approx(3.0 * share, rel=1e-14)
    assert result.flux_stderr_w == pytest.approx(3.0 * math.sqrt(share * (1 - share) / (n - 1)), rel=1e-12)


@pytest.mark.parametrize(
    "text", ["true", "from(LED)", "~from(LED)", "event(emission)", "from(LED) & hit(Lens) & ~from(LED)"]
)
def test_no_error_where_the_source_decides(text):
    assert query(random_map(seed=1), text).flux_stderr_w == 0


@pytest.mark.parametrize(("text", "rays"), [("ended(left)", 0), ("ended(absorbed)", 10)])
def test_none_or_all_of_the_rays_is_uncertain_by_one_ray(text, rays):
    raymap = simple_map("A" * 10, portion_rays=4)
    raymap.source_flux_w = np.array([1.0, 0.0, 0.0])
    result = query(raymap, text)
    assert result.rays == rays
    assert result.flux_stderr_w == 0.1


def test_a_filter_on_one_source_knows_that_the_others_do_not_count():
    raymap = simple_map("LA", portion_rays=2)  # the other sources emitted no ray at all
    assert query(raymap, "ended(left) & from(LED)").flux_stderr_w == 0.5


def test_no_criterion_is_every_ray():
    raymap = random_map(seed=2)
    assert query(raymap).to_dict() == query(raymap, "true").to_dict()
    assert query(raymap).rays == raymap.n_rays
    assert query(raymap).flux_w == pytest.approx(sum(SOURCE_FLUX_W), rel=1e-14)


def test_a_map_without_rays():
    result = query(MemoryMap([], 10), "ended(left)")
    assert (result.rays, result.scanned, result.flux_w) == (0, 0, 0.0)


def test_text_and_tree_ask_the_same():
    raymap = random_map(seed=3)
    tree = From("LED") & ~Happened("absorption")
    assert query(raymap, tree).to_dict() == query(raymap, "from(LED) & ~event(absorption)").to_dict()
    assert parse_criterion(query(raymap, tree).criterion) == tree


def test_figures_for_json():
    data = json.loads(json.dumps(query(simple_map("LA", portion_rays=2), "ended(left)", limit=1).to_dict()))
    assert set(data) == {"criterion", "rays", "scanned", "flux_w", "flux_stderr_w", "interval_w", "ids"}
    assert data["ids"] == [0]


def test_the_border_of_an_area_belongs_to_it():
    def crossing_at(x_mm, y_mm):
        emission = Event(EventKind.EMISSION, source=0, crossings=[Crossing(0, x_mm, y_mm, 0.1, True)])
        return MemoryMap([[emission, Event(EventKind.LEFT)]], 1)

    for x_mm, y_mm, inside in ((1.0, 0.5, 1), (np.nextafter(1.0, 2), 0.5, 0), (0.0, 0.0, 1), (0.0, -1e-300, 0)):
        assert query(crossing_at(x_mm, y_mm), "detector(Sensor, rect=(0,0,1,1))").rays == inside
    for x_mm, y_mm, inside in ((2.0, 0.0, 1), (0.0, 1.0, 1), (np.nextafter(2.0, 3), 0.0, 0), (1.9, 0.9, 0)):
        assert query(crossing_at(x_mm, y_mm), "detector(Sensor, ellipse=(0,0,2,1))").rays == inside


def test_a_crossing_that_was_not_registered_does_not_count():
    emission = Event(EventKind.EMISSION, source=0, crossings=[Crossing(0, 0, 0, 3.0, False)])
    raymap = MemoryMap([[emission, Event(EventKind.LEFT)]], 1)
    assert query(raymap, "detector(Sensor)").rays == 0
    assert query(raymap, "detector(Sensor, rect=(-1,-1,1,1))").rays == 0


def test_being_emitted_from_a_face_is_no_hit():
    emission = Event(EventKind.EMISSION, source=0, body=0, face=0, surface=0)
    raymap = MemoryMap([[emission, Event(EventKind.LEFT)]], 1)
    for text in ("hit(Lens)", "hit(Lens.Face1)", "surface(polished)", "hit(Lens, emission)"):
        assert query(raymap, text).rays == 0


def test_place_and_kind_must_be_of_the_same_event():
    raymap = MemoryMap(
        [
            [
                Event(EventKind.EMISSION, source=0),
                Event(EventKind.FRESNEL_REFLECTION, body=0, face=0, surface=0),
                Event(EventKind.ABSORPTION, body=1, face=2, surface=1),
            ]
        ],
        1,
    )
    assert query(raymap, "hit(Lens) & event(absorption)").rays == 1
    assert query(raymap, "hit(Lens, absorption)").rays == 0
    assert query(raymap, "surface(polished, absorption)").rays == 0
    assert query(raymap, "surface(black, absorption)").rays == 1


def test_a_negative_limit_is_refused():
    with pytest.raises(CriterionError, match="limit must be 0 or more rays, got -1"):
        query(random_map(seed=1), "true", limit=-1)
