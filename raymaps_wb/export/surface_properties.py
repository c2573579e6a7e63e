# SPDX-License-Identifier: LGPL-2.1-or-later
"""A surface property as a scene has it."""

from typing import Any

from raymaps_wb.errors import ExportError
from raymaps_wb.export.values import prop_of, spectral_value
from raymaps_wb.objects.surface_property import SCENE_KINDS

#: Spectral values of each kind, by name in the scene.
VALUES = {
    "Mirror": {"reflectance": "Reflectance"},
    "Lambertian": {"reflectance": "Reflectance", "transmittance": "Transmittance"},
    "Gaussian": {"reflectance": "Reflectance", "transmittance": "Transmittance"},
    "ABg": {"reflectance": "Reflectance", "transmittance": "Transmittance"},
    "Coefficients": {
        "specular_reflectance": "SpecularReflectance",
        "specular_transmittance": "SpecularTransmittance",
        "diffuse_reflectance": "DiffuseReflectance",
        "diffuse_transmittance": "DiffuseTransmittance",
    },
}
#: Numbers of each kind, by name in the scene.
NUMBERS = {
    "Rough": {"roughness": "Roughness"},
    "Gaussian": {"scattered_share": "ScatteredShare", "sigma": "Sigma"},
    "ABg": {"a": "AbgA", "b": "AbgB", "g": "AbgG"},
}


def surface_property(obj, name, properties, media, files):
    """Data of a surface property.

    Parameters
    ----------
    obj : document object
    name : str
    properties, media : dict of document object to name, of the study
    files : SceneFiles

    Raises
    ------
    ExportError
    """
    where = f"Surface property '{name}'"
    data: dict[str, Any] = {"kind": SCENE_KINDS[obj.Kind]}
    for key, prop in VALUES.get(obj.Kind, {}).items():
        none_given = 1.0 if obj.Kind == "Mirror" else 0.0
        data[key] = spectral_value(obj, prop_of(obj, prop), where, files, none_given)
    for key, prop in NUMBERS.get(obj.Kind, {}).items():
        data[key] = getattr(obj, prop)
    if obj.Kind == "Thin film":
        data["layers"] = _layers(obj, where, media)
    if obj.Kind == "BSDF":
        data["data"] = {"file": files.add(obj.Document, obj.BsdfFile, where, "BSDF")}
    if obj.Kind == "Mixture":
        data["parts"] = _parts(obj, where, properties)
    return data


def _layers(obj, where, media):
    if len(obj.LayerMedia) != len(obj.LayerThicknessNm) or not obj.LayerMedia:
        raise ExportError(
            f"{where}: a thin film needs layers, each with a medium and a thickness, got {len(obj.LayerMedia)} media "
            f"and {len(obj.LayerThicknessNm)} thicknesses."
        )
    unknown = [layer.Label for layer in obj.LayerMedia if layer not in media]
    if unknown:
        raise ExportError(f"{where}: its layer '{unknown[0]}' is not a medium of this study; move it there.")
    for thickness_nm in obj.LayerThicknessNm:
        if not 0 < thickness_nm <= 1e6:
            raise ExportError(
                f"{where}: the thickness of a layer must be above 0 and at most 1000000 nm, got {thickness_nm:g} nm."
            )
    layers = zip(obj.LayerMedia, obj.LayerThicknessNm, strict=True)
    return [{"medium": media[layer], "thickness_nm": thickness_nm} for layer, thickness_nm in layers]


def _parts(obj, where, properties):
    if len(obj.Parts) != len(obj.Weights) or not obj.Parts:
        raise ExportError(
            f"{where}: a mixture needs a weight for each part, got {len(obj.Parts)} parts and "
            f"{len(obj.Weights)} weights."
        )
    unknown = [part.Label for part in obj.Parts if part not in properties]
    if unknown:
        raise ExportError(f"{where}: '{unknown[0]}' is not a surface property of this study; move it there.")
    parts = zip(obj.Weights, obj.Parts, strict=True)
    return [{"weight": weight, "surface": properties[part]} for weight, part in parts]
