# SPDX-License-Identifier: LGPL-2.1-or-later
"""Ray Maps: Monte-Carlo ray tracing whose rays are kept, so that questions can be asked of them afterwards.

    import raymaps

    scene = raymaps.load_scene("examples/singlet_barrel.scene.json")
    raymap = raymaps.simulate(scene, "singlet.raymap", rays=200_000)     # or raymaps.open_map("singlet.raymap")
    found = raymaps.query(raymap, "hit(Barrel) & detector(Sensor)")
    print(found.rays, found.flux_w, found.flux_stderr_w)
    print(raymaps.report(raymap, "hit(Barrel) & detector(Sensor)", limit=3).to_text())

Everything is imported when first used, so that ``import raymaps`` costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from raymaps.errors import RayMapsError
from raymaps.version import __version__

if TYPE_CHECKING:
    from raymaps.criterion import parse_criterion, query
    from raymaps.results.detector import evaluate_detector
    from raymaps.results.ledger import energy_ledger
    from raymaps.results.paths import distinct_paths
    from raymaps.results.report import report
    from raymaps.run import open_map, simulate
    from raymaps.scene import Scene, load_scene
    from raymaps.store import RayMap
    from raymaps.target import Target

__all__ = [
    "RayMap",
    "RayMapsError",
    "Scene",
    "Target",
    "__version__",
    "distinct_paths",
    "energy_ledger",
    "evaluate_detector",
    "load_scene",
    "open_map",
    "parse_criterion",
    "query",
    "report",
    "simulate",
]

_MODULES = {
    "RayMap": "raymaps.store",
    "Scene": "raymaps.scene",
    "Target": "raymaps.target",
    "distinct_paths": "raymaps.results.paths",
    "energy_ledger": "raymaps.results.ledger",
    "evaluate_detector": "raymaps.results.detector",
    "load_scene": "raymaps.scene",
    "open_map": "raymaps.run",
    "parse_criterion": "raymaps.criterion",
    "query": "raymaps.criterion",
    "report": "raymaps.results.report",
    "simulate": "raymaps.run",
}


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return getattr(importlib.import_module(_MODULES[name]), name)
    raise AttributeError(f"module 'raymaps' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
