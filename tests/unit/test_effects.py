# SPDX-License-Identifier: LGPL-2.1-or-later
"""Effects: which scene calls for which, with the reason in words; and the slow references at values known by hand."""

from __future__ import annotations

import importlib
import math

import numpy as np
import pytest

from raymaps.effects import EFFECTS, needed_effects
from raymaps.effects.crossings import rectangle_crossing
from raymaps.effects.fresnel import fresnel_reflectance, refracted_direction
from raymaps.effects.lambertian import lambertian_direction
from raymaps.effects.medium_absorption import absorbed_share
from raymaps.effects.mirror import reflected_direction
from raymaps.effects.mixture import drawn_part
from raymaps.kernels import reflectance
from raymaps.scene import RectangleDetector, Scene
from tests.store.small_scenes import changed, workshop

SURFACES = {
    "black": {"kind": "absorber"},
    "mirror": {"kind": "mirror"},
    "white": {"kind": "lambertian", "reflectance": 0.5},
    "polished": {"kind": "fresnel"},
    "half": {"kind": "mixture", "parts": [{"weight": 0.5, "surface": "mirror"}, {"weight": 0.5, "surface": "white"}]},
    "none": {"kind": "mixture", "parts": [{"weight": 1.0, "surface": "white"}, {"weight": 0.0, "surface": "mirror"}]},
}


def scene_with(surface: str, faces: tuple[str, ...] = (), **more) -> Scene:
    geometry = {"file": "a.ply", "faces": [{"name": n, "triangles": 1} for n in faces] or None}
    body = {"geometry": geometry, "medium": "glass", "surface": surface, "face_surfaces": more.pop("face_surfaces", {})}
    return Scene.model_validate(
        {
            "format": "raymaps-scene",
            "version": 1,
            "media": {"glass": {"refractive_index": 1.5}, "ink": {"refractive_index": 1.4, "absorption_per_mm": 2}},
            "surfaces": SURFACES,
            "bodies": {"Part": body},
            "sources": {"P": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}},
            **more,
        }
    )


def test_every_effect_has_its_kernel_and_its_own_name():
    names = [effect.name for effect in EFFECTS]
    assert len(set(names)) == len(names)
    for effect in EFFECTS:
        if effect.stage != "none":
            assert callable(importlib.import_module(f"raymaps.kernels.{effect.name}").run)
        assert effect.summary
        assert effect.needed_by.__doc__


@pytest.mark.parametrize(
    ("surface", "needed"),
    [
        ("black", {"absorber"}),
        ("mirror", {"mirror"}),
        ("white", {"lambertian"}),
        ("polished", {"fresnel"}),
        ("half", {"mixture", "mirror", "lambertian"}),
        ("none", {"mixture", "lambertian"}),
    ],
)
def test_a_surface_calls_for_its_effect_alone(surface, needed):
    effects = needed_effects(scene_with(surface))
    assert set(effects) == needed
    assert all("'Part'" in reason for reasons in effects.values() for reason in reasons)


def test_reasons_name_the_part_of_a_mixture():
    assert needed_effects(scene_with("half"))["mirror"] == ("part 'mirror' of surface 'half' of body 'Part'",)


def test_a_face_calls_for_its_own_surface():
    effects = needed_effects(scene_with("white", ("A", "B"), face_surfaces={"B": "mirror"}))
    assert effects == {
        "mirror": ("surface 'mirror' of face 'Part.B'",),
        "lambertian": ("surface 'white' of body 'Part'",),
    }


def test_a_surface_that_every_face_overrides_calls_for_nothing():
    effects = needed_effects(scene_with("white", ("A", "B"), face_surfaces={"A": "mirror", "B": "mirror"}))
    assert set(effects) == {"mirror"}


def test_media_call_for_absorption_only_where_light_can_be():
    assert "medium_absorption" not in needed_effects(scene_with("white"))  # ink is not used
    ambient = needed_effects(scene_with("white", ambient="ink"))
    assert ambient["medium_absorption"] == ("medium 'ink' of the space around the bodies",)


def test_detectors_call_for_crossings():
    sensor = {"kind": "rectangle", "center_mm": [0, 0, 0], "normal": [0, 0, 1], "x_axis": [1, 0, 0]}
    sensor |= {"width_mm": 1, "height_mm": 1}
    assert "crossings" not in needed_effects(scene_with("white"))
    assert needed_effects(scene_with("white", detectors={"S": sensor}))["crossings"] == ("detector 'S'",)


def test_a_scene_of_everything_calls_for_everything(tmp_path):
    data = workshop(tmp_path)
    needed = list(needed_effects(Scene.model_validate(data)))
    assert needed == ["medium_absorption", "crossings", "mixture", "absorber", "mirror", "lambertian", "fresnel"]
    assert set(needed) < {effect.name for effect in EFFECTS}
    clear = changed(data, "media.glass.absorption_per_mm", 0)
    assert "medium_absorption" not in needed_effects(Scene.model_validate(clear))


# ---------------------------------------------------------------------------------------------------------------------
# The references


def test_fresnel_at_normal_incidence():
    """((n1 - n2) / (n1 + n2))²: 4 % for glass."""
    assert fresnel_reflectance(1.0, 1.0, 1.5) == pytest.approx(0.04)
    assert fresnel_reflectance(1.0, 1.5, 1.0) == pytest.approx(0.04)
    assert fresnel_reflectance(1.0, 1.3, 1.3) == 0


def test_between_equal_indices_nothing_is_reflected_even_along_the_interface():
    """Where the equations are 0 / 0."""
    assert fresnel_reflectance(0.0, 1.3, 1.3) == 0
    assert reflectance.of_clear_medium(0.0, 1.3, 1.3) == (0.0, 0.0)


def test_fresnel_at_brewsters_angle_is_half_of_the_s_part():
    """There r_p is 0 and r_s = cos(2 theta)."""
    theta = math.atan(1.5)
    assert fresnel_reflectance(math.cos(theta), 1.0, 1.5) == pytest.approx(0.5 * math.cos(2 * theta) ** 2)


def test_fresnel_at_grazing_incidence_and_beyond_the_critical_angle():
    assert fresnel_reflectance(0.0, 1.0, 1.5) == pytest.approx(1)
    critical = math.asin(1 / 1.5)
    assert fresnel_reflectance(math.cos(critical + 1e-6), 1.5, 1.0) == 1
    assert fresnel_reflectance(math.cos(critical - 1e-3), 1.5, 1.0) < 1


@pytest.mark.parametrize("n", [0.0, -1.5, math.nan, math.inf])
def test_fresnel_refuses_other_indices(n):
    with pytest.raises(ValueError, match="finite and > 0"):
        fresnel_reflectance(1.0, n, 1.5)
    with pytest.raises(ValueError, match="finite and > 0"):
        fresnel_reflectance(1.0, 1.5, n)


def test_snell():
    theta = np.radians([0.0, 20.0, 60.0, 89.0])
    direction = np.stack([np.sin(theta), 0 * theta, -np.cos(theta)], axis=1)
    out = refracted_direction(direction, np.tile([0.0, 0.0, 1.0], (4, 1)), 1.0, 1.5)
    assert np.linalg.norm(out, axis=1) == pytest.approx(1)
    assert 1.5 * out[:, 0] == pytest.approx(np.sin(theta))
    assert (out[:, 2] < 0).all()
    assert np.isnan(refracted_direction(direction[2:3], np.array([[0.0, 0, 1]]), 1.5, 1.0)).all()


def test_mirror():
    out = reflected_direction(np.array([[0.6, 0.0, -0.8], [0.6, 0.0, -0.8]]), np.array([[0.0, 0, 1], [0.0, 0, -1]]))
    assert out == pytest.approx(np.array([[0.6, 0, 0.8], [0.6, 0, 0.8]]))


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.6, 0, -0.8), (1e-9, 0, -1)])
def test_lambertian_directions(normal):
    """sin² of the angle is u, so the mean cosine over a grid of u is 2/3."""
    u, v = np.meshgrid((np.arange(400) + 0.5) / 400, (np.arange(16) + 0.5) / 16)
    normals = np.tile(np.array(normal, float) / np.linalg.norm(normal), (u.size, 1))
    out = lambertian_direction(u.ravel(), v.ravel(), normals)
    assert np.linalg.norm(out, axis=1) == pytest.approx(1)
    cosine = np.einsum("ij,ij->i", out, normals)
    assert 1 - cosine**2 == pytest.approx(u.ravel(), abs=1e-9)
    assert cosine.mean() == pytest.approx(2 / 3, abs=1e-4)
    assert out.mean(axis=0) == pytest.approx(normals[0] * 2 / 3, abs=1e-3)


def test_beer_lambert():
    light = np.array([[1.0, 0, 0], [0, 0, 1], [0.5, 0, 0.5]])
    share = absorbed_share(light, np.array([0.1, 0, 2.0]), np.full(3, 10.0))
    assert share == pytest.approx([1 - math.exp(-1), 1 - math.exp(-20), 1 - 0.5 * (math.exp(-1) + math.exp(-20))])
    assert absorbed_share(light, np.zeros(3), np.full(3, 10.0)).tolist() == [0, 0, 0]


def test_parts_of_a_mixture_are_drawn_in_proportion():
    u = (np.arange(1000) + 0.5) / 1000
    assert np.bincount(drawn_part(u, (0.2, 0.0, 0.5, 0.3))).tolist() == [200, 0, 500, 300]
    assert drawn_part(np.array([np.nextafter(1.0, 0)]), (0.1,) * 10) == [9]


SENSOR = RectangleDetector(
    center_mm=(1, 2, 3), normal=(0, 0, -2), x_axis=(1, 0, 5), width_mm=4, height_mm=2, resolution=(4, 2)
)


def test_axes_of_a_detector():
    """x is the part of x_axis across the normal, y is normal × x."""
    assert SENSOR.axes == pytest.approx(np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1]]))


@pytest.mark.parametrize(
    ("start", "end", "expected"),
    [
        ((1, 2, 0), (1, 2, 9), (0, 0, 0)),  # travels against the normal: head-on at the front
        ((1, 2, 9), (1, 2, 0), (0, 0, math.pi)),
        ((2, 2.5, 0), (2, 2.5, 9), (1, -0.5, 0)),
        ((-2, 2, 0), (4, 2, 6), (0, 0, math.pi / 4)),
        ((1, 2, 0), (1, 2, 2.9), None),  # ends before
        ((1, 2, 3.1), (1, 2, 9), None),  # starts behind
        ((3.1, 2, 0), (3.1, 2, 9), None),  # passes beside, along x
        ((1, 3.1, 0), (1, 3.1, 9), None),  # along y
        ((0, 2, 3), (5, 2, 3), None),  # runs within the plane
    ],
)
def test_crossings_of_a_rectangle(start, end, expected):
    found = rectangle_crossing(SENSOR, np.array(start, float), np.array(end, float))
    assert found == (None if expected is None else pytest.approx(expected, abs=1e-7))
