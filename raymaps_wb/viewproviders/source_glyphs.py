# SPDX-License-Identifier: LGPL-2.1-or-later
"""What each kind of source looks like in the 3D view, as lines in its own coordinates; and in which colour."""

import math

import Part

from raymaps_wb.errors import WorkbenchError
from raymaps_wb.objects.source import BLACK_BODY, LINES, RGB
from raymaps_wb.viewproviders import glyphs


def lines_of(obj, size):
    """Lines of a source's drawing."""
    return DRAWINGS[obj.Kind](obj, size)


def colour_of(obj):
    """Colour that a source is drawn in: that of its light, never darker than can be seen."""
    rgb = list(obj.RGB) if obj.Spectrum == RGB and len(obj.RGB) == 3 else [1.0, 1.0, 1.0]
    if obj.Spectrum == LINES and obj.LinesNm:
        rgb = [sum(channel) for channel in zip(*map(_of_wavelength, obj.LinesNm), strict=True)]
    if obj.Spectrum == BLACK_BODY:
        rgb = _of_black_body(obj.TemperatureK)
    largest = max(rgb, default=0) or 1.0
    return [0.15 + 0.85 * min(1.0, max(0.0, c / largest)) for c in rgb]


def _of_wavelength(nm):
    """A colour near that of a wavelength, good enough for a drawing."""
    red = _hump(nm, 600, 60) + 0.3 * _hump(nm, 430, 25) + (1.0 if nm > 640 else 0.0)
    return red, _hump(nm, 545, 50), _hump(nm, 455, 40) + (0.5 if nm < 430 else 0.0)


def _hump(nm, middle, width):
    return math.exp(-(((nm - middle) / width) ** 2))


def _of_black_body(kelvin):
    """Red, green and blue of Planck's law at 610, 550 and 465 nm."""
    return [w**-5 / math.expm1(min(500.0, 1.4388e7 / (w * max(kelvin, 100.0)))) for w in (610.0, 550.0, 465.0)]


def _point(obj, size):
    s = size / math.sqrt(3)
    ends = [(size, 0, 0), (0, size, 0), (0, 0, size)] + [(s, s, s), (s, s, -s), (s, -s, s), (-s, s, s)]
    return [[tuple(-0.5 * c for c in end), tuple(0.5 * c for c in end)] for end in ends]


def _cone(obj, size):
    angle = math.radians(min(float(obj.HalfAngle), 175.0))
    r, z = size * math.sin(angle), size * math.cos(angle)
    rim = glyphs.circle(r, z)
    return [rim] + [[(0, 0, 0), rim[i]] for i in (0, 12, 24, 36)] + glyphs.arrow((0, 0, 0), (0, 0, size))


def _disc(obj, size):
    return [glyphs.circle(float(obj.Radius)), *_beam(float(obj.Radius), 0.0, size)]


def _beam(radius, start, size):
    """An arrow along the axis, and four around it."""
    lines = glyphs.arrow((0, 0, start), (0, 0, start + size))
    for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        at = (0.7 * radius * x, 0.7 * radius * y)
        lines += glyphs.arrow((*at, start), (*at, start + 0.7 * size))
    return lines


def _gaussian_beam(obj, size):
    """The beam's edge on both sides of its waist, where it shines to longer, and an arrow."""
    waist, slope = float(obj.WaistRadius), math.tan(math.radians(min(float(obj.Divergence), 80.0)))
    steps = [size * i / 12 for i in range(-6, 13)]
    edge = [(math.hypot(waist, z * slope), z) for z in steps]
    lines = [[(x * r, y * r, z) for r, z in edge] for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    circles = [glyphs.circle(waist), glyphs.circle(*edge[-1])]
    return circles + lines + glyphs.arrow((0, 0, 0), (0, 0, 1.5 * size))


def _sun(obj, size):
    """The disc that light passes, arrows through it, and a small sun behind it."""
    radius, z = float(obj.Radius), -1.6 * size
    lines = [glyphs.circle(radius), *_beam(radius, -0.5 * size, size)]
    sun = 0.35 * size
    lines.append(glyphs.circle(sun, z))
    for i in range(12):
        x, y = math.cos(math.pi * i / 6), math.sin(math.pi * i / 6)
        lines.append([(1.25 * sun * x, 1.25 * sun * y, z), (1.7 * sun * x, 1.7 * sun * y, z)])
    return lines


def _luminaire(obj, size):
    """A shade, open to where gamma is 0, arrows out of it, and a tick where C is 0."""
    top, bottom = glyphs.circle(0.18 * size), glyphs.circle(0.5 * size, -0.45 * size)
    lines = [top, bottom] + [[top[i], bottom[i]] for i in (0, 12, 24, 36)]
    lines += glyphs.arrow((0, 0, -0.45 * size), (0, 0, -1.3 * size))
    for x in (-1, 1):
        lines += glyphs.arrow((0.3 * size * x, 0, -0.45 * size), (0.75 * size * x, 0, -1.1 * size))
    return [*lines, [(0.5 * size, 0, -0.45 * size), (0.68 * size, 0, -0.45 * size)]]


def _rays(obj, size):
    """A bundle of rays that starts here and there, and the axes of the file: x short, z long."""
    lines = [[(0, 0, 0), (0.5 * size, 0, 0)], *glyphs.arrow((0, 0, 0), (0, 0, 1.2 * size))]
    for i in range(6):
        x, y = math.cos(math.pi * i / 3 + 0.3), math.sin(math.pi * i / 3 + 0.3)
        lines += glyphs.arrow((0.25 * size * x, 0.25 * size * y, 0), (0.6 * size * x, 0.6 * size * y, 0.9 * size))
    return lines


def _crossings(obj, size):
    """A frame, as of a detector, with rays that go on from it; the rays themselves start where they crossed."""
    a = 0.5 * size
    frame = [(-a, -a, 0), (a, -a, 0), (a, a, 0), (-a, a, 0), (-a, -a, 0)]
    lines = [frame, *glyphs.arrow((0, 0, 0), (0, 0, size))]
    for x, y in ((1, 1), (1, -1), (-1, -1), (-1, 1)):
        lines += glyphs.arrow((0.5 * a * x, 0.5 * a * y, 0), (0.8 * a * x, 0.8 * a * y, 0.8 * size))
    return lines


def _faces(obj, size):
    """An arrow from the middle of each emitting face, in global coordinates: such a source has no placement."""
    from raymaps_wb.export.bodies import resolve_all, shape_of

    lines = []
    try:
        for place, name in resolve_all(obj):
            shape = shape_of(place)
            for face in shape.Faces if name is None else [shape.Faces[int(name[4:]) - 1]]:
                start = face.CenterOfMass
                u, v = face.Surface.parameter(start)
                length = min(size, 2 * math.sqrt(face.Area))
                lines += glyphs.arrow(start, start + face.normalAt(u, v) * length)
    except (WorkbenchError, Part.OCCError, RuntimeError):
        return []  # the check command says in words what is wrong with the references
    return lines


DRAWINGS = {
    "Point": _point,
    "Cone": _cone,
    "Disc": _disc,
    "Gaussian beam": _gaussian_beam,
    "Sun": _sun,
    "Luminaire": _luminaire,
    "Ray file": _rays,
    "Crossings": _crossings,
    "Faces": _faces,
}
