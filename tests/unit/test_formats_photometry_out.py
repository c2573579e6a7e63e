# SPDX-License-Identifier: LGPL-2.1-or-later
"""IES and EULUMDAT files that are written, read again by the readers of luminaires."""

import math
from pathlib import Path

import numpy as np
import pytest

from raymaps.errors import FormatError
from raymaps.formats.eulumdat import is_eulumdat, parse_eulumdat
from raymaps.formats.ies import is_ies, parse_ies
from raymaps.formats.photometry_out import MOST_GAMMAS, MOST_PLANES, Photometry, eulumdat_text, ies_text

FORMATS = {"ies": (ies_text, parse_ies, is_ies), "ldt": (eulumdat_text, parse_eulumdat, is_eulumdat)}


def photometry(shape=(8, 19), seed=1, scale=100.0, lamps_lm=None, **more):
    rng = np.random.default_rng(seed)
    candela = scale * rng.exponential(size=shape)
    candela[:, 0], candela[:, -1] = candela[0, 0], candela[0, -1]
    given = {"name": "Lamp", "date": "2026-01-31", "luminaire_lm": 1234.5678, "remarks": ("absolute photometry",)}
    return Photometry(candela=candela, lamps_lm=lamps_lm, **{**given, **more})


@pytest.mark.parametrize("format_", FORMATS)
@pytest.mark.parametrize("lamps_lm", [None, 1000.0, 1.0], ids=["absolute", "relative", "faint"])
@pytest.mark.parametrize("scale", [1e-4, 1.0, 3e6])
@pytest.mark.parametrize("shape", [(1, 19), (2, 2), (7, 37), (72, 37)])
def test_round_trip_within_the_printed_digits(format_, lamps_lm, scale, shape):
    write, parse, recognised = FORMATS[format_]
    of = photometry(shape, scale=scale, lamps_lm=lamps_lm)
    text = write(of)
    assert recognised(text)
    data = parse(text, Path("lamp"))
    candela = np.array(data["candela"])
    # the readers close the circle: the half plane at 360 degrees is that at 0
    assert np.array(data["c_deg"]) == pytest.approx(np.append(of.c_deg, 360.0), abs=1e-4)
    assert np.array(data["gamma_deg"]) == pytest.approx(of.gamma_deg, abs=1e-4)
    expected = np.concatenate([of.candela, of.candela[:1]])
    # six digits of the largest value: half a unit of the last one, of a value that may start with a 1
    assert np.abs(candela - expected).max() <= 0.51e-5 * expected.max()


def test_lines_of_an_ies_file():
    lines = ies_text(photometry((2, 3))).split("\r\n")
    assert lines[0] == "IESNA:LM-63-2002"
    keywords = [line.split("]")[0] + "]" for line in lines if line.startswith("[")]
    assert {"[TEST]", "[TESTLAB]", "[ISSUEDATE]", "[MANUFAC]"} <= set(keywords)  # which the standard demands
    at = lines.index("TILT=NONE")
    assert lines[at + 1 : at + 5] == ["1 -1 1 3 3 1 2 0 0 0", "1 1 0", "0 90 180", "0 180 360"]
    assert all(len(line) <= 256 for line in lines)
    assert "1 1000 1 3 3 1 2 0 0 0" in ies_text(photometry((2, 3), lamps_lm=1000.0))


def test_lines_of_an_ldt_file():
    lines = eulumdat_text(photometry((4, 3))).split("\r\n")
    # lines of the specification counted from 1: symmetry, planes and their step, angles and their step
    assert [lines[i - 1] for i in (3, 4, 5, 6, 7)] == ["0", "4", "90", "3", "90"]
    assert [lines[i - 1] for i in (23, 24, 26, 27, 29)] == ["100", "1", "1", "-1", "1234.5678"]
    assert lines[42:46] == ["0", "90", "180", "270"]
    assert lines[46:49] == ["0", "90", "180"]
    assert len(lines) == 26 + 6 + 10 + 4 + 3 + 12 + 1  # and what follows the last end of line
    relative = eulumdat_text(photometry((4, 3), lamps_lm=2000.0)).split("\r\n")
    assert [relative[i - 1] for i in (23, 27, 29)] == ["61.7284", "1", "2000"]


def test_share_of_the_flux_that_goes_down():
    """A Lambertian lamp that shines down: all of it, but for half of the cell around 90 degrees, which is dark."""
    gamma = np.radians(np.arange(0, 181, 5))
    down = np.tile(np.maximum(np.cos(gamma), 0), (4, 1))
    of = Photometry("Lamp", down, math.pi, None, "")
    assert float(eulumdat_text(of).split("\r\n")[21]) == pytest.approx(100, abs=0.01)
    assert float(eulumdat_text(Photometry("Lamp", down[:, ::-1], math.pi, None, "")).split("\r\n")[21]) < 1e-9
    both = Photometry("Lamp", np.ones((4, 37)), math.pi, None, "")
    assert float(eulumdat_text(both).split("\r\n")[21]) == pytest.approx(50, abs=0.01)


@pytest.mark.parametrize("format_", FORMATS)
def test_texts_that_could_break_a_file(format_):
    write, parse, _ = FORMATS[format_]
    of = photometry(name="Straße\r\nTILT=NONE\n" + "x" * 500, remarks=("a\nb", "5 ± 2 °"))
    text = write(of)
    assert text.isascii()
    assert np.array(parse(text, Path("lamp"))["candela"]).shape == (9, 19)


def test_more_directions_than_eulumdat_holds():
    for shape in ((MOST_PLANES + 1, 3), (2, MOST_GAMMAS + 1)):
        with pytest.raises(FormatError, match="EULUMDAT holds at most 721 planes C and 1801 angles gamma, got"):
            eulumdat_text(photometry(shape))
