# SPDX-License-Identifier: LGPL-2.1-or-later
"""A source as a scene has it."""

from raymaps_wb.errors import ExportError
from raymaps_wb.export import tables
from raymaps_wb.export.placing import direction, global_placement, position_mm
from raymaps_wb.export.values import read, table_of
from raymaps_wb.objects.source import (
    BLACK_BODY,
    COSINE_POWER,
    ILLUMINANT,
    LAMBERTIAN,
    LINES,
    RGB,
    SCENE_KINDS,
    SPECTRUM_FILE,
)


def source(obj, name, picked, body_names, files):
    """Data of a source.

    Parameters
    ----------
    obj : document object
    name : str
    picked : list of (BodyPlace, face name or None), where its faces emit
    body_names : dict of BodyPlace to name
    files : SceneFiles

    Raises
    ------
    ExportError
    """
    where = f"Source '{name}'"
    data = {"kind": SCENE_KINDS[obj.Kind], "flux_w": obj.FluxW, **_colour(obj, where, files)}
    if obj.RayShare:
        data["ray_share"] = obj.RayShare
    if obj.Kind == "Faces":
        return {
            **data,
            **faces_of_one_body(picked, where, "emits from faces", "source", body_names),
            **_emission(obj, where),
        }
    placement = global_placement(obj)
    data["position_mm"] = position_mm(placement)
    if obj.Kind in ("Ray file", "Crossings"):
        return {**data, **_axes(placement), **_rays(obj, where, files)}
    if obj.Kind == "Luminaire":
        data["direction"] = direction(placement, 0, 0, -1)
        data["c0_direction"] = direction(placement, 1, 0, 0)
        data["intensity"] = {"file": files.add(obj.Document, obj.LuminaireFile, where, "IES or LDT")}
    elif obj.Kind != "Point":
        data["direction"] = direction(placement, 0, 0, 1)
    if obj.Kind == "Cone":
        data["half_angle_deg"] = float(obj.HalfAngle)
    if obj.Kind in ("Disc", "Sun"):
        data["radius_mm"] = float(obj.Radius)
    if obj.Kind == "Gaussian beam":
        data["waist_radius_mm"], data["divergence_deg"] = float(obj.WaistRadius), float(obj.Divergence)
    if obj.Kind == "Sun":
        data["angular_radius_deg"] = float(obj.AngularRadius)
    return data


def faces_of_one_body(picked, where, verb, what, body_names):
    """Body and faces that references name; raises `ExportError` if they are none, or on several bodies."""
    places = list(dict.fromkeys(place for place, _ in picked))
    if not places:
        raise ExportError(f"{where}: it {verb} and has none; pick the faces of one body.")
    if len(places) > 1:
        shown = " and ".join(f"'{body_names[place]}'" for place in places[:2])
        raise ExportError(f"{where}: its faces are on more than one body ({shown}); make a {what} for each body.")
    faces = [face for _, face in picked]
    return {
        "body": body_names[places[0]],
        **({} if None in faces else {"faces": sorted(set(faces), key=lambda f: int(f[4:]))}),
    }


def _axes(placement):
    return {"z_axis": direction(placement, 0, 0, 1), "x_axis": direction(placement, 1, 0, 0)}


def _rays(obj, where, files):
    if obj.Kind == "Ray file":
        return {"file": files.add(obj.Document, obj.RayFile, where, "rays")}
    name = files.add_map(obj.Document, obj.MapFolder, where)
    if not obj.MapDetector.strip():
        raise ExportError(f"{where}: it starts from the crossings of a detector; name the detector of '{name}'.")
    return {"map": name, "detector": obj.MapDetector.strip()}


def _emission(obj, where):
    if obj.Emission == LAMBERTIAN:
        return {}
    if obj.Emission == COSINE_POWER:
        return {"emission": {"kind": "cosine_power", "exponent": obj.Exponent}}
    return {"emission": {"kind": "table", **table_of(obj, "EmissionFile", where, tables.over_angle, 90.0)}}


def _colour(obj, where, files):
    """Relative flux of the bands, or a spectrum."""
    if obj.Spectrum == RGB:
        if len(obj.RGB) != 3:
            raise ExportError(f"{where}: RGB takes three values (red, green, blue), got {len(obj.RGB)}.")
        return {"rgb": [float(value) for value in obj.RGB]}
    if obj.Spectrum == SPECTRUM_FILE:
        name = files.add(obj.Document, obj.SpectrumFile, where, "spectrum")
        read(where, tables.spectrum, files.files[name])
        return {"spectrum": {"kind": "file", "file": name}}
    if obj.Spectrum == LINES:
        return {"spectrum": {"kind": "lines", **_lines(obj, where)}}
    if obj.Spectrum == BLACK_BODY:
        return {"spectrum": {"kind": "black_body", "temperature_k": obj.TemperatureK}}
    assert obj.Spectrum == ILLUMINANT
    return {"spectrum": {"kind": "illuminant", "name": obj.Illuminant}}


def _lines(obj, where):
    """Wavelengths from short to long, with their shares."""
    lines, shares = list(obj.LinesNm), list(obj.LineShares)
    if not lines:
        raise ExportError(f"{where}: its spectrum is of lines and has none; give their wavelengths in nm.")
    if shares and len(shares) != len(lines):
        raise ExportError(f"{where}: {len(lines)} lines need as many shares or none, got {len(shares)}.")
    if len(set(lines)) < len(lines):
        raise ExportError(f"{where}: the same line stands twice; give each wavelength once.")
    order = sorted(range(len(lines)), key=lambda i: lines[i])
    data = {"wavelength_nm": [lines[i] for i in order]}
    return {**data, "share": [shares[i] for i in order]} if shares else data
