# SPDX-License-Identifier: LGPL-2.1-or-later
"""Surface effects: which scene calls for which, what a scene becomes without them, and what surfaces are refused."""

from __future__ import annotations

import time

import numpy as np
import pytest
from pydantic import ValidationError

from raymaps.effects import EFFECTS, needed_effects, scene_without
from raymaps.effects.usage import faces_of_kind
from raymaps.errors import SceneError
from raymaps.materials import AbgScatter, AngularTable, Coefficients, GaussianScatter, Lambertian, RoughInterface
from raymaps.materials.scatter import abg_total_scatter
from tests.physics.surface_bench import lines, lowered, scene_with

SURFACES = {
    "rough": {"kind": "rough", "roughness": 0.2},
    "gaussian": {"kind": "gaussian", "reflectance": 0.5, "sigma": 0.1},
    "abg": {"kind": "abg", "reflectance": 0.5, "a": 0.001, "b": 0.001, "g": 2},
    "thin_film": {"kind": "thin_film", "layers": [{"medium": "around", "thickness_nm": 100}]},
    "coefficients": {"kind": "coefficients", "specular_reflectance": 0.5},
}
METAL = {"inside": {"refractive_index": 0.5, "extinction": 3.0}}


@pytest.mark.parametrize("kind", SURFACES)
def test_a_surface_calls_for_its_effect_alone(kind):
    scene = scene_with(SURFACES[kind])
    assert needed_effects(scene) == {kind: ("surface 'tested' of body 'Part'",)}
    mixture = {"kind": "mixture", "parts": [{"weight": 1.0, "surface": "part"}]}
    mixed = needed_effects(scene_with(mixture, surfaces={"part": SURFACES[kind]}))
    assert mixed[kind] == ("part 'part' of surface 'tested' of body 'Part'",)
    other = scene_with({"kind": "absorber"}, surfaces={"unused": SURFACES[kind]})
    assert kind not in needed_effects(other)


def test_smooth_metals_call_for_conductors():
    polished = {"kind": "fresnel"}
    assert "conductor" not in needed_effects(scene_with(polished))
    assert "conductor" not in needed_effects(scene_with({"kind": "absorber"}, METAL))
    assert "conductor" not in needed_effects(scene_with(SURFACES["rough"], METAL))
    because = needed_effects(scene_with(polished, METAL))["conductor"]
    assert because == ("surface 'tested' of body 'Part' of the metal 'inside'",)
    mixture = {"kind": "mixture", "parts": [{"weight": 1.0, "surface": "polished"}]}
    assert "conductor" in needed_effects(scene_with(mixture, METAL, surfaces={"polished": polished}))


def test_a_lens_may_touch_metal():
    lens = {"geometry": {"file": "a.ply"}, "medium": "glass", "surface": "polished"}
    housing = {"geometry": {"file": "b.ply"}, "medium": "inside", "surface": "tested"}
    scene = scene_with(
        {"kind": "absorber"},
        {**METAL, "glass": {"refractive_index": 1.5}},
        surfaces={"polished": {"kind": "fresnel"}},
        bodies={"Lens": lens, "Housing": housing},
    )
    assert needed_effects(scene)["conductor"] == (
        "surface 'polished' of body 'Lens', which may touch the metal body 'Housing'",
    )


@pytest.mark.parametrize(
    ("kind", "becomes"),
    [
        ("rough", "fresnel"),
        ("thin_film", "fresnel"),
        ("gaussian", "coefficients"),
        ("abg", "coefficients"),
        ("coefficients", "absorber"),
    ],
)
def test_switched_off_surfaces(kind, becomes):
    scene = scene_with(SURFACES[kind], settings={"without": [kind]})
    assert scene_without(scene).surfaces["tested"].kind == becomes
    assert set(needed_effects(scene)) == {becomes}
    assert next(effect for effect in EFFECTS if effect.name == kind).if_off


def test_switched_off_metals_are_clear():
    scene = scene_with({"kind": "fresnel"}, METAL, settings={"without": ["conductor"]})
    assert not scene_without(scene).media["inside"].is_conductor
    assert set(needed_effects(scene)) == {"fresnel"}
    assert faces_of_kind(scene_without(scene), "fresnel")


def test_lowered_arrays_can_be_kept_and_read():
    """Arrays only, of the types that the kernels are compiled for."""
    for kind, surface in SURFACES.items():
        data = lowered(kind, scene_with(surface))
        for name, array in data._asdict().items():
            assert isinstance(array, np.ndarray), f"{kind}.{name}"
            assert array.dtype in (np.float64, np.int32, np.bool_), f"{kind}.{name}"
            assert array.dtype != np.float64 or np.isfinite(array).all(), f"{kind}.{name}"


def test_index_of_a_metal_that_is_not_known_at_a_wavelength_is_refused():
    metal = {"inside": {"refractive_index": {"wavelength_nm": [500, 600], "n": [0.2, 0.3]}, "extinction": 3.0}}
    for kind, effect in (("fresnel", "conductor"), ("rough", "rough")):
        surface = {"kind": "fresnel"} if kind == "fresnel" else SURFACES["rough"]
        with pytest.raises(SceneError) as caught:
            lowered(effect, scene_with(surface, metal), lines(450.0))
        assert str(caught.value) == (
            "Medium 'inside': its refractive index is known from 500 to 600 nm, but light from 450 to 450 nm is "
            "simulated: narrow settings.spectrum, or give the medium data that reach further."
        )


# ---------------------------------------------------------------------------------------------------------------------
# Shares that add up


def over_angle(angle_deg, value, wavelength_nm=None, **more):
    return {"angle_deg": angle_deg, "value": value, "wavelength_nm": wavelength_nm, **more}


def spectrum(wavelength_nm, value, **more):
    return {"wavelength_nm": wavelength_nm, "value": value, **more}


@pytest.mark.parametrize(
    ("model", "fields", "sentence"),
    [
        (
            Lambertian,
            {"reflectance": 0.7, "transmittance": 0.4},
            "reflectance + transmittance must be at most 1, got 1.1",
        ),
        (
            Lambertian,
            {"reflectance": [0.5, 0.6, 0.7], "transmittance": [0.5, 0.4, 0.4]},
            "reflectance + transmittance must be at most 1, got 1.1 in band b",
        ),
        (
            GaussianScatter,
            {
                "reflectance": spectrum([400, 700], [0.5, 1]),
                "transmittance": spectrum([500, 700], [0.0, 0.3]),
                "sigma": 1.0,
            },
            "reflectance + transmittance must be at most 1, got 1.3 at 700 nm",
        ),
        (
            Coefficients,
            {
                "specular_reflectance": over_angle([0, 80], [[0.1], [0.7]]),
                "diffuse_reflectance": over_angle([0, 40, 60], [[0.1], [0.7], [0.1]]),
            },
            "specular_reflectance + diffuse_reflectance must be at most 1, got 1.1 at 40 degrees",
        ),
        (
            Coefficients,
            {
                "specular_reflectance": over_angle([0, 80], [[0.1, 0.1], [0.1, 0.9]], [400, 700]),
                "diffuse_transmittance": spectrum([400, 650, 700], [0.0, 0.4, 0.0]),
            },
            "specular_reflectance + diffuse_transmittance must be at most 1, got 1.16667 at 80 degrees at 650 nm",
        ),
        (
            Coefficients,
            {
                "specular_reflectance": [0.9, 0.1, 0.1],
                "specular_transmittance": spectrum([400, 700], [0.1, 0.2], outside="clamp"),
            },
            "specular_reflectance + specular_transmittance must be at most 1, got 1.1 at 700 nm in band r",
        ),
    ],
)
def test_shares_above_one_are_refused_in_one_sentence(model, fields, sentence):
    with pytest.raises(ValidationError) as caught:
        model.model_validate(fields)
    assert caught.value.errors()[0]["msg"] == "Value error, " + sentence


@pytest.mark.parametrize(
    "fields",
    [
        {"specular_reflectance": 0.3, "diffuse_reflectance": 0.7},
        {f"{how}_{what}": 0.25 for how in ("specular", "diffuse") for what in ("reflectance", "transmittance")},
        # largest at different angles and wavelengths
        {
            "specular_reflectance": over_angle([0, 90], [[0.2], [0.8]]),
            "specular_transmittance": over_angle([0, 90], [[0.8], [0.2]]),
        },
        # above one only where one of the tables says nothing, so it can't be simulated there
        {
            "specular_reflectance": spectrum([400, 700], [0.5, 1.0]),
            "specular_transmittance": spectrum([300, 400, 690], [1.0, 0.3, 0.0]),
        },
        {
            "specular_reflectance": spectrum([400, 500], [1.0, 1.0]),
            "specular_transmittance": spectrum([600, 700], [1.0, 1.0]),
        },
    ],
)
def test_shares_up_to_one_are_fine(fields):
    Coefficients.model_validate(fields)


def test_the_largest_sum_is_found():
    """Random tables: the sum is refused if and only if it is above one somewhere on a fine grid or at a node."""
    rng = np.random.default_rng(8)
    refused = 0
    for _ in range(150):
        fields = {}
        for name in Coefficients.model_fields:
            angles = np.unique(rng.integers(0, 90, rng.integers(1, 5))).tolist()
            nm = np.unique(rng.integers(400, 700, rng.integers(1, 5))).tolist()
            if name != "kind":
                value = rng.uniform(0, 0.36, (len(angles), len(nm))).tolist()
                fields[name] = AngularTable(angle_deg=angles, wavelength_nm=nm, value=value, outside="clamp")
        angle = np.unique([a for t in fields.values() for a in t.angle_deg] + np.arange(91.0).tolist())
        nm = np.unique([w for t in fields.values() for w in t.wavelength_nm] + np.arange(390.0, 710, 10).tolist())
        total = sum(np.array([row.at(nm) for row in table.at_angles(angle)]) for table in fields.values())
        is_too_much = bool(total.max() > 1 + 1e-9)
        refused += is_too_much
        message = ""
        try:
            Coefficients(**fields)
        except ValidationError as error:
            message = str(error)
        assert (f"got {total.max():.6g} at" in message) if is_too_much else not message
    assert 20 < refused < 130


def test_large_tables_are_checked_fast():
    """Four tables of a degree and a nanometre, all on nodes of their own: well within a second."""
    angle, values = np.linspace(0, 90, 91), np.full((91, 401), 0.25).tolist()
    names = [name for name in Coefficients.model_fields if name != "kind"]
    tables = {
        name: over_angle((angle * (1 - 0.01 * i)).tolist(), values, (np.linspace(380, 780, 401) + 0.1 * i).tolist())
        for i, name in enumerate(names)
    }
    start = time.process_time()
    Coefficients.model_validate(tables)
    assert time.process_time() - start < 2


# ---------------------------------------------------------------------------------------------------------------------
# Lobes and roughness


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        (
            {"reflectance": 0.9, "a": 1.0, "b": 0.01, "g": 2.0},
            "a, b and g scatter 14.4988 of the light at 0 degrees, more than the reflectance of 0.9: "
            "choose a at most 0.062074",
        ),
        (
            {"reflectance": [0.9, 0.1, 0.5], "a": 0.05, "b": 0.01, "g": 2.0},
            "a, b and g scatter 0.724941 of the light at 0 degrees, more than the reflectance of 0.1 in band g: "
            "choose a at most 0.00689711",
        ),
        (
            {"reflectance": 0.9, "transmittance": spectrum([400, 600], [0.01, 0.1]), "a": 0.02, "b": 0.01, "g": 2.0},
            "a, b and g scatter 0.289977 of the light at 0 degrees, more than the transmittance of 0.01 at 400 nm: "
            "choose a at most 0.000689711",
        ),
    ],
)
def test_abg_that_scatters_more_than_there_is_refused(fields, sentence):
    with pytest.raises(ValidationError) as caught:
        AbgScatter.model_validate(fields)
    assert caught.value.errors()[0]["msg"] == "Value error, " + sentence


def test_abg_is_fine_up_to_its_reflectance():
    largest = 0.9 / float(abg_total_scatter(0.0, 1.0, 0.01, 2.0)[0])
    AbgScatter(reflectance=0.9, a=largest, b=0.01, g=2.0)
    AbgScatter(transmittance=0.9, a=largest, b=0.01, g=2.0)  # nothing is reflected, so nothing scatters back
    with pytest.raises(ValidationError):
        AbgScatter(reflectance=0.9, a=1.001 * largest, b=0.01, g=2.0)


@pytest.mark.parametrize(
    ("model", "fields", "field"),
    [
        (RoughInterface, {"roughness": 0.0}, "roughness"),
        (RoughInterface, {"roughness": 1.5}, "roughness"),
        (GaussianScatter, {"sigma": 0.0}, "sigma"),
        (GaussianScatter, {"sigma": 1.0, "scattered_share": 1.1}, "scattered_share"),
        (AbgScatter, {"a": -1.0, "b": 0.1, "g": 2.0}, "a"),
        (AbgScatter, {"a": 0.1, "b": 0.0, "g": 2.0}, "b"),
        (AbgScatter, {"a": 0.1, "b": 0.1, "g": 11.0}, "g"),
        (AbgScatter, {"a": 0.1, "b": 0.1, "g": float("nan")}, "g"),
    ],
)
def test_parameters_out_of_range_are_refused(model, fields, field):
    with pytest.raises(ValidationError) as caught:
        model.model_validate({"reflectance": 0.5, **fields} if model is not RoughInterface else fields)
    assert caught.value.errors()[0]["loc"][0] == field
