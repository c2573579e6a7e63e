# SPDX-License-Identifier: LGPL-2.1-or-later
"""Effects that a scene switches off: what takes their place, in the scene and in the light that arrives."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from raymaps.compile import compile_scene
from raymaps.effects import EFFECTS, needed_effects, scene_without
from raymaps.errors import SceneError
from raymaps.kinds import EventKind
from raymaps.results.ledger import energy_ledger
from raymaps.scene import Scene, load_scene
from tests.everything import write_everything
from tests.physics.scenes import Histories, body, box, disc_source, rectangle, traced, write_scene

NAMES = [effect.name for effect in EFFECTS if effect.name != "absorber"]
SELLMEIER = [1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653]
GOLD = {"refractive_index": 0.2, "extinction": 3.0}
SURFACES = {
    "black": {"kind": "absorber"},
    "polished": {"kind": "fresnel"},
    "mirror": {"kind": "mirror", "reflectance": 0.6},
    "white": {"kind": "lambertian", "reflectance": 0.6},
    "shares": {"kind": "coefficients", "specular_reflectance": 0.6},
    "coated": {"kind": "thin_film", "layers": [{"medium": "film", "thickness_nm": 100}]},
    "ground": {"kind": "rough", "roughness": 0.3},
    "brushed": {"kind": "gaussian", "reflectance": 0.6, "scattered_share": 0.5, "sigma": 0.1},
    "dusty": {"kind": "abg", "reflectance": 0.6, "a": 0.001, "b": 0.01, "g": 2},
    "mixed": {"kind": "mixture", "parts": [{"weight": 0.3, "surface": "black"}, {"weight": 0.7, "surface": "mirror"}]},
    "measured": {
        "kind": "bsdf",
        "data": {
            "lobes": [
                {
                    "comes_from": "front",
                    "goes_to": "reflection",
                    "incoming": {"polar_deg": [0]},
                    "outgoing": [{"ring_deg": [0, 90], "azimuth_deg": [[0, 360]]}],
                    "value": [[[0.6 / math.pi]]],
                }
            ]
        },
    },
}
MEDIA = {
    "glass": {"refractive_index": 1.5},
    "film": {"refractive_index": 1.38},
    "flint": {"refractive_index": {"formula": "sellmeier", "coefficients": SELLMEIER}},
    "ink": {"refractive_index": 1.5, "absorption_per_mm": 0.2},
    "milk": {"refractive_index": 1.5, "scattering": [{"coefficient_per_mm": 0.5}]},
    "gold": GOLD,
}


def surfaces_for(*names: str) -> dict:
    """These surfaces, those that they are mixed of, and black."""
    wanted = {"black", *names} | ({"mirror"} if "mixed" in names else set())
    return {name: SURFACES[name] for name in wanted}


def slab(
    folder, surface: str, medium: str, without: tuple[str, ...] = (), *, name="scene", spectrum=None, **more
) -> Histories:
    """A beam at 30 degrees onto the top of a slab, with a detector above it, traced with effects switched off."""
    tilt = math.radians(30)
    direction = np.array([math.sin(tilt), 0, -math.cos(tilt)])
    source = disc_source(-5 * direction, direction, 0.5, rgb=(2, 1, 1)) | ({"spectrum": spectrum} if spectrum else {})
    return traced(
        folder,
        {"Slab": body(box((-30, -30, -4), (30, 30, 0)), surface, medium)},
        rays=2_000,
        name=name,
        media={key: MEDIA[key] for key in {medium, "film"}},
        surfaces=surfaces_for(surface),
        sources={"S": source},
        detectors={"D": rectangle((0, 0, 3), 50, 50, side="both")},
        settings={"without": list(without), "store": "spectral", **more},
    )


#: For each effect a slab that calls for it: surface, medium.
CALLING = {
    "medium_scattering": ("polished", "milk"),
    "medium_absorption": ("polished", "ink"),
    "crossings": ("black", "glass"),
    "mixture": ("mixed", "glass"),
    "dispersion": ("polished", "flint"),
    "spectral": ("polished", "flint"),
    "mirror": ("mirror", "glass"),
    "lambertian": ("white", "glass"),
    "coefficients": ("shares", "glass"),
    "conductor": ("polished", "gold"),
    "thin_film": ("coated", "glass"),
    "rough": ("ground", "glass"),
    "gaussian": ("brushed", "glass"),
    "abg": ("dusty", "glass"),
    "fresnel": ("polished", "glass"),
    "bsdf": ("measured", "glass"),
}


def scene_without_effects(*names: str) -> Scene:
    source = {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}
    data = {"format": "raymaps-scene", "version": 1, "sources": {"S": source}, "settings": {"without": list(names)}}
    return Scene.model_validate(data)


def share_of(h: Histories, *kinds: EventKind) -> float:
    """Share of the rays whose first event is of one of the kinds."""
    return float(np.isin(h.kind[h.first + 1], kinds).mean())


# ---------------------------------------------------------------------------------------------------------------------
# For every effect


@pytest.mark.parametrize("effect", CALLING)
def test_an_effect_switched_off_is_not_needed_and_its_light_is_accounted_for(tmp_path, effect):
    """Nothing gets lost or stuck: no ray is killed, and the ledger closes."""
    surface, medium = CALLING[effect]
    with_it = slab(tmp_path, surface, medium, name="on")
    h = slab(tmp_path, surface, medium, (effect,), name="off")
    assert effect in needed_effects(with_it.raymap.scene)
    assert effect not in needed_effects(h.raymap.scene)
    assert with_it.raymap.manifest.scene_hash != h.raymap.manifest.scene_hash
    assert with_it.raymap.names == h.raymap.names
    ledger = energy_ledger(h.raymap)
    assert ledger.killed_w == 0
    assert ledger.absorbed_w + ledger.escaped_w == pytest.approx(1, rel=1e-9)


@pytest.mark.parametrize("effect", NAMES)
def test_switching_off_what_a_scene_has_not_changes_its_hash_alone(tmp_path, effect):
    if effect == "crossings":
        return
    sections = {"surfaces": surfaces_for(), "sources": {"S": disc_source((0, 0, 9), (0, 0, -1), 1)}}
    bodies = {"Plate": body(box((-5, -5, -1), (5, 5, 0)), "black")}
    plain = load_scene(write_scene(tmp_path / "a", bodies, **sections))
    off = load_scene(write_scene(tmp_path / "b", bodies, settings={"without": [effect]}, **sections))
    assert needed_effects(off) == needed_effects(plain)
    one, other = compile_scene(plain), compile_scene(off)
    assert one.scene_hash != other.scene_hash
    assert (one.tables.surface_kind == other.tables.surface_kind).all()


def test_an_unknown_effect_lists_the_known(tmp_path):
    scene = scene_without_effects("dispersal")
    for ask in (needed_effects, scene_without):
        with pytest.raises(SceneError, match=r"without: .*'dispersal'.*'spectral', 'medium_scattering'") as error:
            ask(scene)
        assert "\n" not in str(error.value)


def test_absorption_on_surfaces_cannot_be_switched_off():
    with pytest.raises(SceneError, match="'absorber'"):
        needed_effects(scene_without_effects("absorber"))


def test_what_takes_its_place_is_said_of_every_effect():
    for effect in EFFECTS:
        assert effect.if_off
        assert "\n" not in effect.if_off


def test_an_effect_named_twice_is_named_once(tmp_path):
    assert scene_without_effects("mirror", "mirror").settings.without == ("mirror",)


# ---------------------------------------------------------------------------------------------------------------------
# What takes their place


@pytest.mark.parametrize("effect", ["mirror", "lambertian", "coefficients", "fresnel", "bsdf"])
def test_surfaces_that_absorb_all_light(tmp_path, effect):
    h = slab(tmp_path, *CALLING[effect], (effect,))
    assert share_of(h, EventKind.ABSORPTION) == 1
    assert energy_ledger(h.raymap).absorbed_by_body_w["Slab"] == pytest.approx(1, rel=1e-9)


def test_media_that_do_not_absorb(tmp_path):
    h = slab(tmp_path, "polished", "ink", ("medium_absorption",))
    assert h.count_kind(EventKind.MEDIUM_ABSORPTION) == 0
    assert energy_ledger(h.raymap).escaped_w == pytest.approx(1, rel=1e-9)
    clear = slab(tmp_path, "polished", "glass", name="clear")
    assert np.array_equal(h.position, clear.position)
    assert np.array_equal(h.kind, clear.kind)


def test_media_that_do_not_scatter(tmp_path):
    h = slab(tmp_path, "polished", "milk", ("medium_scattering",))
    assert slab(tmp_path, "polished", "milk", name="on").count_kind(EventKind.MEDIUM_SCATTERING) > 1000
    assert h.count_kind(EventKind.MEDIUM_SCATTERING) == 0
    assert np.array_equal(h.position, slab(tmp_path, "polished", "glass", name="clear").position)


def test_rectangles_that_register_nothing(tmp_path):
    h = slab(tmp_path, "mirror", "glass", ("crossings",))
    assert len(h.crossing_row) == 0
    assert len(slab(tmp_path, "mirror", "glass", name="on").crossing_row) > 2_000


def test_mixtures_of_which_the_largest_part_acts(tmp_path):
    h = slab(tmp_path, "mixed", "glass", ("mixture",))
    assert share_of(h, EventKind.SPECULAR_REFLECTION) == 1
    assert energy_ledger(h.raymap).escaped_w == pytest.approx(0.6, rel=1e-6)
    assert np.array_equal(h.position, slab(tmp_path, "mirror", "glass", name="mirror").position)


@pytest.mark.parametrize("nm", [404.6561, 706.5188])
def test_indices_are_those_at_the_d_line(tmp_path, nm):
    """SCHOTT, N-BK7: n_d = 1.51680."""
    h = slab(
        tmp_path,
        "polished",
        "flint",
        ("dispersion",),
        spectrum={"kind": "lines", "wavelength_nm": sorted([nm, 587.5618])},
    )
    assert h.raymap.bands.is_spectral
    assert (np.concatenate([p.ray_wavelength_nm for p in h.raymap.portions]) == 0).all()
    refracted = h.first[h.kind[h.first + 1] == EventKind.FRESNEL_REFRACTION] + 2
    sine = h.way[refracted, 0] / np.linalg.norm(h.way[refracted], axis=1)
    assert len(sine) > 1_800
    assert 0.5 / sine == pytest.approx(1.51680, abs=6e-5)
    assert ((h.light[h.number == 1] > 0).sum(axis=1) == 2).all()


def test_light_is_red_green_and_blue(tmp_path):
    """What disperses does so at three wavelengths, one for each colour."""
    spectrum = {"kind": "illuminant", "name": "D65"}
    h = slab(tmp_path, "polished", "flint", ("spectral",), spectrum=spectrum)
    assert not h.raymap.bands.is_spectral
    assert "dispersion" in needed_effects(h.raymap.scene)
    refracted = h.first[h.kind[h.first + 1] == EventKind.FRESNEL_REFRACTION] + 2
    sine = h.way[refracted, 0] / np.linalg.norm(h.way[refracted], axis=1)
    index = 0.5 / sine
    band = np.argmax(h.light[refracted - 1], axis=1)
    assert ((h.light[refracted - 1] > 0).sum(axis=1) == 1).all()
    um2 = (np.array([611.4, 549.1, 464.2]) / 1000) ** 2
    c = SELLMEIER
    n = np.sqrt(1 + sum(b * um2 / (um2 - p) for b, p in zip(c[::2], c[1::2], strict=True)))
    assert np.abs(index - n[band]).max() < 6e-5
    assert np.bincount(band) == pytest.approx(len(band) / 3, rel=0.15)


def test_metals_are_clear_media_of_their_index(tmp_path):
    """Fresnel's total reflection at 30 degrees from air to n = 0.2, where the metal would take a part."""
    h = slab(tmp_path, "polished", "gold", ("conductor",))
    assert energy_ledger(h.raymap).escaped_w == pytest.approx(1, rel=1e-9)
    assert energy_ledger(slab(tmp_path, "polished", "gold", name="on").raymap).absorbed_w > 0.02


@pytest.mark.parametrize("effect", ["thin_film", "rough"])
def test_interfaces_that_are_smooth_and_bare(tmp_path, effect):
    h = slab(tmp_path, *CALLING[effect], (effect,))
    assert np.array_equal(h.position, slab(tmp_path, "polished", "glass", name="plain").position)
    assert not np.array_equal(h.position, slab(tmp_path, *CALLING[effect], name="on").position)


@pytest.mark.parametrize("effect", ["gaussian", "abg"])
def test_what_would_scatter_goes_on_specularly(tmp_path, effect):
    h = slab(tmp_path, *CALLING[effect], (effect,))
    assert share_of(h, EventKind.SPECULAR_REFLECTION) == 1
    assert energy_ledger(h.raymap).escaped_w == pytest.approx(0.6, rel=1e-6)
    way = h.way[h.first + 2]
    assert way[:, 0] / np.linalg.norm(way, axis=1) == pytest.approx(0.5, abs=1e-4)


# ---------------------------------------------------------------------------------------------------------------------
# Several at once, in any order


@pytest.mark.parametrize(
    ("surface", "effects"),
    [
        ("coated", ("thin_film", "fresnel")),
        ("ground", ("rough", "fresnel")),
        ("brushed", ("gaussian", "coefficients")),
        ("dusty", ("abg", "coefficients")),
        ("mixed", ("mixture", "mirror")),
    ],
)
def test_what_takes_the_place_may_be_switched_off_too(tmp_path, surface, effects):
    """In either order the light is absorbed, not lost."""
    for k, order in enumerate(itertools.permutations(effects)):
        h = slab(tmp_path, surface, "glass", order, name=f"order{k}")
        assert not set(effects) & set(needed_effects(h.raymap.scene))
        assert share_of(h, EventKind.ABSORPTION) == 1
        assert energy_ledger(h.raymap).absorbed_by_body_w["Slab"] == pytest.approx(1, rel=1e-9)


def test_everything_at_once_leaves_light_that_is_absorbed_or_gone(tmp_path):
    assert set(CALLING) == set(NAMES)
    for surface, medium in sorted(set(CALLING.values())):
        h = slab(tmp_path, surface, medium, tuple(NAMES), name=f"{surface}-{medium}")
        assert set(needed_effects(h.raymap.scene)) <= {"absorber"}
        ledger = energy_ledger(h.raymap)
        assert ledger.killed_w == 0
        assert ledger.absorbed_w + ledger.escaped_w == pytest.approx(1, rel=1e-9)


@pytest.mark.parametrize(
    "index",
    [
        {"wavelength_nm": [9000, 11000], "n": [2.41, 2.40]},
        {"formula": "cauchy", "coefficients": [2.35875, 4.151250], "from_nm": 9000, "to_nm": 11000},
    ],
)
def test_a_medium_that_is_not_known_at_the_d_line_has_its_index_as_near_as_that_is(tmp_path, index):
    """At 9 µm, where these data start: 2.41."""
    sections = {
        "media": {"ZnSe": {"refractive_index": index}},
        "surfaces": surfaces_for("polished"),
        "sources": {
            "S": disc_source((0, 0, 9), (0, 0, -1), 1) | {"spectrum": {"kind": "lines", "wavelength_nm": [10600]}}
        },
    }
    bodies = {"Window": body(box((-5, -5, -1), (5, 5, 0)), "polished", "ZnSe")}
    path = write_scene(tmp_path, bodies, settings={"without": ["dispersion"]}, **sections)
    compiled = compile_scene(load_scene(path))
    assert compiled.tables.medium_index[0] == pytest.approx(2.41, abs=1e-4)
    assert "dispersion" not in compiled.effects


def test_the_order_in_which_two_effects_are_named_does_not_matter(tmp_path):
    """In a scene that calls for all of them."""
    scene = load_scene(write_everything(tmp_path))

    def without(*names: str) -> Scene:
        settings = scene.settings.model_copy(update={"without": names})
        reduced = scene_without(scene.model_copy(update={"settings": settings}))
        return reduced.model_copy(update={"settings": scene.settings})

    for one, other in itertools.combinations(NAMES, 2):
        assert without(one, other) == without(other, one), (one, other)
