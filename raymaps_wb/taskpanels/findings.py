# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a chosen file holds, in a few words, so that a wrong one is seen at once. The tracer reads files in full."""

import json
import os
import re
import struct

from raymaps_wb.errors import ExportError
from raymaps_wb.export import tables
from raymaps_wb.gui.figures import count

HEAD_BYTES = 1 << 16


def finding(path, form):
    """What a file holds.

    Parameters
    ----------
    path : str, absolute
    form : str, of the property

    Returns
    -------
    (str, bool): a few words, and whether the file can be what it is to be
    """
    if not path:
        return "", True
    if not os.path.exists(path):
        return "there is no such file", False
    try:
        return FORMS[form](path), True
    except ExportError as error:
        return str(error), False
    except OSError as error:
        return f"can't be read: {error.strerror or error}", False


def glasses(path):
    """Names of the glasses of a Zemax catalogue; empty for other files."""
    if not path.lower().endswith(".agf") or not os.path.isfile(path):
        return []
    return re.findall(r"^NM\s+(\S+)", _text(path), re.M)


def map_detectors(folder):
    """Names of the detectors of a Ray Map; empty if it is none."""
    return list(_manifest(folder).get("names", {}).get("detectors", ()))


def _spectrum(path):
    table = tables.spectrum(path)
    return _range(table["wavelength_nm"], "nm", table["value"])


def _index(path):
    table = tables.index_table(path)
    return _range(table["wavelength_nm"], "nm", table["n"])


def _share(path):
    if not tables.is_over_angle(path):
        if max(tables.read_table(path).rows)[0] <= 90:
            raise ExportError(
                "A table over the angle of incidence begins with a line such as angle_deg, value; this is read as nm."
            )
        return _spectrum(path)
    table = tables.share_over_angle(path)
    found = _range(table["angle_deg"], "\u00b0", [value for row in table["value"] for value in row])
    wavelengths = table.get("wavelength_nm")
    return found + (f", {len(wavelengths)} wavelengths" if wavelengths else "")


def _emission(path):
    table = tables.over_angle(path, 90.0)
    return _range(table["angle_deg"], "\u00b0", table["value"])


def _phase(path):
    table = tables.over_angle(path, 180.0)
    return _range(table["angle_deg"], "\u00b0", table["value"])


def _material(path):
    if path.lower().endswith(".agf"):
        names = glasses(path)
        if not names:
            raise ExportError("No glass (a line that begins with NM) is in this file.")
        return f"glass catalogue of Zemax, {len(names)} glasses"
    if not re.search(r"^\s*DATA\s*:", _text(path), re.M):
        raise ExportError("This is neither a page of refractiveindex.info (no DATA) nor a glass catalogue (*.agf).")
    return "page of refractiveindex.info"


def _luminaire(path):
    head = _head(path)
    if b"TILT" in head.upper():
        return "IES LM-63"
    if path.lower().endswith(".ldt"):
        return "EULUMDAT"
    raise ExportError("This is neither an IES file (no TILT line) nor EULUMDAT (*.ldt).")


def _rays(path):
    head = _head(path)
    if head.startswith(b"TM25"):
        return "IES TM-25"
    if len(head) >= 208:
        identifier, n_rays = struct.unpack("<ii", head[:8])
        if identifier == 1010 and n_rays > 0:
            return f"Zemax source file, {count(n_rays)} rays"
    return "rays, of a kind that the tracer tells"


def _bsdf(path):
    head = _head(path).lstrip()
    if head.startswith((b"<?xml", b"<Window", b"\xef\xbb\xbf<")):
        return "Klems XML"
    if b"\0" in head:
        raise ExportError("This is not a text file.")
    return "BSDF as text"


def _map(folder):
    manifest = _manifest(folder)
    if not manifest:
        raise ExportError("This is not a Ray Map: there is no manifest.json in it.")
    n = len(map_detectors(folder))
    return f"Ray Map with {n} detector{'s' * (n != 1)}"


def _manifest(folder):
    try:
        with open(os.path.join(folder, "manifest.json"), encoding="utf-8") as file:
            data = json.load(file)
    except (OSError, ValueError):
        return {}
    return data if isinstance(data, dict) else {}


def _range(x, unit, y):
    blank = "" if unit == "\u00b0" else " "
    return f"{len(x)} rows, {x[0]:g} to {x[-1]:g}{blank}{unit}, values {min(y):.4g} to {max(y):.4g}"


def _head(path):
    with open(path, "rb") as file:
        return file.read(HEAD_BYTES)


def _text(path):
    with open(path, "rb") as file:
        data = file.read()
    return data.decode("utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8", "replace")


FORMS = {
    "spectrum": _spectrum,
    "index": _index,
    "share": _share,
    "emission": _emission,
    "phase": _phase,
    "material": _material,
    "luminaire": _luminaire,
    "rays": _rays,
    "bsdf": _bsdf,
    "map": _map,
}
