# SPDX-License-Identifier: LGPL-2.1-or-later
"""Tables of scattering: their checks in words, what is lowered, and the kernel's parts against the slow reference."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from raymaps.bands import RGB_BANDS
from raymaps.effects import needed_effects
from raymaps.effects.bsdf import bsdf_per_sr, frame, lower_tables, needed_by, shares
from raymaps.errors import SceneError
from raymaps.kernels import bsdf as kernel
from raymaps.materials.bsdf import BsdfTable
from raymaps.materials.bsdf_directions import BsdfAngles, BsdfCells
from raymaps.scene import scene_from_dict
from tests.bsdf_texts import csv, grid_rows, is_one_sentence, klems, klems_matrix, table_of
from tests.physics.surface_bench import lowered, scene_with, spectrum

CELLS = {"ring_deg": [0, 45, 90], "azimuth_deg": [[0, 360], [-90, 90, 270]]}
LOBE = {
    "comes_from": "front",
    "goes_to": "reflection",
    "incoming": {"polar_deg": [0, 60]},
    "outgoing": [CELLS],
    "value": [[[0.1, 0.1, 0.2], [0.2, 0.1, 0.1]]],
    "specular": [[0.1, 0.2]],
}


def changed(**fields):
    return {"lobes": [{**LOBE, **fields}]}


FAULTS = {
    "no lobes": ({"lobes": []}, "at least 1 item"),
    "rings that end early": (changed(outgoing=[{**CELLS, "ring_deg": [0, 45, 80]}]), "must be from 0 to 90"),
    "rings out of order": (changed(outgoing=[{**CELLS, "ring_deg": [0, 95, 90]}]), "ring_deg must climb"),
    "a ring too few": (changed(outgoing=[{**CELLS, "azimuth_deg": [[0, 360]]}]), "2 rings need as many rows"),
    "sectors with a gap": (changed(outgoing=[{**CELLS, "azimuth_deg": [[0, 360], [0, 300]]}]), "must go once around"),
    "sectors out of order": (changed(outgoing=[{**CELLS, "azimuth_deg": [[0, 360], [0, 9, 5, 360]]}]), "must climb"),
    "incidence past the horizon": (changed(incoming={"polar_deg": [0, 95]}), "polar_deg must be from 0 to 90"),
    "azimuths of incidence": (changed(incoming={"polar_deg": [0, 60], "azimuth_deg": [[0]]}), "2 polar angles need"),
    "azimuths past a turn": (changed(incoming={"polar_deg": [0, 60], "azimuth_deg": [[0], [400]]}), "to below 360"),
    "rows too few": (changed(value=[[[0.1, 0.1, 0.1]]]), "2 incoming directions need as many rows of value, got 1"),
    "numbers too few": (changed(value=[[[0.1, 0.1], [0.1, 0.1, 0.1]]]), "3 outgoing cells need as many numbers, got 2"),
    "sets of cells": (changed(outgoing=[CELLS] * 3), "1 or 2 sets of outgoing cells, got 3"),
    "negative": (changed(value=[[[0.1, 0.1, -0.2], [0.2, 0.1, 0.1]]]), "greater than or equal to 0"),
    "specular shares": (changed(specular=[[0.1]]), "specular must hold 1 row(s) of 2 shares"),
    "two layers": (changed(value=LOBE["value"] * 2, specular=None), "1 layer, or 3 for red, green and blue, got 2"),
    "layers and wavelengths": ({**changed(), "wavelength_nm": [400, 500]}, "2 layer(s), one for each"),
    "wavelengths out of order": (
        {**changed(value=LOBE["value"] * 2, specular=None), "wavelength_nm": [500, 400]}, "wavelength_nm must climb",
    ),
    "twice": ({"lobes": [LOBE, LOBE]}, "reflection of light from the front is given twice"),
    "angles and cells": (
        {
            "lobes": [
                {**LOBE, "goes_to": "transmission"},
                {**LOBE, "incoming": CELLS, "value": [[[0] * 3] * 3], "specular": None},
            ]
        },
        "for angles or for cells",
    ),
    "axis without length": ({**changed(), "x_axis": [0, 0, 0]}, "a length above zero"),
}  # fmt: skip


def test_the_table_of_the_faults_is_good_itself():
    assert BsdfTable.model_validate(changed()).lobe("front", "reflection").is_isotropic


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_told(fault):
    data, expected = FAULTS[fault]
    with pytest.raises(ValidationError) as error:
        BsdfTable.model_validate(data)
    messages = [str(one["msg"]) for one in error.value.errors(include_url=False)]
    assert any(expected in message for message in messages), messages


def test_a_table_that_creates_light_is_refused_where_it_does_so_most(tmp_path):
    """Two lobes with angles of their own: at 40 degrees 0.4 is reflected and 0.7 transmitted, elsewhere it is less."""

    def flat(share):
        return f"{share / math.pi:.9f}"

    reflection = [f"{i},{s},{flat(r)}" for i, r in ((0, 0.0), (80, 0.8)) for s in (0, 80)]
    transmission = [f"{i},{s},{flat(t)},{flat(t / 2)}" for i, t in ((0, 0.9), (40, 0.7), (80, 0.0)) for s in (0, 80)]
    columns = "theta_i,theta_s,500nm,600nm"
    text = csv([f"{row},{row.rpartition(',')[2]}" for row in reflection], columns) + csv(
        transmission, columns, ("to: transmission",)
    )
    with pytest.raises(ValidationError) as error:
        table_of(text, tmp_path)
    told = str(error.value.errors(include_url=False)[0]["msg"])
    assert "of light from the front at 40 degrees, 500 nm, 1.1 times as much goes on (0.4 reflection + 0.7" in told
    assert is_one_sentence(told)
    rows = [f"0,{s},{flat(1.0 + 4e-7)}" for s in (0, 80)]  # what rounding to six digits does is let pass
    assert table_of(csv(rows, "theta_i,theta_s,bsdf"), tmp_path)
    rows = [f"0,{s},{flat(0.9)}" for s in (0, 80)] + ["0,specular,0.100003"]
    with pytest.raises(ValidationError, match=r"at 0 degrees, 1\.000003 times as much"):
        table_of(csv(rows, "theta_i,theta_s,bsdf"), tmp_path)


def test_energy_between_azimuths_is_looked_at():
    """Two anisotropic lobes whose sum is above 1 only at an azimuth that one of them names."""
    cells = {"ring_deg": [0, 90], "azimuth_deg": [[0, 360]]}
    lobes = [
        {
            "comes_from": "front",
            "goes_to": way,
            "incoming": {"polar_deg": [50], "azimuth_deg": [azimuths]},
            "outgoing": [cells],
            "value": [[[share / math.pi] for share in row]],
        }
        for way, azimuths, row in (("reflection", [0, 180], [0.2, 0.8]), ("transmission", [90, 270], [0.6, 0.1]))
    ]
    with pytest.raises(ValidationError, match=r"at 50 degrees, azimuth 180 degrees|at 50 degrees, azimuth 90 degrees"):
        BsdfTable.model_validate({"lobes": lobes})


def test_faults_of_files_are_told_with_the_surface(tmp_path):
    (tmp_path / "bright.csv").write_text(csv(grid_rows(lambda i, s, p: "0.5")))
    data = scene_with({"kind": "absorber"}).model_dump()
    data["surfaces"]["tested"] = {"kind": "bsdf", "data": {"file": "bright.csv"}}
    with pytest.raises(
        SceneError, match=r"surfaces 'tested', data: the table creates light: of light from the front at"
    ):
        scene_from_dict(data, folder=tmp_path)
    data["surfaces"]["tested"]["data"] = {"file": "none.csv"}
    with pytest.raises(SceneError, match=r"surfaces 'tested', data: .*none\.csv': there is no such file"):
        scene_from_dict(data, folder=tmp_path)


def test_a_scene_holds_the_table_itself(tmp_path):
    """Written and read again it is the same table, without the file."""
    (tmp_path / "dull.csv").write_text(csv(grid_rows(lambda i, s, p: f"{0.1 + s / 1000}")))
    data = scene_with({"kind": "absorber"}).model_dump()
    data["surfaces"]["tested"] = {"kind": "bsdf", "data": {"file": "dull.csv", "x_axis": [0, 1, 0]}}
    scene = scene_from_dict(data, folder=tmp_path)
    again = scene_from_dict(scene.model_dump(mode="json"), folder=tmp_path / "elsewhere")
    assert again.surfaces["tested"] == scene.surfaces["tested"]
    assert again.surfaces["tested"].data.x_axis == (0, 1, 0)


def test_who_needs_it(tmp_path):
    surface = {"kind": "bsdf", "data": table_of(csv(grid_rows(lambda i, s, p: "0.1")), tmp_path).model_dump()}
    assert needed_by(scene_with(surface)) == ("surface 'tested' of body 'Part'",)
    assert needed_by(scene_with({"kind": "absorber"}, surfaces={"other": surface})) == ()
    assert set(needed_effects(scene_with(surface))) == {"bsdf"}
    spectral = table_of(csv(grid_rows(lambda i, s, p: "0.1"), "theta_i,theta_s,phi_s,550nm"), tmp_path, outside="clamp")
    assert "spectral" in needed_effects(scene_with({"kind": "bsdf", "data": spectral.model_dump()}))


def test_wavelengths_outside_a_table_are_refused_or_clamped(tmp_path):
    text = csv(grid_rows(lambda i, s, p: "0.1,0.2"), "theta_i,theta_s,phi_s,450nm,650nm")
    bands = spectrum(400, 700, 3)
    surface = {"kind": "bsdf", "data": table_of(text, tmp_path).model_dump()}
    with pytest.raises(SceneError, match=r"Surface 'tested', data: the table holds from 450 to 650 nm.*clamp"):
        lowered("bsdf", scene_with(surface), bands)
    surface["data"]["outside"] = "clamp"
    scattered = lowered("bsdf", scene_with(surface), bands).scattered
    # linear from 450 to 650, constant beyond: means over 400-500, 500-600, 600-700 by hand
    assert scattered[0] == pytest.approx(np.array([0.10625, 0.15, 0.19375]) * math.pi, rel=1e-3)


def anisotropic(tmp_path):
    rows = [
        f"{t},{i},{s},{(i + p) % 360},{0.05 + 0.0001 * i + 0.001 * t:.6f}"
        for t in (20, 60) for i in (0, 100, 250) for s in (0, 50, 80) for p in (0, 120, 240)
    ]  # fmt: skip
    return table_of(csv(rows, "theta_i,phi_i,theta_s,phi_s,bsdf"), tmp_path)


def blind(tmp_path):
    matrix = np.random.default_rng(1).uniform(0, 0.15, (41, 41))
    return table_of(klems({"Transmission Front": matrix, "Reflection Front": matrix.T}), tmp_path, "blind.xml")


def isotropic(tmp_path):
    return table_of(csv(grid_rows(lambda i, s, p: f"{0.05 + (i + s + p) / 5000:.6f}", (10, 50, 75))), tmp_path)


@pytest.mark.parametrize("make", [anisotropic, blind, isotropic])
def test_the_kernel_finds_the_directions_of_incidence_of_the_reference(tmp_path, make):
    table = make(tmp_path)
    data = lower_tables({"s": table}, ("s",), RGB_BANDS, np.zeros(1, bool))
    rng = np.random.default_rng(3)
    polars = [0, 10, 20, 50, 60, 75, 90, *rng.uniform(0, 90, 200)]
    azimuths = [0, 100, 250, 359.9, 100, -170, 45, *rng.uniform(-180, 180, 200)]
    index, weight = np.zeros(4, np.int64), np.zeros(4)
    for number, lobe in enumerate(table.lobes):
        first = data.direction_start[data.ring_start[number]]
        for polar, azimuth in zip(polars, azimuths, strict=True):
            count = kernel.incidence(data, number, math.radians(polar), math.radians(azimuth), index, weight)
            found, expected = np.zeros(len(lobe.incoming)), np.zeros(len(lobe.incoming))
            np.add.at(found, index[:count] - first, weight[:count])
            for i, part in lobe.incoming.weights(polar, azimuth):
                expected[i] += part
            assert found == pytest.approx(expected, abs=1e-9), (polar, azimuth)
            assert found.sum() == pytest.approx(1)


@pytest.mark.parametrize("make", [anisotropic, blind, isotropic])
def test_lowered_shares_are_those_of_the_reference(tmp_path, make):
    table = make(tmp_path)
    data = lower_tables({"s": table}, ("s",), RGB_BANDS, np.zeros(1, bool))
    for way, number in enumerate(data.lobe[0, 0]):
        name = ("reflection", "transmission")[way]
        if number < 0:
            assert table.lobe("front", name) is None
            continue
        for polar, azimuth in ((3, 20), (47, 170), (86, 300)):
            index, weight = np.zeros(4, np.int64), np.zeros(4)
            count = kernel.incidence(data, number, math.radians(polar), math.radians(azimuth), index, weight)
            share = sum(weight[k] * data.scattered[index[k]] for k in range(count))
            assert share == pytest.approx(np.full(3, shares(table, "front", (polar, azimuth))[f"diffuse {name}"]))
            last = data.value_start[index[:count] + 1] - 1
            assert data.cumulated[last, 0] == pytest.approx(data.scattered[index[:count], 0])


def test_the_bsdf_of_the_reference_integrates_to_its_shares(tmp_path):
    """Midpoint rule over the hemisphere, fine enough for 1 in 1000."""
    n, m = 90, 120
    polar = np.degrees(np.arcsin(np.sqrt((np.arange(n) + 0.5) / n)))
    azimuth = (np.arange(m) + 0.5) * 360 / m
    for table in (anisotropic(tmp_path), isotropic(tmp_path)):
        total = sum(bsdf_per_sr(table, "front", "reflection", (40, 130), (s, p)) for s in polar for p in azimuth)
        expected = shares(table, "front", (40, 130))["diffuse reflection"]
        assert total * math.pi / (n * m) == pytest.approx(expected, rel=5e-3)


def test_sides_that_a_table_does_not_speak_of(tmp_path):
    """Alike on both sides if it speaks of one; absorbing if it speaks of both."""
    front = {"Reflection Front": klems_matrix("LBNL/Klems Quarter", 0.1)}
    both = {**front, "Transmission Back": klems_matrix("LBNL/Klems Quarter", 0.2)}
    one = lower_tables({"s": table_of(klems(front), tmp_path)}, ("s",), RGB_BANDS, np.zeros(1, bool))
    assert one.lobe.tolist() == [[[0, -1], [0, -1]]]
    two = lower_tables({"s": table_of(klems(both), tmp_path)}, ("s",), RGB_BANDS, np.zeros(1, bool))
    assert two.lobe.tolist() == [[[0, -1], [-1, 1]]]


def test_frames_on_a_surface():
    """Azimuth 0 is the x axis along the surface, azimuth 90 is to its left as seen from the front."""
    along, across = frame(np.array([0.0, 0.0, 1.0]), np.array([2.0, 0.0, 5.0]))
    assert along == pytest.approx([1, 0, 0])
    assert across == pytest.approx([0, 1, 0])
    along, _ = frame(np.array([1.0, 0.0, 0.0]), np.array([3.0, 0.0, 0.0]))  # nothing is left of it: the next axis
    assert along == pytest.approx([0, 1, 0])
    rng = np.random.default_rng(4)
    for _ in range(100):
        normal, axis = rng.normal(size=(2, 3))
        normal /= np.linalg.norm(normal)
        one, other = frame(normal, axis)
        assert kernel.frame(*normal, axis) == pytest.approx([*one, *other], abs=1e-12)
        assert np.cross(one, other) == pytest.approx(normal)


def test_cells_and_angles_by_hand():
    cells = BsdfCells.model_validate(CELLS)
    assert len(cells) == 3
    assert [cells.index(*d) for d in ((0, 0), (44, 200), (45, 0), (80, 89), (80, 91), (80, -91), (90, 269))] == [
        0, 0, 1, 1, 2, 2, 2,
    ]  # fmt: skip
    assert cells.projected_sr == pytest.approx([math.pi / 2, math.pi / 4, math.pi / 4])
    angles = BsdfAngles(polar_deg=(10, 50), azimuth_deg=((0,), (0, 90, 270)))
    assert dict(angles.weights(0, 30)) == {0: 1}
    assert dict(angles.weights(80, 180)) == pytest.approx({2: 0.5, 3: 0.5})
    assert dict(angles.weights(30, 315)) == pytest.approx({0: 0.5, 3: 0.25, 1: 0.25})
