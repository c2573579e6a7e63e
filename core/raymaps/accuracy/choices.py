# SPDX-License-Identifier: LGPL-2.1-or-later
"""What can be chosen of a scene's simulation that changes its accuracy and its time: sampling, surfaces, bands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from raymaps.scene import Scene, Settings

if TYPE_CHECKING:
    from raymaps.compile import CompiledScene

__all__ = ["Choice", "choices"]

#: Bands beside the scene's own, as shares of them; the most bands stand for the truth.
SHARES = (0.125, 0.25, 0.5, 2.0)
FEWEST_BANDS, MOST_BANDS = 2, 1000
SAMPLING = {"random": "random", "sobol": "Sobol'"}


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
    bias_of : int
        Index of the choice that has the same bias, as it differs in its sampling alone; its own otherwise.
    """

    words: str
    scene: Scene
    is_scene: bool
    is_finest: bool
    bias_of: int

    @property
    def settings(self) -> dict[str, Any]:
        """What is chosen, as a scene has it; ``bands`` None where light is red, green and blue."""
        own = self.scene.settings
        bands = None if "spectral" in own.without else own.spectrum.bands
        return {"sampling": own.sampling, "surfaces": own.surfaces, "bands": bands}


def choices(scene: Scene, compiled: CompiledScene) -> tuple[Choice, ...]:
    """The scene as it is, with the other sampling, with the other surfaces, with other bands; one changed at a time.

    Surfaces can be chosen where faces have exact ones, bands where the scene calls for spectra.
    """
    own, bands = scene.settings, scene.settings.spectrum.bands
    has_exact = own.surfaces == "faceted" or bool((compiled.boundary.tables.exact.face >= 0).any())
    finest = own.model_copy(update={"surfaces": "exact"}) if has_exact else own
    given = [own, own.model_copy(update={"sampling": "random" if own.sampling == "sobol" else "sobol"})]
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
        return ", ".join([*parts, SAMPLING[settings.sampling]])

    return tuple(
        Choice(
            words(settings), scene.model_copy(update={"settings": settings}), i == 0, settings == finest,
            0 if settings.sampling != own.sampling else i,
        )
        for i, settings in enumerate(given)
    )  # fmt: skip


def _with_bands(settings: Settings, n: int) -> Settings:
    return settings.model_copy(update={"spectrum": settings.spectrum.model_copy(update={"bands": n})})
