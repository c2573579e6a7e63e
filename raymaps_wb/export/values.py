# SPDX-License-Identifier: LGPL-2.1-or-later
"""Numbers, colours, spectra and tables of document objects, as a scene has them."""

import os
from functools import lru_cache

from raymaps_wb.errors import ExportError
from raymaps_wb.export import tables
from raymaps_wb.export.scene_files import existing_file


def bands(values, where, what, default=0.0):
    """One number, or a list of three; raises `ExportError` for another count."""
    values = [float(value) for value in values] or [default]
    if len(values) not in (1, 3):
        raise ExportError(f"{where}: {what} takes one value or three (red, green, blue), got {len(values)}.")
    return values[0] if len(values) == 1 else values


def spectral_value(obj, prop, where, files, default=0.0):
    """A value that may depend on wavelength.

    Parameters
    ----------
    obj : document object
    prop : Property
        Of the numbers; ``prop.file`` names that of the file.
    where : str, what the object is called in errors
    files : SceneFiles
    default : float, where no number is given

    Returns
    -------
    float, list of three floats, or dict
    """
    what = prop.label or words(prop.name)
    path = getattr(obj, prop.file)
    if not path:
        return bands(getattr(obj, prop.name), where, what.lower(), default)
    form = next(other.form for other in obj.Proxy.PROPERTIES if other.name == prop.file)
    if form == "share":
        path = existing_file(obj.Document, path, where, what)
        if read(where, tables.is_over_angle, path):
            table = read(where, tables.share_over_angle, path)
            return {**table, **(outside(obj) if "wavelength_nm" in table else {})}
    name = files.add(obj.Document, path, where, what)
    read(where, tables.spectrum, files.files[name])
    return {"file": name, **outside(obj)}


def outside(obj):
    """What holds outside of the tables of an object, where that is not the usual."""
    return {"outside": "clamp"} if obj.OutsideTables == "Clamp" else {}


def table_of(obj, name, where, reader, *arguments):
    """The table in a file that a property names; raises `ExportError`."""
    path = existing_file(obj.Document, getattr(obj, name), where, words(name).lower())
    return read(where, reader, path, *arguments)


def read(where, reader, *arguments):
    """What a reader of tables says, its errors with the object's name before them."""
    path, *others = arguments
    try:
        status = os.stat(path)
        return _read(reader, path, status.st_size, status.st_mtime_ns, *others)
    except ExportError as error:
        raise ExportError(f"{where}: {error}") from error
    except OSError as error:
        raise ExportError(f"{where}: the file '{path}' can't be read: {error.strerror or error}.") from error


@lru_cache(maxsize=64)
def _read(reader, path, size, mtime_ns, *arguments):
    """Files are looked at after every change of a document: what did not change is not read again."""
    return reader(path, *arguments)


def words(name):
    """Name of a property as words: MaxAngle becomes "Max angle"."""
    spaced = "".join(f" {c.lower()}" if c.isupper() else c for c in name).strip()
    return spaced[:1].upper() + spaced[1:]


def prop_of(obj, name):
    """The declared property of an object by its name."""
    return next(prop for prop in obj.Proxy.PROPERTIES if prop.name == name)
