# SPDX-License-Identifier: LGPL-2.1-or-later
"""Makes the example led_collimator inside FreeCAD: an RGB LED, a TIR collimator, a diffuser plate, a work plane.

python3 examples/make.py led_collimator
"""

import math
import os

import FreeCAD
import Part
from building import body_of_revolution, box, look, placed, polygon_edges, vector, write

from raymaps_wb.objects.detector import make_detector
from raymaps_wb.objects.medium import make_medium
from raymaps_wb.objects.references import add_references
from raymaps_wb.objects.source import make_source
from raymaps_wb.objects.study import make_study
from raymaps_wb.objects.surface_property import make_surface_property

N_PMMA = 1.4914
CAVITY_RADIUS_MM = 3.2
LENS_VERTEX_MM = 3.0  # height of the central lens above the chips


def central_lens(n_points=25):
    """(r, z) of the lens that collimates from air into plastic, a hyperbola: sqrt(r^2 + z^2) = n z - (n - 1) f."""
    points = []
    for i in range(n_points):
        r, c = CAVITY_RADIUS_MM * i / (n_points - 1), (N_PMMA - 1) * LENS_VERTEX_MM
        a, b = N_PMMA**2 - 1, -2 * N_PMMA * c
        points.append((r, (-b + math.sqrt(b * b - 4 * a * (c * c - r * r))) / (2 * a)))
    return points


def reflecting_wall(lens_edge_z, n_points=40, n_steps=40):
    """(r, z) of the outer wall that turns light from the cavity's wall parallel to the axis by total reflection.

    Light that leaves the chip at the angle t to the axis meets the cylinder at z = R / tan(t), travels on in plastic at
    the elevation e with cos(t) = n sin(e), and after s mm meets the wall. The wall's normal bisects: along z - d.
    """

    def at(t):
        e = math.asin(math.cos(t) / N_PMMA)
        return e, CAVITY_RADIUS_MM / math.tan(t)

    def ds_dt(t, s):
        h = 1e-6
        (e0, z0), (e1, z1) = at(t - h), at(t + h)
        e, dz, de = at(t)[0], (z1 - z0) / (2 * h), (e1 - e0) / (2 * h)
        move = (-s * math.sin(e) * de, dz + s * math.cos(e) * de)
        normal = (-math.cos(e), 1 - math.sin(e))
        return -(move[0] * normal[0] + move[1] * normal[1]) / (math.sin(e) - 1)

    t, last, s = math.pi / 2, math.atan2(CAVITY_RADIUS_MM, lens_edge_z), 0.9
    points, h = [(CAVITY_RADIUS_MM + s, 0.0)], (last - math.pi / 2) / (n_points * n_steps)
    for _ in range(n_points):
        for _ in range(n_steps):  # Runge and Kutta, fourth order
            k1 = ds_dt(t, s)
            k2 = ds_dt(t + h / 2, s + h / 2 * k1)
            k3 = ds_dt(t + h / 2, s + h / 2 * k2)
            s += h / 6 * (k1 + 2 * k2 + 2 * k3 + ds_dt(t + h, s + h * k3))
            t += h
        e, z = at(t)
        points.append((CAVITY_RADIUS_MM + s * math.cos(e), z + s * math.sin(e)))
    return points


def spline(points):
    curve = Part.BSplineCurve()
    curve.interpolate([vector(r, 0, z) for r, z in points])
    return curve.toShape()


def collimator_profile():
    lens = central_lens()
    wall = reflecting_wall(lens[-1][1])
    (top_r, top_z), edge = wall[-1], lens[-1]
    rim = [wall[-1], (top_r + 0.8, top_z), (top_r + 0.8, top_z + 1.0), (0.0, top_z + 1.0), lens[0]]
    return [
        spline(lens),
        *polygon_edges([edge, (CAVITY_RADIUS_MM, 0.0), wall[0]]),
        spline(wall),
        *polygon_edges(rim),
    ]


def face_towards(obj, direction):
    """Name of the plane face of an object's shape that looks in a direction of the object's parent."""

    def height(i):
        return obj.Shape.Faces[i].CenterOfMass.dot(vector(*direction))

    return f"Face{max(range(len(obj.Shape.Faces)), key=height) + 1}"


def main():
    document = FreeCAD.newDocument("led_collimator")

    # The luminaire shines down: it is built upwards and turned over as a whole.
    luminaire = document.addObject("App::Part", "Luminaire")
    luminaire.Placement = placed(z=60, angle_deg=180)
    collimator = body_of_revolution(document, "Collimator", collimator_profile(), luminaire)
    board = document.addObject("Part::Cylinder", "Board")
    luminaire.addObject(board)
    board.Radius, board.Height, board.Placement = 12, 1.5, placed(z=-1.85)
    chips = {}
    for i, colour in enumerate(("Red", "Green", "Blue")):
        angle = math.radians(90 + 120 * i)
        x, y = 0.62 * math.cos(angle), 0.62 * math.sin(angle)
        chips[colour] = box(document, f"Chip{colour}", (0.8, 0.8, 0.3), (x - 0.4, y - 0.4, -0.3), luminaire)
    diffuser = box(document, "Diffuser", (60, 60, 2), (-30, -30, 26))
    work_plane = box(document, "WorkPlane", (120, 120, 2), (-60, -60, -2))
    document.recompute()

    study = make_study(document, "led_collimator")
    study.Rays, study.Seed, study.AngularDeflection, study.ChordTolerance = 100_000, 1, 6.0, 0.02

    pmma = make_medium(document, study, preset="PMMA")
    pmma.AbsorptionPerMm = [0.0008, 0.0005, 0.0009]
    add_references(pmma, [(collimator, ""), (diffuser, "")])

    polished = make_surface_property(document, study, "polished", "Fresnel")
    add_references(polished, [(collimator, ""), (diffuser, "")])
    opal = make_surface_property(document, study, "opal", "Lambertian")
    opal.Reflectance, opal.Transmittance = [0.3], [0.65]
    satin = make_surface_property(document, study, "satin", "Mixture")
    satin.Parts, satin.Weights = [opal, polished], [0.5, 0.5]
    add_references(satin, [(diffuser, face_towards(diffuser, (0, 0, -1)))])
    white = make_surface_property(document, study, "white_board", "Lambertian")
    white.Reflectance = [0.85]
    add_references(white, [(board, "")])
    die = make_surface_property(document, study, "chip_surface", "Lambertian")
    die.Reflectance = [0.4]
    add_references(die, [(chip, "") for chip in chips.values()])
    matte = make_surface_property(document, study, "matte", "Lambertian")
    matte.Reflectance = [0.2]
    add_references(matte, [(work_plane, "")])

    for colour, rgb in (("Red", (1, 0, 0)), ("Green", (0, 1, 0)), ("Blue", (0, 0, 1))):
        source = make_source(document, study, f"LED_{colour.lower()}", "Faces")
        source.FluxW, source.RGB = 1.0, list(rgb)
        # Local z points out of the chips; the shape of a member is in the part's coordinates.
        add_references(source, [(chips[colour], face_towards(chips[colour], (0, 0, 1)))])

    beam = make_detector(document, study, "Beam")
    beam.Width, beam.Height, beam.ResolutionX, beam.ResolutionY = 30, 30, 60, 60
    beam.Placement = placed(z=40)
    target = make_detector(document, study, "Target")
    target.Width, target.Height, target.ResolutionX, target.ResolutionY = 116, 116, 58, 58
    target.Placement = placed(z=0.05)

    look(collimator, (0.75, 0.88, 1.0), 75)
    look(diffuser, (0.95, 0.95, 0.9), 65)
    look(board, (0.93, 0.93, 0.9))
    look(work_plane, (0.32, 0.34, 0.38))
    for colour, rgb in (("Red", (0.9, 0.1, 0.1)), ("Green", (0.1, 0.7, 0.1)), ("Blue", (0.15, 0.2, 0.9))):
        look(chips[colour], rgb)
    write(document, study, os.path.splitext(os.path.basename(__file__))[0])


main()
