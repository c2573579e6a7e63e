# SPDX-License-Identifier: LGPL-2.1-or-later
"""The whole scene: what is simulated, validated as far as that goes without its files."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import Field, PrivateAttr, model_validator

from raymaps.errors import decapitalised, unknown_name
from raymaps.materials import VACUUM, Medium, MediumOrCatalogue, Mixture, Name, Record, SurfaceProperty, ThinFilm
from raymaps.scene.bodies import Body
from raymaps.scene.detectors import Detector, FaceDetector
from raymaps.scene.free_data import FreeData
from raymaps.scene.settings import Settings
from raymaps.scene.sources import FacesSource, Source

__all__ = ["SCENE_FORMAT", "SCENE_VERSION", "Scene"]

SCENE_FORMAT = "raymaps-scene"
SCENE_VERSION = 1


class Scene(Record):
    """Everything that is simulated.

    Attributes of a loaded scene: ``folder``, the folder that geometry files are relative to.
    """

    format: Literal["raymaps-scene"] = "raymaps-scene"
    version: Literal[1] = 1
    name: Name = "scene"
    ambient: Name | None = Field(None, description="Medium outside all bodies; null: vacuum.")
    media: dict[Name, MediumOrCatalogue] = Field(default_factory=dict)
    surfaces: dict[Name, SurfaceProperty] = Field(default_factory=dict)
    bodies: dict[Name, Body] = Field(default_factory=dict)
    sources: dict[Name, Source] = Field(min_length=1)
    detectors: dict[Name, Detector] = Field(default_factory=dict)
    settings: Settings = Settings()
    origin: FreeData | None = Field(None, description="Where the scene came from; not part of what is simulated.")

    _folder: Path = PrivateAttr(default_factory=Path)

    @property
    def folder(self) -> Path:
        """Folder that the geometry files are relative to."""
        return self._folder

    @property
    def ambient_medium(self) -> Medium:
        """Medium outside all bodies."""
        return VACUUM if self.ambient is None else self.media[self.ambient]

    @model_validator(mode="after")
    def _names_are_known(self) -> Scene:
        def known(where: str, what: str, name: str | None, names: dict[str, Any]) -> None:
            if name is not None and name not in names:
                raise ValueError(f"{where}: {decapitalised(unknown_name(what, name, names))}")

        known("ambient", "medium", self.ambient, self.media)
        for name, prop in self.surfaces.items():
            for part in prop.parts if isinstance(prop, Mixture) else ():
                known(f"surfaces '{name}'", "surface property", part.surface, self.surfaces)
                if isinstance(self.surfaces[part.surface], Mixture):
                    raise ValueError(f"surfaces '{name}': a mixture can't hold the mixture '{part.surface}'")
            for layer in prop.layers if isinstance(prop, ThinFilm) else ():
                known(f"surfaces '{name}'", "medium", layer.medium, self.media)
        for name, body in self.bodies.items():
            known(f"bodies '{name}'", "medium", body.medium, self.media)
            known(f"bodies '{name}'", "surface property", body.surface, self.surfaces)
            for face, prop_name in body.face_surfaces.items():
                known(f"bodies '{name}', face '{face}'", "surface property", prop_name, self.surfaces)
        for name, source in self.sources.items():
            if isinstance(source, FacesSource):
                known(f"sources '{name}'", "body", source.body, self.bodies)
        for name, detector in self.detectors.items():
            if isinstance(detector, FaceDetector):
                known(f"detectors '{name}'", "body", detector.body, self.bodies)
        return self

    def with_folder(self, folder: Path) -> Scene:
        """The same scene with its geometry files relative to another folder."""
        scene = self.model_copy()
        scene._folder = folder
        return scene
