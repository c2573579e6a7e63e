# SPDX-License-Identifier: LGPL-2.1-or-later
"""Lumens, lux and candela of spectral simulations, from the tables of the CIE."""

import csv
import json
import math
import warnings

import numpy as np
import pytest

from raymaps import evaluate_detector
from raymaps.results.report import report
from raymaps.run import simulate
from tests.physics.scenes import Histories, agrees, body, box, disc_source, rectangle, write_scene

KM = 683.0  # lm/W of light of 540 THz (BIPM: The International System of Units, 9th edition)


def cie_tables():
    """V(lambda) of CIE 1924 and the relative spectrum of D65, both by 1 nm from 380 to 780 nm, of the CIE."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour
    nm = np.arange(380.0, 781.0)
    v, d65 = colour.SDS_LEFS["CIE 1924 Photopic Standard Observer"], colour.SDS_ILLUMINANTS["D65"]
    return nm, np.interp(nm, v.wavelengths, v.values), np.interp(nm, d65.wavelengths, d65.values)


def spectral(folder, spectrum, *, bodies=None, rays=20_000, store="rgb", **sections):
    scene = write_scene(
        folder, bodies or {}, sources={"S": {"kind": "point", "flux_w": 2.0, "position_mm": [0, 0, 0],
                                             "spectrum": spectrum}}, **sections,
    )  # fmt: skip
    return Histories(simulate(scene, folder / "m.raymap", rays=rays, seed=1, threads=2, store=store))


@pytest.mark.parametrize("store", ["rgb", "spectral"])
def test_light_of_555_nm(tmp_path, store):
    """683 lm/W (V(555 nm) = 1): lumens, lux on a rectangle, and candela of an isotropic point, flux / 4 pi."""
    h = spectral(
        tmp_path, {"kind": "lines", "wavelength_nm": [555.0]}, store=store,
        detectors={"R": rectangle((0, 0, 10), 8, 5, side="back", resolution=[4, 5]), "Far": {"kind": "far_field"}},
    )  # fmt: skip
    flat, far = evaluate_detector(h.raymap, "R"), evaluate_detector(h.raymap, "Far")
    for found in (flat, far):
        assert found.flux_lm.value == pytest.approx(KM * found.flux_w.value, rel=1e-6)
        assert found.flux_lm.stderr == pytest.approx(KM * found.flux_w.stderr, rel=1e-6)
    # lx are lm per m²
    assert flat.mean_lx.value == pytest.approx(KM * flat.flux_w.value / 40e-6, rel=1e-6)
    assert flat.max_lx.value == pytest.approx(KM * flat.max_w_per_mm2.value * 1e6, rel=1e-6)
    assert flat.max_lx.stderr == pytest.approx(KM * flat.max_w_per_mm2.stderr * 1e6, rel=1e-6)
    assert far.flux_lm.value == pytest.approx(2 * KM, rel=1e-6)
    assert far.flux_lm.stderr == pytest.approx(2 * KM / 20_000, rel=1e-6)  # all rays left: the error is that of one
    assert far.mean_cd.value == pytest.approx(2 * KM / (4 * math.pi), rel=1e-6)
    assert far.intensity_cd == pytest.approx(KM * far.intensity_w_per_sr, rel=1e-6)
    data = flat.to_dict()
    assert {"flux_lm", "flux_stderr_lm", "mean_lx", "min_lx", "max_lx", "max_stderr_lx"} <= set(data)
    assert {"flux_lm", "max_cd", "min_stderr_cd"} <= set(far.to_dict())
    assert ("spectrum" in data) == (store == "spectral")
    assert "lm" in flat.to_text()
    assert "lx" in flat.to_text()
    assert "cd" in far.to_text()


def test_luminous_efficacy_of_d65(tmp_path):
    """683 lm/W times the integral of D65 V over that of D65, 380 to 780 nm: 205 lm/W."""
    nm, v, d65 = cie_tables()
    expected = KM * np.trapezoid(d65 * v, nm) / np.trapezoid(d65, nm)
    assert 200 < expected < 230
    h = spectral(
        tmp_path, {"kind": "illuminant", "name": "D65"}, store="spectral", detectors={"Far": {"kind": "far_field"}}
    )
    far = evaluate_detector(h.raymap, "Far")
    # V is averaged over bands of 12.5 nm in which D65 is taken as even
    assert far.flux_lm.value / far.flux_w.value == pytest.approx(expected, rel=2e-3)
    assert far.spectrum.flux_w.sum() == pytest.approx(2.0, rel=1e-6)
    # all rays left, with all of their bands: the errors are those of one
    assert far.flux_lm.stderr == pytest.approx(far.flux_lm.value / 20_000, rel=1e-6)
    assert far.spectrum.stderr_w == pytest.approx(far.spectrum.flux_w / 20_000, rel=1e-6)
    shares = np.array(
        [np.trapezoid(np.interp(x := np.linspace(low, high, 200), nm, d65), x)
         for low, high in zip(far.spectrum.low_nm, far.spectrum.high_nm, strict=True)]
    )  # fmt: skip
    assert far.spectrum.flux_w == pytest.approx(2.0 * shares / shares.sum(), rel=2e-3)
    assert far.spectrum.density_w_per_nm[0] == pytest.approx(far.spectrum.flux_w[0] / 12.5, rel=1e-9)


def test_lumens_do_not_depend_on_what_is_stored(tmp_path):
    """Two lines, the second invisible: lumens on faces, with colours or spectra stored."""
    lines = {"kind": "lines", "wavelength_nm": [589.0, 950.0], "share": [1, 3]}
    found = {}
    for store in ("rgb", "spectral"):
        h = spectral(
            tmp_path / store, lines, store=store, rays=5_000, bodies={"P": body(box((-5, -5, 4), (5, 5, 5)), "grey")},
            surfaces={"grey": {"kind": "lambertian", "reflectance": 0.4}},
            detectors={"In": {"kind": "face", "body": "P"},
                       "Kept": {"kind": "face", "body": "P", "measure": "absorbed"}},
        )  # fmt: skip
        found[store] = [evaluate_detector(h.raymap, name) for name in ("In", "Kept")]
    nm, v, _ = cie_tables()
    v589 = float(np.interp(589.0, nm, v))
    for colours, spectra in zip(*found.values(), strict=True):
        assert colours.flux_lm.value == pytest.approx(spectra.flux_lm.value, rel=1e-6)
        assert colours.flux_lm.stderr == pytest.approx(spectra.flux_lm.stderr, rel=1e-6)
        assert colours.mean_lx.value == pytest.approx(spectra.mean_lx.value, rel=1e-6)
        assert spectra.flux_lm.value == pytest.approx(KM * v589 * spectra.flux_w.value / 4, rel=1e-6)
        assert spectra.spectrum.flux_w == pytest.approx(spectra.flux_w.value * np.array([0.25, 0.75]), rel=1e-6)
        assert colours.spectrum is None
        assert spectra.spectrum.stderr_w[0] == pytest.approx(0.25 * spectra.flux_w.stderr, rel=1e-6)
        assert np.isnan(spectra.spectrum.density_w_per_nm).all()  # single wavelengths have no width
    incident, absorbed = found["spectral"]
    agrees("absorbed share", absorbed.flux_lm.value, absorbed.flux_lm.stderr, 0.6 * incident.flux_lm.value)


def test_spectrum_through_a_filter(tmp_path):
    """Beer-Lambert through 3 mm of a medium whose absorption climbs with wavelength: band by band on a rectangle."""
    table = {"wavelength_nm": [380, 780], "value": [0.0, 0.4]}
    scene = write_scene(
        tmp_path, {}, ambient="dye", media={"dye": {"refractive_index": 1.0, "absorption_per_mm": table}},
        sources={"S": {**disc_source((0, 0, 3), (0, 0, -1), 1), "spectrum": {"kind": "illuminant", "name": "E"}}},
        detectors={"R": rectangle((0, 0, 0), 3, 3)}, settings={"spectrum": {"bands": 8}},
    )  # fmt: skip
    h = Histories(simulate(scene, tmp_path / "m.raymap", rays=100_000, seed=1, threads=2, store="spectral"))
    found = evaluate_detector(h.raymap, "R")
    middle = (found.spectrum.low_nm + found.spectrum.high_nm) / 2
    expected = np.exp(-3 * 0.4 * (middle - 380) / 400) / 8
    # all bands share the error of the number of rays that get through
    relative = found.flux_w.stderr / found.flux_w.value
    agrees("spectrum", found.spectrum.flux_w, relative * expected, expected, rounding=1e-3)
    assert found.spectrum.flux_w.sum() == pytest.approx(found.flux_w.value, rel=1e-6)


def test_files_and_reports_of_spectral_maps(tmp_path):
    h = spectral(
        tmp_path, {"kind": "lines", "wavelength_nm": [555.0]}, store="spectral", rays=2_000,
        bodies={"P": body(box((-5, -5, 4), (5, 5, 5)), "black")}, surfaces={"black": {"kind": "absorber"}},
        detectors={"R": rectangle((0, 0, 3), 8, 5, side="back", resolution=[4, 5]), "Far": {"kind": "far_field"},
                   "P": {"kind": "face", "body": "P"}},
        settings={"without": ["mixture"]},
    )  # fmt: skip
    for name, column in (("R", "flux_lm"), ("P", "flux_lm"), ("Far", "intensity_cd")):
        found = evaluate_detector(h.raymap, name)
        text = found.write(tmp_path / f"{name}.csv").read_text(encoding="utf-8")
        assert '# without: ["mixture"]' in text
        rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
        if column == "flux_lm":
            total = math.fsum(float(row[column]) for row in rows)
        else:
            total = math.fsum(float(row[column]) * float(row["solid_angle_sr"]) for row in rows)
        assert total == pytest.approx(found.flux_lm.value, rel=1e-9)
        with np.load(found.write(tmp_path / f"{name}.npz")) as arrays:
            assert arrays["spectrum_flux_w"] == pytest.approx([found.flux_w.value], rel=1e-6)
            assert json.loads(str(arrays["figures"])) == found.to_dict()
        assert "without     mixture" in found.to_text()
    told = report(h.raymap, limit=3)
    event = told.rays[0].events[0]
    assert event.flux_left_lm == pytest.approx(KM * event.flux_left_w, rel=1e-6)
    assert "without    mixture (switched off)" in told.to_text()
    assert "# without: mixture (switched off)" in told.to_csv()
    assert "mixture (switched off)" in told.to_html()
    assert "in lumens" in told.to_html()
    assert "flux_left_lm" in told.to_csv()
