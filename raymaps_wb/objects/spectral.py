# SPDX-License-Identifier: LGPL-2.1-or-later
"""Values that may depend on wavelength, as two properties: numbers, and a file that is used in their place."""

from raymaps_wb.objects.properties import Limits, Property

TEXT_FILES = "Tables (*.csv *.txt *.tsv *.dat);;All files (*)"

#: What a table says of wavelengths outside it.
OUTSIDE = {
    "Refuse": "a run with light of such wavelengths does not start, and says why",
    "Clamp": "the value at the table's border holds there",
}


def spectral(name, text, default, *, file, limits=None, label="", shown_for=(), when=None, form="spectrum"):
    """The two properties of a value that is one number, one for each of red, green and blue, or a file.

    Parameters
    ----------
    name, text, default, label, shown_for, when : see `Property`
    file : str
        Name of the file's property.
    limits : Limits, by default a share from 0 to 1
    form : str
        "spectrum", or "share" for a file over wavelength or over the angle of incidence.
    """
    numbers = "one number, or one for each of red, green and blue, such as 0.9 or 0.9 0.5 0.1"
    table = "a file with two columns, wavelength in nm and value"
    if form == "share":
        table += ", or over the angle of incidence: its first line is angle_deg, value or angle_deg, 450, 550, 650"
    common = {"shown_for": shown_for, "when": when}
    return (
        Property(
            "App::PropertyFloatList",
            name,
            f"{text}: {numbers}; {file} is used in its place where it names a file",
            default,
            label=label,
            limits=limits or Limits(0, 1),
            bands=True,
            file=file,
            **common,
        ),
        Property("App::PropertyFile", file, f"{text}: {table}", "", form=form, filter=TEXT_FILES, **common),
    )


def outside_property(shown_for=()):
    """What the tables of an object say of wavelengths outside them."""
    return Property(
        "App::PropertyEnumeration",
        "OutsideTables",
        "What holds at wavelengths that a spectrum file says nothing of",
        "Refuse",
        label="Off the tables",
        choices=OUTSIDE,
        shown_for=shown_for,
    )
