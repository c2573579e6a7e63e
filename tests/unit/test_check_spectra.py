# SPDX-License-Identifier: LGPL-2.1-or-later
"""What `raymaps check` says of spectra that reach beyond what is simulated; single wavelengths of ray files."""

from __future__ import annotations

import numpy as np
import pytest

from raymaps.bands import spectral_bands
from raymaps.check import check_scene
from raymaps.formats.ray_set import RaySet
from raymaps.ray_sets import light_of_rays, lines_of_rays
from raymaps.scene import EmissionTable, Scene
from tests.physics.scenes import disc_source, write_scene


def test_a_spectrum_that_is_cut_is_told(tmp_path):
    """A rectangle from 680 to 980 nm: a third lies below 780 nm."""
    table = {"kind": "table", "wavelength_nm": [680, 980], "value": [1, 1]}
    lamp = {**disc_source((0, 0, 0), (0, 0, 1), 1.0), "spectrum": table}
    scene = write_scene(tmp_path, {}, sources={"Lamp": lamp})
    texts = [finding.text for finding in check_scene(scene)]
    assert any("'Lamp': 67 % of its spectrum lies outside of 380 to 780 nm" in text for text in texts)
    whole = write_scene(tmp_path, {}, name="whole", sources={"Lamp": lamp}, settings={"spectrum": {"to_nm": 1000}})
    assert not any("of its spectrum" in finding.text for finding in check_scene(whole))


@pytest.mark.parametrize(
    ("low", "high", "share"), [(400, 500, 1.0), (0, 1000, 1.0), (450, 500, 0.75), (400, 450, 0.25), (500, 600, 0.0)]
)
def test_share_of_a_table(low, high, share):
    """A ramp from 0 at 400 nm to its height at 500 nm."""
    assert EmissionTable(wavelength_nm=(400, 500), value=(0, 1)).share_within(low, high) == pytest.approx(share)


def test_wavelengths_of_rays_have_bands_of_their_own():
    """So that lumens and coefficients are those of the wavelength: 632.8 nm in single precision."""
    nm = np.float32([632.8, 532.0, 632.8])
    rays = RaySet(np.zeros((3, 3)), np.tile([0.0, 0.0, 1.0], (3, 1)), np.ones(3), wavelength_nm=nm)
    source = {"kind": "rays", "flux_w": 1.0, "file": "r.dat"}
    scene = Scene.model_validate({"format": "raymaps-scene", "version": 1, "sources": {"R": source}})
    lines = lines_of_rays(scene, {"R": rays})
    assert lines == (532.0, float(np.float32(632.8)))
    bands = spectral_bands(scene, lines)
    light = light_of_rays(scene.sources["R"], rays, bands)
    for row, wavelength in zip(light.of_ray, nm, strict=True):
        band = int(np.argmax(light.light[row]))
        assert bands.low_nm[band] == bands.high_nm[band] == wavelength
