# SPDX-License-Identifier: LGPL-2.1-or-later
"""Maps of every released version of the format stay readable: each version leaves one here, never to be changed."""

from pathlib import Path

import pytest

from raymaps.check import check_map
from raymaps.compile import compile_scene
from raymaps.criterion import query
from raymaps.errors import MapError
from raymaps.results.detector import evaluate_detector
from raymaps.results.info import map_info
from raymaps.store import RayMap

OLD = sorted((Path(__file__).parent / "old").iterdir())


@pytest.mark.parametrize("path", OLD, ids=lambda path: path.name)
def test_an_old_map_is_read_as_it_was_written(path):
    """All checksums and the hash of the rays fit, and every ray is accounted for."""
    assert not any(finding.is_fault for finding in check_map(path))
    raymap = RayMap.open(path)
    facts = map_info(raymap)
    assert raymap.n_rays == facts.rays_asked == 120
    ends = [query(raymap, f"ended({how})").rays for how in ("absorbed", "left", "killed")]
    assert sum(ends) == 120
    ledger = facts.ledger
    ended_w = ledger.absorbed_w + ledger.escaped_w + ledger.killed_w
    assert ended_w == pytest.approx(ledger.emitted_w, rel=1e-9)


def test_each_version_of_the_format_has_left_a_map():
    assert [path.name for path in OLD] == ["map-version-1", "map-version-2"]


@pytest.fixture
def second() -> RayMap:
    """Version 2, spectral: the first portion stored as colours, the second as spectra."""
    return RayMap.open(OLD[1])


def test_the_light_of_version_2_is_what_it_was(second):
    """Figures as they were when the map was made."""
    assert second.content_hash == "e3275b24a789a0e8e707a6376829f884"
    assert second.manifest.scene_hash == compile_scene(second.scene).scene_hash
    assert second.bands.n == 34
    assert second.bands.low_nm[-2:].tolist() == [532.0, 632.8]
    assert [portion.lights.has_spectra for portion in second.portions] == [False, True]
    assert [len(portion.lights.values) for portion in second.portions] == [38, 44]
    assert [int((portion.ray_wavelength_nm > 0).sum()) for portion in second.portions] == [25, 31]
    for portion in second.portions:
        led = portion.event_light[0]
        assert portion.lights.lumen_per_w[led] == pytest.approx(316.402190, rel=1e-6)
        assert portion.shown_light[0] == pytest.approx([0.482745, 0.322438, 0.194817], abs=2e-6)
    assert second.portions[1].light.shape == (second.portions[1].n_events, 34)
    with pytest.raises(MapError, match="--store spectral"):
        _ = second.portions[0].light


@pytest.mark.parametrize(
    ("criterion", "rays"),
    [
        ("hit(Block, fresnel_refraction)", 54),
        ("event(medium_scattering)", 8),
        ("detector(Around)", 69),
        ("wavelength(531, 633)", 19),
        ("from(Beam)", 7),
    ],
)
def test_questions_to_version_2_have_the_answers_that_they_had(second, criterion, rays):
    assert query(second, criterion).rays == rays


def test_figures_of_version_2_are_what_they_were(second):
    ledger = map_info(second).ledger
    assert ledger.absorbed_by_body_w["Stop"] == pytest.approx(0.7489933130, rel=1e-9)
    assert ledger.absorbed_by_medium_w["glass"] == pytest.approx(0.2732205283, rel=1e-9)
    assert ledger.escaped_w == pytest.approx(2.2316950285, rel=1e-9)
    around = evaluate_detector(second, "Around")
    assert around.crossings == 78
    assert around.flux_w.value == pytest.approx(2.3233999, rel=1e-6)
