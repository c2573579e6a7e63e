# SPDX-License-Identifier: LGPL-2.1-or-later
"""Everything that is wrong, or worth knowing, about a scene or a map, in words."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from raymaps.compile import CompiledScene, compile_scene
from raymaps.effects.usage import used_surfaces
from raymaps.errors import RayMapsError, SceneError, listed
from raymaps.exact import Fallback, exact_faces
from raymaps.materials import Mixture, ThinFilm
from raymaps.results.ledger import energy_ledger
from raymaps.results.lost import MAX_PLACES, lost_rays, lost_words
from raymaps.scene import CrossingsSource, EmissionTable, RectangleDetector, Scene, load_scene
from raymaps.solids.overlaps import Overlap, overlaps
from raymaps.solids.ranks import why_it_rules
from raymaps.solids.shells import oddities
from raymaps.store import RayMap
from raymaps.store.columns import REMEDY

__all__ = ["Finding", "check", "check_map", "check_scene"]

#: Share of the emitted light that may be killed for too many events before it is worth a word.
KILLED_SHARE = 1e-4
#: Findings of a kind that are told one by one.
MAX_ALIKE = 20


@dataclass(frozen=True)
class Finding:
    """One sentence; a fault keeps the scene or the map from being used, the rest is worth knowing."""

    text: str
    is_fault: bool = False

    def to_dict(self) -> dict[str, str]:
        """As in ``raymaps check --json``."""
        return {"severity": "fault" if self.is_fault else "note", "text": self.text}


def check(path: str | Path) -> tuple[Finding, ...]:
    """Check a map (a folder) or a scene (a file)."""
    path = Path(path)
    return check_map(path) if os.path.isdir(path) or path.suffix == ".raymap" else check_scene(path)


def check_scene(path: str | Path) -> tuple[Finding, ...]:
    """Findings about a scene file and its geometry."""
    try:
        scene = load_scene(path)
    except SceneError as error:
        return tuple(Finding(fault, is_fault=True) for fault in error.faults)
    return (*_geometry_findings(scene), *_cut_spectra(scene), *_lost_spectra(scene), *_unused(scene))


def _lost_spectra(scene: Scene) -> Iterator[Finding]:
    """Sources of rays whose map was spectral but kept colours only."""
    for name, source in scene.sources.items():
        if isinstance(source, CrossingsSource) and source.spectrum is None:
            try:
                raymap = RayMap.open(scene.folder / source.map)
                colours = raymap.bands.is_spectral and not all(p.lights.has_spectra for p in raymap.portions)
            except RayMapsError:
                continue  # told where its rays are read
            if colours:
                yield Finding(
                    f"Source '{name}': its map '{source.map}' was simulated with spectra but keeps colours only, so "
                    "lumens and colours are approximate; trace it with --store spectral."
                )


def _cut_spectra(scene: Scene) -> Iterator[Finding]:
    """Sources whose table reaches beyond the wavelengths that are simulated."""
    settings = scene.settings.spectrum
    for name, source in scene.sources.items():
        if isinstance(source.spectrum, EmissionTable):
            share = source.spectrum.share_within(settings.from_nm, settings.to_nm)
            if 0 < share < 0.99:
                yield Finding(
                    f"Source '{name}': {100 * (1 - share):.0f} % of its spectrum lies outside of "
                    f"{settings.from_nm:g} to {settings.to_nm:g} nm, which are simulated; its flux_w is that of the "
                    "rest. Widen settings.spectrum to simulate all of it."
                )


def _geometry_findings(scene: Scene) -> Iterator[Finding]:
    try:
        compiled = compile_scene(scene)
    except SceneError as error:
        yield from (Finding(fault, is_fault=True) for fault in error.faults)
        return
    if not compiled.meshes:
        yield Finding("The scene has no body: all light leaves it.")
    smallest = min(
        [float(np.ptp(mesh.vertices_mm, axis=0).max()) for mesh in compiled.meshes]
        + [max(d.width_mm, d.height_mm) for d in scene.detectors.values() if isinstance(d, RectangleDetector)],
        default=0.0,
    )
    if 0 < smallest < 2000 * compiled.frame.grid_mm:
        yield Finding(
            f"The scene is up to {2 * compiled.frame.unit_mm:.3g} mm wide, so places are kept to "
            f"{compiled.frame.grid_mm:.3g} mm, too coarse for its smallest part of {smallest:.3g} mm: move far "
            "sources, detectors and bodies nearer."
        )
    for mesh in compiled.meshes:
        yield from map(Finding, oddities(mesh))
    yield from _first(_facets_in_words(compiled), "faces stay facets")
    pairs = [_pair_in_words(compiled, overlap) for overlap in overlaps(scene, compiled.meshes, compiled.frame)]
    yield from _first(pairs, "pairs of bodies touch, overlap or stand in each other")


def _first(texts: list[str], what: str) -> Iterator[Finding]:
    """The first findings of a kind, and how many more there are."""
    yield from map(Finding, texts[:MAX_ALIKE])
    if len(texts) > MAX_ALIKE:
        yield Finding(f"{len(texts) - MAX_ALIKE} more {what}.")


def _facets_in_words(compiled: CompiledScene) -> list[str]:
    """Faces that stay facets though exact surfaces were asked for, those of a body for one reason together."""
    alike: dict[tuple[str, str], list[Fallback]] = {}
    for fallback in exact_faces(compiled.scene, compiled.meshes).fallbacks:
        alike.setdefault((fallback.body, fallback.reason), []).append(fallback)
    texts = []
    for (body, reason), faces in alike.items():
        error_mm = max(face.error_mm for face in faces)
        off = f", up to about {error_mm:.1g} mm off the surface," if error_mm else ""
        names = listed([face.face for face in faces], 5)
        texts.append(f"Body '{body}': light meets the facets of {names}{off} as {reason}.")
    return texts


def _pair_in_words(compiled: CompiledScene, overlap: Overlap) -> str:
    first, second = (compiled.names.bodies[i] for i in (overlap.first, overlap.second))
    other = overlap.second if overlap.ruling == overlap.first else overlap.first
    rules = f"'{compiled.names.bodies[overlap.ruling]}' rules there, as "
    rules += why_it_rules(compiled.scene, compiled.meshes, overlap.ruling, other)
    faces = " and ".join(
        f"{listed(faces, 5)} of '{name}'" for name, faces in zip((first, second), overlap.faces, strict=True) if faces
    )
    if overlap.kind == "overlap":
        return (
            f"Bodies '{first}' and '{second}' overlap by about {overlap.depth_mm:.2g} mm: {rules}. If that is not "
            "meant, move one of them, or set a priority."
        )
    if overlap.kind == "inside":
        meet = f" They share {faces}." if faces else ""
        unseen = " Nothing of it is left: set a priority." if overlap.ruling == overlap.second else ""
        return f"Body '{first}' stands inside body '{second}': {rules}.{meet}{unseen}"
    return (
        f"Bodies '{first}' and '{second}' touch at {faces}: that is one interface. Facets can't tell a gap of less "
        f"than {overlap.within_mm:.1g} mm."
    )


def _unused(scene: Scene) -> Iterator[Finding]:
    used = set(used_surfaces(scene))
    for name in list(used):
        prop = scene.surfaces[name]
        used |= {part.surface for part in prop.parts} if isinstance(prop, Mixture) else set()
    media = {body.medium for body in scene.bodies.values()} | {scene.ambient}
    films = [scene.surfaces[name] for name in used]
    media |= {layer.medium for film in films if isinstance(film, ThinFilm) for layer in film.layers}
    for what, unused in (("Surface property", set(scene.surfaces) - used), ("Medium", set(scene.media) - media)):
        for name in sorted(unused):
            yield Finding(f"{what} '{name}' is not used.")


def check_map(path: str | Path) -> tuple[Finding, ...]:
    """Findings about a map: reads all of it, verifies the checksums and the hashes of its scene and of its rays."""
    try:
        raymap = RayMap.open(path)
    except RayMapsError as error:
        return (Finding(str(error), is_fault=True),)
    return (*_scene_findings(raymap), *_portion_findings(raymap), *_map_findings(raymap))


def _scene_findings(raymap: RayMap) -> Iterator[Finding]:
    try:
        scene_hash = compile_scene(raymap.scene).scene_hash
    except RayMapsError as error:
        yield Finding(str(error), is_fault=True)
        return
    # maps of version 1 hashed the scene in another way
    if raymap.manifest.version > 1 and scene_hash != raymap.manifest.scene_hash:
        yield Finding(
            f"Ray Map '{raymap.path}': scene.json or its geometry is not what was simulated; trace the scene again.",
            is_fault=True,
        )


def _portion_findings(raymap: RayMap) -> Iterator[Finding]:
    for portion in raymap.portions:
        try:
            damaged = portion.damaged_files()
            if not damaged and portion.content() != portion.summary.content:
                damaged = ("portion.json",)
        except RayMapsError as error:
            yield Finding(str(error), is_fault=True)
            continue
        for name in damaged:
            yield Finding(f"Ray Map file '{portion.folder / name}' is not what was written; {REMEDY}.", is_fault=True)
        portion.forget()


def _map_findings(raymap: RayMap) -> Iterator[Finding]:
    if any(finding.is_fault for finding in _scene_findings(raymap)):
        return  # without its scene a map has no watts
    asked, present = raymap.manifest.rays_asked, raymap.n_rays
    if present < asked:
        yield Finding(f"The map holds {present} of {asked} rays: the run was interrupted; go on with --resume.")
    for name, n in zip(raymap.names.sources, raymap.rays_of_source, strict=True):
        if n == 0 and present:
            yield Finding(f"Source '{name}' has no ray in the map, so its light is missing: trace more rays.")
    ledger = energy_ledger(raymap)
    too_long_w = ledger.killed_by_reason_w["depth"]
    if too_long_w > KILLED_SHARE * ledger.emitted_w:
        yield Finding(
            f"{100 * too_long_w / ledger.emitted_w:.3g} % of the light was killed (depth): set settings.max_events "
            "higher, or look for light that is trapped."
        )
    lost = lost_rays(raymap)
    for one in lost[:MAX_PLACES]:
        yield Finding(one.sentence())
    if len(lost) > MAX_PLACES:
        rest = lost[MAX_PLACES:]
        yield Finding(f"{lost_words(rest)}, got lost at {len(rest)} more places: raymaps info --json tells them.")
