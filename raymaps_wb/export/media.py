# SPDX-License-Identifier: LGPL-2.1-or-later
"""A medium as a scene has it."""

import os

from raymaps_wb.errors import ExportError
from raymaps_wb.export import tables
from raymaps_wb.export.scene_files import existing_file
from raymaps_wb.export.values import bands, outside, prop_of, read, spectral_value, table_of
from raymaps_wb.objects.catalogue import catalogue_medium, catalogue_names
from raymaps_wb.objects.medium import (
    CATALOGUE,
    FILE,
    FORMULA,
    FORMULAS,
    HENYEY_GREENSTEIN,
    ISOTROPIC,
    NUMBER,
    PHASE_TABLE,
    PHASES,
    scatterers,
)


def medium(obj, files):
    """Data of a medium; raises `ExportError`."""
    where = f"Medium '{obj.Label}'"
    if obj.Kind == CATALOGUE:
        return _of_catalogue(obj, where, files)
    if obj.Kind == FILE:
        return _of_file(obj, where, files)
    data = {
        "refractive_index": _index(obj, where),
        "absorption_per_mm": spectral_value(obj, prop_of(obj, "AbsorptionPerMm"), where, files),
    }
    extinction = spectral_value(obj, prop_of(obj, "Extinction"), where, files)
    if is_given(extinction):
        data["extinction"] = extinction
    if obj.ScatteringKinds:
        data["scattering"] = _scattering(obj, where, files)
    if obj.Reference.strip():
        data["reference"] = obj.Reference.strip()
    return data


def is_given(value):
    """Whether a spectral value is more than zero."""
    return isinstance(value, dict) or (any(value) if isinstance(value, list) else value != 0)


def _of_catalogue(obj, where, files):
    """The name of the medium, or its data where absorption or scatterers are put in."""
    known = catalogue_medium(obj.Catalogue)
    if known is None:
        names = catalogue_names()
        some = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
        raise ExportError(
            f"{where}: the catalogue has no medium '{obj.Catalogue}'"
            + (f"; choose one of it: {some}" if names else ", for it is empty")
            + "; or give own values."
        )
    absorption = spectral_value(obj, prop_of(obj, "AbsorptionPerMm"), where, files)
    added = {"absorption_per_mm": absorption} if is_given(absorption) else {}
    if obj.ScatteringKinds:
        added["scattering"] = _scattering(obj, where, files)
    return {**known, **added} if added else {"catalogue": obj.Catalogue}


def _of_file(obj, where, files):
    name = files.add(obj.Document, obj.MaterialFile, where, "YAML or AGF")
    is_glass_catalogue = os.path.splitext(name)[1].lower() == ".agf"
    if is_glass_catalogue and not obj.Glass.strip():
        raise ExportError(f"{where}: a glass catalogue holds many glasses; name one of them.")
    return {"file": name, **({"glass": obj.Glass.strip()} if is_glass_catalogue else {})}


def _index(obj, where):
    if obj.Index == NUMBER:
        return obj.RefractiveIndex
    if obj.Index == FORMULA:
        formula, equation, counts = FORMULAS[obj.Formula]
        if len(obj.Coefficients) not in counts:
            allowed = ", ".join(map(str, counts))
            raise ExportError(
                f"{where}: the formula {obj.Formula} takes {allowed} coefficients, "
                f"got {len(obj.Coefficients)}: {equation}."
            )
        data = {"formula": formula, "coefficients": list(obj.Coefficients)}
        for key, value in (("from_nm", obj.FromNm), ("to_nm", obj.ToNm)):
            if value:
                data[key] = value
        return data
    return {**table_of(obj, "IndexFile", where, tables.index_table), **outside(obj)}


def _scattering(obj, where, files):
    return [
        {"coefficient_per_mm": _coefficient(obj, text, where, files), "phase": _phase(obj, kind, g, path, where)}
        for kind, text, g, path in scatterers(obj)
    ]


def _coefficient(obj, text, where, files):
    """A coefficient that was typed: one number, three, or a file."""
    numbers = text.replace(";", " ").split()
    try:
        values = [float(number) for number in numbers]
    except ValueError:
        name = files.add(obj.Document, text.strip(), where, "scattering coefficient")
        read(where, tables.spectrum, files.files[name])
        return {"file": name, **outside(obj)}
    if not values or min(values) < 0:
        raise ExportError(f"{where}: each scatterer needs a coefficient of 0 or more in 1/mm, got '{text}'.")
    return bands(values, where, "the scattering coefficient")


def _phase(obj, kind, g, path, where):
    if kind == ISOTROPIC:
        return {"kind": "isotropic"}
    if kind == HENYEY_GREENSTEIN:
        if not -1 < g < 1:
            raise ExportError(f"{where}: g of a scatterer must be above -1 and below 1, got {g:g}.")
        return {"kind": "henyey_greenstein", "g": g}
    if kind == PHASE_TABLE:
        path = existing_file(obj.Document, path, where, "phase function")
        table = read(where, tables.over_angle, path, 180.0)
        if table["angle_deg"][0] != 0 or table["angle_deg"][-1] != 180:
            raise ExportError(f"{where}: a phase function must reach from 0 to 180 degrees.")
        return {"kind": "table", **table}
    raise ExportError(f"{where}: there is no kind of scatterers '{kind}'; known: {', '.join(PHASES)}.")
