# SPDX-License-Identifier: LGPL-2.1-or-later
"""The scene: a frozen, validated description of everything that is simulated, and its JSON file.

Triangles stand in geometry files beside the scene file and are read by `raymaps.geometry`.
"""

from raymaps.scene.bodies import Body, FaceGroup, Geometry
from raymaps.scene.description import SCENE_FORMAT, SCENE_VERSION, Scene
from raymaps.scene.detectors import Detector, FaceDetector, FarFieldDetector, RectangleDetector
from raymaps.scene.emission import (
    BlackBody,
    CosinePower,
    EmissionSpectrum,
    EmissionTable,
    Illuminant,
    IntensityTable,
    LambertianEmission,
    SpectralLines,
    TabulatedEmission,
)
from raymaps.scene.exact_surfaces import (
    BSplineSurface,
    ConeSurface,
    CylinderSurface,
    ExactSurface,
    OtherSurface,
    PlaneSurface,
    SphereSurface,
    TorusSurface,
)
from raymaps.scene.files import load_scene, scene_from_dict, scene_json_schema
from raymaps.scene.settings import Settings, SpectralBands
from raymaps.scene.sources import (
    ConeSource,
    CrossingsSource,
    DiscSource,
    FacesSource,
    GaussianBeamSource,
    LuminaireSource,
    PointSource,
    RaysSource,
    Source,
    SunSource,
)

__all__ = [
    "SCENE_FORMAT",
    "SCENE_VERSION",
    "BSplineSurface",
    "BlackBody",
    "Body",
    "ConeSource",
    "ConeSurface",
    "CosinePower",
    "CrossingsSource",
    "CylinderSurface",
    "Detector",
    "DiscSource",
    "EmissionSpectrum",
    "EmissionTable",
    "ExactSurface",
    "FaceDetector",
    "FaceGroup",
    "FacesSource",
    "FarFieldDetector",
    "GaussianBeamSource",
    "Geometry",
    "Illuminant",
    "IntensityTable",
    "LambertianEmission",
    "LuminaireSource",
    "OtherSurface",
    "PlaneSurface",
    "PointSource",
    "RaysSource",
    "RectangleDetector",
    "Scene",
    "Settings",
    "Source",
    "SpectralBands",
    "SpectralLines",
    "SphereSurface",
    "SunSource",
    "TabulatedEmission",
    "TorusSurface",
    "load_scene",
    "scene_from_dict",
    "scene_json_schema",
]
