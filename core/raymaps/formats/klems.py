# SPDX-License-Identifier: LGPL-2.1-or-later
"""BSDFs on Klems' patches: the XML files of LBNL WINDOW, Radiance (genBSDF, wrapBSDF) and others.

Each hemisphere is cut into rings of patches. The file holds a matrix of BSDFs in 1/sr for each of the directions
"Transmission Front", "Transmission Back", "Reflection Front", "Reflection Back"; front is the outside of the window.
With ``IncidentDataStructure`` "Columns" a column of the matrix is an incoming patch and a row an outgoing one, with
"Rows" the other way round. A patch's azimuth is that of the direction in which light travels, so the diagonal is what
goes straight on or is reflected specularly; what is specular spreads over its patch. In a ring of n patches the first
is centred on azimuth 0, the x axis, and the others follow counter-clockwise as seen from the back; here they are put
into the order seen from the front. Integrals over the visible or the solar spectrum hold for all bands alike.

References ---------- J. Klems: A new method for predicting the solar heat gain of complex fenestration systems, ASHRAE
Transactions 100 (1994).
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raymaps.errors import FormatError

__all__ = ["KLEMS_BASES", "AngleBasis", "is_klems", "parse_klems"]

Float = NDArray[np.float64]

_LOBES = {
    "transmission front": ("front", "transmission"),
    "transmission back": ("back", "transmission"),
    "reflection front": ("front", "reflection"),
    "reflection back": ("back", "reflection"),
}
_NM = {"nanometer": 1.0, "nm": 1.0, "micrometer": 1e3, "um": 1e3, "micron": 1e3}
_MOST_PATCHES = 2000


@dataclass(frozen=True)
class AngleBasis:
    """Rings of patches: borders of polar angle (n_rings + 1,), and the number of patches in each ring."""

    ring_deg: tuple[float, ...]
    patches: tuple[int, ...]

    def __len__(self) -> int:
        return sum(self.patches)

    @property
    def order(self) -> NDArray[np.int64]:
        """(n_patches,): which patch of the file is each patch counted counter-clockwise as seen from the front."""
        order, first = [], 0
        for n in self.patches:
            order += [first + (n - k) % n for k in range(n)]
            first += n
        return np.array(order)

    @property
    def cells(self) -> dict[str, Any]:
        """Data of a `raymaps.materials.BsdfCells`."""
        azimuths = tuple(tuple((k - 0.5) * 360 / n for k in range(n)) + (360 - 180 / n,) for n in self.patches)
        return {"ring_deg": self.ring_deg, "azimuth_deg": azimuths}


#: The bases that files name without describing them.
KLEMS_BASES: dict[str, AngleBasis] = {
    "LBNL/Klems Full": AngleBasis(
        (0.0, 5.0, 15.0, 25.0, 35.0, 45.0, 55.0, 65.0, 75.0, 90.0), (1, 8, 16, 20, 24, 24, 24, 16, 12)
    ),
    "LBNL/Klems Half": AngleBasis((0.0, 6.5, 19.5, 32.5, 46.5, 61.5, 76.5, 90.0), (1, 8, 12, 16, 20, 12, 4)),
    "LBNL/Klems Quarter": AngleBasis((0.0, 9.0, 27.0, 46.0, 66.0, 90.0), (1, 8, 12, 12, 8)),
}


def is_klems(text: str) -> bool:
    """Whether a text looks like this format."""
    return text.lstrip().startswith("<")


def parse_klems(text: str, path: str, spectrum: str = "visible") -> dict[str, Any]:
    """The data of a `raymaps.materials.BsdfTable`.

    Parameters
    ----------
    path : str
        What the text is called in errors.
    spectrum : "visible" or "solar"
        Which integral to take; data at single wavelengths come before both.

    Raises
    ------
    FormatError
        If the text is not of such a file, is damaged, or holds no such spectrum.
    """
    where = f"Klems file '{path}'"
    layer = _layer(text, where)
    rows = _word(layer, "DataDefinition/IncidentDataStructure", where)
    if rows.lower().startswith("tensortree"):
        raise FormatError(f"{where}: tensor trees ({rows}) can't be read; resample it to Klems' patches (bsdf2klems).")
    if rows.lower() not in ("columns", "rows"):
        raise FormatError(f"{where}: IncidentDataStructure must be Columns or Rows, got '{rows[:40]}'.")
    bases = _bases(layer, where)
    found: dict[str, dict[tuple[str, str], dict[str, Any]]] = {}
    for data in layer.findall("WavelengthData"):
        key = _spectrum_of(data, where)
        for block in data.findall("WavelengthDataBlock"):
            name = _word(block, "WavelengthDataDirection", where)
            lobe = _LOBES.get(" ".join(name.lower().split()))
            if lobe is None:
                raise FormatError(
                    f"{where}: WavelengthDataDirection '{name[:40]}' is unknown; known: Transmission Front, "
                    "Transmission Back, Reflection Front, Reflection Back."
                )
            if lobe in found.setdefault(key, {}):
                raise FormatError(f"{where}: {name} is given twice for {key}.")
            found[key][lobe] = _lobe(block, bases, rows.lower() == "columns", lobe, f"{where}, {key}, {name}")
    wavelengths = sorted((key for key in found if key.endswith(" nm")), key=lambda key: float(key[:-3]))
    chosen = wavelengths or [key for key in found if key.lower() == spectrum]
    if not chosen:
        raise FormatError(
            f"{where}: it holds no data for the {spectrum} spectrum, but for: {', '.join(found) or 'nothing'}; choose "
            "by the field 'spectrum'."
        )
    return {
        "lobes": _merged([found[key] for key in chosen], where),
        "wavelength_nm": tuple(float(key[:-3]) for key in wavelengths) or None,
        "reference": (layer.findtext("Material/Name") or "").strip() or None,
    }


def _layer(text: str, where: str) -> ET.Element:
    """The element that describes the window, without the names of its namespace."""
    if re.search(r"<!(DOCTYPE|ENTITY)", text):
        raise FormatError(f"{where}: document type declarations are not part of this format.")
    try:
        root = ET.fromstring(text.encode("utf-8") if not text.lstrip().startswith("<?xml") else _undeclared(text))
    except ET.ParseError as error:
        line = error.position[0]
        raise FormatError(f"{where}, line {line}: it is not valid XML; it may be cut short.") from None
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    if root.tag != "WindowElement":
        raise FormatError(
            f"{where}: the root element must be WindowElement, got '{root.tag[:40]}'; this is another XML."
        )
    layers = root.findall("Optical/Layer")
    if len(layers) != 1:
        raise FormatError(f"{where}: one element Optical/Layer is needed, got {len(layers)}.")
    return layers[0]


def _undeclared(text: str) -> bytes:
    """XML as UTF-8 without its declaration, which may tell of another encoding."""
    return re.sub(r"^\s*<\?xml[^>]*\?>", "", text, count=1).encode("utf-8")


def _find(element: ET.Element, path: str, where: str) -> str:
    text = element.findtext(path)
    if text is None or not text.strip():
        raise FormatError(f"{where}: the element {path} is missing.")
    return text


def _word(element: ET.Element, path: str, where: str) -> str:
    """Text of an element on one line."""
    return " ".join(_find(element, path, where).split())


def _bases(layer: ET.Element, where: str) -> dict[str, AngleBasis]:
    """The bases that the file may speak of, by their names in small letters: its own and the known ones."""
    bases = {name.lower(): basis for name, basis in KLEMS_BASES.items()}
    for element in layer.findall("DataDefinition/AngleBasis"):
        name = _word(element, "AngleBasisName", where)
        blocks = element.findall("AngleBasisBlock")
        if blocks:
            bases[name.lower()] = _basis(blocks, f"{where}, angle basis '{name[:40]}'")
        elif name.lower() not in bases:
            raise FormatError(f"{where}: the angle basis '{name[:40]}' is unknown and not described.")
    return bases


def _basis(blocks: list[ET.Element], where: str) -> AngleBasis:
    """A basis that a file describes."""
    edges, counts = [0.0], []
    for block in blocks:
        upper = _number(_find(block, "ThetaBounds/UpperTheta", where), f"{where}, UpperTheta")
        lower = _number(block.findtext("ThetaBounds/LowerTheta") or str(edges[-1]), f"{where}, LowerTheta")
        if abs(max(lower, 0.0) - edges[-1]) > 1e-6 or upper <= edges[-1]:
            raise FormatError(
                f"{where}: rings must follow each other without gaps from 0 to 90 degrees, but {lower:g} to {upper:g} "
                f"follows {edges[-1]:g}."
            )
        count = _number(_find(block, "nPhis", where), f"{where}, nPhis")
        if count != int(count) or not 1 <= count <= _MOST_PATCHES:
            raise FormatError(f"{where}: nPhis must be a whole number from 1 to {_MOST_PATCHES}, got {count:g}.")
        edges.append(upper)
        counts.append(int(count))
    if edges[-1] != 90 or sum(counts) > _MOST_PATCHES:
        raise FormatError(
            f"{where}: rings must reach 90 degrees with at most {_MOST_PATCHES} patches, got {edges[-1]:g} and "
            f"{sum(counts)}."
        )
    return AngleBasis(tuple(edges), tuple(counts))


def _spectrum_of(data: ET.Element, where: str) -> str:
    """What spectrum a block is for: "Visible", "Solar" or another word, or "550 nm"."""
    element = data.find("Wavelength")
    text = " ".join((element.text or "").split()) if element is not None else ""
    if element is None or not text:
        raise FormatError(f"{where}: the element Wavelength is missing.")
    try:
        value = float(text)
    except ValueError:
        return text
    unit = element.get("unit", "").lower()
    if unit not in _NM:
        raise FormatError(
            f"{where}: the wavelength {text[:20]} has the unit '{unit[:20]}'; Nanometer or Micrometer is needed."
        )
    return f"{value * _NM[unit]:g} nm"


def _lobe(
    block: ET.Element, bases: dict[str, AngleBasis], columns: bool, lobe: tuple[str, str], where: str
) -> dict[str, Any]:
    """Data of a `raymaps.materials.BsdfLobe` with one layer."""
    kind = block.findtext("ScatteringDataType")
    if kind is not None and kind.strip().upper() not in ("BTDF", "BRDF", "BSDF", "BRTF", ""):
        raise FormatError(f"{where}: ScatteringDataType must be BTDF or BRDF, got '{' '.join(kind.split())[:40]}'.")
    pair = []
    for tag in ("ColumnAngleBasis", "RowAngleBasis"):
        name = _word(block, tag, where)
        if name.lower() not in bases:
            raise FormatError(f"{where}: {tag} '{name[:40]}' is not described; known: {', '.join(KLEMS_BASES)}.")
        pair.append(bases[name.lower()])
    column, row = pair
    numbers = _numbers(_find(block, "ScatteringData", where), where)
    if len(numbers) != len(column) * len(row):
        raise FormatError(
            f"{where}: ScatteringData must hold {len(row)} x {len(column)} = {len(row) * len(column)} numbers, got "
            f"{len(numbers)}; the file may be cut short or of another basis."
        )
    matrix = numbers.reshape(len(row), len(column))
    incoming, outgoing = (column, row) if columns else (row, column)
    values = (matrix.T if columns else matrix)[incoming.order][:, outgoing.order]
    return {
        "comes_from": lobe[0],
        "goes_to": lobe[1],
        "incoming": incoming.cells,
        "outgoing": (outgoing.cells,),
        "value": (tuple(map(tuple, values.tolist())),),
    }


def _numbers(text: str, where: str) -> Float:
    """The numbers of a matrix, separated by blanks or commas."""
    cells = text.replace(",", " ").split()
    try:
        numbers = np.array(cells, dtype=np.float64)
    except ValueError:
        wrong = next(cell for cell in cells if not _is_number(cell))
        raise FormatError(f"{where}: '{wrong[:40]}' in ScatteringData is not a number.") from None
    if not np.isfinite(numbers).all():
        raise FormatError(
            f"{where}: number {int(np.argmin(np.isfinite(numbers))) + 1} of ScatteringData is not finite."
        )
    if (numbers < 0).any():
        raise FormatError(
            f"{where}: a BSDF must be 0 or more, got {numbers.min():g} as number {int(numbers.argmin()) + 1}."
        )
    return numbers


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _number(text: str, where: str) -> float:
    if not _is_number(text) or not abs(float(text)) < float("inf"):
        raise FormatError(f"{where}: '{' '.join(text.split())[:40]}' is not a number.")
    return float(text)


def _merged(layers: list[dict[tuple[str, str], dict[str, Any]]], where: str) -> tuple[dict[str, Any], ...]:
    """The same directions at several wavelengths as lobes with several layers."""
    for layer in layers[1:]:
        if layer.keys() != layers[0].keys():
            raise FormatError(f"{where}: all wavelengths must have data for the same directions.")
    lobes = []
    for key, first in layers[0].items():
        same = [layer[key] for layer in layers]
        if any(one["incoming"] != first["incoming"] or one["outgoing"] != first["outgoing"] for one in same):
            raise FormatError(
                f"{where}: {key[1]} of light from the {key[0]} must have the same patches at all wavelengths."
            )
        lobes.append({**first, "value": tuple(one["value"][0] for one in same)})
    return tuple(lobes)
