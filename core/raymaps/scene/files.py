# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scene files: JSON to a scene, with one clear sentence about each fault."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

from pydantic import ValidationError

from raymaps.errors import SceneError, decapitalised, shortened
from raymaps.materials.spectrum import SHORTEST_NM
from raymaps.scene.description import SCENE_FORMAT, SCENE_VERSION, Scene

__all__ = ["load_scene", "scene_from_dict", "scene_json_schema"]

#: Letters of what a file says that an error repeats at most.
_LONGEST = 120


def load_scene(path: str | Path) -> Scene:
    """Read and validate a scene file.

    Parameters
    ----------
    path : path of a ``NAME.scene.json`` file

    Returns
    -------
    Scene; its geometry files are not read yet (see `raymaps.geometry.load_bodies`).

    Raises
    ------
    SceneError
        If the file is missing, is not JSON, is of a newer version, or says something that can't be simulated.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SceneError(f"Scene '{path}': there is no such file.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"Scene '{path}' can't be read: {_reason(error)}.") from error
    try:
        data = json.loads(text, object_pairs_hook=_unique_keys, parse_constant=_no_constant)
    except RecursionError:
        raise SceneError(f"Scene '{path}': it is nested too deeply to be a scene.") from None
    except ValueError as error:
        raise SceneError(f"Scene '{path}' is not valid JSON: {shortened(str(error), _LONGEST)}.") from None
    return scene_from_dict(data, str(path), path.parent)


def scene_from_dict(data: Any, where: str = "scene", folder: Path | None = None) -> Scene:
    """Validate a scene given as plain data, and read the tables of the files that it speaks of.

    Parameters
    ----------
    data : dict, as in a scene file
    where : str
        What the scene is called in errors.
    folder : Path, optional
        What files are relative to; by default the present folder.

    Raises
    ------
    SceneError
        With one sentence about the first fault; its ``faults`` hold them all.
    """
    folder = folder or Path()
    if not isinstance(data, dict):
        raise SceneError(f"Scene '{where}' must be a JSON object with the fields of a scene.")
    if data.get("format") != SCENE_FORMAT:
        if type(data.get("version")) is int and data["version"] > SCENE_VERSION:
            raise SceneError(_newer(where, data["version"]))
        raise SceneError(f'Scene \'{where}\': "format" must be "{SCENE_FORMAT}"; this is not a scene file.')
    version = data.get("version")
    if type(version) is int and version > SCENE_VERSION:
        raise SceneError(_newer(where, version))
    if type(version) is not int:
        raise SceneError(f"Scene '{where}', version: must be a whole number from 1 to {SCENE_VERSION}.")
    try:
        return Scene.model_validate(data, context={"folder": folder}).with_folder(folder)
    except ValidationError as error:
        faults = _faults(where, error)
        more = f" ({len(faults) - 1} more fault{'s' * (len(faults) > 2)})" if len(faults) > 1 else ""
        raise SceneError(f"{faults[0]}{more}.", tuple(f"{fault}." for fault in faults)) from None
    except RecursionError:
        raise SceneError(f"Scene '{where}': it is nested too deeply to be a scene.") from None


def scene_json_schema() -> dict[str, Any]:
    """The published JSON Schema of a scene file."""
    schema = Scene.model_json_schema(mode="validation")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Ray Maps scene",
        **{key: value for key, value in schema.items() if key != "title"},
    }


def _newer(where: str, version: int) -> str:
    return (
        f"Scene '{where}' has version {shortened(str(version), _LONGEST)}, this program reads up to version "
        f"{SCENE_VERSION}: update Ray Maps."
    )


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in pairs:
        if key in result:
            raise ValueError(f"the name '{shortened(key, _LONGEST)}' stands twice in one section")
        result[key] = value
    return result


def _no_constant(text: str) -> NoReturn:
    raise ValueError(f"{text} is not a number that a scene can hold")


def _faults(where: str, error: ValidationError) -> list[str]:
    """Every fault of a validation; one that all bands share, because one number stands for them, is told once."""
    told = error.errors(include_url=False)
    # entries that are wrong are missing in their list, which is then too short; that is no fault of its own
    wrong = {fault["loc"][:-1] for fault in told if fault["loc"] and isinstance(fault["loc"][-1], int)}
    found = [(f["loc"], _fault(f)) for f in told if not (f["type"] == "too_short" and f["loc"] in wrong)]
    bands = [(loc[:-1], text) if loc and isinstance(loc[-1], int) else None for loc, text in found]
    faults = {
        (loc[:-1] if band is not None and bands.count(band) == 3 else loc, text): None
        for (loc, text), band in zip(found, bands, strict=True)
    }
    return [f"Scene '{where}'{_place(loc)}: {text}" for loc, text in faults]


def _fault(fault: Any) -> str:
    """What is wrong, in our words where pydantic's are those of a programmer."""
    context, given = fault.get("ctx", {}), fault.get("input")
    words = {
        "missing": "this field is missing",
        "extra_forbidden": "there is no such field",
        "union_tag_not_found": "the field 'kind' is missing",
        "union_tag_invalid": f"unknown kind '{context.get('tag')}'; known: {context.get('expected_tags')}",
        "too_short": f"at least {context.get('min_length')} must be given",
        "model_type": "must be an object with fields",
        "model_attributes_type": "must be an object with fields",
        "dict_type": "must be an object with names",
        "tuple_type": "must be a list",
    }
    if fault["type"] in words:
        return words[fault["type"]] + _example(fault["loc"], given)
    message = decapitalised(fault["msg"].removeprefix("Value error, ")).replace("input should", "must")
    if fault["type"] == "value_error" or isinstance(given, dict | list | tuple) or given is None:
        return message
    return f"{message}, got {shortened(repr(given), _LONGEST)}{_unit_hint(context, given)}"


def _example(loc: tuple[int | str, ...], given: Any) -> str:
    """What to write in place of a bare name."""
    if not isinstance(given, str):
        return ""
    if len(loc) == 2 and loc[0] == "media":
        return ', such as {"catalogue": "N-BK7"}'
    return ', such as {"kind": "illuminant", "name": "D65"}' if loc and loc[-1] == "spectrum" else ""


def _unit_hint(context: dict[str, Any], given: Any) -> str:
    """What a number out of range may have been meant to be."""
    if not isinstance(given, int | float):
        return ""
    if context.get("ge") == SHORTEST_NM and 0 < given < SHORTEST_NM:
        return " (wavelengths are in nm; 1 µm is 1000 nm)"
    return f" ({given:g} % is {given / 100:g})" if context.get("le") == 1 and 1 < given <= 100 else ""


#: Forms of values that pydantic names among the fields.
_FORMS = {
    "bands", "table", "angles", "number", "formula", "isotropic", "henyey_greenstein", "lambertian", "cosine_power",
    "lines", "black_body", "illuminant", "plane", "cylinder", "cone", "sphere", "torus", "bspline", "other", "kept",
}  # fmt: skip


def _place(loc: tuple[int | str, ...]) -> str:
    """``('media', 'glass', 'refractive_index')`` as ``, media 'glass', refractive_index``."""
    sections = {"media", "surfaces", "bodies", "sources", "detectors"}
    words: list[str] = []
    for i, part in enumerate(loc):
        if i == 1 and loc[0] in sections:
            words[-1] += f" '{part}'"
        elif (i == 2 and loc[0] in ("surfaces", "sources", "detectors")) or part in _FORMS:
            continue  # which kind or form of an object was read, not a field
        elif isinstance(part, int):
            words[-1] += f"[{part}]"
        else:
            words.append(str(part))
    return "".join(f", {word}" for word in words)


def _reason(error: OSError | UnicodeDecodeError) -> str:
    return "it is not UTF-8 text" if isinstance(error, UnicodeDecodeError) else (error.strerror or str(error)).lower()
