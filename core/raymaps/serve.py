# SPDX-License-Identifier: LGPL-2.1-or-later
"""Answer requests about one map: JSON-RPC 2.0, one object a line, on standard input and output.

The workbench keeps such a process beside FreeCAD, so that a map is read once and each question costs only itself.
Big arrays travel in a file that the request names.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from raymaps.criterion import query
from raymaps.errors import RayMapsError
from raymaps.results.detector import evaluate_detector
from raymaps.results.info import map_info
from raymaps.results.overlay import overlay
from raymaps.results.paths import distinct_paths
from raymaps.results.report import report
from raymaps.store import RayMap

__all__ = ["METHODS", "serve"]

#: Error codes of JSON-RPC 2.0, section 5.1, and ours for everything that a user can cause.
PARSE_ERROR, INVALID_REQUEST, METHOD_NOT_FOUND, INVALID_PARAMS, USER_ERROR = -32700, -32600, -32601, -32602, -32000


def _info(raymap: RayMap) -> dict[str, Any]:
    return map_info(raymap).to_dict()


def _query(raymap: RayMap, criterion: str, limit: int | None = None) -> dict[str, Any]:
    return query(raymap, criterion, limit).to_dict()


def _report(raymap: RayMap, criterion: str | None = None, limit: int = 20) -> dict[str, Any]:
    histories = report(raymap, criterion, limit)
    return {**histories.to_dict(), "html": histories.to_html()}


def _paths(raymap: RayMap, criterion: str | None = None, limit: int | None = None) -> dict[str, Any]:
    return distinct_paths(raymap, criterion, limit).to_dict()


def _detector(
    raymap: RayMap, name: str, resolution: Any = None, max_angle_deg: float | None = None, source: str | None = None,
    criterion: str | None = None, rect: Any = None, ellipse: Any = None, file: str | None = None,
) -> dict[str, Any]:  # fmt: skip
    evaluated = evaluate_detector(
        raymap, name, resolution=resolution and tuple(resolution), max_angle_deg=max_angle_deg, source=source,
        where=criterion, rect=rect and tuple(rect), ellipse=ellipse and tuple(ellipse),
    )  # fmt: skip
    if file is not None:
        evaluated.write(Path(file))
    return evaluated.to_dict()


def _overlay(
    raymap: RayMap,
    file: str,
    criterion: str | None = None,
    max_rays: int | None = None,
    max_segments: int | None = None,
) -> dict[str, Any]:
    limits = {"max_rays": max_rays, "max_segments": max_segments}
    lines = overlay(raymap, criterion, **{name: value for name, value in limits.items() if value is not None})
    lines.write(Path(file))
    return {"file": file, **lines.to_dict()}


#: What can be asked; parameters are the functions' own.
METHODS: dict[str, Callable[..., dict[str, Any]]] = {
    "info": _info,
    "query": _query,
    "report": _report,
    "paths": _paths,
    "detector": _detector,
    "overlay": _overlay,
}


def serve(path: str | Path, requests: IO[str] | None = None, answers: IO[str] | None = None) -> None:
    """Answer requests until ``shutdown`` or the end of input.

    Raises
    ------
    MapError
        If the map can't be opened.
    """
    raymap = RayMap.open(path)
    requests, answers = requests or sys.stdin, answers or sys.stdout
    for line in requests:
        if not line.strip():
            continue
        answer, is_last = _answer(raymap, line)
        if answer is not None:
            print(json.dumps(answer, ensure_ascii=False), file=answers, flush=True)
        if is_last:
            return


def _answer(raymap: RayMap, line: str) -> tuple[dict[str, Any] | None, bool]:
    """The answer to one line (None to a notification), and whether it was the last."""
    try:
        request = json.loads(line)
    except (ValueError, RecursionError):
        return _error({}, PARSE_ERROR, "The line is not valid JSON."), False
    if not isinstance(request, dict) or not isinstance(request.get("method"), str):
        return _error({}, INVALID_REQUEST, "A request is a JSON object with a method, params and an id."), False
    method, params = request["method"], request.get("params") or {}
    if method == "shutdown":
        answer = _result(request, {})
    elif method not in METHODS:
        known = ", ".join([*METHODS, "shutdown"])
        answer = _error(request, METHOD_NOT_FOUND, f"There is no method '{method}'; known: {known}.")
    elif not isinstance(params, dict):
        answer = _error(request, INVALID_PARAMS, f"The params of '{method}' must be an object of named values.")
    else:
        answer = _called(raymap, request, method, params)
    return (answer if "id" in request else None), method == "shutdown"


def _called(raymap: RayMap, request: dict[str, Any], method: str, params: dict[str, Any]) -> dict[str, Any]:
    try:
        return _result(request, METHODS[method](raymap, **params))
    except RayMapsError as error:
        return _error(request, USER_ERROR, str(error))
    except (TypeError, ValueError) as error:
        return _error(request, INVALID_PARAMS, f"The params of '{method}' can't be used: {error}.")
    except MemoryError:
        return _error(request, USER_ERROR, "There is not enough memory for this; ask about fewer rays.")


def _result(request: dict[str, Any], result: dict[str, Any]) -> dict[str, Any]:
    return {"jsonrpc": "2.0", "id": request.get("id"), "result": result}


def _error(request: dict[str, Any], code: int, message: str) -> dict[str, Any]:
    return {"jsonrpc": "2.0", "id": request.get("id"), "error": {"code": code, "message": message}}
