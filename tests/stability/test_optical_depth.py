# SPDX-License-Identifier: LGPL-2.1-or-later
"""Media from a millionth of a millionth to a million mean free paths thick, scattering straight on or straight back."""

import math

import numpy as np
import pytest

from raymaps.kernels.phase import henyey_greenstein
from raymaps.kernels.random import uniforms
from raymaps.kinds import EventKind
from raymaps.results.ledger import energy_ledger
from tests.physics.adding_doubling import half_space_reflectance
from tests.physics.scenes import agrees, body, box, disc_source, share_agrees, traced
from tests.stability.aiming import lost

DEPTHS = [1e-12, 1e-9, 1e-6, 1e-3, 1.0, 30.0, 1e3, 1e6]


def slab(folder, medium, *, rays, events=1_000, mirrors=True, side=4.0):
    """A beam onto a slab 1 mm thick, without an interface, between mirrors."""
    sides = dict.fromkeys(("plus_x", "minus_x", "plus_y", "minus_y"), "mirror") if mirrors else {}
    h = traced(
        folder,
        {"Slab": body(box((-side, -side, 0), (side, side, 1)), "polished", "milk", **sides)},
        rays=rays,
        settings={"max_events": events},
        media={"milk": {"refractive_index": 1.0, **medium}},
        surfaces={"polished": {"kind": "fresnel"}, "mirror": {"kind": "mirror", "reflectance": 1.0}},
        sources={"S": disc_source((0, 0, 2), (0, 0, -1), 0.1)},
    )
    assert lost(h).all == 0
    ledger = energy_ledger(h.raymap)
    assert ledger.absorbed_w + ledger.escaped_w + ledger.killed_w == pytest.approx(1, abs=1e-9)
    return h, ledger


@pytest.mark.parametrize("depth", DEPTHS)
def test_absorption(tmp_path, depth):
    """exp(-depth) gets through, and what is absorbed lies 1 / coefficient deep in the mean.

    Guards: expm1 and log1p in place of exp and log: 1 - exp(-1e-12) keeps four digits, and log(1 - u (1 - exp(-1e6)))
    is that of 0 for the last of all draws.
    """
    h, ledger = slab(tmp_path, {"absorption_per_mm": depth}, rays=100_000)
    absorbed = h.count_kind(EventKind.MEDIUM_ABSORPTION)
    # a draw is a multiple of 2^-33: so is a probability
    share = -math.expm1(-depth)
    agrees("absorbed", absorbed / h.n_rays, math.sqrt(share * (1 - share) / h.n_rays) + 2.0**-33, share)
    assert ledger.absorbed_by_medium_w["milk"] == pytest.approx(absorbed / h.n_rays, abs=1e-12)
    if absorbed > 100:
        deep = 1 - h.position[h.kind == EventKind.MEDIUM_ABSORPTION, 2]
        mean = (1 - (1 + depth) * math.exp(-depth)) / (depth * share) if depth < 100 else 1 / depth
        grid = h.raymap.manifest.grid_mm
        agrees("depth", deep.mean(), deep.std() / math.sqrt(absorbed) + grid / 2, mean)
        assert deep.min() >= -grid
        assert deep.max() <= 1 + grid


@pytest.mark.parametrize("depth", DEPTHS)
def test_absorption_of_one_band_of_three(tmp_path, depth):
    """Light of the band that is absorbed follows exp(-depth), the others keep all of theirs.

    Guards: light is recoloured by what was lost, not by what is left (a difference of nearly equal numbers).
    """
    h, _ = slab(tmp_path, {"absorption_per_mm": [depth, 0, 0]}, rays=100_000)
    out = h.kind == EventKind.LEFT
    flux, stderr = h.flux_w(h.per_ray(out, h.light[out]))
    agrees("bands", flux, stderr + 2.0**-33, np.array([math.exp(-depth), 1, 1]) / 3, rounding=2e-6)


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("g", [0.9999, -0.9999, 0.0])
def test_scattering_without_absorption(tmp_path, depth, g):
    """All light gets out again, or is still on its way at the last event; unscattered light follows exp(-depth).

    Guards: the inversion of Henyey's and Greenstein's phase function without differences; a scattered ray that is
    nearer to a face than float32 can tell stays on its side of it; distances of 1e-6 mm are not lost in the rounding of
    places.
    """
    medium = {"scattering": [{"coefficient_per_mm": depth, "phase": {"kind": "henyey_greenstein", "g": g}}]}
    thick = depth > 100
    h, ledger = slab(tmp_path, medium, rays=1_000 if thick else 20_000, events=3_000 if thick else 1_000)
    assert ledger.absorbed_w == 0
    straight = np.bincount(h.ray[h.kind == EventKind.MEDIUM_SCATTERING], minlength=h.n_rays) == 0
    agrees(
        "unscattered", straight.mean(), math.sqrt(math.exp(-depth) * -math.expm1(-depth) / h.n_rays) + 2.0**-33,
        math.exp(-depth),
    )  # fmt: skip
    inside = h.position[h.kind == EventKind.MEDIUM_SCATTERING, 2]
    if len(inside):
        assert inside.min() >= -h.raymap.manifest.grid_mm
        assert inside.max() <= 1 + h.raymap.manifest.grid_mm


def test_a_million_mean_free_paths_reflect_like_a_half_space(tmp_path):
    """Albedo 0.9, isotropic: what comes back from a slab of optical depth 1e6 is what a half space reflects.

    Guards: all of this happens within a few thousandths of a START_OFFSET of the face.
    """
    albedo, depth = 0.9, 1e6
    medium = {
        "absorption_per_mm": (1 - albedo) * depth,
        "scattering": [{"coefficient_per_mm": albedo * depth, "phase": {"kind": "isotropic"}}],
    }
    h, ledger = slab(tmp_path, medium, rays=60_000, events=2_000)
    assert ledger.killed_w == 0
    up = (h.kind[h.last] == EventKind.LEFT) & (h.way[h.last, 2] > 0)
    down = (h.kind[h.last] == EventKind.LEFT) & ~up
    share_agrees("reflected", up.sum(), h.n_rays, half_space_reflectance(albedo, 1.0))
    assert not down.any()


def test_an_albedo_of_all_but_a_millionth_of_a_millionth(tmp_path):
    """Ten mean free paths in a slab that absorbs 1e-12 of each scattering: nothing is lost that can be counted.

    Guards: absorption and scattering are drawn each by its own coefficient: 1 - albedo is never formed.
    """
    medium = {
        "absorption_per_mm": 10 * 1e-12,
        "scattering": [{"coefficient_per_mm": 10.0, "phase": {"kind": "henyey_greenstein", "g": 0.9}}],
    }
    h, ledger = slab(tmp_path, medium, rays=20_000, events=20_000)
    assert ledger.absorbed_w == 0
    assert ledger.killed_w == 0
    assert ledger.escaped_w == 1.0
    assert (h.light == h.light[0]).all()


@pytest.mark.parametrize("g", [0.9999, 0.99, 0.0, -0.99, -0.9999])
def test_moments_of_the_phase_function(g):
    """The mean cosine is g, that of the second Legendre polynomial g²; and sine and cosine belong together.

    Guards: 1 - cos near 0 and 180 degrees is not taken from a cosine that is 1 to all digits.
    """
    n = 200_000
    drawn = np.array([henyey_greenstein(g, uniforms(np.uint64(1), np.uint64(k), 0, 0)[0]) for k in range(n)])
    cosine, sine = drawn.T
    assert np.abs(cosine**2 + sine**2 - 1).max() < 1e-15 * 8
    for what, values, expected in (("g", cosine, g), ("g²", 1.5 * cosine**2 - 0.5, g * g)):
        agrees(what, values.mean(), values.std() / math.sqrt(n), expected)
    # where cos rounds to 1, the sine still tells the angle: half of all light lies within u = 1/2
    half = henyey_greenstein(g, 0.5)
    assert half[1] > 0
    if g > 0.99:
        d = 0.5 * (1 - g) + 0.5 * (1 + g)
        below = 2 * ((1 - g) / d) ** 2 * 0.5 * (0.5 + 0.5 * (1 + g))
        assert half[1] == pytest.approx(math.sqrt(below * (2 - below)), rel=1e-14, abs=0)
