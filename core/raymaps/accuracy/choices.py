# SPDX-License-Identifier: LGPL-2.1-or-later
"""What can be chosen of a scene's simulation that changes its accuracy and its time: rays, surfaces, bands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raymaps.exact import exact_faces, finer
from raymaps.geometry import BodyMesh, write_ply
from raymaps.scene import Scene, Settings
from raymaps.scene.exact_surfaces import CurvedSurface

if TYPE_CHECKING:
    from raymaps.compile import CompiledScene

__all__ = ["Choice", "choices", "finer_facets", "shared_by_need"]

#: Bands beside the scene's own, as shares of them; the most bands stand for the truth.
SHARES = (0.125, 0.25, 0.5, 2.0)
FEWEST_BANDS, MOST_BANDS = 2, 1000
SAMPLING = {"random": "random", "sobol": "Sobol'"}
#: Roulette thresholds at which all losses on surfaces are drawn, and at which most make rays weaker.
DRAWN, WEIGHED = 1.0, 0.1
#: How often facets are split in four, if no more triangles come of it than so many.
SPLITS, MOST_TRIANGLES = 2, 100_000
#: No source has less than this share of the rays, or what was not seen of it would never be.
LEAST_SHARE = 0.02


@dataclass(frozen=True)
class Choice:
    """One way to simulate a scene.

    Attributes
    ----------
    words : str
        What is chosen, where scenes differ in it.
    scene : Scene
    is_scene : bool
        Whether these are the scene's own settings.
    is_finest : bool
        Whether the others leave a bias against it: exact surfaces, where there are any, and the most bands.
    has_own_bias : bool
        Whether something else is simulated; if not, other rays of the scene as it is.
    ray_share : dict or None
        The sources' shares of the rays, where these are chosen.
    finer : int
        How many triangles stand for each of the scene's.
    """

    words: str
    scene: Scene
    is_scene: bool
    is_finest: bool
    has_own_bias: bool
    ray_share: dict[str, float] | None = None
    finer: int = 1

    @property
    def is_faceted(self) -> bool:
        """Whether light meets the triangles in place of exact surfaces."""
        return self.scene.settings.surfaces == "faceted"

    @property
    def settings(self) -> dict[str, Any]:
        """What is chosen, as a scene has it; ``bands`` None where spectra are switched off."""
        own = self.scene.settings
        bands = None if "spectral" in own.without else own.spectrum.bands
        return {
            "sampling": own.sampling, "roulette_threshold": own.roulette_threshold, "surfaces": own.surfaces,
            "bands": bands,
        }  # fmt: skip


def choices(scene: Scene, compiled: CompiledScene) -> tuple[Choice, ...]:
    """The scene as it is, with other sampling, losses, surfaces, bands; one changed at a time.

    Surfaces can be chosen where curved faces have exact ones, bands where the scene calls for spectra.
    """
    own, bands = scene.settings, scene.settings.spectrum.bands
    has_exact = _has_curved_faces(scene)
    finest = own.model_copy(update={"surfaces": "exact"}) if has_exact else own
    given = [own, own.model_copy(update={"sampling": "random" if own.sampling == "sobol" else "sobol"})]
    given.append(own.model_copy(update={"roulette_threshold": DRAWN if own.roulette_threshold < DRAWN else WEIGHED}))
    if has_exact:
        given.append(own.model_copy(update={"surfaces": "faceted" if own.surfaces == "exact" else "exact"}))
    if compiled.bands.is_spectral:
        given.append(own.model_copy(update={"without": (*own.without, "spectral")}))
        others = {min(max(round(bands * share), FEWEST_BANDS), MOST_BANDS) for share in SHARES}
        given += [_with_bands(own, n) for n in sorted(others - {bands})]
        finest = _with_bands(finest, max(*others, bands))
    if finest not in given:
        given.append(finest)

    def words(settings: Settings) -> str:
        parts: list[str] = [settings.surfaces] if has_exact else []
        if compiled.bands.is_spectral:
            parts.append("RGB" if "spectral" in settings.without else f"{settings.spectrum.bands} bands")
        parts.append(SAMPLING[settings.sampling])
        if settings.roulette_threshold != own.roulette_threshold:
            parts.append("losses drawn" if settings.roulette_threshold == DRAWN else "losses weighed")
        return ", ".join(parts)

    def light(settings: Settings) -> Settings:
        """Settings that decide what is simulated, not how."""
        return settings.model_copy(update={"sampling": "random", "roulette_threshold": DRAWN})

    return tuple(
        Choice(
            words(settings), scene.model_copy(update={"settings": settings}), i == 0, settings == finest,
            i == 0 or light(settings) != light(own),
        )
        for i, settings in enumerate(given)
    )  # fmt: skip


def _has_curved_faces(scene: Scene) -> bool:
    """Whether triangles and exact surfaces differ."""
    return any(
        isinstance(face.surface, CurvedSurface) for body in scene.bodies.values() for face in body.geometry.faces or ()
    )


def _with_bands(settings: Settings, n: int) -> Settings:
    return settings.model_copy(update={"spectrum": settings.spectrum.model_copy(update={"bands": n})})


def shared_by_need(choice: Choice, need: NDArray[np.float64]) -> Choice:
    """The same with rays shared by what each source adds to the error.

    With n rays a source's variance is ``need² / n``: its flux times the spread of its rays' light. The sum over sources
    is least where their rays are as their needs (Neyman's allocation).

    Parameters
    ----------
    choice : Choice
    need : (n_sources,) float64
    """
    share = np.maximum(need / need.sum(), LEAST_SHARE)
    of_source = {name: float(value) for name, value in zip(choice.scene.sources, share / share.sum(), strict=True)}
    sources = {
        name: source.model_copy(update={"ray_share": of_source[name]}) for name, source in choice.scene.sources.items()
    }
    return Choice(
        f"{choice.words}, rays by need", choice.scene.model_copy(update={"sources": sources}), False, False,
        False, of_source,
    )  # fmt: skip


def finer_facets(choice: Choice, compiled: CompiledScene, folder: Path) -> Iterator[Choice]:
    """The same with more triangles, whose new corners are on the exact surfaces; none where all faces are plane.

    Parameters
    ----------
    choice : Choice
        One of triangles.
    compiled : CompiledScene
        Its scene, or one that differs in its settings.
    folder : Path
        Meshes are written there.
    """
    if not _has_curved_faces(choice.scene):
        return
    scene, meshes = choice.scene, compiled.meshes
    surfaces = iter(exact_faces(_with_exact(scene), meshes).surfaces)
    of_body = [[next(surfaces) for _ in mesh.face_names] for mesh in meshes]
    for split in range(1, SPLITS + 1):
        if 4 * sum(len(mesh.triangles) for mesh in meshes) > MOST_TRIANGLES:
            break
        meshes = tuple(
            finer(mesh, surfaces) if any(surfaces) else mesh for mesh, surfaces in zip(meshes, of_body, strict=True)
        )
        yield Choice(
            f"{choice.words}, {4**split}x finer", _of_meshes(scene, meshes, folder / f"finer-{split}"), False, False,
            True, None, 4**split,
        )  # fmt: skip


def _with_exact(scene: Scene) -> Scene:
    return scene.model_copy(update={"settings": scene.settings.model_copy(update={"surfaces": "exact"})})


def _of_meshes(scene: Scene, meshes: tuple[BodyMesh, ...], folder: Path) -> Scene:
    """The scene with other triangles of the same faces."""
    bodies = {}
    for number, (mesh, (name, body)) in enumerate(zip(meshes, scene.bodies.items(), strict=True)):
        path = folder / f"{number}.ply"
        write_ply(path, mesh)
        counts = np.bincount(mesh.triangle_face, minlength=len(mesh.face_names))
        faces = body.geometry.faces and tuple(
            face.model_copy(update={"triangles": int(n)}) for face, n in zip(body.geometry.faces, counts, strict=True)
        )
        geometry = body.geometry.model_copy(update={"file": str(path), "mm_per_unit": 1.0, "faces": faces})
        bodies[name] = body.model_copy(update={"geometry": geometry})
    return scene.model_copy(update={"bodies": bodies})
