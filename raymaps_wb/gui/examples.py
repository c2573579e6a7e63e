# SPDX-License-Identifier: LGPL-2.1-or-later
"""Criteria to start from, made from the names of a study."""

from raymaps_wb.errors import WorkbenchError
from raymaps_wb.export.description import describe


def criteria(study):
    """Criteria that make sense for a study, simplest first."""
    found = ["true"]
    try:
        scene = describe(study).scene
    except WorkbenchError:
        return [*found, "ended(left)", "event(killed)"]
    sources, detectors = list(scene["sources"]), list(scene["detectors"])
    filled = [name for name, body in scene["bodies"].items() if body["medium"]]
    found += [f"from({quoted(name)})" for name in sources]
    found += [f"detector({quoted(name)})" for name in detectors]
    if sources and detectors:
        found.append(f"from({quoted(sources[-1])}) & detector({quoted(detectors[-1])})")
    found += [f"hit({quoted(name)}, fresnel_reflection)" for name in filled]
    found += [
        f"medium({quoted(name)}, scattering)" for name, medium in scene["media"].items() if medium.get("scattering")
    ]
    found += [f"surface({quoted(name)})" for name in scene["surfaces"]]
    if detectors and scene["surfaces"]:
        found.append(f"detector({quoted(detectors[-1])}) & ~surface({quoted(next(iter(scene['surfaces'])))})")
    return [*found, "ended(left)", "ended(killed)"]


def quoted(name):
    """A name as the criterion language writes it."""
    plain = name.replace("_", "a")
    if plain.isascii() and plain.isalnum() and not plain[0].isdigit():
        return name
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
