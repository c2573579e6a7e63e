# SPDX-License-Identifier: LGPL-2.1-or-later
"""A detector as a scene has it."""

from raymaps_wb.export.placing import direction, global_placement, position_mm
from raymaps_wb.export.sources import faces_of_one_body


def detector(obj, name, picked, body_names):
    """Data of a detector; raises `ExportError`.

    Parameters
    ----------
    obj : document object
    name : str
    picked : list of (BodyPlace, face name or None) on which it registers light
    body_names : dict of BodyPlace to name
    """
    if obj.Kind == "Faces":
        faces = faces_of_one_body(picked, f"Detector '{name}'", "registers light on faces", "detector", body_names)
        return {"kind": "face", **faces, "measure": obj.Measure.lower()}
    placement = global_placement(obj)
    if obj.Kind == "Far field":
        return {
            "kind": "far_field",
            "axis": direction(placement, 0, 0, -1),
            "x_axis": direction(placement, 1, 0, 0),
            "resolution": [obj.ResolutionC, obj.ResolutionGamma],
        }
    return {
        "kind": "rectangle",
        "center_mm": position_mm(placement),
        "normal": direction(placement, 0, 0, 1),
        "x_axis": direction(placement, 1, 0, 0),
        "width_mm": float(obj.Width),
        "height_mm": float(obj.Height),
        "resolution": [obj.ResolutionX, obj.ResolutionY],
        "side": obj.Side.lower(),
        "max_angle_deg": float(obj.MaxAngle),
    }
