# SPDX-License-Identifier: LGPL-2.1-or-later
"""Detectors on faces and of the far field, lumens, and effects that are switched off, by the command and the server."""

import csv
import io
import json
import math

import pytest

from raymaps.formats.luminaire_files import read_luminaire
from raymaps.run import simulate
from raymaps.serve import serve
from tests.physics.scenes import body, box, rectangle, write_scene

D65 = {"kind": "illuminant", "name": "D65"}


def made(folder, spectrum, **settings):
    """A map of a grey plate, a point above it and a glass block between; names with blanks."""
    lamp = {"kind": "point", "flux_w": 2, "position_mm": [0, 0, 9], **({"spectrum": spectrum} if spectrum else {})}
    index = {"formula": "cauchy", "coefficients": [1.5, 0.005]} if spectrum else 1.5
    scene = write_scene(
        folder,
        {"Plate": body(box((-10, -10, -1), (10, 10, 0)), "grey"),
         "Block": body(box((-3, -3, 2), (3, 3, 5)), "clear", "glass")},
        surfaces={"grey": {"kind": "lambertian", "reflectance": 0.5}, "clear": {"kind": "fresnel"}},
        media={"glass": {"refractive_index": index, "absorption_per_mm": 0.02}},
        sources={"Lamp": lamp}, settings=settings,
        detectors={"On top": {"kind": "face", "body": "Plate", "faces": ["+z"]},
                   "Far": {"kind": "far_field", "axis": [0, 0, 1]}, "Flat": rectangle((0, 0, 1), 20, 20)},
    )  # fmt: skip
    path = folder / "m.raymap"
    simulate(scene, path, rays=4000, portion_rays=1500, store="spectral" if spectrum else "rgb")
    return path


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return made(tmp_path_factory.mktemp("plain"), None)


@pytest.fixture(scope="module")
def coloured(tmp_path_factory):
    return made(tmp_path_factory.mktemp("coloured"), D65, without=["medium_absorption"])


@pytest.mark.parametrize("name", ["On top", "Far"])
def test_other_conditions(plain, raymaps, name):
    whole = raymaps("detector", plain, name, "--json").data
    assert whole["flux_w"] > 0
    assert whole["flux_stderr_w"] > 0
    assert whole["crossings"] >= whole["rays"] > 0
    fine = raymaps("detector", plain, name, "--resolution", "7x5", "--json").data
    assert fine["flux_w"] == pytest.approx(whole["flux_w"], rel=1e-12)
    assert fine["flux_stderr_w"] == pytest.approx(whole["flux_stderr_w"], rel=1e-12)
    narrow = raymaps("detector", plain, name, "--max-angle", 40, "--json").data
    assert 0 < narrow["flux_w"] < whole["flux_w"]
    through, beside = (
        raymaps("detector", plain, name, "--where", where, "--json").data["flux_w"]
        for where in ("hit(Block)", "~hit(Block)")
    )
    assert through + beside == pytest.approx(whole["flux_w"], rel=1e-12)
    assert raymaps("query", plain, f'detector("{name}")', "--json").data["rays"] == whole["rays"]


@pytest.mark.parametrize("name", ["On top", "Far"])
@pytest.mark.parametrize("region", [("--rect=-1,-1,1,1",), ("--ellipse", "0,0,1,1")])
def test_regions_are_those_of_rectangles(plain, raymaps, name, region):
    assert "can only be cut out of a rectangle" in raymaps("detector", plain, name, *region).sentence
    area = region[0].removeprefix("--").split("=")[0]
    assert "of a rectangle" in raymaps("query", plain, f'detector("{name}", {area}=(-1,-1,1,1))').sentence


def test_files_of_the_far_field(plain, raymaps, tmp_path):
    data = raymaps("detector", plain, "Far", "--resolution", "8x18", "-o", tmp_path / "far.csv", "--json").data
    text = (tmp_path / "far.csv").read_text(encoding="utf-8")
    rows = list(
        csv.DictReader(io.StringIO("".join(line for line in text.splitlines(True) if not line.startswith("#"))))
    )
    told = {(float(r["c_deg"]), float(r["gamma_deg"])): float(r["intensity_w_per_sr"]) for r in rows}
    for suffix in ("ies", "ldt"):
        path = tmp_path / f"far.{suffix}"
        assert raymaps("detector", plain, "Far", "--resolution", "8x18", "-o", path).code == 0
        # red, green and blue tell no lumens: 2 W of the lamp count as 1000 lm, and the file says so
        assert "2 W emitted count as 1000 lm" in path.read_text()
        table = read_luminaire(path)
        for c, row in zip(table["c_deg"], table["candela"], strict=True):
            for gamma, candela in zip(table["gamma_deg"], row, strict=True):
                assert candela == pytest.approx(500 * told[c % 360, gamma], abs=1e-5 * 500 * data["max_w_per_sr"])
    assert raymaps("detector", plain, "Flat", "-o", tmp_path / "flat.ies").sentence.endswith(".png, .csv, .npz.")


def test_lumens(coloured, raymaps, tmp_path):
    for name, keys in (("On top", "lx"), ("Flat", "lx"), ("Far", "cd")):
        data = raymaps("detector", coloured, name, "--json").data
        # D65 from 380 to 780 nm: 205.15 lm/W (tests/physics/test_photometry.py)
        assert abs(data["flux_lm"] - 205.15 * data["flux_w"]) < 5 * data["flux_stderr_lm"]
        assert 0 < data["flux_stderr_lm"] < 0.2 * data["flux_lm"]
        assert {f"{figure}_{keys}" for figure in ("mean", "min", "max")} <= set(data)
        assert math.fsum(data["spectrum"]["flux_w"]) == pytest.approx(data["flux_w"], rel=1e-6)
        text = raymaps("detector", coloured, name).out
        assert " lm" in text
        assert f"{keys}\n" in text
    data = raymaps("detector", coloured, "Far", "-o", tmp_path / "far.ies", "--json").data
    assert "absolute photometry" in (tmp_path / "far.ies").read_text()
    assert max(map(max, read_luminaire(tmp_path / "far.ies")["candela"])) == pytest.approx(data["max_cd"], rel=1e-5)


def test_wavelengths(coloured, plain, raymaps):
    narrowed = raymaps("query", coloured, "hit(Block)", "--json").data["rays"]  # its index depends on wavelength
    assert raymaps("query", coloured, "wavelength(1, 10000)", "--json").data["rays"] == narrowed > 0
    parts = [
        raymaps("query", coloured, f"wavelength({a}, {b})", "--json").data["rays"] for a, b in ((1, 550), (550, 9999))
    ]
    assert sum(parts) == narrowed
    assert raymaps("query", plain, "wavelength(1, 10000)", "--json").data["rays"] == 0
    history = raymaps("report", coloured, "--where", "wavelength(500, 600)", "--limit", 1, "--json").data["rays"][0]
    assert 500 <= history["wavelength_nm"] <= 600
    assert (
        f"{history['wavelength_nm']:.5g} nm"
        in raymaps("report", coloured, "--where", "wavelength(500, 600)", "--limit", 1).out
    )


def test_effects_that_are_off_are_told_everywhere(coloured, plain, raymaps, tmp_path):
    assert raymaps("info", coloured, "--json").data["without"] == ["medium_absorption"]
    assert raymaps("info", plain, "--json").data["without"] == []
    for arguments in (
        ("info",),
        ("report", "--limit", 1),
        ("detector", "Far"),
        ("detector", "Flat"),
        ("detector", "On top"),
    ):
        command, *rest = arguments
        options = rest[1:] if command == "detector" else rest
        names = rest[:1] if command == "detector" else []
        for map_, off in ((coloured, True), (plain, False)):
            assert ("medium_absorption" in raymaps(command, map_, *names, *options).out) == off, arguments
    page = tmp_path / "view.html"
    raymaps("view", coloured, "-o", page)
    assert "without medium_absorption" in page.read_text(encoding="utf-8")


def test_the_server_answers_alike(plain, raymaps, tmp_path):
    asked = [
        {"jsonrpc": "2.0", "id": 1, "method": "detector", "params": {"name": "Far", "resolution": [6, 6],
                                                                     "file": str(tmp_path / "far.ldt")}},
        {"jsonrpc": "2.0", "id": 2, "method": "detector", "params": {"name": "On top", "max_angle_deg": 30}},
        {"jsonrpc": "2.0", "id": 3, "method": "detector", "params": {"name": "On top", "rect": [0, 0, 1, 1]}},
    ]  # fmt: skip
    answers = io.StringIO()
    serve(plain, io.StringIO("\n".join(map(json.dumps, asked))), answers)
    far, top, refused = map(json.loads, answers.getvalue().splitlines())
    assert far["result"] == raymaps("detector", plain, "Far", "--resolution", "6x6", "--json").data
    assert (tmp_path / "far.ldt").stat().st_size > 500
    assert top["result"] == raymaps("detector", plain, "On top", "--max-angle", 30, "--json").data
    assert "one of faces" in refused["error"]["message"]
