# SPDX-License-Identifier: LGPL-2.1-or-later
"""Flux and étendue through lenses and prisms.

In a closed black room whose walls emit with the same radiance L everywhere, a lens that absorbs nothing changes
nothing: every point in the room still sees L from every direction, and every point inside the lens that all directions
reach sees n² L, reflections included, because n² dA cos dOmega is conserved along each ray and a reflectance is the
same both ways (R. Boyd: Radiometry and the Detection of Optical Radiation, 1983, section 5.2; G. Kirchhoff, 1860).
This holds for every shape, so facets of a mesh leave no bias.
"""

import math

import numpy as np
import pytest

from raymaps.kinds import EventKind
from raymaps.results.ledger import energy_ledger
from tests.physics.scenes import (
    agrees,
    ball,
    body,
    box,
    disc_source,
    follows,
    prism,
    rectangle,
    revolved,
    share_agrees,
    traced,
    unit,
)

SURFACES = {"polished": {"kind": "fresnel"}, "black": {"kind": "absorber"}}


def plano_convex(radius, thickness, segments=96, rings=48):
    """A lens whose curved side is up, with its apex at z = thickness and its flat side at z = 0."""
    edge = math.acos((radius - thickness) / radius)
    angle = np.linspace(0, edge, rings)
    curve = np.stack([radius * np.sin(angle), radius * np.cos(angle) - radius + thickness], axis=1)
    curve[0, 0], curve[-1, 1] = 0, 0
    return revolved(np.vstack([curve, [[0, 0]]]), segments)


LENSES = {
    "ball": lambda: ball(10, 3),
    "plano-convex": lambda: plano_convex(20, 6).moved(0, 0, -3),
    "block": lambda: box((-9, -8, -4), (9, 8, 5)).turned(0.4, (1, 2, 0.5)),
}


def lit_room(folder, lens, n_glass, detectors, rays):
    """A lens in the middle of a room of radius 40 mm that emits 1 W from all its wall; and the irradiance L pi on a
    side.
    """
    room = ball(40, 2).inside_out
    h = traced(
        folder,
        {"Room": body(room, "black"), "Lens": body(lens, "polished", "glass")},
        rays=rays,
        surfaces=SURFACES,
        media={"glass": {"refractive_index": n_glass}},
        detectors=detectors,
        settings={"max_events": 5000},
        sources={"Wall": {"kind": "faces", "flux_w": 1, "body": "Room"}},
    )
    return h, 1 / room.area


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("n_glass", [1.5, 1.9])
def test_radiance_is_conserved_through_a_lens(tmp_path, lens, n_glass):
    """Before, behind, and across the lens each side of a detector gets pi L A, and the angles have the density of a
    uniform radiance: sin² is uniform. For the detectors that the lens refracts or reflects onto, and for an oblique
    one.
    """
    detectors = {
        "Before": rectangle((0, 0, -12), 12, 12, side="both"),
        "Behind": rectangle((0, 0, 12), 12, 12, side="both"),
        "Oblique": rectangle((13, 0, 3), 8, 8, side="both", normal=[1, 0.3, 0.2], x_axis=[0, 1, 0]),
    }
    h, irradiance = lit_room(tmp_path, LENSES[lens](), n_glass, detectors, 200_000)
    for name, detector in detectors.items():
        area = detector["width_mm"] * detector["height_mm"]
        crossings = h.through(name)
        front = h.crossing_angle < math.pi / 2
        for side, rows in (("front", crossings & front), ("back", crossings & ~front)):
            agrees(f"{name}, {side}", *h.flux_w(h.crossings_per_ray(rows)), irradiance * area)
            follows(f"{name}, {side}, sin²", np.sin(h.crossing_angle[rows]) ** 2, 20)
    ledger = energy_ledger(h.raymap)
    assert ledger.absorbed_by_body_w["Room"] == pytest.approx(1, abs=1e-6 + ledger.killed_w)
    assert ledger.killed_w < 1e-4


@pytest.mark.parametrize("n_glass", [1.33, 1.5, 1.9])
def test_radiance_inside_glass_grows_with_the_square_of_its_index(tmp_path, n_glass):
    """Within R / n of the centre of a ball every direction comes from outside, so a side of a detector there gets
    n² pi L A, and sin² of the angle is uniform. In the middle, where light meets the surface steeply, and near R / n,
    where much of it arrives beyond Brewster's angle.
    """
    side = 8 / n_glass  # half the diagonal is 0.57 R / n
    detectors = {
        "Middle": rectangle((0, 0, 0), side, side, side="both"),
        "Edge": rectangle((8.5 / n_glass, 0, 0), 1 / n_glass, 3 / n_glass, side="both"),
    }
    h, irradiance = lit_room(tmp_path, ball(10, 3), n_glass, detectors, 150_000)
    front = h.crossing_angle < math.pi / 2
    for name, detector in detectors.items():
        area = detector["width_mm"] * detector["height_mm"]
        for side_name, rows in (("front", h.through(name) & front), ("back", h.through(name) & ~front)):
            agrees(f"{name}, {side_name}", *h.flux_w(h.crossings_per_ray(rows)), n_glass**2 * irradiance * area)
            follows(f"{name}, {side_name}, sin²", np.sin(h.crossing_angle[rows]) ** 2, 10)
    assert (h.medium[h.crossing_row] == h.index("media", "glass")).all()


def test_flux_before_a_lens_is_flux_behind_and_losses(tmp_path):
    """Ray by ray: what crosses a detector before an absorbing lens comes back, crosses the detector behind, leaves
    sideways or is absorbed in the glass.
    """
    wide = {"side": "both", "normal": [0, 0, -1]}
    h = traced(
        tmp_path,
        {"Lens": body(plano_convex(20, 6), "polished", "glass")},
        rays=100_000,
        surfaces=SURFACES,
        media={"glass": {"refractive_index": 1.5, "absorption_per_mm": 0.02}},
        sources={"Beam": disc_source((0, 0, -15), (0, 0, 1), 9)},
        detectors={"Before": rectangle((0, 0, -2), 100, 100, **wide), "Behind": rectangle((0, 0, 9), 100, 100, **wide)},
    )
    forward = h.crossing_angle < math.pi / 2

    def net(name):
        """Forward minus backward crossings of each ray."""
        rows = h.through(name)
        return h.crossings_per_ray(rows & forward) - h.crossings_per_ray(rows & ~forward)

    assert (h.crossings_per_ray(h.through("Before") & forward) == 1).all()
    ended = h.kind[h.last]
    sideways = (ended == EventKind.LEFT) & (np.abs(h.position[h.last, 2] - 3.5) < 5.4)
    killed = ~np.isin(ended, [EventKind.LEFT, EventKind.MEDIUM_ABSORPTION])
    assert killed.sum() <= 2
    balance = net("Before") - net("Behind") - (ended == EventKind.MEDIUM_ABSORPTION) - sideways
    assert (balance[~killed] == 0).all()
    assert (ended == EventKind.MEDIUM_ABSORPTION).mean() > 0.05


@pytest.mark.parametrize("n_glass", [1.3, 1.5, 2.0])
def test_lens_transmits_near_its_axis_as_a_plate(tmp_path, n_glass):
    """Near its apex a lens lets 2n / (n² + 1) through, all reflections inside added up (Born & Wolf, section 7.6.1: a
    plate with incoherent light, T = (1 - R) / (1 + R)). A beam of a hundredth of the radius: angles below 0.02 change
    it by less than 1e-4.
    """
    h = traced(
        tmp_path,
        {"Lens": body(plano_convex(50, 5, rings=200), "polished", "glass")},
        rays=100_000,
        surfaces=SURFACES,
        media={"glass": {"refractive_index": n_glass}},
        sources={"Beam": disc_source((0, 0, -5), (0, 0, 1), 0.5)},
    )
    expected = 2 * n_glass / (n_glass**2 + 1)
    through = (h.kind[h.last] == EventKind.LEFT) & (h.way[h.last, 2] > 0)
    agrees(
        "transmitted share", through.mean(), math.sqrt(expected * (1 - expected) / h.n_rays), expected, rounding=1e-4
    )


def test_plano_convex_lens_has_its_focal_length(tmp_path):
    """A beam parallel to the axis onto the flat side of a thin lens meets the axis f = R / (n - 1) behind the apex (the
    second principal point of a plano-convex lens; E. Hecht: Optics, section 6.1). Facets tilt each ray by their own;
    over rings and segments the tilts average out: the slope of direction over height is that of the sphere but for the
    spherical aberration, of the order of (height / R)² = 1e-4, and what facets leave.
    """
    n_glass, radius = 1.5, 100.0
    h = traced(
        tmp_path,
        {"Lens": body(plano_convex(radius, 2, segments=400, rings=800), "polished", "glass")},
        rays=100_000,
        surfaces=SURFACES,
        media={"glass": {"refractive_index": n_glass}},
        sources={"Beam": disc_source((0, 0, -5), (0, 0, 1), 1.5)},
        detectors={"Screen": rectangle((0, 0, 2.5), 40, 40, normal=[0, 0, -1])},
    )
    direct = np.diff(h.offsets) == 4  # emission, two refractions, out
    rows = h.first[direct] + 2
    height, slope = h.position[rows, :2], unit(h.way[rows + 1])[:, :2]
    power = -(height * slope).sum() / (height**2).sum()
    residual = slope + power * height
    stderr = math.sqrt((residual**2).sum() / residual.size / (height**2).sum())
    agrees("1 / f", power, stderr, (n_glass - 1) / radius, rounding=5e-4)


@pytest.mark.parametrize("n_glass", [1.3, 1.5, 1.7])
def test_prism_at_minimum_deviation(tmp_path, n_glass):
    """n sin(A / 2) = sin((A + D) / 2), and D is least there (Born & Wolf, section 4.7.2, eq. 7). Transmitted
    straight: the square of one interface's transmittance by Fresnel's equations (section 1.5.2, eq. 21).
    """
    apex = math.radians(60)
    deviation = 2 * math.asin(n_glass * math.sin(apex / 2)) - apex
    sources = {}
    for k, more in enumerate((0.0, 0.03, -0.03)):
        tilt = deviation / 2 + more
        direction = np.array([math.cos(tilt), 0, math.sin(tilt)])
        entry = np.array([-10 * math.sin(apex / 2), 0, -10 * math.cos(apex / 2)])
        sources[f"S{k}"] = disc_source(entry - 10 * direction, direction, 0.2)
    h = traced(
        tmp_path,
        {"Prism": body(prism(apex, 20, 30), "polished", "glass", rest="black")},
        rays=60_000,
        surfaces=SURFACES,
        media={"glass": {"refractive_index": n_glass}},
        sources=sources,
    )
    rows = np.repeat(h.first, 4).reshape(-1, 4) + np.arange(4)
    straight = np.diff(h.offsets) == 4
    faces = [h.face_index("Prism", "left"), h.face_index("Prism", "right")]
    straight[straight] = (h.face[rows[straight]][:, 1:3] == faces).all(axis=1)
    straight[straight] = (h.kind[rows[straight, 1:3]] == EventKind.FRESNEL_REFRACTION).all(axis=1)
    inward, outward = unit(h.way[rows[straight, 1]]), unit(h.way[rows[straight, 3]])
    turned = np.arctan2(np.cross(outward, inward)[:, 1], (inward * outward).sum(axis=1))
    grid_error = (
        6 * h.raymap.manifest.grid_mm / min(np.linalg.norm(h.way[rows[straight, k]], axis=1).min() for k in (1, 3))
    )
    source = h.ray_source[straight]
    assert np.abs(np.abs(turned[source == 0]) - deviation).max() < grid_error
    assert np.abs(turned[source != 0]).min() > deviation + 1e-4

    i, t = (apex + deviation) / 2, apex / 2
    reflected = 0.5 * ((math.tan(i - t) / math.tan(i + t)) ** 2 + (math.sin(i - t) / math.sin(i + t)) ** 2)
    share_agrees("transmitted straight", (source == 0).sum(), (h.ray_source == 0).sum(), (1 - reflected) ** 2)
