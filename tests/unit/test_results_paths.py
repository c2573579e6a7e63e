# SPDX-License-Identifier: LGPL-2.1-or-later
import json
import math
from collections import Counter

import pytest

from raymaps.kinds import EventKind
from raymaps.results.paths import distinct_paths
from tests.criterion_maps import NAMES, OFF_SURFACES, SOURCE_FLUX_W, Crossing, Event, MemoryMap, random_map


def written_out(ray):
    """The signature of a ray, event by event."""
    words = []
    for before, event in zip([None, *ray], ray, strict=False):
        kind = event.kind.label
        if event.kind is EventKind.EMISSION:
            words.append(NAMES.sources[event.source])
        elif event.kind in (EventKind.MEDIUM_ABSORPTION, EventKind.MEDIUM_SCATTERING):
            words.append(f"{NAMES.media[before.medium]} {kind}")
        elif event.face >= 0 and event.kind not in OFF_SURFACES:
            body, face = NAMES.faces[event.face]
            words.append(f"{NAMES.bodies[body]}.{face} {kind}")
        else:
            words.append(kind)
        for crossing in event.crossings:
            detector = NAMES.detectors[crossing.detector]
            words.append(f"[{detector}]" if crossing.registered else f"({detector})")
    return " > ".join(words)


@pytest.fixture(scope="module")
def raymap():
    return random_map(seed=30, n_rays=800, portion_rays=90)


def test_every_ray_is_on_one_path(raymap):
    table = distinct_paths(raymap)
    expected = Counter(written_out(ray) for ray in raymap.rays)
    assert {path.signature: path.rays for path in table.paths} == dict(expected)
    assert table.n_paths == len(expected) < raymap.n_rays
    assert table.rays == raymap.n_rays
    assert sum(path.flux_w for path in table.paths) == pytest.approx(sum(SOURCE_FLUX_W), rel=1e-12)


def test_flux_and_error_of_a_path(raymap):
    for path in distinct_paths(raymap, limit=20).paths:
        source = NAMES.sources.index(path.source)
        n = sum(ray[0].source == source for ray in raymap.rays)
        share = path.rays / n
        assert path.flux_w == pytest.approx(SOURCE_FLUX_W[source] * share, rel=1e-14)
        error = SOURCE_FLUX_W[source] * math.sqrt(share * (1 - share) / (n - 1))
        assert path.flux_stderr_w == pytest.approx(error, rel=1e-10)


def test_largest_first_and_limited(raymap):
    table, short = distinct_paths(raymap), distinct_paths(raymap, limit=5)
    fluxes = [path.flux_w for path in table.paths]
    assert fluxes == sorted(fluxes, reverse=True)
    assert short.paths == table.paths[:5]
    assert (short.n_paths, short.rays) == (table.n_paths, table.rays)


def test_portions_make_no_difference():
    assert distinct_paths(random_map(4, portion_rays=11)) == distinct_paths(random_map(4, portion_rays=10**6))


def test_only_matching_rays(raymap):
    table = distinct_paths(raymap, "from(LED) & detector(Sensor)")
    assert table.rays > 0
    assert all(path.signature.startswith("LED >") and "[Sensor]" in path.signature for path in table.paths)
    assert table.criterion == "from(LED) & detector(Sensor)"
    assert distinct_paths(raymap, "~true").paths == ()


def test_how_a_path_reads():
    emission = Event(EventKind.EMISSION, source=0, body=0, face=0, medium=1)
    emission.crossings = [Crossing(0, 0, 0, 0.1, True), Crossing(1, 0, 0, 0.1, False)]
    scattered = Event(EventKind.MEDIUM_SCATTERING, medium=1)
    refracted = Event(EventKind.FRESNEL_REFRACTION, body=0, face=1, surface=0, medium=0)
    absorbed = Event(EventKind.ABSORPTION, body=2, face=4, surface=1)
    table = distinct_paths(MemoryMap([[emission, scattered, refracted, absorbed]], 1))
    assert table.paths[0].signature == (
        "LED > [Sensor] > (Wall) > glass medium_scattering > Lens.Face2 fresnel_refraction > Plate.Top side absorption"
    )


def test_the_face_ahead_of_an_absorption_on_the_way_makes_no_other_path():
    rays = [
        [Event(EventKind.EMISSION, source=0, medium=1), Event(EventKind.MEDIUM_ABSORPTION, body=0, face=face, medium=1)]
        for face in (0, 1)
    ]
    assert [path.rays for path in distinct_paths(MemoryMap(rays, 2)).paths] == [2]


def test_figures_for_json_and_text(raymap):
    table = distinct_paths(raymap, limit=3)
    data = json.loads(json.dumps(table.to_dict()))
    keys = {"signature", "source", "rays", "flux_w", "flux_stderr_w", "interval_w"}
    assert [set(path) for path in data["paths"]] == [keys] * 3
    lines = table.to_text().splitlines()
    assert len(lines) == 5
    assert table.paths[0].signature in lines[1]
    assert lines[-1] == f"and {table.n_paths - 3} more with less flux"


def test_a_map_without_rays():
    assert distinct_paths(MemoryMap([], 5)).to_dict()["paths"] == []
