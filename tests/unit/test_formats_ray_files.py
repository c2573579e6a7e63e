# SPDX-License-Identifier: LGPL-2.1-or-later
"""Ray files IES TM-25, Zemax .DAT and our own: what they say is read, and every damage is told in one sentence."""

from __future__ import annotations

import json
import struct
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from raymaps.errors import FormatError, SceneError
from raymaps.formats.ray_file import read_rays, write_rays
from raymaps.formats.ray_set import RaySet
from raymaps.ray_sets import load_ray_sets
from raymaps.scene import scene_from_dict

#: x y z, direction, flux of three rays.
RAYS = np.array(
    [[1, 2, 3, 0, 0, 1, 0.5], [-1, 0, 0.25, 0.6, 0, 0.8, 0.25], [0, 0, 0, -1, 0, 0, 0]], np.float32
)  # fmt: skip


def tm25(rays=RAYS, *, flags=(1, 1, 1, 0, 0, 0, 0, 0), kind=0, wavelength=np.nan, spectra=(), additional=0, text=b""):
    """A TM-25 file, field by field as in section 4.7 of the standard."""
    blocks = [
        b"TM25", struct.pack("<iiff", 2013, 0, np.nan, 0.75), struct.pack("<Q", len(rays)),
        b"2024-02-03T04:05:06+01:00".ljust(28, b"\0"), struct.pack("<ii", 0, kind),
        struct.pack("<fff", wavelength, 380, 780), struct.pack("<iii", len(spectra), additional, len(text)), bytes(168),
        struct.pack("<8i", *flags), *("Lämp".encode("utf-32-le").ljust(4000, b"\0") for _ in range(9)),
    ]  # fmt: skip
    tables = b"".join(struct.pack("<i", len(s)) + np.array(s, "<f4").tobytes() for s in spectra)
    blocks += [tables.ljust(-(-len(tables) // 32) * 32, b"\0")]
    blocks += ["more".encode("utf-32-le").ljust(512, b"\0")] * additional
    return b"".join(blocks) + text + np.ascontiguousarray(rays, "<f4").tobytes()


def dat(rays=RAYS, *, unit=4, form=0, flux_kind=0, identifier=1010, count=None):
    """A binary Zemax source file."""
    head = struct.pack("<II", identifier, len(rays) if count is None else count) + b"Made by a test".ljust(100, b"\0")
    head += struct.pack("<7f", 1, 1, 0.55, 0, 90, 0, 360) + struct.pack("<i", unit) + struct.pack("<13f", *[7.0] * 13)
    head += struct.pack("<4i", form, flux_kind, 0, 0)
    assert len(head) == 208
    return head + np.ascontiguousarray(rays, "<f4").tobytes()


def dat_text(rays=RAYS, unit=4):
    return "\n".join([f"{len(rays)} {unit}", *(" ".join(f"{v:.6g}" for v in ray) for ray in rays)]).encode() + b"\n"


def read(tmp_path, content, name="source.bin"):
    path = tmp_path / name
    path.write_bytes(content)
    return read_rays(path)


def with_columns(*columns):
    return np.column_stack([RAYS, *columns])


def are_the_rays(rays: RaySet, scale=1.0):
    assert np.allclose(rays.position_mm, RAYS[:, :3] * scale, rtol=1e-6)
    assert np.allclose(rays.direction, RAYS[:, 3:6], rtol=1e-6)
    assert np.allclose(rays.power, RAYS[:, 6], rtol=1e-6)


# --------------------------------------------------------------------------------------------------- TM-25


def test_tm25(tmp_path):
    rays = read(tmp_path, tm25())
    are_the_rays(rays)
    assert not rays.is_coloured
    assert rays.box_mm.tolist() == [[-1, 0, 0], [1, 2, 3]]


def test_tm25_with_luminous_flux_only(tmp_path):
    are_the_rays(read(tmp_path, tm25(flags=(1, 1, 0, 0, 1, 0, 0, 0))))


def test_tm25_of_one_wavelength(tmp_path):
    assert read(tmp_path, tm25(kind=1, wavelength=532)).wavelength_nm.tolist() == [532, 532, 532]


def test_tm25_with_a_wavelength_for_each_ray(tmp_path):
    rays = read(tmp_path, tm25(with_columns([450, 550, 650]), flags=(1, 1, 1, 1, 0, 0, 0, 0), kind=2))
    are_the_rays(rays)
    assert rays.wavelength_nm.tolist() == [450, 550, 650]


def test_tm25_with_a_spectrum(tmp_path):
    spectrum = [(400, 0), (500, 100), (600, 50)]
    rays = read(tmp_path, tm25(kind=3, spectra=[spectrum]))
    are_the_rays(rays)
    assert rays.spectra == (((400, 500, 600), (0, 100, 50)),)
    assert rays.spectrum.tolist() == [0, 0, 0]


def test_tm25_with_spectra_by_ray_and_everything_else(tmp_path):
    """Spectra whose padding differs, labels, a text, Stokes parameters and additional items shift what follows."""
    spectra = [[(400, 1), (500, 2)], [(450, 1), (550, 2), (650, 0)]]
    more = with_columns(*np.full((6, 3), 9.0), [2, 1, 2], [7, 7, 7], [8, 8, 8])
    content = tm25(
        more, flags=(1, 1, 1, 0, 0, 1, 0, 1), kind=4, spectra=spectra, additional=2, text="notes...".encode("utf-32-le")
    )
    rays = read(tmp_path, content)
    are_the_rays(rays)
    assert rays.spectrum.tolist() == [1, 0, 1]
    assert [len(nm) for nm, _ in rays.spectra] == [2, 3]


def test_tm25_with_colours(tmp_path):
    """X, Y and Z of the sRGB primaries (IEC 61966-2-1) are red, green, and white of the sum of all."""
    xyz = np.array([[0.4124, 0.2126, 0.0193], [0.3576, 0.7152, 0.1192], [0.9505, 1.0, 1.0890]])
    columns = np.column_stack([RAYS[:, :6], xyz[:, 1], xyz[:, 0], xyz[:, 2]])
    rays = read(tmp_path, tm25(columns, flags=(1, 1, 0, 0, 1, 0, 1, 0)))
    assert rays.light == pytest.approx(np.array([[1, 0, 0], [0, 1, 0], [1, 1, 1]]), abs=2e-3)
    assert rays.power == pytest.approx([1, 1, 3], abs=5e-3)


# ------------------------------------------------------------------------------------------------------ Zemax


@pytest.mark.parametrize(("unit", "mm"), [(0, 1000), (1, 25.4), (2, 10), (3, 304.8), (4, 1)])
def test_zemax_units(tmp_path, unit, mm):
    """The file's own place, rotation and scale do not count, as in OpticStudio."""
    are_the_rays(read(tmp_path, dat(unit=unit)), mm)
    are_the_rays(read(tmp_path, dat_text(unit=unit), "source.dat"), mm)


def test_zemax_wavelengths(tmp_path):
    um = [0.45, 0.55, 0.65]
    for content in (dat(with_columns(um), form=2), dat(with_columns(um), form=2, identifier=8675309)):
        rays = read(tmp_path, content)
        are_the_rays(rays)
        assert rays.wavelength_nm == pytest.approx([450, 550, 650])
    assert read(tmp_path, dat_text(with_columns(um))).wavelength_nm == pytest.approx([450, 550, 650])


def test_zemax_text_with_comments_and_commas(tmp_path):
    text = b"! made by hand\n\n 1 , 4\n! x y z l m n f\n1, 2, 3, 0, 0, 1, 5\n\n"
    rays = read(tmp_path, text)
    assert rays.position_mm.tolist() == [[1, 2, 3]]
    assert rays.power.tolist() == [5]


# ------------------------------------------------------------------------------------------------------- ours


def some_rays(n=1000, **more):
    rng = np.random.default_rng(3)
    direction = rng.normal(size=(n, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    return RaySet(rng.normal(size=(n, 3)), direction, rng.random(n), **more)


def colours(n=1000):
    rng = np.random.default_rng(4)
    return [
        {},
        {"wavelength_nm": rng.uniform(400, 700, n).astype(np.float32)},
        {"light": rng.random((n, 3)).astype(np.float32)},
        {"light": rng.random((n, 2)).astype(np.float32), "bands_nm": np.array([[400.0, 500], [532, 532]])},
        {"spectrum": rng.integers(0, 2, n).astype(np.int32), "spectra": (((400.0, 500.0), (1.0, 2.0)),) * 2},
    ]


@pytest.mark.parametrize("colour", range(5))
def test_our_own_file_holds_rays_exactly(tmp_path, colour):
    rays = some_rays(**colours()[colour])
    write_rays(tmp_path / "deep" / "rays.parquet", rays)
    again = read_rays(tmp_path / "deep" / "rays.parquet")
    assert again.digest == rays.digest
    for name in ("position_mm", "direction", "power", "wavelength_nm", "light", "bands_nm", "spectrum"):
        one, other = getattr(rays, name), getattr(again, name)
        assert (one is None) == (other is None)
        if one is not None:
            assert one.dtype == other.dtype
            assert np.array_equal(one, other)
    assert again.spectra == rays.spectra


def test_digest_tells_rays_apart():
    variants = [some_rays(**colour) for colour in colours()]
    rays = some_rays()
    moved = rays.position_mm.copy()
    moved[7, 1] = np.nextafter(moved[7, 1], 9)
    variants += [replace(rays, position_mm=moved), replace(rays, power=rays.power[::-1].copy())]
    assert len({variant.digest for variant in variants}) == len(variants)
    assert some_rays().digest == rays.digest


def test_arrays_of_a_set_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        some_rays().power[0] = 1


# ---------------------------------------------------------------------------------------------------- damage


def changed(ray, column, value):
    rays = RAYS.copy()
    rays[ray, column] = value
    return rays


def patched(content, at, data):
    return content[:at] + data + content[at + len(data) :]


def int_at(at, value):
    return lambda: patched(tm25(), at, struct.pack("<i", value))


TWO = [[(400, 1), (500, 2)]]
DAMAGED = {
    # TM-25
    "tm25 cut in its header": (lambda: tm25()[:1000], "do not hold its header"),
    "tm25 cut in its rays": (lambda: tm25()[:-5], "is cut short: 3 rays of 28 bytes from byte 36288 on"),
    "tm25 with more bytes": (lambda: tm25() + b"more", "is longer than its rays"),
    "tm25 cut in a spectrum": (lambda: tm25(kind=3, spectra=TWO)[:36300], "is cut short in its spectrum 1"),
    "tm25 of another version": (int_at(4, 2040), "its version is 2040; version 2013 is read"),
    "tm25 of no rays": (lambda: tm25(RAYS[:0]), "its number of rays must be above 0"),
    "tm25 of endless rays": (lambda: patched(tm25(), 20, struct.pack("<Q", 2**60)), "must be above 0 and below 2^40"),
    "tm25 of many rays": (lambda: patched(tm25(), 20, struct.pack("<Q", 2**33)), "is cut short"),
    "tm25 with a flag of 2": (lambda: tm25(flags=(1, 1, 2, 0, 0, 0, 0, 0)), "must be 0 or 1"),
    "tm25 without places": (lambda: tm25(flags=(0, 1, 1, 0, 0, 0, 0, 0)), "those of place and direction 1"),
    "tm25 without flux": (lambda: tm25(flags=(1, 1, 0, 0, 0, 0, 0, 0)), "neither the radiant nor the luminous flux"),
    "tm25 without its wavelengths": (lambda: tm25(kind=2), "flags say that none are known"),
    "tm25 of wavelength 0": (lambda: tm25(kind=1, wavelength=0), "single wavelength must be above 0 nm"),
    "tm25 of kind 9": (int_at(60, 9), "spectral_kind must be from 0 to 4, got 9"),
    "tm25 without its spectra": (lambda: tm25(kind=3), "its 0 spectra and its flags do not fit its kind 3"),
    "tm25 with -1 spectra": (int_at(76, -1), "spectra must be from 0 to 100000, got -1"),
    "tm25 with -1 text": (int_at(84, -32), "text_bytes must be from 0"),
    "tm25 with an empty spectrum": (lambda: tm25(kind=3, spectra=[[]]), "number of points must be from 1"),
    "tm25 with spectrum out of order": (
        lambda: tm25(kind=3, spectra=[[(500, 1), (400, 2)]]), "spectrum 1: two or more climbing wavelengths",
    ),
    "tm25 with negative spectrum": (lambda: tm25(kind=3, spectra=[[(400, 1), (500, -2)]]), "values of 0 or more"),
    "tm25 with a spectrum in µm": (lambda: tm25(kind=3, spectra=[[(0.4, 1), (0.5, 2)]]), "from 100 to 20000 nm"),
    "tm25 with unknown spectrum": (
        lambda: tm25(with_columns([1, 2, 1]), flags=(1, 1, 1, 0, 0, 0, 0, 1), kind=4, spectra=TWO),
        "ray 2: its spectrum must be a whole number from 1 to 1, got 2",
    ),
    "tm25 with NaN": (lambda: tm25(changed(1, 0, np.nan)), "ray 2: its place must be finite"),
    "tm25 with a long direction": (lambda: tm25(changed(1, 5, 2)), "direction must be of length 1, got 0.6, 0, 2"),
    "tm25 without a direction": (lambda: tm25(changed(0, 5, 0)), "ray 1: its direction must be of length 1"),
    "tm25 with negative flux": (lambda: tm25(changed(2, 6, -1)), "ray 3: its flux must be finite and 0 or more"),
    "tm25 without any light": (lambda: tm25(RAYS * [1, 1, 1, 1, 1, 1, 0]), "no ray has a flux above 0"),
    "tm25 with a wavelength in µm": (lambda: tm25(kind=1, wavelength=0.55), "must be from 100 to 20000 nm, got 0.55"),
    # Zemax, binary
    "dat cut in its header": (lambda: dat()[:100], "do not hold its header"),
    "dat cut in its rays": (lambda: dat()[:-1], "is cut short: 3 rays of 28 bytes make 292 bytes, it has 291"),
    "dat with more rays": (lambda: dat(count=2), "is longer than its rays"),
    "dat of no rays": (lambda: dat(RAYS[:0]), "holds no ray"),
    "dat of unknown unit": (lambda: dat(unit=9), "unit of length must be 0 (m)"),
    "dat of format 1": (lambda: dat(form=1), "format must be 0 (flux) or 2 (spectral)"),
    "dat of flux 7": (lambda: dat(flux_kind=7), "got 0 and 7"),
    "dat spectral by its header only": (lambda: dat(form=2), "is cut short: 3 rays of 32 bytes"),
    "dat with NaN": (lambda: dat(changed(0, 6, np.nan)), "ray 1: its flux must be finite"),
    "dat with infinity": (lambda: dat(changed(0, 2, np.inf)), "ray 1: its place must be finite"),
    "dat beyond float32 in mm": (lambda: dat(changed(0, 2, 1e38), unit=0), "ray 1: its place must be finite"),
    "dat with a short direction": (lambda: dat(changed(2, 3, 0.9)), "ray 3: its direction must be of length 1"),
    "dat with negative flux": (lambda: dat(changed(1, 6, -0.5)), "ray 2: its flux must be finite and 0 or more"),
    "dat with wavelengths in nm": (lambda: dat(with_columns([450, 550, 650]), form=2), "got 450000"),
    # Zemax, text
    "text cut short": (lambda: dat_text().rsplit(b"\n", 2)[0], "says that it holds 3 rays, but 2 lines follow"),
    "text cut in a line": (lambda: dat_text()[:-3], "line 4: 7 numbers are needed"),
    "text with a word": (lambda: dat_text().replace(b"0.25 0.6", b"x 0.6"), "line 3: 7 numbers are needed, got"),
    "text with few columns": (lambda: b"1 4\n1 2 3\n", "a ray is x y z l m n flux, and a wavelength or none, got 3"),
    "text of unknown unit": (lambda: dat_text(unit=7), "unit of length must be 0 (m)"),
    "text of no rays": (lambda: b"0 4\n", "holds no ray"),
    "text of another kind": (lambda: b"hello there\n", "no known format of rays"),
    "text with NaN": (lambda: dat_text(changed(1, 6, np.nan)), "ray 2: its flux must be finite"),
    "text of one number": (lambda: b"3\n", "no known format of rays"),
    # others
    "empty": (lambda: b"", "is empty"),
    "picture": (lambda: b"\x89PNG\r\n\x1a\n" + bytes(300), "not a text file"),
    "zeros": (lambda: bytes(5000), "not a text file"),
    "Parquet cut short": (lambda: b"PAR1" + bytes(20), "is damaged"),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGED)
def test_damage_is_told_in_one_sentence(tmp_path, damage):
    make, words = DAMAGED[damage]
    with pytest.raises(FormatError) as caught:
        read(tmp_path, make())
    sentence = str(caught.value)
    assert words in sentence
    assert "source.bin" in sentence
    assert sentence.endswith(".")
    assert "\n" not in sentence
    assert len(sentence) < 400


def scrambled(content, seed):
    """Bytes changed, taken out and put in at a few places, of the header or of the rays."""
    rng = np.random.default_rng(seed)
    data = bytearray(content)
    for _ in range(rng.integers(1, 6)):
        in_texts = 288 < len(data) > 36288 and rng.random() < 0.9  # long texts that nobody reads
        at = int(rng.choice([*range(288), *range(36288, len(data))]) if in_texts else rng.integers(len(data)))
        end = at + int(rng.integers(0, 9))
        data[at:end] = bytes(rng.integers(0, 256, rng.integers(0, 9), dtype=np.uint8))
    return bytes(data)


@pytest.mark.parametrize(
    "content",
    [
        tm25(with_columns([2, 1, 2]), flags=(1, 1, 1, 0, 0, 0, 0, 1), kind=4, spectra=[[(400, 1), (500, 2)]] * 2),
        dat(),
        dat_text(),
    ],
    ids=["tm25", "dat", "text"],
)
def test_scrambled_files_are_read_or_refused(tmp_path, content):
    sentences = []
    for seed in range(100):
        try:
            rays = read(tmp_path, scrambled(content, seed))
        except FormatError as error:
            sentences.append(str(error))
        else:
            assert np.isfinite(rays.position_mm).all()
            assert rays.power.min() >= 0
    assert len(sentences) > 30
    assert all(sentence.endswith(".") and "\n" not in sentence for sentence in sentences)


def own(tmp_path, change=None, **about):
    """Our own file, its table or metadata changed."""
    path = tmp_path / "source.bin"
    write_rays(path, some_rays(20, **{k: v[:20] if k == "wavelength_nm" else v for k, v in colours()[1].items()}))
    table = pq.read_table(path)
    metadata = table.schema.metadata
    if change is None and not about:
        return path
    if change is not None:
        table = change(table)
    if about:
        data = {**json.loads(metadata[b"raymaps-rays"]), **about}
        metadata = {"raymaps-rays": json.dumps(data)}
    pq.write_table(table.replace_schema_metadata(metadata), path)
    return path


OWN_DAMAGED = {
    "another table": (
        lambda p: pq.write_table(pq.read_table(own(p)).replace_schema_metadata(None), own(p)),
        "not one of rays",
    ),
    "newer": (lambda p: own(p, version=2), "has version 2, this program reads version 1"),
    "without a column": (lambda p: own(p, lambda t: t.drop_columns(["ky"])), "has no 'ky'"),
    "with words": (
        lambda p: own(p, lambda t: t.set_column(6, "power", [["a"] * 20])),
        "column power must hold numbers",
    ),
    "with nulls": (lambda p: own(p, lambda t: t.set_column(6, "power", [[None] + [1.0] * 19])), "must hold numbers"),
    "negative": (lambda p: own(p, lambda t: t.set_column(6, "power", [[-1.0] * 20])), "ray 1: its flux must be finite"),
    "no rays": (lambda p: own(p, lambda t: t.slice(0, 0)), "holds no ray"),
    "bad bands": (lambda p: own(p, bands_nm=[[1.0]]), "damaged metadata"),
    "bands without light": (lambda p: own(p, bands_nm=[[400.0, 500.0]]), "its bands of wavelengths are no bands"),
    "bad spectra": (lambda p: own(p, spectra=[7]), "damaged metadata"),
    "no spectra": (lambda p: own(p, spectra=None), "damaged metadata"),
    "cut": (lambda p: own(p).write_bytes(own(p).read_bytes()[:-40]), "is damaged"),
    "flipped": (lambda p: own(p).write_bytes(patched(own(p).read_bytes(), 60, b"\xff" * 30)), "is damaged"),
}


@pytest.mark.parametrize("damage", OWN_DAMAGED)
def test_damage_of_our_own_file_is_told_in_one_sentence(tmp_path, damage):
    make, words = OWN_DAMAGED[damage]
    make(tmp_path)
    with pytest.raises(FormatError) as caught:
        read_rays(tmp_path / "source.bin")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


# ------------------------------------------------------------------------------------------- sets of a scene


def rays_scene(**more):
    source = {"kind": "rays", "flux_w": 1, **more}
    return {"format": "raymaps-scene", "version": 1, "sources": {"R": source, "P": point()}}


def point():
    return {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}


def test_sets_of_a_scene_are_read_beside_it(tmp_path):
    (tmp_path / "led.tm25ray").write_bytes(tm25())
    sets = load_ray_sets(scene_from_dict(rays_scene(file="led.tm25ray"), folder=tmp_path))
    assert list(sets) == ["R"]
    are_the_rays(sets["R"])


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ({"file": "none.dat"}, r"^Source 'R': ray file '.*none\.dat': there is no such file\.$"),
        ({"file": "."}, r"^Source 'R': ray file .* can't be read"),
        (
            {"kind": "crossings", "map": "no.raymap", "detector": "D"},
            r"^Source 'R': .*no\.raymap.*there is no such folder",
        ),
    ],
)
def test_what_can_not_be_read_names_its_source(tmp_path, source, words):
    data = rays_scene(**source)
    with pytest.raises(SceneError, match=words):
        load_ray_sets(scene_from_dict(data, folder=tmp_path))


def test_axes_of_rays_must_differ():
    with pytest.raises(SceneError, match="x_axis must not be parallel to the z_axis"):
        scene_from_dict(rays_scene(file="x.dat", z_axis=[1, 1, 0], x_axis=[-2, -2, 0]))
