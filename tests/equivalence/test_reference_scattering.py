# SPDX-License-Identifier: LGPL-2.1-or-later
"""Media that scatter and absorb give ray for ray what a slow tracer gives."""

import numpy as np
import pytest

from raymaps.compile import compile_scene
from raymaps.kinds import EventKind
from raymaps.scene import load_scene
from raymaps.trace import Tracer
from tests.equivalence.reference_tracer import ReferenceTracer
from tests.physics.scenes import ball, body, box, write_scene

N_RAYS = 1_500
#: Solids, the smallest first: where they overlap the smaller rules. Core stands in Ball; Dip overlaps Ball and Block.
RANKED = ("Core", "Dip", "Ball", "Block")
SOURCE_SOLIDS = {"Out": (), "In": ("Ball",)}


@pytest.fixture(scope="module")
def milky(tmp_path_factory):
    """Scattering media of all kinds, one in the other, in fog."""
    table = {"kind": "table", "angle_deg": [0, 3, 30, 90, 180], "value": [50, 8, 1, 0.1, 0.3]}
    forward, backward = ({"kind": "henyey_greenstein", "g": g} for g in (0.9, -0.4))
    media = {
        "fog": {"refractive_index": 1.0003, "scattering": [{"coefficient_per_mm": 0.02}]},
        "milk": {
            "refractive_index": 1.34,
            "absorption_per_mm": [0.001, 0.01, 0.02],
            "scattering": [
                {"coefficient_per_mm": [0.1, 0.2, 0.4], "phase": forward},
                {"coefficient_per_mm": [0.05, 0.0, 0.1], "phase": backward},
                {"coefficient_per_mm": 0.05, "phase": table},
            ],
        },
        "opal": {
            "refractive_index": 1.5,
            "absorption_per_mm": 0.05,
            "scattering": [{"coefficient_per_mm": [1.0, 0.0, 0.2], "phase": table}],
        },
        "clear": {"refractive_index": 1.5},
    }
    path = write_scene(
        tmp_path_factory.mktemp("scene"),
        {
            "Ball": body(ball(8, 3), "polished", "milk"),
            "Core": body(ball(3, 2).moved(2, 0, 0), "polished", "opal"),
            "Dip": body(box((-3, -3, -12), (4, 3, -5)).turned(0.1, (3, 1, 0)), "polished", "opal"),
            "Block": body(box((-15, -15, -13), (15, 15, -9)).turned(0.1, (1, 2, 0)), "frosted", "clear"),
        },
        ambient="fog",
        media=media,
        surfaces={
            "polished": {"kind": "fresnel"},
            "frosted": {"kind": "lambertian", "reflectance": [0.8, 0.6, 0.5], "transmittance": [0.1, 0.2, 0.3]},
        },
        sources={
            "Out": {"kind": "point", "flux_w": 1, "position_mm": [0, 5, 15], "rgb": [0.5, 0.3, 0.2]},
            "In": {"kind": "point", "flux_w": 1, "position_mm": [-4, 0, 0]},
        },
        settings={"max_events": 40},
    )
    compiled = compile_scene(load_scene(path))
    portion = Tracer(compiled, 77).trace_portion(5_000_000_000, N_RAYS)
    slow = ReferenceTracer(compiled, 77, RANKED, SOURCE_SOLIDS)
    histories = []
    for k in range(N_RAYS):
        light = portion.light[portion.event_offsets[k]].astype(float)
        histories.append(slow.trace(5_000_000_000 + k, compiled.names.sources[portion.source[k]], light))
    return compiled, portion, histories


def test_every_ray_has_the_same_events(milky):
    compiled, portion, histories = milky
    for k, events in enumerate(histories):
        rows = slice(portion.event_offsets[k], portion.event_offsets[k + 1])
        assert portion.kind[rows].tolist() == [event.kind for event in events], f"ray {k}"
        assert [compiled.names.media[m] for m in portion.medium[rows]] == [e.medium for e in events], f"ray {k}"
        inside = [e.kind in (EventKind.MEDIUM_SCATTERING, EventKind.LEFT) for e in events]
        assert (portion.triangle[rows][inside] == -1).all(), f"ray {k}"
        places = np.array([e.position for e in events])
        assert np.abs(portion.position_mm[rows] - places).max() <= 0.5001 * compiled.frame.grid_mm, f"ray {k}"
        assert np.allclose(portion.light[rows], [e.light for e in events], rtol=2e-5, atol=1e-7), f"ray {k}"


def test_every_medium_scattered_and_absorbed(milky):
    compiled, portion, _ = milky
    for kind, media in (
        (EventKind.MEDIUM_SCATTERING, {"fog", "milk", "opal"}),
        (EventKind.MEDIUM_ABSORPTION, {"milk", "opal"}),
    ):
        assert {compiled.names.media[m] for m in portion.medium[portion.kind == kind]} == media
    assert (portion.kind == EventKind.KILLED_DEPTH).any()
    assert (portion.kind == EventKind.KILLED_MEDIUM_MISMATCH).sum() == 0
