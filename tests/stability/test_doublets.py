# SPDX-License-Identifier: LGPL-2.1-or-later
"""A cemented doublet whose lenses touch, stand 1 nm apart, or overlap by 1 um: the spot and the flux move
continuously."""

import math

import numpy as np
import pytest

from raymaps.kinds import EventKind
from raymaps.run import simulate
from tests.physics.lenses import Lens, write_lenses
from tests.physics.scenes import Histories, disc_source, rectangle
from tests.physics.sequential import LensFace, paraxial_focus
from tests.stability.aiming import lost

#: Crown and flint after Fraunhofer's kind: radii of curvature, thicknesses in mm; indices of N-BK7 and N-SF5 at 587.6
#: nm.
FRONT, CEMENT, REAR = 60.0, -45.0, -130.0
CROWN, FLINT = 6.0, 3.0
INDICES = (1.0, 1.5168, 1.6727, 1.0)
RADIUS = 12.0
RAYS = 40_000


def faces(gap_mm):
    """The four faces; the second lens stands a gap behind the first (below 0: it overlaps)."""
    return (
        LensFace(0.0, 1 / FRONT),
        LensFace(CROWN, 1 / CEMENT),
        LensFace(CROWN + gap_mm, 1 / CEMENT),
        LensFace(CROWN + FLINT + gap_mm, 1 / REAR),
    )


FOCUS = paraxial_focus((faces(0)[0], faces(0)[1], faces(0)[3]), INDICES)[1]


def doublet(folder, gap_mm, rings=(12, 12), name="doublet", **sections) -> Histories:
    """A beam of 8 mm through the doublet, onto a detector in its paraxial focus."""
    front, back, front_2, rear = faces(gap_mm)
    lenses = {
        "Crown": (Lens(front, back, RADIUS, "crown"), rings[0]),
        "Flint": (Lens(front_2, rear, RADIUS, "flint"), rings[1]),
    }
    scene = write_lenses(
        folder,
        lenses,
        {"crown": INDICES[1], "flint": INDICES[2]},
        name=name,
        sources={"S": disc_source((0, 0, -10), (0, 0, 1), 8)},
        detectors={"Focus": rectangle((0, 0, FOCUS), 20, 20, side="both")},
        **sections,
    )
    h = Histories(simulate(scene, folder / f"{name}.raymap", rays=RAYS, seed=1, threads=2))
    assert lost(h).all == 0
    return h


def spot(h):
    """Places on the detector of the rays that were never reflected, by ray; NaN of others."""
    reflected = np.bincount(h.ray[h.kind == EventKind.FRESNEL_REFLECTION], minlength=h.n_rays) > 0
    xy = np.full((h.n_rays, 2), np.nan)
    xy[h.crossing_ray] = h.crossing_xy
    xy[reflected] = np.nan
    return xy


@pytest.fixture(scope="module")
def touching(tmp_path_factory):
    return doublet(tmp_path_factory.mktemp("touching"), 0.0)


def cemented_loss():
    """Share of light on the axis that the cement reflects, and that two faces to air would."""

    def r(a, b):
        return ((a - b) / (a + b)) ** 2

    return r(INDICES[1], INDICES[2]), r(INDICES[1], 1) + r(1, INDICES[2])


def test_touching_faces_are_one_interface(touching):
    """Three refractions, from crown to flint without air between, and the reflectance of the cement.

    Guards: crossings in contact are one interface, between the medium before all and that beyond all.
    """
    h = touching
    straight = np.isfinite(spot(h)[:, 0])
    assert (np.diff(h.offsets)[straight] == 5).all()
    at_cement = h.first[:, None] + 2
    media = h.medium[h.first + 2][straight]
    assert (media == h.index("media", "flint")).all()
    cemented, air = cemented_loss()
    lost_there = (h.kind[at_cement[:, 0]] == EventKind.FRESNEL_REFLECTION) & (
        h.kind[h.first + 1] == EventKind.FRESNEL_REFRACTION
    )
    n = (h.kind[h.first + 1] == EventKind.FRESNEL_REFRACTION).sum()
    share = lost_there.sum() / n
    assert share < 2 * cemented < 0.2 * air
    assert abs(share - cemented) < 5 * math.sqrt(cemented / n) + 0.1 * cemented  # of the angles


@pytest.mark.parametrize(
    ("gap_mm", "moves_mm"), [(1e-9, 2e-5), (1e-7, 2e-5), (1e-6, 2e-5), (-1e-6, 2e-5), (-1e-3, 2e-3)]
)
def test_gaps_and_overlaps_move_the_spot_no_more_than_themselves(tmp_path, touching, gap_mm, moves_mm):
    """A gap of 1 nm, or of 1 pm, is no film of air: ray by ray the same way as through the cemented doublet, with the
    same draws; an overlap of 1 um moves each ray in the focus by less than 2 um.

    Guards: CONTACT (a gap of 1 nm would reflect 10 % of the light); the priority of overlapping bodies.
    """
    h = doublet(tmp_path, gap_mm)
    ours, theirs = spot(h), spot(touching)
    both = np.isfinite(ours[:, 0]) & np.isfinite(theirs[:, 0])
    assert both.mean() > 0.85
    assert np.isfinite(ours[:, 0]).mean() == pytest.approx(np.isfinite(theirs[:, 0]).mean(), abs=2e-3)
    off = np.linalg.norm(ours - theirs, axis=1)[both]
    print(f"  gap {gap_mm * 1e6:g} nm: {1e6 * off.max():.3g} nm at most")
    assert off.max() <= moves_mm


@pytest.mark.parametrize("rings", [(12, 9), (5, 20)])
def test_touching_faces_of_other_triangles(tmp_path, touching, rings):
    """The faces in contact are cut into other triangles: up to 0.05 mm apart as facets, one as exact surfaces.

    Guards: contact is told by exact surfaces, found through facets that may be as far apart as their sagitta.
    """
    h = doublet(tmp_path, 0.0, rings)
    ours, theirs = spot(h), spot(touching)
    both = np.isfinite(ours[:, 0]) & np.isfinite(theirs[:, 0])
    assert np.isfinite(ours[:, 0]).mean() == pytest.approx(np.isfinite(theirs[:, 0]).mean(), abs=2e-3)
    assert np.linalg.norm(ours - theirs, axis=1)[both].max() <= 2e-5


def test_a_gap_that_is_one_is_seen(tmp_path, touching):
    """A gap of 10 um is a film of air: two faces reflect.

    Guards: the reach of CONTACT.
    """
    h = doublet(tmp_path, 1e-2)
    assert (np.diff(h.offsets)[np.isfinite(spot(h)[:, 0])] == 6).all()
    assert np.isfinite(spot(h)[:, 0]).mean() < np.isfinite(spot(touching)[:, 0]).mean() - 0.05
