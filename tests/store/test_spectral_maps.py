# SPDX-License-Identifier: LGPL-2.1-or-later
"""Maps of spectral light: stored as spectra or as colours, changed between portions, resumed, damaged, and asked."""

from __future__ import annotations

import itertools
import json
import shutil
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from raymaps.bands import RGB_BANDS, spectral_bands
from raymaps.check import check_map
from raymaps.compile import compile_scene
from raymaps.criterion import query
from raymaps.errors import Interrupted, MapError, TraceError
from raymaps.results.info import map_info
from raymaps.results.overlay import overlay
from raymaps.results.paths import distinct_paths
from raymaps.results.report import report
from raymaps.run import simulate
from raymaps.scene import Scene, load_scene
from raymaps.store import Portion, RayMap
from raymaps.store.lights import Lights, distinct_lights
from raymaps.store.writing import write_portion
from raymaps.trace import Tracer
from raymaps.traced import FaceIndex
from tests.store.small_scenes import changed, workshop, write_scene
from tests.store.test_round_trip import (
    FACE_BODY,
    FACE_SURFACE,
    NAMES,
    TRIANGLE_FACE,
    assert_same,
    cut,
    random_history,
)

RAYS, PORTION = 3000, 1000
GLASS = {
    "formula": "sellmeier",
    "coefficients": [1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653],
}


def spectral_workshop(folder: Path) -> dict:
    """The workshop with a lamp, an LED, a laser of two lines and an rgb source, in glass that disperses."""
    data = workshop(folder)
    data["media"]["glass"]["refractive_index"] = GLASS
    data["surfaces"]["mirror"]["reflectance"] = {"wavelength_nm": [300, 500, 600, 900], "value": [0.9, 0.5, 0.99, 0.8]}
    data["sources"]["LED"]["spectrum"] = {"kind": "illuminant", "name": "LED-B3"}
    data["sources"]["Lamp"]["spectrum"] = {"kind": "black_body", "temperature_k": 3000}
    data["sources"]["Beam"]["spectrum"] = {"kind": "lines", "wavelength_nm": [532.0, 632.8]}
    return data


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("spectral")
    return write_scene(folder, spectral_workshop(folder))


@pytest.fixture(scope="module")
def maps(scene_file) -> dict[str, Path]:
    """The same rays stored as spectra, as colours, and portion by portion in turns."""
    turns = itertools.cycle(["spectral", "rgb"])
    stores = {"spectral": "spectral", "rgb": "rgb", "mixed": lambda: next(turns)}
    folder = scene_file.parent
    for name, store in stores.items():
        simulate(scene_file, folder / f"{name}.raymap", rays=RAYS, portion_rays=PORTION, threads=1, store=store)
    return {name: folder / f"{name}.raymap" for name in stores}


@pytest.fixture(scope="module")
def histories(scene_file, maps):
    """The portions as they are traced."""
    tracer = Tracer(compile_scene(load_scene(scene_file)), RayMap.open(maps["rgb"]).manifest.seed)
    return [tracer.trace_portion(first, PORTION) for first in range(0, RAYS, PORTION)]


# ---------------------------------------------------------------------------------------------------------------------
# Round trip


def bands_of(n: int):
    """Bands of a scene with an even source, and a line."""
    point = {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}
    even = {"kind": "table", "wavelength_nm": [380, 780], "value": [1, 1]}
    line = {"kind": "lines", "wavelength_nm": [532]}
    sources = {"S": {**point, "spectrum": even}, "L": {**point, "spectrum": line}}
    data = {"format": "raymaps-scene", "version": 1, "sources": sources, "settings": {"spectrum": {"bands": n - 1}}}
    return spectral_bands(Scene.model_validate(data))


def spectral_history(seed: int, n_bands: int, n_rays: int = 200) -> SimpleNamespace:
    rng = np.random.default_rng(seed)
    history = random_history(rng, 40, n_rays)
    lights = rng.random((30, n_bands)).astype(np.float32) / n_bands
    lights[::5] = 0
    history.light = rng.choice(lights, len(history.kind))
    history.wavelength_nm = rng.choice(np.array([0, 486.1327, 587.5618], np.float32), n_rays)
    return history


def written(folder: Path, history, bands, stored) -> Portion:
    folder.mkdir(exist_ok=True)
    write_portion(folder, history, NAMES, FaceIndex(TRIANGLE_FACE, FACE_BODY, FACE_SURFACE), bands, stored)
    return Portion.open(folder / f"{history.first_ray:012d}", NAMES, bands)


@pytest.mark.parametrize("n_bands", [2, 3, 5, 33, 1000])
def test_spectra_come_back_bit_by_bit(tmp_path, n_bands):
    history = spectral_history(n_bands, n_bands)
    portion = written(tmp_path, history, bands_of(n_bands), "spectral")
    assert_same(portion, history)
    assert np.array_equal(portion.ray_wavelength_nm, history.wavelength_nm)
    assert portion.lights.has_spectra
    assert len(portion.lights.values) <= 30
    assert portion.content() == portion.summary.content


def test_colours_come_back_as_the_sums_of_the_spectra(tmp_path):
    history, bands = spectral_history(1, 33), bands_of(33)
    portion = written(tmp_path, history, bands, "rgb")
    light = history.light.astype(float)
    assert not portion.lights.has_spectra
    assert portion.power == pytest.approx(light.sum(axis=1), rel=1e-6)
    lights = {name: getattr(portion.lights, name)[portion.event_light] for name in ("rgb", "lumen_per_w")}
    assert lights["rgb"] == pytest.approx(light @ bands.rgb_per_w, rel=1e-5, abs=1e-7)
    assert lights["lumen_per_w"] == pytest.approx(light @ bands.lumen_per_w, rel=1e-6)
    assert np.array_equal(portion.ray_wavelength_nm, history.wavelength_nm)
    assert portion.content() == portion.summary.content
    with pytest.raises(MapError, match=r"holds colours, not spectra.*--store spectral"):
        _ = portion.light


def test_rgb_light_is_stored_alike_whatever_is_asked_for(tmp_path):
    history = random_history(np.random.default_rng(3), 0, 100)
    one = written(tmp_path / "a", history, RGB_BANDS, "rgb")
    other = written(tmp_path / "b", history, RGB_BANDS, "spectral")
    assert one.summary.content == other.summary.content
    assert one.summary.file_sha256 == other.summary.file_sha256


@pytest.mark.parametrize("stored", ["rgb", "spectral"])
def test_the_content_hash_of_spectra_does_not_depend_on_portions(tmp_path, stored):
    """Nor does it on the order in which a portion numbers its lights."""
    history, bands = spectral_history(7, 33), bands_of(33)
    whole = written(tmp_path / "whole", history, bands, stored).summary.content
    edges = [0, 1, 77, 200]
    parts = [
        written(tmp_path / "parts", cut(history, a, b), bands, stored).summary.content
        for a, b in zip(edges, edges[1:], strict=False)
    ]
    assert tuple(sum(part[i] for part in parts) % 2**64 for i in range(2)) == whole


def test_the_content_hash_depends_on_light_and_wavelengths(tmp_path):
    history, bands = spectral_history(8, 33, 20), bands_of(33)
    before = written(tmp_path / "before", history, bands, "spectral").summary.content
    for i, (name, at) in enumerate(
        [("light", (3, 0)), ("light", (-1, 32)), ("wavelength_nm", 0), ("wavelength_nm", -1)]
    ):
        other = SimpleNamespace(**{k: np.copy(v) if isinstance(v, np.ndarray) else v for k, v in vars(history).items()})
        getattr(other, name)[at] = np.nextafter(getattr(other, name)[at], np.float32(1e4))
        assert written(tmp_path / f"{i}", other, bands, "spectral").summary.content != before, (name, at)


def test_distinct_lights_are_the_distinct_rows():
    rng = np.random.default_rng(0)
    light = rng.choice(rng.random((5000, 33)).astype(np.float32), 20_000)
    lights, index = distinct_lights(light, bands_of(33))
    assert np.array_equal(lights.values[index], light)
    assert len(lights.values) == len(np.unique(light, axis=0))


@pytest.mark.parametrize("which", ["spectral", "rgb", "mixed"])
def test_traced_portions_come_back(maps, histories, which):
    raymap = RayMap.open(maps[which])
    stored = {"spectral": [True] * 3, "rgb": [False] * 3, "mixed": [True, False, True]}[which]
    for portion, history, with_spectra in zip(raymap.portions, histories, stored, strict=True):
        assert portion.lights.has_spectra == with_spectra
        if with_spectra:
            assert portion.light.tobytes() == history.light.tobytes()
        for name in ("position_mm", "triangle", "crossing_xy_mm", "event_offsets"):
            assert getattr(portion, name).tobytes() == getattr(history, name).tobytes(), name
        assert portion.ray_wavelength_nm.tobytes() == history.wavelength_nm.tobytes()
        assert 0.2 < (portion.ray_wavelength_nm > 0).mean() < 0.95
        assert portion.content() == portion.summary.content


# ---------------------------------------------------------------------------------------------------------------------
# Columns


def test_the_columns_of_spectral_light(maps):
    """As other programs read them."""
    for which, names in (
        ("spectral", [f"band_{band}" for band in range(34)]),
        ("rgb", ["power", "lumen_per_w", "r", "g", "b"]),
    ):
        raymap = RayMap.open(maps[which])
        assert raymap.bands.n == 34  # 32 of the lamps, two lines
        folder = raymap.portions[0].folder
        lights = pq.read_table(folder / "lights.parquet")
        assert lights.column_names == ["light", *names]
        assert {str(t) for t in lights.schema.types[1:]} == {"float"}
        rays = pq.read_table(folder / "rays.parquet")
        assert rays.column_names == ["ray", "signature", "wavelength_nm"]
        assert str(rays.schema.field("wavelength_nm").type) == "float"
        assert pq.read_table(folder / "events.parquet").column("light").to_numpy().max() < len(lights)


def test_the_manifest_tells_the_bands(maps):
    data = json.loads((maps["rgb"] / "manifest.json").read_text())
    assert data["version"] == 2
    bands = data["bands"]
    assert bands["is_spectral"] is True
    assert len(bands["low_nm"]) == len(bands["high_nm"]) == len(bands["lumen_per_w"]) == len(bands["rgb_per_w"]) == 34
    assert bands["low_nm"][-2:] == bands["high_nm"][-2:] == [532.0, 632.8]


def test_wavelengths_lie_in_the_band_of_the_light(maps):
    raymap = RayMap.open(maps["spectral"])
    bands = raymap.bands
    for portion in raymap.portions:
        nm = portion.ray_wavelength_nm.astype(float)
        row = np.repeat(np.arange(portion.n_rays), np.diff(portion.event_offsets))
        narrowed = (portion.light > 0).sum(axis=1) == 1
        band = np.argmax(portion.light, axis=1)
        known = narrowed & (nm[row] > 0)
        assert known.sum() > 500
        assert (nm[row][known] >= bands.low_nm[band][known] - 1e-4).all()
        assert (nm[row][known] <= bands.high_nm[band][known] + 1e-4).all()


def test_an_rgb_map_has_no_wavelengths(workshop_map):
    portion = workshop_map.raymap.portions[0]
    assert pq.read_schema(portion.folder / "rays.parquet").names == ["ray", "signature"]
    assert portion.ray_wavelength_nm.tolist() == [0] * portion.n_rays


def test_bytes_of_a_segment(scene_file, workshop_map, tmp_path, record_property):
    """33 wavelengths cost little more than RGB because a light is stored once (the paper: 10 and 10.2 bytes)."""
    folder = workshop_map.scene_file
    sizes = {}
    for name, scene, store in (
        ("RGB", folder, "rgb"),
        ("colours", scene_file, "rgb"),
        ("spectra", scene_file, "spectral"),
    ):
        raymap = simulate(scene, tmp_path / f"{name}.raymap", rays=20_000, portion_rays=20_000, threads=1, store=store)
        sizes[name] = raymap.n_bytes / (raymap.n_events - raymap.n_rays)
        record_property(f"bytes a segment, {name}", sizes[name])
    print("  bytes a segment:", {name: round(size, 2) for name, size in sizes.items()})
    assert sizes["colours"] < sizes["RGB"] + 1
    assert sizes["spectra"] < sizes["colours"] + 1


# ---------------------------------------------------------------------------------------------------------------------
# Changing how light is stored, and going on


def test_how_light_is_stored_is_asked_before_each_portion(scene_file, tmp_path):
    asked = iter(["rgb", "spectral", "spectral"])
    raymap = simulate(
        scene_file, tmp_path / "m.raymap", rays=3000, portion_rays=1000, threads=1, store=lambda: next(asked)
    )
    assert [p.lights.has_spectra for p in raymap.portions] == [False, True, True]
    assert next(asked, None) is None


def test_the_scene_says_how_light_is_stored_unless_the_run_does(scene_file, tmp_path):
    data = changed(json.loads(scene_file.read_text()), "settings.store", "spectral")
    path = write_scene(scene_file.parent, data, "stored.scene.json")
    assert simulate(path, tmp_path / "a.raymap", rays=100).portions[0].lights.has_spectra
    assert not simulate(path, tmp_path / "b.raymap", rays=100, store="rgb").portions[0].lights.has_spectra
    assert compile_scene(load_scene(path)).scene_hash == compile_scene(load_scene(scene_file)).scene_hash


def test_another_word_than_rgb_or_spectral_is_refused(scene_file, tmp_path):
    with pytest.raises(TraceError, match="'rgb' or 'spectral', got 'colour'"):
        simulate(scene_file, tmp_path / "m.raymap", rays=100, store="colour")


@pytest.mark.parametrize(("first", "then"), [("rgb", "spectral"), ("spectral", "rgb")])
def test_a_stopped_run_goes_on_storing_otherwise(scene_file, tmp_path, maps, first, then):
    path, stop = tmp_path / "m.raymap", threading.Event()
    with pytest.raises(Interrupted):
        simulate(
            scene_file, path, rays=RAYS, portion_rays=PORTION, threads=1, store=first, stop=stop,
            on_progress=lambda p: stop.set() if p.rays else None,
        )  # fmt: skip
    done = RayMap.open(path).n_rays
    assert 0 < done < RAYS
    raymap = simulate(scene_file, path, resume=True, threads=2, store=then)
    assert [p.lights.has_spectra == (first == "spectral") for p in raymap.portions] == [
        p.first_ray < done for p in raymap.portions
    ]
    assert not any(finding.is_fault for finding in check_map(path))
    # ray by ray it is what was stored in one go
    whole = {kind: RayMap.open(maps[kind]) for kind in ("rgb", "spectral")}
    for i, portion in enumerate(raymap.portions):
        kind = "spectral" if portion.lights.has_spectra else "rgb"
        assert portion.summary.content == whole[kind].portions[i].summary.content


@pytest.mark.parametrize("store", ["rgb", "spectral"])
def test_the_content_hash_does_not_depend_on_how_the_run_went(scene_file, tmp_path, maps, store):
    """Other portions, threads, and an interruption, of each kind."""
    whole = RayMap.open(maps[store]).content_hash
    path, stop = tmp_path / "m.raymap", threading.Event()
    with pytest.raises(Interrupted):
        simulate(
            scene_file, path, rays=RAYS, portion_rays=350, threads=2, store=store, stop=stop,
            on_progress=lambda p: stop.set() if p.rays else None,
        )  # fmt: skip
    assert simulate(scene_file, path, resume=True, threads=1, store=store).content_hash == whole
    assert simulate(scene_file, tmp_path / "n.raymap", rays=RAYS, portion_rays=RAYS, store=store).content_hash == whole


def test_colours_and_spectra_are_different_contents(maps):
    hashes = {RayMap.open(path).content_hash for path in maps.values()}
    assert len(hashes) == 3


def test_rays_added_later_are_those_of_a_longer_run(scene_file, tmp_path, maps):
    path = tmp_path / "m.raymap"
    simulate(scene_file, path, rays=1000, portion_rays=PORTION, store="spectral")
    more = simulate(scene_file, path, rays=RAYS, resume=True, store="spectral")
    assert more.content_hash == RayMap.open(maps["spectral"]).content_hash


# ---------------------------------------------------------------------------------------------------------------------
# Asking


@pytest.mark.parametrize("which", ["spectral", "rgb", "mixed"])
def test_the_ledger_closes_and_is_the_same_however_light_is_stored(maps, which):
    ledger = map_info(RayMap.open(maps[which])).ledger
    assert ledger.emitted_w == pytest.approx(3.75, rel=1e-12)
    assert ledger.absorbed_w + ledger.escaped_w + ledger.killed_w == pytest.approx(3.75, rel=1e-9)
    assert ledger == map_info(RayMap.open(maps["spectral"])).ledger
    assert min(ledger.absorbed_by_body_w["Mirror"], ledger.absorbed_by_medium_w["glass"], ledger.escaped_w) > 0


@pytest.mark.parametrize("which", ["rgb", "mixed"])
def test_every_question_has_the_same_answer_however_light_is_stored(maps, which):
    spectra, other = RayMap.open(maps["spectral"]), RayMap.open(maps[which])
    assert not any(finding.is_fault for finding in check_map(maps[which]))
    for criterion in ("hit(Block, fresnel_refraction)", "from(Beam) & ended(left)", "detector(Around)"):
        one, two = query(spectra, criterion), query(other, criterion)
        assert (one.rays, one.flux_w, one.flux_stderr_w) == (two.rays, two.flux_w, two.flux_stderr_w)
    one, two = distinct_paths(spectra), distinct_paths(other)
    assert [path.signature for path in one.paths] == [path.signature for path in two.paths]
    ones, twos = (overlay(m, max_rays=200) for m in (spectra, other))
    assert np.array_equal(ones.segments_mm, twos.segments_mm)
    assert np.abs(ones.light - twos.light).max() < 1e-5
    ones, twos = (report(m, limit=50) for m in (spectra, other))
    for a, b in zip(ones.rays, twos.rays, strict=True):
        assert a.wavelength_nm == b.wavelength_nm
        assert [e.kind for e in a.events] == [e.kind for e in b.events]
        assert np.abs(np.array([e.rgb for e in a.events]) - [e.rgb for e in b.events]).max() < 1e-5


def test_shown_colours_are_shares_of_the_power(maps):
    for portion in (p for path in maps.values() for p in RayMap.open(path).portions):
        shown = portion.shown_light
        assert shown.min() >= 0
        assert np.abs(shown.sum(axis=1) - portion.power).max() < 1e-5
        assert shown.dtype == np.float32


@pytest.mark.parametrize("store", ["rgb", "spectral"])
def test_light_that_no_eye_sees_is_drawn_white(tmp_path, store):
    data = spectral_workshop(tmp_path)
    data["media"]["glass"]["refractive_index"] = 1.5
    data["surfaces"]["mirror"]["reflectance"] = 0.9
    lines = {"LED": [266.0], "Lamp": [1064.0], "Spot": [10600.0], "Beam": [532.0]}
    for name, nm in lines.items():
        data["sources"][name]["spectrum"] = {"kind": "lines", "wavelength_nm": nm}
    raymap = simulate(write_scene(tmp_path, data), tmp_path / "m.raymap", rays=400, store=store)
    portion = raymap.portions[0]
    source = np.repeat(raymap.portions[0].signatures.ray_source[portion.ray_signature], np.diff(portion.event_offsets))
    lit = portion.power > 0
    unseen = lit & (source != raymap.names.sources.index("Beam"))
    assert unseen.sum() > 400
    assert portion.shown_light[unseen] == pytest.approx(np.tile(portion.power[unseen, None] / 3, (1, 3)), rel=1e-5)
    green = portion.shown_light[lit & ~unseen]
    assert (green[:, 1] > 10 * green[:, 0]).all()
    drawn = overlay(raymap, max_rays=400)
    assert drawn.light.max() > 0.3
    assert (drawn.rgba != 0).all()


# ---------------------------------------------------------------------------------------------------------------------
# Damage


def rewritten(change: Callable[[pa.Table], pa.Table]) -> Callable[[Path], None]:
    """A change of the table in a file, written as a sound Parquet file."""
    return lambda path: pq.write_table(change(pq.read_table(path)), path)


def flipped(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 4
    path.write_bytes(bytes(data))


def resealed(path: Path) -> None:
    """Let the portion's summary speak of the file as it is now: damage that sizes and checksums do not show."""
    import hashlib

    from raymaps.store.sealed import seal, unseal

    summary = path.parent / "portion.json"
    data = unseal(json.loads(summary.read_text()))
    data["file_bytes"][path.name] = path.stat().st_size
    data["file_sha256"][path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
    summary.write_text(seal(data))


DAMAGE: dict[str, Callable[[Path], None]] = {
    "missing": Path.unlink,
    "empty": lambda path: path.write_bytes(b""),
    "cut short": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "other bytes": lambda path: path.write_bytes(b"\xa5" * path.stat().st_size),
    "a bit flipped": flipped,
    "a text file": lambda path: path.write_text("light,r,g,b\n0,1,1,1\n"),
    "a column missing": rewritten(lambda table: table.remove_column(3)),
    "another column": rewritten(lambda table: table.append_column("more", table.column(1))),
    "columns in another order": rewritten(lambda table: table.select(table.column_names[::-1])),
    "colours for spectra": rewritten(lambda t: t.select(t.column_names[:4]).rename_columns(["light", "r", "g", "b"])),
}


def all_read(path: Path) -> None:
    for portion in RayMap.open(path).portions:
        for name in ("power", "shown_light", "event_light"):
            getattr(portion, name)


@pytest.mark.parametrize("sealed", [False, True], ids=["", "resealed"])
@pytest.mark.parametrize("which", ["rgb", "spectral"])
@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_lights_are_told_in_one_sentence(maps, tmp_path, which, damage, sealed):
    path = Path(shutil.copytree(maps[which], tmp_path / "copy.raymap"))
    file = path / "portions" / f"{PORTION:012d}" / "lights.parquet"
    DAMAGE[damage](file)
    if sealed and file.exists():
        resealed(file)
    faults = [finding.text for finding in check_map(path) if finding.is_fault]
    assert len(faults) == 1
    assert "lights.parquet" in faults[0] or "portion.json" in faults[0]
    assert "\n" not in faults[0]
    assert len(faults[0]) < 600
    if damage == "a bit flipped" and not sealed:
        return  # in a place that no column needs, it may be read
    with pytest.raises(MapError) as error:
        all_read(path)
    assert "lights.parquet" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("which", ["rgb", "spectral"])
def test_fewer_lights_than_events_speak_of_are_told(maps, tmp_path, which):
    path = Path(shutil.copytree(maps[which], tmp_path / "copy.raymap"))
    file = path / "portions" / f"{PORTION:012d}" / "lights.parquet"
    rewritten(lambda table: table.slice(0, 5))(file)
    resealed(file)
    faults = [finding.text for finding in check_map(path) if finding.is_fault]
    assert len(faults) == 1


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("low_nm", []),
        ("low_nm", "380"),
        ("high_nm", [1.0]),
        ("rgb_per_w", [[1, 2]]),
        ("lumen_per_w", [1.0]),
        ("low_nm", None),
    ],
)
def test_damaged_bands_are_told_in_one_sentence(maps, tmp_path, field, value):
    from raymaps.store.sealed import seal, unseal

    path = Path(shutil.copytree(maps["spectral"], tmp_path / "copy.raymap"))
    manifest = path / "manifest.json"
    data = unseal(json.loads(manifest.read_text()))
    data["bands"][field] = value
    manifest.write_text(seal(data))
    with pytest.raises(MapError, match=r"damaged manifest\.json") as error:
        RayMap.open(path)
    assert "\n" not in str(error.value)


def test_lights_of_other_columns_are_refused():
    with pytest.raises(ValueError, match="other columns"):
        Lights.from_columns({"light": np.zeros(1), "r": np.zeros(1), "g": np.zeros(1), "b": np.zeros(1)}, bands_of(33))
