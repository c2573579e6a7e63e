# SPDX-License-Identifier: LGPL-2.1-or-later
"""A slow tracer to compare the fast one with: one ray at a time, all triangles, float64, in mm.

It uses the readable references of `raymaps.effects` and the same uniform numbers, nothing else of the kernels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import scipy.optimize

from raymaps.effects.crossings import rectangle_crossing
from raymaps.effects.fresnel import fresnel_reflectance, refracted_direction
from raymaps.effects.lambertian import lambertian_direction
from raymaps.effects.medium_absorption import absorbed_share
from raymaps.effects.medium_scattering import drawn_free_path, phase_cumulated
from raymaps.effects.mirror import reflected_direction
from raymaps.effects.mixture import drawn_part
from raymaps.kernels.random import EMIT_PLACE, IN_MEDIUM, ON_SURFACE, SCATTER_DIRECTION, SCATTER_PLACE, uniforms
from raymaps.kinds import EventKind
from raymaps.materials import (
    Absorber,
    FresnelInterface,
    HenyeyGreenstein,
    Lambertian,
    Mirror,
    Mixture,
    TabulatedPhase,
)


@dataclass
class Event:
    """One event of a ray; ``light`` after it, ``medium`` in which the ray is after it."""

    kind: EventKind
    triangle: int
    medium: str
    position: np.ndarray
    light: np.ndarray
    solids: frozenset = frozenset()  # bodies with a medium in which the ray is after it
    crossings: list = field(default_factory=list)  # of the segment that starts here: (detector, x, y, angle)


class ReferenceTracer:
    """Traces single rays of a compiled scene.

    Parameters
    ----------
    compiled : CompiledScene
        Only its scene, meshes, names and the box that rays leave are used.
    seed : int
    ranked : tuple of str
        Bodies with a medium, as the test knows which rules where several are: the first of them.
    source_solids : dict of str to tuple of str
        Those of them in which each source stands, as the test knows it.
    """

    def __init__(self, compiled, seed, ranked, source_solids):
        self.scene, self.meshes, self.seed = compiled.scene, compiled.meshes, np.uint64(seed)
        self.box = compiled.frame.to_mm(compiled.tables.box)
        self.ranked, self.source_solids = ranked, source_solids
        self.corners = np.concatenate([mesh.corners_mm for mesh in self.meshes])
        a, b, c = np.moveaxis(self.corners, 1, 0)
        normal = np.cross(b - a, c - a)
        self.normal = normal / np.linalg.norm(normal, axis=1)[:, None]
        self.owner = [
            (name, mesh.face_names[face])
            for name, mesh in zip(self.scene.bodies, self.meshes, strict=True)
            for face in mesh.triangle_face
        ]

    def draws(self, ray, event, purpose):
        return uniforms(self.seed, np.uint64(ray), event, purpose)

    def coefficients(self, medium):
        """Index and absorption; the ambient vacuum has no entry."""
        found = self.scene.media.get(medium, self.scene.ambient_medium)
        return found.refractive_index, np.array(found.absorption_per_mm)

    def emission(self, ray, name):
        """Place, direction, triangle."""
        source = self.scene.sources[name]
        u, v, _, _ = self.draws(ray, 0, ON_SURFACE)
        if source.kind == "faces":
            triangles = np.array(
                [
                    k
                    for k, (owner, face) in enumerate(self.owner)
                    if owner == source.body and (source.faces is None or face in source.faces)
                ]
            )
            a, b, c = np.moveaxis(self.corners[triangles], 1, 0)
            area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
            place, p, q, _ = self.draws(ray, 0, EMIT_PLACE)
            k = np.searchsorted(np.cumsum(area) / area.sum(), place, side="right")
            root = math.sqrt(p)
            position = (1 - root) * a[k] + root * (1 - q) * b[k] + root * q * c[k]
            return position, around(self.normal[triangles[k]], math.sqrt(1 - u), v), triangles[k]
        position = np.array(source.position_mm)
        if source.kind == "point":
            return position, around(np.array([0.0, 0, 1]), 1 - 2 * u, v), -1
        axis = np.array(source.direction) / np.linalg.norm(source.direction)
        if source.kind == "cone":
            cosine = 1 - u * (1 - math.cos(math.radians(source.half_angle_deg)))
            return position, around(axis, cosine, v), -1
        return position + source.radius_mm * math.sqrt(u) * around(axis, 0.0, v), axis, -1

    def ruling(self, solids):
        """Which of the bodies rules, None if there is none."""
        return next((name for name in self.ranked if name in solids), None)

    def medium(self, solids):
        ruler = self.ruling(solids)
        return self.scene.ambient if ruler is None else self.scene.bodies[ruler].medium

    def nearest(self, position, direction, standing_on, passed=0.0):
        """Distance and triangle of the first hit (T. Möller, B. Trumbore: Fast, minimum storage ray/triangle
        intersection, J. Graphics Tools 2 (1997), p. 21); infinity and -1 if there is none.
        """
        a, b, c = np.moveaxis(self.corners, 1, 0)
        edge1, edge2 = b - a, c - a
        p = np.cross(direction, edge2)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / (edge1 * p).sum(axis=1)
            to = position - a
            u = (to * p).sum(axis=1) * inverse
            q = np.cross(to, edge1)
            v = (q @ direction) * inverse
            t = (edge2 * q).sum(axis=1) * inverse
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > passed + 1e-9)
        if standing_on >= 0:
            hit[standing_on] = False
        if not hit.any():
            return math.inf, -1
        t = np.where(hit, t, math.inf)
        return t.min(), int(t.argmin())

    def trace(self, ray, source, light):
        """All events of one ray, with the crossings of the segments between them."""
        position, direction, triangle = self.emission(ray, source)
        solids = frozenset(self.source_solids[source])
        events = [Event(EventKind.EMISSION, triangle, self.medium(solids), position, light, solids)]
        for number in range(1, self.scene.settings.max_events):
            event, direction = self.step(ray, number, events[-1], direction)
            events[-1].crossings = self.crossings(events[-1].position, event.position)
            events.append(event)
            if direction is None:
                break
        return events

    def step(self, ray, number, before, direction):
        """The next event, and the direction after it (None at the end)."""
        light, medium, start = before.light, before.medium, before.position
        distance, triangle, solids, passes = self.way(before, direction)
        left = triangle < 0
        if left:
            moves = direction != 0
            wall = np.where(direction > 0, self.box[1], self.box[0])
            distance = ((wall - start)[moves] / direction[moves]).min()

        found = self.scene.media.get(medium, self.scene.ambient_medium)
        scattering = sum((np.array(part.coefficient_per_mm) for part in found.scattering), np.zeros(3))
        scattered = False
        if scattering.any():
            a, b, c, d = self.draws(ray, number, SCATTER_PLACE)
            u, v = (a - 2.0**-33) + b * 2.0**-32, (c - 2.0**-33) + d * 2.0**-32
            scattered, distance, light = drawn_free_path(light, scattering, distance, u, v)

        _, absorption = self.coefficients(medium)
        if absorption.any():
            u, v, _, _ = self.draws(ray, number, IN_MEDIUM)
            through = np.exp(-absorption * distance)
            lost = light * (1 - through)
            if u < absorbed_share(light[None], absorption, np.array([distance]))[0]:
                band = int(np.searchsorted(np.cumsum(lost), u * light.sum(), side="right"))
                depth = -math.log(1 - v * (1 - through[band])) / absorption[band]
                return Event(EventKind.MEDIUM_ABSORPTION, triangle, medium, start + depth * direction, 0 * light), None
            light = light * through * light.sum() / (light * through).sum()

        end = start + distance * direction
        if scattered:
            if number == self.scene.settings.max_events - 1:
                return Event(EventKind.KILLED_DEPTH, -1, medium, end, light), None
            light, direction = self.turned(ray, number, found, light, direction)
            for passed, name in passes:
                solids = solids if passed < distance else solids ^ {name}
            return Event(EventKind.MEDIUM_SCATTERING, -1, medium, end, light, solids), direction
        if left:
            return Event(EventKind.LEFT, -1, medium, end, light), None
        body_name, face = self.owner[triangle]
        body = self.scene.bodies[body_name]
        normal = self.normal[triangle]
        from_front = direction @ normal < 0
        across = solids ^ {body_name} if body.medium is not None else solids
        assert body.medium is None or (body_name in across) == from_front
        near, beyond = medium, self.medium(across)
        if number == self.scene.settings.max_events - 1:
            return Event(EventKind.KILLED_DEPTH, triangle, medium, end, light), None
        facing = normal if from_front else -normal
        surface = self.scene.surfaces[body.face_surfaces.get(face, body.surface)]
        kind, direction, crosses, light = self.interact(surface, ray, number, direction, facing, near, beyond, light)
        return Event(
            kind, triangle, beyond if crosses else medium, end, light, across if crosses else solids
        ), direction

    def way(self, before, direction):
        """Distance to the next triangle at which something changes, solids before it, and what is passed on the way."""
        solids, passed, passes, standing_on = before.solids, 0.0, [], before.triangle
        while True:
            distance, triangle = self.nearest(before.position, direction, standing_on, passed)
            name = self.owner[triangle][0] if triangle >= 0 else None
            if name not in self.ranked or self.ruling(solids) != self.ruling(solids ^ {name}):
                return distance, triangle, solids, passes
            solids, passed = solids ^ {name}, distance
            passes.append((distance, name))

    def turned(self, ray, number, medium, light, direction):
        """Light and direction after a scattering."""
        u, v, w, _ = self.draws(ray, number, SCATTER_DIRECTION)
        coefficients = np.array([part.coefficient_per_mm for part in medium.scattering])
        by_part = light * coefficients / np.maximum(coefficients.sum(axis=0), 1e-300)
        drawn = int(np.searchsorted(np.cumsum(by_part.sum(axis=1)), u * by_part.sum(), side="right"))
        light = by_part[drawn] * light.sum() / by_part[drawn].sum()
        phase = medium.scattering[drawn].phase
        if isinstance(phase, TabulatedPhase):
            angle = scipy.optimize.brentq(lambda t: 1 - phase_cumulated(phase, math.cos(t)) - v, 0, math.pi, xtol=1e-14)
            cosine = math.cos(angle)
        elif isinstance(phase, HenyeyGreenstein) and phase.g != 0:
            g = phase.g
            cosine = (1 + g * g - ((1 - g * g) / (1 - g + 2 * g * v)) ** 2) / (2 * g)
        else:
            cosine = 2 * v - 1
        return light, around(direction, cosine, w)

    def interact(self, surface, ray, number, direction, facing, near, beyond, light):
        """Kind, direction after it (None if absorbed), whether the ray goes on behind the surface, light."""
        u0, u1, u2, u3 = self.draws(ray, number, ON_SURFACE)
        if isinstance(surface, Mixture):
            part = drawn_part(np.array([u0]), tuple(part.weight for part in surface.parts))[0]
            surface = self.scene.surfaces[surface.parts[part].surface]
        d, n = direction[None], facing[None]
        if isinstance(surface, FresnelInterface):
            n_i, n_t = self.coefficients(near)[0], self.coefficients(beyond)[0]
            if u1 < fresnel_reflectance(-(d * n).sum(axis=1), n_i, n_t)[0]:
                return EventKind.FRESNEL_REFLECTION, reflected_direction(d, n)[0], False, light
            return EventKind.FRESNEL_REFRACTION, refracted_direction(d, n, n_i, n_t)[0], True, light
        if isinstance(surface, Absorber):
            return EventKind.ABSORPTION, None, False, 0 * light
        shares = [np.array(surface.reflectance)]
        if isinstance(surface, Lambertian):
            shares.append(np.array(surface.transmittance))
        outcome, light = self.drawn(light, shares, u1)
        if outcome is None:
            return EventKind.ABSORPTION, None, False, light
        if isinstance(surface, Mirror):
            return EventKind.SPECULAR_REFLECTION, reflected_direction(d, n)[0], False, light
        kind = (EventKind.DIFFUSE_REFLECTION, EventKind.DIFFUSE_REFRACTION)[outcome]
        normal = (n, -n)[outcome]
        return kind, lambertian_direction(np.array([u2]), np.array([u3]), normal)[0], outcome == 1, light

    def drawn(self, light, shares, u):
        """Which outcome a uniform number draws, and the light after it; see `raymaps.kernels.outcome`."""
        by = [float((light * share).sum()) for share in shares]
        through = sum(by)
        going_on = max(through, min(light.sum(), self.scene.settings.roulette_threshold))
        for k, share in enumerate(shares):
            if u * going_on < sum(by[: k + 1]):
                return k, light * share / by[k] * going_on
        return None, 0 * light

    def crossings(self, start, end):
        """(detector, x, y, angle) of a segment, along its way."""
        found = []
        for index, detector in enumerate(self.scene.detectors.values()):
            crossing = rectangle_crossing(detector, start, end)
            if crossing is not None:
                normal = np.array(detector.normal)
                before, after = (start - detector.center_mm) @ normal, (end - detector.center_mm) @ normal
                found.append((before / (before - after), index, *crossing))
        return [rest for _, *rest in sorted(found)]


def around(axis, cosine, azimuth):
    """Unit vector at an angle to an axis, in the basis of `lambertian_direction`."""
    vector = lambertian_direction(np.array([1 - cosine**2]), np.array([azimuth]), axis[None])[0]
    return vector if cosine >= 0 else vector - 2 * (vector @ axis) * axis
