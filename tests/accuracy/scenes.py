# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scenes with closed forms that independent rays and Sobol' points are both asked for."""

import math

from tests.physics.scenes import body, box, disc_source, rectangle, write_scene

BLACK = {"kind": "absorber"}
#: Rays of each of the two lamps are as many.
LAMP_FLUX_W = {"A": 1.0, "B": 3.0}
LAMP_HEIGHT_MM = {"A": 1.0, "B": 2.0}
SLAB_FLUX_W = 2.0


def two_lamps(folder, **settings):
    """Two point sources above a detector "D" of 20 mm in a square."""
    return write_scene(
        folder,
        {"Floor": body(box((-20, -20, -2), (20, 20, -1)), "black")},
        surfaces={"black": BLACK},
        sources={
            name: {"kind": "point", "flux_w": flux_w, "position_mm": [0, 0, LAMP_HEIGHT_MM[name]], "ray_share": 1}
            for name, flux_w in LAMP_FLUX_W.items()
        },
        detectors={"D": rectangle((0, 0, 0), 20, 20, resolution=[1, 1])},
        settings=settings,
    )


def slab(folder, **settings):
    """A slab that reflects to and fro and absorbs, above a black floor, in a beam."""
    return write_scene(
        folder,
        {
            "Slab": body(box((-5, -5, 0), (5, 5, 1)), "clear", "glass"),
            "Floor": body(box((-5, -5, -3), (5, 5, -2)), "black"),
        },
        media={"glass": {"refractive_index": 1.5, "absorption_per_mm": 0.3}},
        surfaces={"clear": {"kind": "fresnel"}, "black": BLACK},
        sources={"Beam": disc_source((0, 0, 3), (0, 0, -1), 1, SLAB_FLUX_W)},
        settings=settings,
    )


def slab_flux_w():
    """Flux by what happens to it, without interference: geometric series over the ways to and fro."""
    r, through = 0.04, math.exp(-0.3)
    transmitted = (1 - r) ** 2 * through / (1 - (r * through) ** 2)
    reflected = r + r * (1 - r) ** 2 * through**2 / (1 - (r * through) ** 2)
    shares = {
        "reflected": reflected,
        "transmitted": transmitted,
        "absorbed": 1 - reflected - transmitted,
        "absorbed by all": 1 - reflected,
    }
    return {name: SLAB_FLUX_W * share for name, share in shares.items()}


def two_mirrors(folder, reflectances, edge_mm, **settings):
    """A beam of 1 mm radius and 1 W on a bright mirror, left of the edge, and a dull one; detectors see it go and come.

    "Both" counts light on both ways, "Up" what comes back.
    """
    return write_scene(
        folder,
        {
            "Bright": body(box((-3, -3, -1), (edge_mm, 3, 0)), "bright"),
            "Dull": body(box((edge_mm, -3, -1), (3, 3, 0)), "dull"),
        },
        surfaces={
            name: {"kind": "mirror", "reflectance": r} for name, r in zip(("bright", "dull"), reflectances, strict=True)
        },
        sources={"Beam": disc_source((0, 0, 3), (0, 0, -1), 1)},
        detectors={
            "Both": rectangle((0, 0, 1), 8, 8, side="both", resolution=[1, 1]),
            "Up": rectangle((0, 0, 1), 8, 8, side="back", resolution=[1, 1]),
        },
        settings={"roulette_threshold": 0, **settings},
    )
