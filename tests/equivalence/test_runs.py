# SPDX-License-Identifier: LGPL-2.1-or-later
"""A map depends on the scene, the seed and the number of rays: not on threads, portions, or how a run was
interrupted.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import raymaps
from raymaps.compile import compile_scene
from raymaps.kinds import EventKind
from raymaps.run import simulate
from raymaps.scene import load_scene
from raymaps.store import RayMap
from raymaps.trace import Tracer
from tests.equivalence.scenes import everything
from tests.physics.scenes import Histories

N_RAYS, SEED = 40_000, 11
COLUMNS = (
    "ray_source",
    "offsets",
    "kind",
    "face",
    "body",
    "medium",
    "triangle",
    "position",
    "light",
    "crossing_row",
    "crossing_detector",
    "crossing_xy",
    "crossing_angle",
    "crossing_registered",
)


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return everything(tmp_path_factory.mktemp("scene"))


@pytest.fixture(scope="module")
def whole(scene, tmp_path_factory):
    """The map of one thread in one go."""
    return simulate(scene, tmp_path_factory.mktemp("whole") / "a.raymap", rays=N_RAYS, seed=SEED, threads=1)


def assert_same_rays(raymap, expected):
    assert raymap.content_hash == expected.content_hash
    assert raymap.n_rays == expected.n_rays
    here, there = Histories(raymap), Histories(expected)
    for column in COLUMNS:
        assert np.array_equal(getattr(here, column), getattr(there, column)), column
    for portion in raymap.portions:
        assert portion.content() == portion.summary.content


@pytest.mark.parametrize(("threads", "portion_rays"), [(2, None), (1, 10_007), (2, 1_000), (4, 65_536)])
def test_threads_and_portions_change_nothing(scene, whole, tmp_path, threads, portion_rays):
    raymap = simulate(scene, tmp_path / "b.raymap", rays=N_RAYS, seed=SEED, threads=threads, portion_rays=portion_rays)
    assert portion_rays is None or len(raymap.portions) == -(-N_RAYS // portion_rays)
    assert_same_rays(raymap, whole)


def test_another_seed_gives_other_rays(scene, whole, tmp_path):
    raymap = simulate(scene, tmp_path / "b.raymap", rays=N_RAYS, seed=SEED + 1)
    assert raymap.content_hash != whole.content_hash
    assert not np.array_equal(Histories(raymap).kind[:1000], Histories(whole).kind[:1000])


def test_a_map_grown_in_parts_is_the_map_of_one_run(scene, whole, tmp_path):
    path = tmp_path / "b.raymap"
    for rays in (1, 10_000, N_RAYS):
        raymap = simulate(scene, path, rays=rays, seed=SEED, resume=True, portion_rays=3_000)
        assert raymap.n_rays == rays
    assert_same_rays(raymap, whole)


def test_a_lost_portion_is_made_anew(scene, whole, tmp_path):
    path = tmp_path / "b.raymap"
    simulate(scene, path, rays=N_RAYS, seed=SEED, portion_rays=5_000)
    lost = path / "portions" / f"{15_000:012d}"
    lost.rename(tmp_path / "lost")
    assert RayMap.open(path).n_rays == N_RAYS - 5_000
    assert_same_rays(simulate(scene, path, rays=N_RAYS, resume=True), whole)


def test_killed_and_resumed_is_uninterrupted(scene, whole, tmp_path):
    """SIGKILL while portions are being written: what was committed stands, the rest is traced on resuming."""
    path = tmp_path / "b.raymap"
    program = (
        "import sys; from raymaps.run import simulate; "
        f"simulate(sys.argv[1], sys.argv[2], rays={N_RAYS}, seed={SEED}, threads=2, portion_rays=100)"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(raymaps.__file__).parents[1])}
    process = subprocess.Popen([sys.executable, "-c", program, str(scene), str(path)], env=environment)
    try:
        deadline = time.monotonic() + 120
        while process.poll() is None and time.monotonic() < deadline:
            if (path / "portions").is_dir() and sum(p.name.isdigit() for p in (path / "portions").iterdir()) >= 20:
                break
            time.sleep(0.002)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert process.returncode == -signal.SIGKILL
    interrupted = RayMap.open(path)
    assert 2_000 <= interrupted.n_rays < N_RAYS
    for portion in interrupted.portions:
        assert portion.content() == portion.summary.content
    assert_same_rays(simulate(scene, path, rays=N_RAYS, resume=True), whole)
    assert not list((path / "portions").glob(".making-*"))


def test_stored_columns_are_what_was_traced(scene, whole):
    """Signatures unfolded per event and per crossing give back every traced array, value for value."""
    compiled = compile_scene(load_scene(scene))
    traced = Tracer(compiled, SEED).trace_portion(0, N_RAYS)
    stored = Histories(whole)
    face = np.append(compiled.tables.triangle_face, -1)[traced.triangle]
    assert (stored.ray_source == traced.source).all()
    assert (stored.offsets == traced.event_offsets).all()
    assert (stored.kind == traced.kind).all()
    assert (stored.triangle == traced.triangle).all()
    assert (stored.face == face).all()
    assert (stored.body == np.append(compiled.tables.face_body, -1)[face]).all()
    assert (stored.medium == traced.medium).all()
    assert (stored.position == traced.position_mm).all()
    assert (stored.light == traced.light).all()
    assert (stored.crossing_row == traced.crossing_row).all()
    assert (stored.crossing_detector == traced.crossing_detector).all()
    assert (stored.crossing_xy == traced.crossing_xy_mm).all()
    assert (stored.crossing_angle == traced.crossing_angle_rad).all()
    assert (stored.crossing_registered == traced.crossing_registered).all()
    assert traced.crossing_registered.any()
    assert not traced.crossing_registered.all()


def test_steps_of_a_signature_are_events_and_their_crossings_in_order(whole):
    """A signature starts with the emission and holds a source there only; crossings have a detector, events none."""
    for portion in whole.portions:
        table = portion.signatures
        first = np.zeros(len(table.kind), bool)
        first[table.offsets[:-1]] = True
        crossing = table.kind == EventKind.CROSSING
        assert (table.kind[first] == EventKind.EMISSION).all()
        assert ((table.source >= 0) == first).all()
        assert ((table.detector >= 0) == crossing).all()
        assert ((table.registered >= 0) == crossing).all()
        assert (table.medium[~crossing] >= 0).all()
        rays_per_signature = np.bincount(portion.ray_signature, minlength=len(table))
        assert (rays_per_signature > 0).all()
