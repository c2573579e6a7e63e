# SPDX-License-Identifier: LGPL-2.1-or-later
"""``import raymaps``: what it offers, and that the few lines of its docstring work."""

from __future__ import annotations

import inspect
import re

import pytest

import raymaps
from tests.store.small_scenes import workshop, write_scene


def test_all_is_what_the_module_shows():
    assert sorted(dir(raymaps)) == sorted(raymaps.__all__)
    assert len(set(raymaps.__all__)) == len(raymaps.__all__)


@pytest.mark.parametrize("name", raymaps.__all__)
def test_every_name_can_be_imported(name):
    assert getattr(raymaps, name) is not None


@pytest.mark.parametrize("name", sorted(set(raymaps.__all__) - {"__version__"}))
def test_every_name_has_a_docstring(name):
    assert len(inspect.getdoc(getattr(raymaps, name)) or "") > 20


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'trace_everything'"):
        raymaps.trace_everything  # noqa: B018


def test_version_is_that_of_the_distribution():
    assert re.fullmatch(r"\d+\.\d+\.\d+\S*", raymaps.__version__)


def test_the_flow_in_python(tmp_path):
    """Load, simulate, open, query, report, ledger, paths, detector: as the module's docstring shows it."""
    scene = raymaps.load_scene(write_scene(tmp_path, workshop(tmp_path)))
    raymap = raymaps.simulate(scene, tmp_path / "m.raymap", rays=500, seed=2)
    again = raymaps.open_map(tmp_path / "m.raymap")
    assert isinstance(again, raymaps.RayMap)
    assert again.content_hash == raymap.content_hash
    assert again.n_rays == 500

    found = raymaps.query(raymap, "hit(Block) & detector(Above)")
    assert 0 < found.rays < 500
    assert len(found.ids) == found.rays
    assert raymaps.query(again, raymaps.parse_criterion("hit(Block) & detector(Above)")).rays == found.rays

    ledger = raymaps.energy_ledger(raymap)
    assert ledger.emitted_w == pytest.approx(3.75)
    assert ledger.absorbed_w + ledger.escaped_w + ledger.killed_w == pytest.approx(ledger.emitted_w, rel=1e-9)

    histories = raymaps.report(raymap, "hit(Block)", limit=3)
    assert len(histories.rays) == 3
    assert "Block" in histories.to_text()

    table = raymaps.distinct_paths(raymap)
    assert sum(path.rays for path in table.paths) == 500
    detector = raymaps.evaluate_detector(raymap, "Around")
    assert detector.to_dict()["flux_w"] > 0


def test_simulate_takes_the_scene_files_settings(tmp_path):
    path = write_scene(tmp_path, {**workshop(tmp_path), "settings": {"rays": 123, "seed": 77}})
    raymap = raymaps.simulate(path, tmp_path / "m.raymap")
    assert (raymap.n_rays, raymap.manifest.seed) == (123, 77)


@pytest.mark.parametrize(
    "arguments", [{"rays": -5}, {"rays": 0}, {"seed": -1}, {"seed": 2**64}, {"threads": -1}, {"portion_rays": 0}]
)
def test_simulate_refuses_numbers_that_mean_nothing(tmp_path, arguments):
    path = write_scene(tmp_path, workshop(tmp_path))
    with pytest.raises((raymaps.RayMapsError, ValueError)):
        raymaps.simulate(path, tmp_path / "m.raymap", **{"rays": 50, **arguments})
    assert not (tmp_path / "m.raymap").exists()


@pytest.mark.parametrize("limit", [-1])
def test_query_refuses_a_negative_limit(tmp_path, limit):
    raymap = raymaps.simulate(write_scene(tmp_path, workshop(tmp_path)), tmp_path / "m.raymap", rays=50)
    with pytest.raises(raymaps.RayMapsError, match="-1"):
        raymaps.query(raymap, "true", limit=limit)
