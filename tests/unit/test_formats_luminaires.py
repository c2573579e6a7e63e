# SPDX-License-Identifier: LGPL-2.1-or-later
"""Luminaire files IES LM-63 and EULUMDAT: what they say is read, and every damage is told in one sentence."""

from __future__ import annotations

import numpy as np
import pytest

from raymaps.errors import FormatError, SceneError
from raymaps.formats.luminaire_files import read_luminaire
from raymaps.formats.photometry_out import Photometry, eulumdat_text, ies_text
from raymaps.scene import IntensityTable, scene_from_dict

GAMMA = (0.0, 45.0, 90.0)


def ies(
    c,
    rows,
    *,
    gamma=GAMMA,
    first_line="IESNA:LM-63-2002",
    tilt="NONE",
    after_tilt="",
    lamps="1 1000 1",
    kind="1 2",
    factors="1 1 40",
):
    numbers = [
        f"{lamps} {len(gamma)} {len(c)} {kind} 0 0 0", factors, " ".join(map(str, gamma)), " ".join(map(str, c)),
        *(" ".join(map(str, row)) for row in rows),
    ]  # fmt: skip
    head = [first_line, "[TEST] 4711", "[MANUFAC] Nobody", "[LUMINAIRE] Tür, 3 m", f"TILT={tilt}"]
    return "\r\n".join([line for line in head if line] + ([after_tilt] if after_tilt else []) + numbers) + "\r\n"


def ldt(symmetry, c, rows, *, gamma=GAMMA, lamps=((1, "T16", "1000", "840", "1B", "28"),), factor="1", n_c=None):
    head = [
        "Nobody Ltd.", "1", str(symmetry), str(n_c or len(c)), "30", str(len(gamma)), "45", "4711", "Tür … hell", "N-1",
        "file.ldt", "2020", "1200", "200", "80", "1180", "180", "0", "0", "0", "0", "98", "85.5", factor, "0",
        str(len(lamps)),
    ]  # fmt: skip
    lines = head + [str(value) for lamp in lamps for value in lamp] + ["0.5"] * 10
    lines += [f"{v:g}" for v in c] + [f"{v:g}" for v in gamma] + [f"{v:g}" for row in rows for v in row]
    return "\r\n".join(lines) + "\r\n"


def read(tmp_path, text, name="lamp.txt"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode("cp1252"))
    return read_luminaire(path)


def row(k):
    """A half plane of its own: k in the tens of every intensity."""
    return (10 * k + 1.0, 10 * k + 2.0, 10 * k + 3.0)


def as_table(data):
    return dict(zip(data["c_deg"], data["candela"], strict=True))


# --------------------------------------------------------------------------------------------------- IES


def test_ies_with_all_half_planes(tmp_path):
    c = (0, 90, 180, 270, 360)
    data = read(tmp_path, ies(c, [row(1), row(2), row(3), row(4), row(1)]))
    assert data == {"c_deg": c, "gamma_deg": GAMMA, "candela": (row(1), row(2), row(3), row(4), row(1))}


def test_ies_of_rotation(tmp_path):
    data = read(tmp_path, ies((0,), [row(1)]))
    assert data == {"c_deg": (0, 360), "gamma_deg": GAMMA, "candela": (row(1), row(1))}


def test_ies_alike_in_quadrants(tmp_path):
    data = read(tmp_path, ies((0, 30, 90), [row(1), row(2), row(3)]))
    expected = {0: 1, 30: 2, 90: 3, 150: 2, 180: 1, 210: 2, 270: 3, 330: 2, 360: 1}
    assert as_table(data) == {c: row(k) for c, k in expected.items()}


def test_ies_alike_on_both_sides_of_the_plane_of_0(tmp_path):
    data = read(tmp_path, ies((0, 60, 180), [row(1), row(2), row(3)]))
    assert as_table(data) == {c: row(k) for c, k in {0: 1, 60: 2, 180: 3, 300: 2, 360: 1}.items()}


def test_ies_alike_on_both_sides_of_the_plane_of_90(tmp_path):
    data = read(tmp_path, ies((90, 135, 180, 225, 270), [row(1), row(2), row(3), row(4), row(5)]))
    expected = {0: 3, 45: 2, 90: 1, 135: 2, 180: 3, 225: 4, 270: 5, 315: 4, 360: 3}
    assert as_table(data) == {c: row(k) for c, k in expected.items()}


def test_ies_without_its_last_half_plane_is_closed(tmp_path):
    data = read(tmp_path, ies((0, 90, 180, 270), [row(1), row(2), row(3), row(4)]))
    assert as_table(data)[360] == row(1)


@pytest.mark.parametrize(
    ("first_line", "scale"),
    [
        ("IESNA:LM-63-2002", 6.0),
        ("IES:LM-63-2019", 6.0),
        ("IESNA:LM-63-1995", 3.0),
        ("IESNA91", 3.0),
        ("Lamp of 1986", 3.0),
    ],
)
def test_ies_factors(tmp_path, first_line, scale):
    """Multiplier 4, ballast factor 1.5, and a lamp factor of 0.5 that counts up to 1995 only."""
    text = ies((0,), [row(1)], first_line=first_line, lamps="2 -1 4", factors="1.5 0.5 40")
    assert read(tmp_path, text)["candela"][0] == pytest.approx([scale * v for v in row(1)])


def test_ies_tilt_is_passed_over_and_numbers_wrap_as_they_like(tmp_path):
    text = ies((0,), [row(1)], tilt="INCLUDE", after_tilt="1\r\n3\r\n0 45 90\r\n1 0.95 0.9")
    expected = read(tmp_path, ies((0,), [row(1)]))
    assert read(tmp_path, text) == expected
    head, numbers = text.split("INCLUDE\r\n")
    assert read(tmp_path, head + "INCLUDE\n" + "\n".join(numbers.split())) == expected
    assert read(tmp_path, head + "INCLUDE\n" + ", ".join(numbers.split()) + "\x1a") == expected
    assert read(tmp_path, ies((0,), [row(1)], tilt="lamp.tlt")) == expected
    assert read(tmp_path, text.replace("TILT=", "TILT = ")) == expected


DAMAGED_IES = {
    "cut short": (lambda t: t[: t.rindex("21")], "cut short"),
    "cut before its numbers": (lambda t: t[: t.index("1 1000")], "cut short"),
    "without TILT": (lambda t: t.replace("TILT=NONE\r\n", ""), "no line TILT="),
    "type B": (lambda t: t.replace(" 1 2 0 0 0", " 2 2 0 0 0"), "type B; only type C is read"),
    "type A": (lambda t: t.replace(" 1 2 0 0 0", " 3 2 0 0 0"), "type A; only type C is read"),
    "unknown unit": (lambda t: t.replace(" 1 2 0 0 0", " 1 7 0 0 0"), "unit 1 (feet) or 2 (metres), got 1 and 7"),
    "too few half planes": (lambda t: t.replace(" 3 2 1 2 ", " 3 1 1 2 "), "counts are wrong"),
    "huge counts": (lambda t: t.replace(" 3 2 1 2 ", " 100000 100000 1 2 "), "more than a measurement has"),
    "fraction of a count": (lambda t: t.replace(" 3 2 1 2 ", " 3.5 2 1 2 "), "must be a whole number"),
    "angles out of order": (lambda t: t.replace("0.0 45.0 90.0", "0.0 95.0 90.0"), "must climb within 0 to 180"),
    "angle beyond": (lambda t: t.replace("0.0 45.0 90.0", "0.0 45.0 270.0"), "must climb within 0 to 180"),
    "half planes of no symmetry": (lambda t: t.replace("0 180\r\n", "0 100\r\n"), "got 0 to 100"),
    "negative": (lambda t: t.replace("22.0", "-22.0"), "from 0 to 1e+11 and above 0 somewhere, got -22"),
    "not a number": (lambda t: t.replace("22.0", "nan"), "line 11: candela values: 'nan' is not a number"),
    "a word": (lambda t: t.replace("22.0", "22,O"), "'O' is not a number"),
    "all dark": (lambda t: t[: t.index("11.0")] + "0 0 0 0 0 0", "above 0 somewhere, got 0 to 0"),
    "factor 0": (lambda t: t.replace("1 1000 1 ", "1 1000 0 "), "must be above 0, got 0 and 1"),
    "absurd": (lambda t: t.replace("22.0", "1e30"), "got 11 to 1e+30"),
    "too much": (lambda t: t + "17 18\r\n", "'17' follows the last candela value"),
}


@pytest.mark.parametrize("damage", DAMAGED_IES)
def test_damaged_ies_is_told_in_one_sentence(tmp_path, damage):
    change, words = DAMAGED_IES[damage]
    sound = ies((0, 180), [row(1), row(2)])
    read(tmp_path, sound, "lamp.ies")
    assert change(sound) != sound
    one_sentence(tmp_path, change(sound), words, "lamp.ies")


# ----------------------------------------------------------------------------------------------- EULUMDAT


def test_ldt_without_symmetry(tmp_path):
    c = (0, 90, 180, 270)
    data = read(tmp_path, ldt(0, c, [row(1), row(2), row(3), row(4)]))
    assert data["gamma_deg"] == GAMMA
    assert as_table(data) == {0: row(1), 90: row(2), 180: row(3), 270: row(4), 360: row(1)}


def test_ldt_of_rotation(tmp_path):
    assert as_table(read(tmp_path, ldt(1, (0,), [row(1)]))) == {0: row(1), 360: row(1)}
    assert as_table(read(tmp_path, ldt(1, (0, 90, 180, 270), [row(1)]))) == {0: row(1), 360: row(1)}


def test_ldt_alike_on_both_sides_of_the_plane_of_0(tmp_path):
    c = tuple(range(0, 360, 60))
    data = read(tmp_path, ldt(2, c, [row(1), row(2), row(3), row(4)]))
    expected = {0: 1, 60: 2, 120: 3, 180: 4, 240: 3, 300: 2, 360: 1}
    assert as_table(data) == {c: row(k) for c, k in expected.items()}


def test_ldt_alike_on_both_sides_of_the_plane_of_90(tmp_path):
    """Given from C = 270 over 0 to 90."""
    c = tuple(range(0, 360, 45))
    data = read(tmp_path, ldt(3, c, [row(1), row(2), row(3), row(4), row(5)]))
    expected = {0: 3, 45: 4, 90: 5, 135: 4, 180: 3, 225: 2, 270: 1, 315: 2, 360: 3}
    assert as_table(data) == {c: row(k) for c, k in expected.items()}


def test_ldt_alike_in_quadrants(tmp_path):
    c = tuple(range(0, 360, 30))
    data = read(tmp_path, ldt(4, c, [row(1), row(2), row(3), row(4)]))
    expected = [1, 2, 3, 4, 3, 2, 1, 2, 3, 4, 3, 2, 1]
    assert as_table(data) == {30 * i: row(k) for i, k in enumerate(expected)}


def test_ldt_is_in_candela_per_kilolumen(tmp_path):
    lamps = ((2, "T16", "2600,5", "840", "1B", "28"),)
    data = read(tmp_path, ldt(1, (0,), [row(1)], lamps=lamps, factor="1.5"))
    assert data["candela"][0] == pytest.approx([v * 1.5 * 2.6005 for v in row(1)])
    assert as_table(read(tmp_path, ldt(1, (0,), [row(1)], lamps=())))[0] == row(1)


def test_ldt_with_two_sets_of_lamps(tmp_path):
    two = ((1, "A", "1000", "840", "1B", "28"), (2, "B", "900", "840", "1B", "28"))
    assert as_table(read(tmp_path, ldt(1, (0,), [row(1)], lamps=two)))[360] == row(1)


def replaced_line(text, number, by):
    lines = text.split("\r\n")
    lines[number - 1 : number] = [by] if by is not None else []
    return "\r\n".join(lines)


DAMAGED_LDT = {
    "cut short": (lambda t: t[: t.rindex("23")], "ends at line"),
    "cut in its head": (lambda t: "\r\n".join(t.split("\r\n")[:20]), "ends at line 20, before its number of sets"),
    "symmetry 7": (lambda t: replaced_line(t, 3, "7"), "symmetry Isym must be a whole number from 0 to 4, got 7"),
    "a word for a count": (
        lambda t: replaced_line(t, 4, "many"),
        "line 4: number of C planes Mc: 'many' is not a number",
    ),
    "more planes": (lambda t: replaced_line(t, 4, "6"), "C angles must climb"),
    "fewer angles": (lambda t: replaced_line(t, 6, "2"), "counts are wrong"),
    "huge counts": (lambda t: replaced_line(t, 6, "99999"), "from 2 to 1801, got 99999"),
    "planes that its symmetry has not": (
        lambda t: replaced_line(t, 3, "3").replace("\r\n90\r\n", "\r\n91\r\n", 1).split("41\r\n")[0],
        "its C angles are not those of its symmetry 3",
    ),
    "symmetry that does not divide": (
        lambda t: ldt(4, (0, 90, 180), [row(1)]),
        "its symmetry 4 needs a number of C planes that 4 divides, got 3",
    ),
    "a line too many in its head": (lambda t: replaced_line(t, 9, "Tür\r\nhell"), "EULUMDAT file"),
    "angles out of order": (lambda t: t.replace("\r\n0\r\n45\r\n90\r\n", "\r\n0\r\n95\r\n90\r\n"), "must climb"),
    "negative": (lambda t: t.replace("\r\n22\r\n", "\r\n-22\r\n"), "above 0 somewhere, got -22 to 43"),
    "not a number": (lambda t: t.replace("\r\n22\r\n", "\r\nNaN\r\n"), "intensities: 'NaN' is not a number"),
    "absurd": (lambda t: t.replace("\r\n22\r\n", "\r\n1e20\r\n"), "got 11 to 1e+20"),
    "too much": (lambda t: t + "17\r\n", "'17' follows the last intensity"),
}


@pytest.mark.parametrize("damage", DAMAGED_LDT)
def test_damaged_ldt_is_told_in_one_sentence(tmp_path, damage):
    change, words = DAMAGED_LDT[damage]
    sound = ldt(0, (0, 90, 180, 270), [row(1), row(2), row(3), row(4)])
    read(tmp_path, sound, "lamp.ldt")
    assert change(sound) != sound
    one_sentence(tmp_path, change(sound), words, "lamp.ldt")


# ----------------------------------------------------------------------------------------------- both


def one_sentence(tmp_path, text, words, name):
    with pytest.raises(FormatError) as caught:
        read(tmp_path, text, name)
    sentence = str(caught.value)
    assert words in sentence
    assert name in sentence
    assert sentence.endswith(".")
    assert "\n" not in sentence
    assert len(sentence) < 400


@pytest.mark.parametrize(
    "text",
    [ies((0, 90), [row(1), row(2)]), ldt(2, tuple(range(0, 360, 60)), [row(1), row(2), row(3), row(4)])],
    ids=["ies", "ldt"],
)
def test_scrambled_files_are_read_or_refused(tmp_path, text):
    """Characters changed, taken out and put in at a few places: a sound table or one sentence."""
    sentences = []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        scrambled = text
        for _ in range(rng.integers(1, 6)):
            at = int(rng.integers(len(scrambled)))
            put = "".join(rng.choice(list("0123456789.-e+ \n\rnaif,"), rng.integers(0, 4)))
            scrambled = scrambled[:at] + put + scrambled[at + int(rng.integers(0, 4)) :]
        try:
            data = read(tmp_path, scrambled)
        except FormatError as error:
            sentences.append(str(error))
        else:
            IntensityTable.model_validate(data)
    assert len(sentences) > 50
    assert all(sentence.endswith(".") and "\n" not in sentence for sentence in sentences)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "not a text file"),
        (b'{"format": "raymaps-scene"}', "no known format of luminaires"),
        (b"\n" * 100, "is empty"),
        (b"0.1 0.2\n0.3 0.4\n", "no known format of luminaires"),
    ],
)
def test_files_of_other_formats(tmp_path, content, words):
    one_sentence(tmp_path, content, words, "lamp.txt")


def test_missing_file(tmp_path):
    with pytest.raises(FormatError, match="there is no such file"):
        read_luminaire(tmp_path / "none.ies")


def test_a_file_is_told_by_what_it_holds(tmp_path):
    swapped = read(tmp_path, ldt(1, (0,), [row(1)]), "lamp.txt")
    assert swapped == read(tmp_path, ies((0,), [row(1)]), "lamp.ldt")


def luminaire_scene(**changes):
    source = {"kind": "luminaire", "flux_w": 1, "position_mm": [0, 0, 0], **changes}
    return {"format": "raymaps-scene", "version": 1, "sources": {"L": source}}


def test_a_scene_holds_the_table_of_its_file(tmp_path):
    (tmp_path / "lamp.ies").write_text(ies((0, 90), [row(1), row(2)]))
    scene = scene_from_dict(luminaire_scene(intensity={"file": "lamp.ies"}), folder=tmp_path)
    table = scene.sources["L"].intensity
    assert table.c_deg == (0, 90, 180, 270, 360)
    assert np.array(table.candela)[:, 0].tolist() == [11, 21, 11, 21, 11]


def test_a_scene_tells_what_is_wrong_with_its_file(tmp_path):
    (tmp_path / "lamp.ies").write_text(ies((0, 90), [row(1)]))
    with pytest.raises(SceneError, match=r"sources 'L'.*lamp\.ies.*cut short"):
        scene_from_dict(luminaire_scene(intensity={"file": "lamp.ies"}), folder=tmp_path)


def test_axes_of_a_luminaire_must_differ(tmp_path):
    data = luminaire_scene(
        intensity={"c_deg": [0.0, 360.0], "gamma_deg": [0.0, 90.0], "candela": [[1.0, 1.0], [1.0, 1.0]]},
        direction=[0, 0, -1], c0_direction=[0, 0, 2.0],
    )  # fmt: skip
    with pytest.raises(SceneError, match="c0_direction must not be parallel to the direction"):
        scene_from_dict(data)


# ------------------------------------------------------------------------------------- what we write ourselves


def photometry(n_c, lamps_lm=None):
    rng = np.random.default_rng(n_c)
    return Photometry("Lamp", rng.uniform(0.5, 900, (n_c, 19)), 1234.5, lamps_lm, "2024-01-02", ("a remark",))


@pytest.mark.parametrize("n_c", [1, 2, 24])
@pytest.mark.parametrize("lamps_lm", [None, 2600.0])
@pytest.mark.parametrize("write", [ies_text, eulumdat_text])
def test_our_own_files_are_read_as_they_were_meant(tmp_path, write, n_c, lamps_lm):
    of = photometry(n_c, lamps_lm)
    data = read(tmp_path, write(of))
    assert data["gamma_deg"] == pytest.approx(of.gamma_deg)
    assert data["c_deg"] == pytest.approx([*of.c_deg, 360])
    assert np.array(data["candela"]) == pytest.approx(np.concatenate([of.candela, of.candela[:1]]), abs=0.01)
