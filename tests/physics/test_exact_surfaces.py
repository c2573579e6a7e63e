# SPDX-License-Identifier: LGPL-2.1-or-later
"""Light on exact surfaces, ray by ray beside a sequential trace of the same lenses.

Stored places are rounded to a millionth of the scene, so what is compared is the tracer's own state in float64.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
import trimesh

from raymaps.compile import compile_scene
from raymaps.kinds import EventKind
from raymaps.scene import load_scene
from raymaps.trace import Tracer
from tests.physics import sequential
from tests.physics.lenses import HERE, Lens, Placement, Step, follow, write_lenses
from tests.physics.scenes import disc_source, unit
from tests.physics.sequential import LensFace, RaysAt

#: What a ray's place may be off, over the focal length, and its direction: rounding, 100 m from the origin too.
CLOSE = 1e-11
GLASS = 1.5168
AXIS = np.array([0.0, 0.0, 1.0])


# ------------------------------------------------------------------------------- the sequential trace, by closed forms


def beam(radius: float, n: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """Rays along the axis, from evenly spread places."""
    i = np.arange(n) + 0.5
    r, angle = radius * np.sqrt(i / n), math.pi * (3 - math.sqrt(5)) * i
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), np.full(n, -20.0)]), np.tile(AXIS, (n, 1))


def test_reference_ellipsoid_and_hyperboloid_focus_in_a_point():
    """Parallel light is focused exactly by an ellipsoid of k = -1/n² inside of the glass, at n R / (n - 1), and by a
    hyperboloid of k = -n² behind it, at R / (n - 1) (R. Luneburg: Mathematical Theory of Optics, section 23).
    """
    n, radius = 1.7, 20.0
    inside = sequential.trace([LensFace(3, 1 / radius, -1 / n**2)], [1, n], *beam(18))[-1]
    assert np.abs(sequential.at_plane(inside, 3 + n * radius / (n - 1))).max() < 1e-12
    behind = sequential.trace([LensFace(0), LensFace(9, -1 / radius, -(n**2))], [1, n, 1], *beam(25))[-1]
    assert np.abs(sequential.at_plane(behind, 9 + radius / (n - 1))).max() < 1e-12


def test_reference_sphere_has_its_aplanatic_points():
    """Light from R / n beyond the centre of a ball comes from n R after refraction, at any angle (M. Born, E. Wolf:
    Principles of Optics, section 4.2.3).
    """
    n, radius = 1.6, 10.0
    points, directions = beam(1.0)
    directions = unit(directions + 0.9 * points * (1, 1, 0))
    start = np.tile([0, 0, -radius / n], (len(points), 1))
    out = sequential.trace([LensFace(radius, -1 / radius)], [n, 1], start, directions)[-1]
    assert np.abs(sequential.at_plane(out, -n * radius)).max() < 1e-12


def test_reference_focal_length_is_that_of_the_thick_lens():
    """1 / f = (n - 1) (c1 - c2 + (n - 1) d c1 c2 / n) (E. Hecht: Optics, eq. 6.2), for rays near the axis too."""
    n, d, c1, c2 = 1.6, 9.0, 1 / 40, -1 / 70
    faces = [LensFace(5, c1), LensFace(5 + d, c2)]
    focal_length, focus = sequential.paraxial_focus(faces, [1, n, 1])
    power = (n - 1) * (c1 - c2 + (n - 1) * d * c1 * c2 / n)
    assert math.isclose(focal_length, 1 / power, rel_tol=1e-14)
    assert math.isclose(focus, 5 + d + (1 - (n - 1) * d * c1 / n) / power, rel_tol=1e-14)
    out = sequential.trace(faces, [1, n, 1], *beam(1e-4))[-1]
    assert np.abs(sequential.at_plane(out, focus)).max() < 1e-13


def test_reference_obeys_fermat_on_an_asphere():
    """To first order the optical path between two points of a ray does not change with the place on the face."""
    face, n = LensFace(2, 1 / 30, -0.6, (2e-5, -3e-8)), 1.5
    points, directions = beam(11)
    directions = unit(directions + (0.1, -0.05, 0))
    out = sequential.trace([face], [1, n], points, directions)[-1]
    assert np.abs(out.points_mm[:, 2] - 2 - face.sag_mm((out.points_mm[:, :2] ** 2).sum(axis=1))).max() < 1e-14
    end, step = out.points_mm + 30 * out.directions, 1e-4
    for shift in ((step, 0.0), (0.0, step)):
        paths = []
        for sign in (1, -1):
            xy = out.points_mm[:, :2] + sign * np.array(shift)
            at = np.column_stack([xy, 2 + face.sag_mm((xy**2).sum(axis=1))])
            paths.append(np.linalg.norm(at - points, axis=1) + n * np.linalg.norm(end - at, axis=1))
        assert np.abs(paths[0] - paths[1]).max() / (2 * step) < 1e-9


@pytest.mark.parametrize(
    ("face", "radius", "rounding"),
    [
        (LensFace(50, -1 / 60, -1), 40, 1e-12),
        # a sphere, and what its series lacks of the paraboloid up to r⁸; the next power turns rays by 10 r⁹ 7 c⁹ / 256
        (LensFace(50, -1 / 60, 0, (1 / 8 / 60**3, 1 / 16 / 60**5, 5 / 128 / 60**7)), 3, 1e-10),
    ],
    ids=["conic", "powers"],
)
def test_reference_reflects_where_the_index_changes_sign(face, radius, rounding):
    """A paraboloid collects parallel light at half its radius of curvature."""
    out = sequential.trace([face], [1, -1], *beam(radius))[-1]
    assert (out.directions[:, 2] < 0).all()
    assert np.abs(sequential.at_plane(out, 20)).max() < rounding


# --------------------------------------------------------------------------------------------------- the tracer's rays


class System(NamedTuple):
    """Lenses in a row; ``faces`` and ``indices`` as the sequential trace takes them."""

    lenses: dict[str, tuple[Lens, int]]
    media: dict[str, float]
    faces: list[LensFace]
    indices: list[float]
    beam_mm: float  # radius of the beam

    @property
    def names(self) -> list[set[tuple[str, str]]]:
        """Body and face that light comes to first, next, and so on; a cemented face has two names."""
        bodies = list(self.lenses)
        cemented = [{(a, "Rear"), (b, "Front")} for a, b in pairwise(bodies)]
        return [{(bodies[0], "Front")}, *cemented, {(bodies[-1], "Rear")}]

    @property
    def scale_mm(self) -> float:
        """The focal length; 100 mm where it is longer."""
        n = len(self.names)
        power = 1 / sequential.paraxial_focus(self.faces[:n], [abs(i) for i in self.indices[: n + 1]])[0]
        return 1 / max(abs(power), 1 / 100)


def singlet(front: LensFace, rear: LensFace, radius: float, *, beam_mm: float, rings: int = 6, n: float = GLASS):
    """A lens in air."""
    lens = Lens(front, rear, radius)
    return System({"Lens": (lens, rings)}, {"glass": n}, [front, rear], [1, n, 1], beam_mm)


def doublet(*curvatures: float, rings: tuple[int, int] = (6, 6)):
    """A cemented doublet of crown and flint."""
    a, b, c = (LensFace(z, curvature) for z, curvature in zip((0.0, 6.0, 8.5), curvatures, strict=True))
    media = {"crown": 1.5168, "flint": 1.6727}
    lenses = {"Crown": (Lens(a, b, 14, "crown"), rings[0]), "Flint": (Lens(b, c, 14, "flint"), rings[1])}
    return System(lenses, media, [a, b, c], [1, *media.values(), 1], 12.5)


def traced(folder, system: System, *, rays: int = 3000, tilt=(0.0, 0.0), placement: Placement = HERE, **sections):
    """Steps of a beam through a system, and the names of faces by triangle."""
    direction = unit(np.array([*tilt, 1.0]))
    pupil = np.array([0.0, 0.0, system.faces[0].vertex_mm])
    start = disc_source(
        placement.points(pupil - 15 * direction), placement.vectors(direction), system.beam_mm * placement.factor
    )
    scene = load_scene(
        write_lenses(folder, system.lenses, system.media, placement=placement, sources={"Beam": start}, **sections)
    )
    tracer = Tracer(compile_scene(scene), 1)
    steps = [
        step._replace(
            points_mm=placement.points_back(step.points_mm), directions=placement.vectors_back(step.directions)
        )
        for step in follow(tracer, rays)
    ]
    names = tracer.compiled.names
    named = [(names.bodies[body], face) for body, face in names.faces]
    return steps, [named[face] for face in tracer.compiled.tables.triangle_face]


def compare(steps: list[Step], of_triangle, system: System, names=None, *, kinds=None) -> tuple[float, float, int]:
    """Largest error in place over the focal length, largest error in direction, and how many rays came to the end.

    Followed are the rays that are refracted at each face, or to which happens what ``kinds`` says.
    """
    names = names or system.names
    kinds = kinds or [EventKind.FRESNEL_REFRACTION] * len(names)
    n_rays = len(steps[0].rays)
    expected = sequential.trace(system.faces, system.indices, steps[0].points_mm, steps[0].directions)
    left = np.ones(n_rays, bool)
    place = direction = 0.0
    for step, reference, name, kind in zip(steps[1:], expected, names, kinds, strict=False):
        # a ray that is told to miss, or to be totally reflected, is not followed further
        mine = left[step.rays] & ~np.isnan(reference.directions[step.rays]).any(axis=1)
        assert mine.any()
        assert {of_triangle[t] for t in np.unique(step.triangle[mine])} <= name
        off = np.linalg.norm(step.points_mm[mine] - reference.points_mm[step.rays[mine]], axis=1)
        place = max(place, float(off.max()) / system.scale_mm)
        mine &= step.kind == kind
        left[:] = False
        left[step.rays[mine]] = True
        off = np.linalg.norm(step.directions[mine] - reference.directions[step.rays[mine]], axis=1)
        direction = max(direction, float(off.max()))
    print(f"  place {place:.1e} of the focal length, direction {direction:.1e}, {left.sum()} of {n_rays} rays")
    return place, direction, int(left.sum())


ASPHERE = LensFace(0, 1 / 40, -0.6, (2e-6, -1.5e-9))
PARABOLOID = LensFace(0, 1 / 40, -1.0, (-3e-6, 1e-9))

SYSTEMS = {
    "biconvex": singlet(LensFace(0, 1 / 60), LensFace(9, -1 / 60), 15, beam_mm=13),
    "plano-convex": singlet(LensFace(0, 1 / 50), LensFace(7), 15, beam_mm=13),
    "convex-plano": singlet(LensFace(0), LensFace(7, -1 / 50), 15, beam_mm=13),
    "biconcave": singlet(LensFace(0, -1 / 60), LensFace(3, 1 / 45), 15, beam_mm=13),
    "meniscus": singlet(LensFace(0, 1 / 30), LensFace(5, 1 / 50), 15, beam_mm=13),
    "meniscus, hollow side first": singlet(LensFace(0, -1 / 50), LensFace(6, -1 / 30), 15, beam_mm=13),
    "half ball": singlet(LensFace(0, 1 / 10), LensFace(9.9), 9.9, beam_mm=8.5),
    "nearly flat": singlet(LensFace(0, 1 / 5000), LensFace(4, -1 / 8000), 15, beam_mm=13),
    "asphere": singlet(ASPHERE, LensFace(9, -1 / 150), 15, beam_mm=13),
    "asphere behind": singlet(LensFace(0), LensFace(9, -1 / 40, -0.6, (-2e-6, 1e-9)), 15, beam_mm=13),
    "paraboloid and powers": singlet(PARABOLOID, LensFace(8), 15, beam_mm=13),
    "two aspheres": singlet(ASPHERE, LensFace(9, -1 / 90, 2.0, (1e-6,)), 15, beam_mm=13),
    "corrector plate": singlet(LensFace(0, 0, 0, (-1e-6,)), LensFace(4), 15, beam_mm=13),
    "doublet": doublet(1 / 62.8, -1 / 45.7, -1 / 128.2),
    "doublet, other nets": doublet(1 / 62.8, -1 / 45.7, -1 / 128.2, rings=(5, 9)),
    "doublet, cemented plane": doublet(1 / 50, 0, -1 / 200),
}


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.06, -0.03)], ids=["along the axis", "aslant"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_rays_are_those_of_the_sequential_trace(tmp_path, name, tilt):
    system = SYSTEMS[name]
    place, direction, n_left = compare(*traced(tmp_path, system, tilt=tilt), system)
    assert place < CLOSE
    assert direction < CLOSE
    assert n_left > 2000


@pytest.mark.parametrize("name", ["meniscus", "asphere", "doublet"])
@pytest.mark.parametrize("rings", [2, 20])
def test_the_fineness_of_the_triangles_does_not_show(tmp_path, name, rings):
    system = SYSTEMS[name]
    system = system._replace(lenses={body: (lens, rings) for body, (lens, _) in system.lenses.items()})
    place, direction, n_left = compare(*traced(tmp_path, system, tilt=(0.02, 0.03)), system)
    assert place < CLOSE
    assert direction < CLOSE
    assert n_left > 2000


@pytest.mark.parametrize(
    ("factor", "shift"), [(1.0, 5.0), (1e-3, 0.02), (1e3, -4e4), (1.0, 1e5)], ids=["here", "tiny", "huge", "far away"]
)
@pytest.mark.parametrize("name", ["meniscus", "asphere", "doublet"])
def test_lenses_stand_anywhere_in_any_size(tmp_path, name, factor, shift):
    """100 m from the origin coordinates themselves have steps of 1.5e-11 mm."""
    turn = trimesh.transformations.rotation_matrix(2.0, (1.0, -2.0, 0.5))[:3, :3]
    placement = Placement(turn, factor, np.array([shift, -0.5 * shift, 2.0 * shift]))
    system = SYSTEMS[name]
    place, direction, n_left = compare(*traced(tmp_path, system, placement=placement), system)
    assert place < CLOSE
    assert direction < CLOSE
    assert n_left > 2000


@pytest.mark.parametrize("name", ["biconvex", "asphere"])
def test_ghosts_are_those_of_the_sequential_trace(tmp_path, name):
    """Reflected once at each face inside of the lens before light goes on."""
    system = SYSTEMS[name]
    front, rear = system.faces
    n = system.indices[1]
    ghost = system._replace(faces=[front, rear, front, rear], indices=[1, n, -n, n, 1])
    names = 2 * system.names
    through, back = EventKind.FRESNEL_REFRACTION, EventKind.FRESNEL_REFLECTION
    steps, of_triangle = traced(tmp_path, ghost, rays=60_000)
    place, direction, n_left = compare(steps, of_triangle, ghost, names, kinds=[through, back, back, through])
    assert place < CLOSE
    assert direction < CLOSE
    assert n_left > 30


def test_a_hyperboloid_focuses_in_a_point(tmp_path):
    """Plane in front, k = -n² behind: all light meets R / (n - 1) behind the vertex, whatever the triangles are."""
    radius = 25.0
    system = singlet(LensFace(0), LensFace(12, -1 / radius, -(GLASS**2)), 20, beam_mm=18, rings=4)
    steps, _ = traced(tmp_path, system)
    last = steps[2]
    through = last.kind == EventKind.FRESNEL_REFRACTION
    assert through.sum() > 2000
    spot = sequential.at_plane(RaysAt(last.points_mm[through], last.directions[through]), 12 + radius / (GLASS - 1))
    assert np.abs(spot).max() < CLOSE * radius / (GLASS - 1)


def test_facets_are_far_from_it(tmp_path):
    """The same comparison fails by orders of magnitude on the triangles, so it can fail; and ``faceted`` is obeyed."""
    system = SYSTEMS["biconvex"]
    place, direction, _ = compare(*traced(tmp_path, system, settings={"surfaces": "faceted"}), system)
    assert place > 1e-4
    assert direction > 1e-2
