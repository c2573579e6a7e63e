# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which scenes call for spectra and for dispersion, with the reasons in words."""

from __future__ import annotations

from typing import Any

import pytest

from raymaps.effects import needed_effects
from raymaps.scene import Scene

TABLE = {"wavelength_nm": [380, 780], "value": [0.2, 0.8]}
INDEX = {"wavelength_nm": [380, 780], "n": [1.6, 1.5]}
SURFACES: dict[str, Any] = {
    "polished": {"kind": "fresnel"},
    "white": {"kind": "lambertian", "reflectance": [0.9, 0.5, 0.1]},
    "tinted": {"kind": "mirror", "reflectance": TABLE},
    "shares": {"kind": "coefficients", "diffuse_reflectance": TABLE},
    "angles": {
        "kind": "coefficients",
        "specular_reflectance": {"angle_deg": [0, 90], "wavelength_nm": [380, 780], "value": [[0.1, 0.1], [1, 1]]},
    },
    "angles only": {"kind": "coefficients", "specular_reflectance": {"angle_deg": [0, 90], "value": [[0.1], [1]]}},
    "mixed": {"kind": "mixture", "parts": [{"weight": 0.5, "surface": "white"}, {"weight": 0.5, "surface": "tinted"}]},
    "unmixed": {"kind": "mixture", "parts": [{"weight": 1, "surface": "white"}, {"weight": 0, "surface": "tinted"}]},
}
MEDIA: dict[str, Any] = {
    "clear": {"refractive_index": 1.5, "absorption_per_mm": [0.1, 0.2, 0.3]},
    "dye": {"refractive_index": 1.5, "absorption_per_mm": TABLE},
    "milk": {"refractive_index": 1.5, "scattering": [{"coefficient_per_mm": 1}, {"coefficient_per_mm": TABLE}]},
    "flint": {"refractive_index": INDEX},
    "gold": {"refractive_index": 0.2, "extinction": TABLE},
    "silver": {"refractive_index": {"wavelength_nm": [380, 780], "n": [0.2, 0.1]}, "extinction": 3},
    "grey metal": {"refractive_index": 2.0, "extinction": 3},
}


def needed(
    surface: str = "polished", medium: str = "clear", spectrum: Any = None, **more: Any
) -> dict[str, tuple[str, ...]]:
    source = {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 9]} | ({"spectrum": spectrum} if spectrum else {})
    body = {"geometry": {"file": "a.ply"}, "medium": medium, "surface": surface}
    data = {
        "format": "raymaps-scene", "version": 1, "surfaces": SURFACES, "media": MEDIA, "bodies": {"Part": body},
        "sources": {"Lamp": source}, **more,
    }  # fmt: skip
    effects = needed_effects(Scene.model_validate(data))
    return {name: because for name, because in effects.items() if name in ("spectral", "dispersion")}


@pytest.mark.parametrize("surface", ["polished", "white", "angles only", "unmixed"])
@pytest.mark.parametrize("medium", ["clear", "grey metal"])
def test_a_scene_without_wavelengths_stays_red_green_and_blue(surface, medium):
    """Tables that no light can meet count for nothing."""
    assert needed(surface, medium) == {}


@pytest.mark.parametrize(
    "spectrum",
    [
        {"kind": "illuminant", "name": "D65"},
        {"kind": "black_body", "temperature_k": 3000},
        {"kind": "lines", "wavelength_nm": [532]},
        {"kind": "table", "wavelength_nm": [400, 700], "value": [1, 1]},
    ],
)
def test_a_spectrum_of_a_source_calls_for_spectra(spectrum):
    assert needed(spectrum=spectrum) == {"spectral": ("spectrum of source 'Lamp'",)}


@pytest.mark.parametrize("surface", ["tinted", "shares", "angles", "mixed"])
def test_a_table_of_a_surface_calls_for_spectra(surface):
    assert needed(surface) == {"spectral": (f"surface '{surface}' of body 'Part' depends on wavelength",)}


@pytest.mark.parametrize("medium", ["dye", "milk", "gold", "silver"])
def test_a_table_of_a_medium_calls_for_spectra(medium):
    """And metals are not refracted into, so they do not disperse."""
    assert needed(medium=medium) == {"spectral": (f"medium '{medium}' of body 'Part' depends on wavelength",)}


def test_an_index_over_wavelength_calls_for_both():
    assert needed(medium="flint") == {
        "spectral": ("dispersion: medium 'flint' of body 'Part'",),
        "dispersion": ("medium 'flint' of body 'Part'",),
    }


def test_the_medium_around_all_counts():
    around = needed(ambient="flint")
    assert around["dispersion"] == ("medium 'flint' of the space around the bodies",)


def test_switched_off_dispersion_calls_for_no_spectra():
    assert needed(medium="flint", settings={"without": ["dispersion"]}) == {}


def test_switched_off_spectra_leave_dispersion():
    assert set(needed(medium="flint", settings={"without": ["spectral"]})) == {"dispersion"}
