# SPDX-License-Identifier: LGPL-2.1-or-later
"""Makes the example singlet_barrel inside FreeCAD: a biconvex lens in a black barrel with a sensor, and a stray source.

python3 examples/make.py singlet_barrel
"""

import math
import os

import FreeCAD
from building import body_of_revolution, box, look, placed, polygon_edges, vector, write

from raymaps_wb.objects.detector import make_detector
from raymaps_wb.objects.medium import make_medium
from raymaps_wb.objects.references import add_references
from raymaps_wb.objects.source import make_source
from raymaps_wb.objects.study import make_study
from raymaps_wb.objects.surface_property import make_surface_property

LENS_RADIUS_MM, CURVATURE_MM, THICKNESS_MM = 12.5, 51.68, 6.0  # focal length 51 mm
SENSOR_MM = 51.25  # z of the sensor's surface; the middle of the lens is at 0


def lens(document):
    """Common of two spheres and a cylinder, so that both faces are exact spheres."""
    parts = []
    for label, sign in (("LensFront", 1), ("LensBack", -1)):
        sphere = document.addObject("Part::Sphere", label)
        sphere.Radius = CURVATURE_MM
        sphere.Placement = placed(z=sign * (CURVATURE_MM - THICKNESS_MM / 2))
        parts.append(sphere)
    rim = document.addObject("Part::Cylinder", "LensRim")
    rim.Radius, rim.Height, rim.Placement = LENS_RADIUS_MM, 20, placed(z=-10)
    common = document.addObject("Part::MultiCommon", "Lens")
    common.Shapes = [*parts, rim]
    for part in common.Shapes:
        part.Visibility = False
    return common


def barrel(document):
    """A tube with a stop before the lens, a ledge behind it, a baffle and a back wall."""
    inner = [(12.6, -28), (12.6, -9), (10.5, -8.5), (10.5, -8), (12.6, -7.5)]
    inner += [(12.6, 3.5), (11.5, 3.6), (11.5, 5), (14, 5.5)]
    for z in (20,):
        inner += [(14, z), (11, z + 0.3), (11, z + 0.5), (14, z + 0.8)]
    inner += [(14, 56), (0, 56), (0, 58), (16, 58), (16, -28), (12.6, -28)]
    return body_of_revolution(document, "Barrel", polygon_edges(inner))


def main():
    document = FreeCAD.newDocument("singlet_barrel")
    glass_body = lens(document)
    tube = barrel(document)
    sensor = box(document, "Sensor", (14, 14, 1), (-7, -7, SENSOR_MM))
    document.recompute()

    study = make_study(document, "singlet_barrel")
    study.Rays, study.Seed, study.RouletteThreshold = 100_000, 1, 0.001
    study.AngularDeflection, study.ChordTolerance = 5.0, 0.01

    add_references(make_medium(document, study, preset="BK7"), [(glass_body, "")])
    polished = make_surface_property(document, study, "polished", "Fresnel")
    add_references(polished, [(glass_body, "")])

    absorbing = make_surface_property(document, study, "absorbing", "Absorber")
    matte = make_surface_property(document, study, "matte", "Lambertian")
    matte.Reflectance = [0.9]
    gloss = make_surface_property(document, study, "gloss", "Mirror")
    gloss.Reflectance = [0.9]
    paint = make_surface_property(document, study, "black_paint", "Mixture")
    paint.Parts, paint.Weights = [absorbing, matte, gloss], [0.9, 0.08, 0.02]
    add_references(paint, [(tube, "")])
    silicon = make_surface_property(document, study, "silicon", "Mirror")
    silicon.Reflectance = [0.25, 0.2, 0.3]
    add_references(silicon, [(sensor, "")])

    axial = make_source(document, study, "Axial", "Disc")
    axial.FluxW, axial.Radius, axial.RGB, axial.Placement = 1.0, 9, [0.4, 0.8, 1.0], placed(z=-40)
    stray = make_source(document, study, "Stray", "Disc")
    angle_deg = 25.0
    back = vector(0, -math.sin(math.radians(angle_deg)), -math.cos(math.radians(angle_deg))) * 48
    stray.FluxW, stray.Radius, stray.RGB = 1.0, 8, [1.0, 0.55, 0.1]
    stray.Placement = placed(back.x, back.y, back.z - 6, (1, 0, 0), -angle_deg)

    plane = make_detector(document, study, "SensorPlane")
    plane.Width, plane.Height, plane.ResolutionX, plane.ResolutionY = 13, 13, 65, 65
    # The light travels along +z: the detector looks back along -z.
    plane.Placement = placed(z=SENSOR_MM - 0.05, angle_deg=180)

    look(glass_body, (0.7, 0.87, 1.0), 60)
    look(tube, (0.2, 0.2, 0.22), 80)
    look(sensor, (0.25, 0.3, 0.45))
    write(document, study, os.path.splitext(os.path.basename(__file__))[0])


main()
