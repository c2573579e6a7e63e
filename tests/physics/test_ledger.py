# SPDX-License-Identifier: LGPL-2.1-or-later
"""The energy ledger: it closes to 1e-9, and each of its buckets has the flux of a closed form."""

import math

import numpy as np
import pytest

from raymaps.kinds import EventKind
from raymaps.results.ledger import energy_ledger
from tests.physics.scenes import agrees, ball, body, box, disc_source, rectangle, share_agrees, traced

RGB = np.array([0.5, 0.3, 0.2])


def assert_closes(ledger):
    """Emitted = absorbed + escaped + killed, and the parts are the sums of their parts, to 1e-9."""
    assert ledger.absorbed_w + ledger.escaped_w + ledger.killed_w == pytest.approx(ledger.emitted_w, rel=1e-9)
    parts = math.fsum([*ledger.absorbed_by_body_w.values(), *ledger.absorbed_by_medium_w.values()])
    assert parts == pytest.approx(ledger.absorbed_w, rel=1e-9)
    assert math.fsum(ledger.killed_by_reason_w.values()) == pytest.approx(ledger.killed_w, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("roulette_threshold", [0.0, 0.1, 1.0])
@pytest.mark.parametrize("max_events", [5, 1000])
def test_ledger_closes_with_everything_in_the_scene(tmp_path, roulette_threshold, max_events):
    """All kinds of surfaces, sources and endings; coloured media, an absorbing ambient one, bodies inside one another
    and two that overlap.
    """
    h = traced(
        tmp_path,
        {
            "Ball": body(ball(8, 3), "polished", "glass"),
            "Core": body(ball(3, 2).moved(2, 0, 0), "polished", "ink"),
            "Floor": body(box((-40, -40, -21), (40, 40, -20)), "mixed"),
            "Sheet": body(box((15, -9, -9), (15.5, 9, 9)), "white"),
            "Wall": body(box((-30, -20, -20), (-29, 20, 20)), "mirror", plus_x="tinted"),
            "Left": body(box((-6, 20, -3), (0, 26, 3)), "polished", "glass"),
            "Right": body(box((-2, 19, -2), (6, 25, 2)), "polished", "ink"),
        },
        rays=60_000,
        ambient="fog",
        media={
            "glass": {"refractive_index": 1.5, "absorption_per_mm": [0.001, 0.01, 0.05]},
            "ink": {"refractive_index": 1.33, "absorption_per_mm": [0.2, 0.01, 0.0]},
            "fog": {"refractive_index": 1.0003, "absorption_per_mm": [0.0001, 0.001, 0.003]},
        },
        surfaces={
            "polished": {"kind": "fresnel"},
            "white": {"kind": "lambertian", "reflectance": [0.8, 0.6, 0.5], "transmittance": 0.15},
            "mirror": {"kind": "mirror", "reflectance": [0.9, 0.8, 0.7]},
            "tinted": {"kind": "mirror", "reflectance": [0, 0, 0.7]},
            "black": {"kind": "absorber"},
            "mixed": {
                "kind": "mixture",
                "parts": [
                    {"weight": 0.5, "surface": "white"},
                    {"weight": 0.3, "surface": "mirror"},
                    {"weight": 0.2, "surface": "black"},
                ],
            },
        },
        sources={
            "Point": {"kind": "point", "flux_w": 1.7, "position_mm": [0, 0, 15], "rgb": list(RGB)},
            "Inside": {"kind": "point", "flux_w": 0.3, "position_mm": [-4, 0, 0]},
            "Spot": {
                "kind": "cone",
                "flux_w": 0.01,
                "position_mm": [-10, 22, 0],
                "direction": [1, 0, 0],
                "half_angle_deg": 15,
            },
            "Beam": disc_source((0, 0, 30), (0.1, 0, -1), 20, 5.0, (0, 0, 1)),
            "Lamp": {"kind": "faces", "flux_w": 2, "body": "Floor", "faces": ["+z"], "rgb": [1, 0, 0.1]},
        },
        detectors={"D": rectangle((0, 0, -15), 30, 30, side="both")},
        settings={"roulette_threshold": roulette_threshold, "max_events": max_events},
    )
    ledger = energy_ledger(h.raymap)
    assert_closes(ledger)
    assert ledger.emitted_w == pytest.approx(9.01, rel=1e-12)
    assert min(ledger.absorbed_by_body_w["Floor"], ledger.absorbed_by_medium_w["ink"], ledger.escaped_w) > 0
    assert ledger.killed_by_reason_w["numerical"] == ledger.killed_by_reason_w["medium_mismatch"] == 0
    assert (ledger.killed_by_reason_w["depth"] > 0) == (max_events == 5)

    # the ledger is the sum over the stored histories, but for what float32 rounds away on coloured last segments
    watts = h.raymap.ray_flux_w[h.ray_source]
    end = h.light[h.last].sum(axis=1)
    left = h.kind[h.last] == EventKind.LEFT
    assert ledger.escaped_w == pytest.approx((watts * end)[left].sum(), rel=1e-7)


@pytest.mark.parametrize("absorption", [0.01, [0.001, 0.004, 0.01]])
def test_ledger_closes_where_light_leaves_through_an_absorbing_medium(tmp_path, absorption):
    """The last segment too recolours light; what float32 rounds away there must not be missing."""
    h = traced(
        tmp_path,
        {},
        rays=50_000,
        ambient="fog",
        media={"fog": {"refractive_index": 1, "absorption_per_mm": absorption}},
        sources={"S": disc_source((0, 0, 0), (0, 0, 1), 1)},
        detectors={"D": rectangle((0, 0, 100), 60, 60)},
    )
    assert_closes(energy_ledger(h.raymap))


def test_each_bucket_has_its_closed_form(tmp_path):
    """Beams that each end in a known way: by a body, a medium, by leaving (through bodies that overlap too), and by the
    limit of events."""
    flux = {"Black": 1.0, "Gray": 2.0, "Slab": 0.5, "Out": 0.25, "Trap": 4.0, "Overlap": 0.125}
    places = {name: np.array([100.0 * k, 0, 0]) for k, name in enumerate(flux)}
    plate = box((-20, -20, -1), (20, 20, 0))
    overlap = places["Overlap"]
    bodies = {
        "Black": body(plate.moved(*places["Black"]), "black"),
        "Gray": body(plate.moved(*places["Gray"]), "gray"),
        "Slab": body(box((-20, -20, -10), (20, 20, 0)).moved(*places["Slab"]), "polished", "ink"),
        "Trap": body(ball(20, 2).moved(*places["Trap"]), "perfect"),
        "Upper": body(box((-20, -20, -10), (20, 20, 0)).moved(*overlap), "polished", "clear"),
        "Lower": body(box((-20, -20, -15), (20, 20, -5)).moved(*overlap), "polished", "clear too"),
    }
    h = traced(
        tmp_path,
        bodies,
        rays=100_000,
        sources={name: disc_source(places[name] + [0, 0, 5], (0, 0, -1), 1, f, tuple(RGB)) for name, f in flux.items()},
        media={
            "ink": {"refractive_index": 1, "absorption_per_mm": [0.01, 0.1, 0.3]},
            "clear": {"refractive_index": 1},
            "clear too": {"refractive_index": 1},
        },
        surfaces={
            "black": {"kind": "absorber"},
            "gray": {"kind": "mirror", "reflectance": [0.9, 0.5, 0.2]},
            "polished": {"kind": "fresnel"},
            "perfect": {"kind": "mirror", "reflectance": 1},
        },
        settings={"max_events": 50},
    )
    ledger = energy_ledger(h.raymap)
    assert_closes(ledger)
    assert ledger.emitted_w == pytest.approx(sum(flux.values()), rel=1e-12)
    through_gray = float((RGB * [0.9, 0.5, 0.2]).sum())
    through_slab = float((RGB * np.exp(-10 * np.array([0.01, 0.1, 0.3]))).sum())
    exactly = {"rel": 1e-6}
    assert ledger.absorbed_by_body_w["Black"] == pytest.approx(flux["Black"], **exactly)
    assert ledger.absorbed_by_body_w["Gray"] == pytest.approx(flux["Gray"] * (1 - through_gray), **exactly)
    assert ledger.absorbed_by_body_w["Slab"] == pytest.approx(0, abs=1e-6)
    assert ledger.killed_by_reason_w["depth"] == pytest.approx(flux["Trap"], **exactly)
    assert ledger.killed_by_reason_w["numerical"] == 0
    n = (h.ray_source == h.index("sources", "Slab")).sum()
    stderr = flux["Slab"] * math.sqrt(through_slab * (1 - through_slab) / n)
    agrees("absorbed by ink", ledger.absorbed_by_medium_w["ink"], stderr, flux["Slab"] * (1 - through_slab))
    agrees(
        "escaped",
        ledger.escaped_w,
        stderr,
        flux["Out"] + flux["Overlap"] + flux["Gray"] * through_gray + flux["Slab"] * through_slab,
    )
    share_agrees(
        "rays through the slab", ((h.kind[h.last] == EventKind.LEFT) & (h.ray_source == 2)).sum(), n, through_slab
    )
