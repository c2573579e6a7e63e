# SPDX-License-Identifier: LGPL-2.1-or-later
import numpy as np
import pytest

from raymaps.criterion import query
from raymaps.errors import CriterionError, OutputError
from raymaps.results.colours import BRIGHTEST_ON_PAPER, DIMMEST, hex_colour, light_colours, paper_colours
from raymaps.results.overlay import overlay
from tests.criterion_maps import random_map


@pytest.fixture(scope="module")
def raymap():
    return random_map(seed=50, n_rays=300, portion_rays=40)


def expected_segments(raymap, ids):
    segments, numbers = [], []
    for number in ids:
        ray = raymap.rays[number]
        for start, end in zip(ray, ray[1:], strict=False):
            segments.append([*start.position_mm, *end.position_mm])
            numbers.append(number)
    return np.array(segments, np.float32).reshape(-1, 6), numbers


def test_all_segments_of_all_rays(raymap):
    shown = overlay(raymap)
    segments, numbers = expected_segments(raymap, range(300))
    assert np.array_equal(shown.segments_mm, segments)
    assert shown.ray.tolist() == numbers
    assert (shown.rays, shown.matching, shown.scanned) == (300, 300, 300)


def test_only_matching_rays_and_no_more_than_asked(raymap):
    ids = query(raymap, "from(LED) | hit(Lens)").ids
    for max_rays in (0, 1, 5, 60, 10_000):
        shown = overlay(raymap, "from(LED) | hit(Lens)", max_rays=max_rays)
        segments, numbers = expected_segments(raymap, ids[:max_rays])
        assert np.array_equal(shown.segments_mm, segments)
        assert shown.ray.tolist() == numbers
        assert shown.rays == min(max_rays, len(ids))


def test_rays_are_shown_whole_up_to_the_cap(raymap):
    lengths = np.cumsum([len(ray) - 1 for ray in raymap.rays])
    for cap in (0, 1, 17, 18, 19, 200, int(lengths[-1]), int(lengths[-1]) + 1):
        shown = overlay(raymap, max_segments=cap)
        assert shown.rays == np.searchsorted(lengths, cap, side="right")
        assert shown.n_segments == (lengths[shown.rays - 1] if shown.rays else 0) <= cap


def test_scanning_stops_when_enough_are_shown(raymap):
    assert overlay(raymap, max_rays=10).scanned == 40
    assert overlay(raymap, max_segments=5).scanned == 40


def test_light_of_a_segment_is_that_of_the_event_where_it_starts(raymap):
    shown = overlay(raymap, max_rays=20)
    expected = [start.light for ray in raymap.rays[:20] for start in ray[:-1]]
    assert np.array_equal(shown.light, np.array(expected, np.float32))


def test_file(raymap, tmp_path):
    shown = overlay(raymap, max_rays=25)
    data = shown.write(tmp_path / "lines.bin").read_bytes()
    n = shown.n_segments
    assert len(data) == 28 * n
    assert np.array_equal(np.frombuffer(data, "<f4", 6 * n).reshape(n, 6), shown.segments_mm)
    assert np.array_equal(np.frombuffer(data, "<u4", n, 24 * n), shown.rgba)
    assert shown.to_dict() == {"segments": n, "rays": 25, "matching": shown.matching, "scanned": shown.scanned}
    with pytest.raises(OutputError, match="can't be written"):
        shown.write(tmp_path / "nowhere" / "lines.bin")


def test_colours_are_packed_red_first(raymap):
    shown = overlay(raymap, max_rays=5)
    colours = light_colours(shown.light)
    for rgba, (red, green, blue) in zip(shown.rgba.tolist(), colours.tolist(), strict=True):
        assert rgba == red << 24 | green << 16 | blue << 8 | 0xFF


def test_negative_limits_are_refused(raymap):
    with pytest.raises(CriterionError, match="At least 0 rays"):
        overlay(raymap, max_rays=-1)


def test_a_colour_keeps_its_hue_and_gets_dimmer():
    full, half, dim = light_colours(np.array([[0.8, 0.2, 0.0], [0.4, 0.1, 0.0], [8e-7, 2e-7, 0.0]]))
    assert full[0] == 255
    assert full[2] == 0
    assert full[0] > half[0] > dim[0] >= round(255 * DIMMEST)
    ratios = [colour[1] / colour[0] for colour in (full, half, dim)]
    assert max(ratios) - min(ratios) < 0.02  # of two numbers rounded to 1 in 255
    assert light_colours(np.zeros((1, 3))).tolist() == [[0, 0, 0]]


def test_white_light_is_white_and_a_pure_band_is_pure():
    assert light_colours(np.array([[1 / 3, 1 / 3, 1 / 3]])).tolist() == [[255, 255, 255]]
    assert light_colours(np.eye(3)).tolist() == [[255, 0, 0], [0, 255, 0], [0, 0, 255]]
    assert hex_colour(np.array([255, 0, 16], np.uint8)) == "#ff0010"


def test_on_paper_even_white_light_is_dark_enough():
    white, blue, gone = paper_colours(np.array([[1 / 3, 1 / 3, 1 / 3], [0, 0, 1.0], [0, 0, 0]]))
    linear = ((white[:3] / 255 + 0.055) / 1.055) ** 2.4
    assert linear @ [0.2126, 0.7152, 0.0722] == pytest.approx(BRIGHTEST_ON_PAPER, abs=0.01)  # rounded to 1 in 255
    assert white[0] == white[1] == white[2]
    assert blue.tolist() == [0, 0, 255, 255]
    assert gone[3] > 0
