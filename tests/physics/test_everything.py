# SPDX-License-Identifier: LGPL-2.1-or-later
"""A scene with everything on: it runs, every light is accounted for, and nothing depends on threads or portions."""

from __future__ import annotations

import numpy as np
import pytest

from raymaps.check import check_map
from raymaps.effects import EFFECTS, needed_effects
from raymaps.kinds import EventKind
from raymaps.results.ledger import energy_ledger
from raymaps.run import simulate
from raymaps.scene import load_scene
from tests.everything import write_everything

RAYS = 12_000


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory):
    return write_everything(tmp_path_factory.mktemp("everything"))


@pytest.fixture(scope="module")
def everything(scene_file):
    return simulate(scene_file, scene_file.parent / "m.raymap", rays=RAYS, threads=2, store="spectral")


def test_every_effect_is_called_for(scene_file):
    assert list(needed_effects(load_scene(scene_file))) == [effect.name for effect in EFFECTS]


def test_ledger_closes(everything):
    ledger = energy_ledger(everything)
    ended_w = ledger.absorbed_w + ledger.escaped_w + ledger.killed_w
    assert ended_w == pytest.approx(ledger.emitted_w, rel=1e-9)
    assert ledger.killed_w < 1e-3 * ledger.emitted_w
    assert ledger.escaped_w < 1e-3 * ledger.emitted_w  # the room is closed


def test_light_is_booked_to_what_took_it(everything):
    """Clear media take nothing but rounding; metals, films and all that is not white take light."""
    ledger = energy_ledger(everything)
    for medium, absorbed_w in ledger.absorbed_by_medium_w.items():
        if medium in ("tinted", "milk", "glass"):
            assert absorbed_w > 1e-4 * ledger.emitted_w, medium
        else:
            assert abs(absorbed_w) < 1e-6 * ledger.emitted_w, medium
    for body in ("polished_metal", "brushed_metal", "coated_metal", "filter_None", "Room"):
        assert ledger.absorbed_by_body_w[body] > 1e-4 * ledger.emitted_w, body


def test_light_never_grows(everything):
    for portion in everything.portions:
        before = np.delete(portion.power, portion.event_offsets[1:] - 1)
        after = np.delete(portion.power, portion.event_offsets[:-1])
        assert (after <= before * (1 + 1e-5)).all()
        assert np.isfinite(portion.power).all()
        assert (portion.lights.values >= 0).all()
        assert (portion.power[portion.event_offsets[:-1]] == 1).all()


def test_every_kind_of_event_happens(everything):
    seen = set()
    for portion in everything.portions:
        seen |= set(np.unique(portion.signatures.kind).tolist())
    expected = set(EventKind) - {EventKind.LEFT, EventKind.KILLED_DEPTH}
    expected -= {EventKind.KILLED_NUMERICAL, EventKind.KILLED_MEDIUM_MISMATCH}
    assert {EventKind(kind).label for kind in seen} >= {kind.label for kind in expected}


def test_threads_and_portions_change_nothing(scene_file, everything):
    again = simulate(
        scene_file, scene_file.parent / "n.raymap", rays=RAYS, threads=1, portion_rays=1777, store="spectral"
    )
    assert again.content_hash == everything.content_hash


def test_the_map_stands_alone(everything):
    """Its own copy of the scene is what was simulated, though the files that the scene spoke of are elsewhere."""
    assert not [finding for finding in check_map(everything.path) if finding.is_fault]
