# SPDX-License-Identifier: LGPL-2.1-or-later
"""The wavefront over Embree gives ray for ray what a slow tracer gives; each kernel what its reference gives."""

import numpy as np
import pytest

from raymaps.compile import compile_scene
from raymaps.effects.fresnel import fresnel_reflectance
from raymaps.effects.lambertian import lambertian_direction
from raymaps.effects.medium_absorption import Data, absorbed_share
from raymaps.kernels import directions, medium_absorption, reflectance
from raymaps.kernels.random import IN_MEDIUM, uniforms
from raymaps.kinds import EventKind
from raymaps.scene import load_scene
from raymaps.trace import Tracer
from raymaps.wave import RunKey, Wave
from tests.equivalence.reference_tracer import ReferenceTracer
from tests.equivalence.scenes import RANKED, SOURCE_SOLIDS, everything

N_RAYS = 1_500


@pytest.fixture(scope="module", params=[0.0, 0.2, 1.0])
def compared(request, tmp_path_factory):
    """A compiled scene, its traced portion, and the histories of the slow tracer."""
    path = everything(
        tmp_path_factory.mktemp("scene"), settings={"max_events": 30, "roulette_threshold": request.param}
    )
    compiled = compile_scene(load_scene(path))
    first_ray = 123_456_789_012
    portion = Tracer(compiled, 2**63 + 5).trace_portion(first_ray, N_RAYS)
    slow = ReferenceTracer(compiled, 2**63 + 5, RANKED, SOURCE_SOLIDS)
    names = compiled.names.sources
    histories = []
    for k in range(N_RAYS):
        light = portion.light[portion.event_offsets[k]].astype(float)
        histories.append(slow.trace(first_ray + k, names[portion.source[k]], light))
    return compiled, portion, histories


def test_every_ray_has_the_same_events(compared):
    """Kinds, triangles, media, places to the grid and light to float32."""
    compiled, portion, histories = compared
    media = compiled.names.media
    grid = compiled.frame.grid_mm
    for k, events in enumerate(histories):
        rows = slice(portion.event_offsets[k], portion.event_offsets[k + 1])
        assert portion.kind[rows].tolist() == [event.kind for event in events], f"ray {k}"
        on_surface = [e.kind not in (EventKind.MEDIUM_ABSORPTION, EventKind.LEFT) for e in events]
        triangles = np.array([e.triangle for e in events])
        assert (portion.triangle[rows] == triangles)[on_surface].all(), f"ray {k}"
        assert [media[m] for m in portion.medium[rows]] == [e.medium for e in events], f"ray {k}"
        places = np.array([e.position for e in events])
        assert np.abs(portion.position_mm[rows] - places).max() <= 0.5001 * grid, f"ray {k}"
        assert np.allclose(portion.light[rows], [e.light for e in events], rtol=2e-5, atol=1e-7), f"ray {k}"


def test_every_kind_of_event_was_compared(compared):
    _, portion, _ = compared
    seen = {EventKind(kind) for kind in np.unique(portion.kind)}
    expected = {
        EventKind.EMISSION,
        EventKind.DIFFUSE_REFLECTION,
        EventKind.DIFFUSE_REFRACTION,
        EventKind.SPECULAR_REFLECTION,
        EventKind.FRESNEL_REFLECTION,
        EventKind.FRESNEL_REFRACTION,
        EventKind.ABSORPTION,
        EventKind.MEDIUM_ABSORPTION,
        EventKind.LEFT,
    }
    assert expected <= seen
    assert EventKind.KILLED_NUMERICAL not in seen


def test_every_segment_has_the_same_crossings(compared):
    """Detectors in the order along the way, places to the grid, angles to their step, and which are registered."""
    compiled, portion, histories = compared
    expected = [
        (portion.event_offsets[k] + number, *crossing)
        for k, events in enumerate(histories)
        for number, event in enumerate(events)
        for crossing in event.crossings
    ]
    assert len(expected) > 200
    row, detector, x, y, angle = (np.array(column) for column in zip(*expected, strict=True))
    assert (portion.crossing_row == row).all()
    assert (portion.crossing_detector == detector).all()
    assert np.abs(portion.crossing_xy_mm - np.stack([x, y], axis=1)).max() <= 0.5001 * compiled.frame.grid_mm
    assert np.abs(portion.crossing_angle_rad - angle).max() <= 2.0**-19 * 1.001
    for index, rectangle in enumerate(compiled.scene.detectors.values()):
        mine = portion.crossing_detector == index
        assert mine.any()
        degrees = np.degrees(angle[mine])
        front, back = degrees < rectangle.max_angle_deg, 180 - degrees < rectangle.max_angle_deg
        accepted = {"front": front, "back": back, "both": front | back}[rectangle.side]
        assert (portion.crossing_registered[mine] == accepted).all()


def test_fresnel_kernel_is_its_reference():
    """Over all angles and many pairs of indices, beyond the critical angle too."""
    rng = np.random.default_rng(1)
    cosine = np.concatenate([rng.uniform(0, 1, 20_000), [0.0, 1.0]])
    n_i, n_t = rng.uniform(1, 3, (2, len(cosine)))
    reference = fresnel_reflectance(cosine, n_i, n_t)
    fast = np.array([reflectance.of_clear_medium(*values)[0] for values in zip(cosine, n_i, n_t, strict=True)])
    assert np.abs(fast - reference).max() < 1e-14
    assert ((fast == 1) == (reference == 1)).all()


def test_lambertian_kernel_is_its_reference():
    """Around normals everywhere on the sphere, its poles among them."""
    rng = np.random.default_rng(2)
    normal = rng.normal(size=(5_000, 3))
    normal[:4] = [[0, 0, 1], [0, 0, -1], [1e-9, 0, -1], [0, 1, 0]]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    u, v = rng.uniform(size=(2, len(normal)))
    reference = lambertian_direction(u, v, normal)
    fast = np.array([directions.lambertian(*n, a, b) for n, a, b in zip(normal, u, v, strict=True)])
    assert np.abs(fast - reference).max() < 1e-12
    assert np.abs(np.linalg.norm(fast, axis=1) - 1).max() < 1e-12
    assert ((fast * normal).sum(axis=1) > 0).all()


def test_absorption_kernel_draws_the_share_of_its_reference(compared):
    """Rays are absorbed if and only if their uniform number lies below the reference's share; the others keep the
    expectation of each band: light · share that gets through = light · exp(-a d).
    """
    rng = np.random.default_rng(3)
    n = 20_000
    wave = Wave.allocate(n, 3)
    light = rng.dirichlet([1, 1, 1], n).astype(np.float32)
    wave.light[:], wave.distance[:] = light, rng.exponential(2, n)
    wave.direction[:, 2] = 1
    absorption = np.array([[0.1, 0.6, 1.5]])
    tables, data = compared[0].tables, Data(absorption)
    key = RunKey(np.uint64(9), np.uint64(77), 0.0)
    distance = wave.distance.copy()
    medium_absorption.run(np.arange(n, dtype=np.int32), wave, tables, data, key, 3)
    u = np.array([uniforms(np.uint64(9), np.uint64(77 + i), 3, IN_MEDIUM)[0] for i in range(n)])
    share = absorbed_share(light.astype(float), absorption[0], distance)
    absorbed = wave.state == EventKind.MEDIUM_ABSORPTION
    assert (absorbed == (u < share)).all()
    through = light * np.exp(-absorption[0] * distance[:, None])
    assert np.allclose((wave.light * (1 - share)[:, None])[~absorbed], through[~absorbed], rtol=2e-6)
    assert (wave.light[absorbed] == 0).all()
    assert (wave.distance <= distance).all()
    total = light.astype(float).sum(axis=1)
    assert np.abs(wave.light.astype(float).sum(axis=1) - total)[~absorbed].max() < 3e-7  # float32 of three bands
