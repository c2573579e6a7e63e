# SPDX-License-Identifier: LGPL-2.1-or-later
"""Lost rays by place: against the rays themselves, the ledger and the criteria that show them."""

from __future__ import annotations

import math
from collections import defaultdict
from types import SimpleNamespace

import numpy as np
import pytest

from raymaps.check import check_map
from raymaps.criterion import estimate_flux, query
from raymaps.kinds import KILL_REASONS
from raymaps.results.info import map_info
from raymaps.results.ledger import energy_ledger
from raymaps.results.lost import LOST, MAX_PLACES, lost_lines, lost_rays
from raymaps.results.overlay import overlay
from raymaps.results.report import ray_histories, report
from tests.criterion_maps import NAMES, SOURCE_FLUX_W, MemoryMap, random_map
from tests.lossy_maps import lossy_map
from tests.store.small_scenes import lamp_in_a_room, workshop, write_scene


@pytest.fixture(scope="module")
def raymap(tmp_path_factory):
    """The workshop with lost rays, in three portions."""
    folder = tmp_path_factory.mktemp("lost")
    return lossy_map(write_scene(folder, workshop(folder)), folder / "lossy.raymap")


@pytest.fixture(scope="module")
def random():
    return random_map(seed=8, n_rays=400, portion_rays=61)


def test_every_lost_ray_is_counted_at_its_place(random):
    """Against the rays as plain objects: count, light with its error, and where the first one was."""
    by_place = defaultdict(list)
    for ray in random.rays:
        if ray[-1].kind in LOST:
            by_place[ray[-1].kind, ray[-1].face].append(ray)
    found = lost_rays(random)
    assert len(found) == len(by_place) == 2 * (len(NAMES.faces) + 1)  # each kind at each face and off all
    told = {(one.reason, one.body, one.face): one for one in found}
    for (kind, face), rays in by_place.items():
        body, name = (NAMES.bodies[NAMES.faces[face][0]], NAMES.faces[face][1]) if face >= 0 else (None, None)
        one = told[KILL_REASONS[kind], body, name]
        assert one.rays == len(rays)
        assert one.point_mm == rays[0][-1].position_mm
        left = [(ray[0].source, sum(ray[-1].light)) for ray in rays]
        total, squares = (
            [math.fsum(x**power for source, x in left if source == s) for s in range(3)] for power in (1, 2)
        )
        flux_w, stderr_w = estimate_flux(SOURCE_FLUX_W, random.rays_of_source, total, squares)
        assert one.flux_w == pytest.approx(float(flux_w), rel=1e-6)
        assert one.flux_stderr_w == pytest.approx(float(stderr_w), rel=1e-6)
        assert one.share == pytest.approx(one.flux_w / sum(SOURCE_FLUX_W), rel=1e-12)


@pytest.mark.parametrize("kind", LOST)
def test_each_reason_is_found_alone(random, kind):
    rays = [ray for ray in random.rays if ray[-1].kind is kind]
    assert sum(one.rays for one in lost_rays(MemoryMap(rays, portion_rays=9))) == len(rays) > 0


def test_places_with_the_most_rays_come_first(random):
    counts = [one.rays for one in lost_rays(random)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[-1]


def test_the_criterion_of_a_place_shows_its_rays(raymap):
    found = lost_rays(raymap)
    assert {one.body for one in found} >= {None, "Block", "Stop"}
    for one in found:
        matching = query(raymap, one.criterion)
        if one.body is None:
            assert one.rays < matching.rays  # those at faces too
            continue
        assert one.rays == matching.rays
        assert f"{one.body}.{one.face}" in one.criterion
        (history,) = ray_histories(raymap, matching.ids[:1].tolist())
        assert history.events[-1].position_mm == one.point_mm
        assert history.ended == "killed"


def test_the_light_of_all_places_is_that_of_the_ledger(raymap):
    by_reason = energy_ledger(raymap).killed_by_reason_w
    for reason in ("numerical", "medium_mismatch"):
        of_places = math.fsum(one.flux_w for one in lost_rays(raymap) if one.reason == reason)
        assert of_places == pytest.approx(by_reason[reason], rel=1e-6)
        assert of_places > 0


def test_portions_without_losses_are_not_read(raymap):
    """So that `raymaps info` of a sound map stays as quick as its manifest."""

    class Untouchable(SimpleNamespace):
        def __getattr__(self, name):
            raise AssertionError(f"{name} was read")

    sound = Untouchable(summary=SimpleNamespace(ledger=[]))
    needed = ("names", "source_flux_w", "rays_of_source", "n_replicates", "rays_of_replicate", "group_of_rays")
    shown = SimpleNamespace(**{name: getattr(raymap, name) for name in needed})
    assert lost_rays(SimpleNamespace(**shown.__dict__, portions=(sound,))) == ()
    assert lost_rays(SimpleNamespace(**shown.__dict__, portions=(sound, *raymap.portions))) == lost_rays(raymap)


def test_info_tells_them(raymap):
    info = map_info(raymap)
    data = info.to_dict()["lost"]
    assert [set(one) for one in data] == [
        {"body", "face", "reason", "rays", "flux_w", "flux_stderr_w", "interval_w", "share", "point_mm", "criterion"}
    ] * len(data)
    assert data[0]["rays"] == info.lost[0].rays
    text = info.to_text()
    (line,) = (line for line in text.splitlines() if line.startswith("lost "))
    assert f"{sum(one.rays for one in info.lost)} rays with " in line
    assert all(one.criterion in text for one in info.lost[:MAX_PLACES])


def test_a_long_table_ends_with_what_is_left_out(random):
    found = lost_rays(random)
    lines = lost_lines(found)
    assert len(found) > MAX_PLACES
    assert len(lines) == MAX_PLACES + 1
    assert lines[-1] == f"and at {len(found) - MAX_PLACES} more places"
    assert len(lost_lines(found[:MAX_PLACES])) == MAX_PLACES


def test_the_report_tells_them_in_every_form(raymap):
    told = report(raymap, "from(Spot)", limit=1)
    most = told.lost[0]
    assert told.to_dict()["lost"][0] == most.to_dict()
    for text in (told.to_text(), told.to_csv(), told.to_html().replace("&quot;", '"')):
        assert most.criterion in text
        assert most.place in text


def test_check_tells_them_in_words_with_the_criterion(raymap):
    findings = check_map(raymap.path)
    assert not any(finding.is_fault for finding in findings)
    said = [finding.text for finding in findings if "got lost" in finding.text]
    found = lost_rays(raymap)
    assert len(said) == min(len(found), MAX_PLACES) + (len(found) > MAX_PLACES)
    for one, sentence in zip(found[:MAX_PLACES], said, strict=False):
        assert sentence == one.sentence()
        assert one.criterion in sentence
        assert one.place in sentence


def test_they_are_drawn(raymap):
    """Each to the point where it was lost."""
    one = next(one for one in lost_rays(raymap) if one.body is not None)
    shown = overlay(raymap, one.criterion)
    assert shown.rays == one.rays
    first = shown.segments_mm[shown.ray == shown.ray[0]]
    assert first[-1, 3:] == pytest.approx(np.float32(one.point_mm))


def test_a_sound_map_has_none_and_says_nothing(tmp_path):
    from raymaps.run import simulate

    sound = simulate(write_scene(tmp_path, lamp_in_a_room(tmp_path)), tmp_path / "sound.raymap", rays=500)
    assert map_info(sound).lost == ()
    assert "lost" not in map_info(sound).to_text()
    assert "lost" not in report(sound, limit=1).to_text()
    assert not any("lost" in finding.text for finding in check_map(sound.path))
