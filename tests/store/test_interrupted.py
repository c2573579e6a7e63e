# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs that are stopped, killed, crash, or meet a full disk: what was committed stays valid and can be resumed."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from raymaps.check import check_map
from raymaps.errors import Interrupted, MapError, OutputError
from raymaps.run import simulate
from raymaps.store import Manifest, MapWriter, RayMap
from raymaps.store import portion as portion_module
from raymaps.traced import FaceIndex
from tests.store.small_scenes import changed, lamp_in_a_room, write_scene

REPOSITORY = Path(__file__).resolve().parents[2]
RAYS, PORTION = 20_000, 500


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "raymaps", *map(str, arguments)]


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(REPOSITORY / "core")}


def raymaps(*arguments: object, **options) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command(*arguments), capture_output=True, text=True, timeout=120, check=False, env=environment(),
        stdin=subprocess.DEVNULL, **options,
    )  # fmt: skip


def started(*arguments: object) -> subprocess.Popen[str]:
    return subprocess.Popen(
        command(*arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(),
        stdin=subprocess.DEVNULL,
    )  # fmt: skip


def committed(path: Path) -> list[Path]:
    folder = path / "portions"
    return sorted(p for p in folder.iterdir() if p.name.isdigit()) if folder.is_dir() else []


def wait_for(condition: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    """Until a condition holds while the process is still busy."""
    deadline = time.monotonic() + 60
    while not condition():
        assert process.poll() is None, f"the run ended too soon: {process.communicate()}"
        assert time.monotonic() < deadline, "nothing happened"
        time.sleep(0.005)


def sound(path: Path) -> bool:
    return not any(finding.is_fault for finding in check_map(path))


@pytest.fixture(scope="module")
def room(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("room")
    return write_scene(folder, lamp_in_a_room(folder))


@pytest.fixture(scope="module")
def whole(room, tmp_path_factory) -> str:
    """Content hash of an uninterrupted run, in other portions."""
    path = tmp_path_factory.mktemp("whole") / "whole.raymap"
    return simulate(room, path, rays=RAYS, portion_rays=9000, threads=2).content_hash


# ---------------------------------------------------------------------------------------------------------------------
# Stopped within the process


def test_stopped_and_resumed_is_uninterrupted(room, tmp_path):
    path, stop = tmp_path / "m.raymap", threading.Event()
    with pytest.raises(Interrupted, match=r"of 20000 rays.*--resume"):
        simulate(
            room, path, rays=20_000, portion_rays=1000, threads=2, stop=stop,
            on_progress=lambda at: stop.set() if at.rays >= 3000 else None,
        )  # fmt: skip
    held = RayMap.open(path)
    assert 3000 <= held.n_rays < 20_000
    assert held.manifest.rays_asked == 20_000
    assert sound(path)
    resumed = simulate(room, path, rays=20_000, resume=True)
    assert resumed.n_rays == 20_000
    fresh = simulate(room, tmp_path / "fresh.raymap", rays=20_000, portion_rays=7777, threads=1)
    assert resumed.content_hash == fresh.content_hash


def test_stopped_before_it_began(room, tmp_path):
    stop = threading.Event()
    stop.set()
    with pytest.raises(Interrupted, match="after 0 of 5000"):
        simulate(room, tmp_path / "m.raymap", rays=5000, stop=stop)
    assert RayMap.open(tmp_path / "m.raymap").n_rays == 0
    assert sound(tmp_path / "m.raymap")
    assert simulate(room, tmp_path / "m.raymap", rays=5000, resume=True).n_rays == 5000


def test_rays_can_be_added(room, tmp_path):
    path = tmp_path / "m.raymap"
    simulate(room, path, rays=1500, portion_rays=1000)
    more = simulate(room, path, rays=4000, resume=True)
    assert more.n_rays == more.manifest.rays_asked == 4000
    assert more.content_hash == simulate(room, tmp_path / "f.raymap", rays=4000).content_hash
    again = simulate(room, path, rays=1000, resume=True)  # it has more already
    assert (again.n_rays, again.manifest.rays_asked) == (4000, 4000)


def test_resuming_what_does_not_exist_makes_it(room, tmp_path):
    assert simulate(room, tmp_path / "m.raymap", rays=100, resume=True).n_rays == 100


def test_resume_refuses_another_seed_or_scene(room, tmp_path):
    path = tmp_path / "m.raymap"
    simulate(room, path, rays=100, seed=4)
    with pytest.raises(MapError, match="seed 4, not 5"):
        simulate(room, path, rays=200, seed=5, resume=True)
    other = write_scene(
        room.parent, changed(lamp_in_a_room(room.parent), "surfaces.grey.reflectance", 0.6), "other.json"
    )
    with pytest.raises(MapError, match="another scene"):
        simulate(other, path, rays=200, resume=True)
    assert simulate(room, path, rays=200, seed=4, resume=True).n_rays == 200
    assert simulate(room, path, rays=300, resume=True).manifest.seed == 4


def test_a_failure_of_the_tracer_leaves_what_was_committed(room, tmp_path, monkeypatch):
    from raymaps.trace import Tracer

    trace_portion = Tracer.trace_portion

    def fail_at_the_fourth(self, first_ray, n_rays):
        if first_ray == 3000:
            raise MemoryError
        return trace_portion(self, first_ray, n_rays)

    monkeypatch.setattr(Tracer, "trace_portion", fail_at_the_fourth)
    path = tmp_path / "m.raymap"
    with pytest.raises(MemoryError):
        simulate(room, path, rays=8000, portion_rays=1000, threads=1)
    assert [p.first_ray for p in RayMap.open(path).portions] == [0, 1000, 2000]
    monkeypatch.undo()
    resumed = simulate(room, path, rays=8000, resume=True)
    assert resumed.content_hash == simulate(room, tmp_path / "f.raymap", rays=8000).content_hash


def test_a_gap_is_filled(room, tmp_path):
    """Portions are committed in any order by several threads, so a killed run may leave a gap."""
    path = tmp_path / "m.raymap"
    before = simulate(room, path, rays=5000, portion_rays=1000).content_hash
    shutil.rmtree(path / "portions" / "000000002000")
    shutil.rmtree(path / "portions" / "000000000000")
    assert RayMap.open(path).n_rays == 3000
    assert simulate(room, path, rays=5000, resume=True).content_hash == before


# ---------------------------------------------------------------------------------------------------------------------
# The process dies


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV], ids=["SIGKILL", "SIGSEGV"])
def test_a_run_that_dies_midway(room, whole, tmp_path, number):
    path = tmp_path / "m.raymap"
    process = started("trace", room, "-o", path, "--rays", RAYS, "--portion", PORTION, "--threads", 2)
    wait_for(lambda: len(committed(path)) >= 3, process)
    process.send_signal(number)
    process.communicate(timeout=30)
    assert process.returncode == -number
    held = RayMap.open(path)
    assert 3 * PORTION <= held.n_rays < RAYS
    assert sound(path)
    assert raymaps("info", path, "--json").returncode == 0
    # and once more, while it is resumed
    n = len(committed(path))
    process = started("trace", room, "-o", path, "--rays", RAYS, "--resume")
    wait_for(lambda: len(committed(path)) >= n + 3, process)
    process.kill()
    process.communicate(timeout=30)
    assert simulate(room, path, rays=RAYS, resume=True).content_hash == whole
    assert sound(path)
    assert [p.name for p in (path / "portions").iterdir() if not p.name.isdigit()] == []


def test_leftovers_of_a_killed_run_are_ignored_and_cleared(room, tmp_path):
    path = tmp_path / "m.raymap"
    before = simulate(room, path, rays=3000, portion_rays=1000)
    left = path / "portions" / ".making-000000003000-4242"
    shutil.copytree(path / "portions" / "000000001000", left)
    (left / "events.parquet").write_bytes(b"half")
    assert RayMap.open(path).content_hash == before.content_hash
    assert sound(path)
    simulate(room, path, rays=4000, resume=True)
    assert not left.exists()
    assert RayMap.open(path).n_rays == 4000


def test_a_portion_without_its_rename_is_not_there(room, tmp_path, monkeypatch):
    """Killed at any moment before the rename, all files of the portion written: nothing to be seen."""
    path = tmp_path / "m.raymap"
    simulate(room, path, rays=1000, portion_rays=1000)
    seen = []

    def look(self, target):
        seen.append(RayMap.open(path).n_rays)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(portion_module.Path, "rename", look)
        with pytest.raises(KeyboardInterrupt):
            simulate(room, path, rays=2000, resume=True, threads=1)
    assert seen == [1000]
    assert RayMap.open(path).n_rays == 1000
    assert len(list((path / "portions").iterdir())) == 1


def test_nothing_is_left_of_a_map_that_could_not_be_made(room, tmp_path, monkeypatch):
    def fail(self, folder):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Manifest, "write", fail)
    with pytest.raises(OutputError, match="no space left on device"):
        simulate(room, tmp_path / "m.raymap", rays=100)
    assert list(tmp_path.iterdir()) == []


def test_a_reader_never_sees_half_a_portion(room, tmp_path):
    """Somebody opens, reads and checks the map over and over while it is written."""
    path, ended, seen, wrong = tmp_path / "m.raymap", threading.Event(), [], []

    def read_on() -> None:
        while not ended.is_set():
            if (path / "manifest.json").exists():
                raymap = RayMap.open(path)
                seen.append(raymap.n_rays)
                wrong.extend(p.first_ray for p in raymap.portions[-2:] if p.content() != p.summary.content)

    reader = threading.Thread(target=read_on)
    reader.start()
    try:
        simulate(room, path, rays=30_000, portion_rays=1000, threads=2)
    finally:
        ended.set()
        reader.join()
    assert wrong == []
    assert seen == sorted(seen)
    assert len(set(seen)) > 5
    assert all(n % 1000 == 0 for n in seen)


# ---------------------------------------------------------------------------------------------------------------------
# Two runs on one map


@pytest.mark.parametrize("first_rays", [None, 2000], ids=["both add to a fresh map", "both add to a map of fewer rays"])
def test_two_runs_on_one_map_are_refused(room, whole, tmp_path, first_rays):
    path = tmp_path / "m.raymap"
    if first_rays is not None:
        simulate(room, path, rays=first_rays, portion_rays=PORTION)
    n = len(committed(path))
    process = started("trace", room, "-o", path, "--rays", RAYS, "--portion", PORTION, "--threads", 1, "--resume")
    try:
        wait_for(lambda: len(committed(path)) > n + 1, process)
        process.send_signal(signal.SIGSTOP)  # busy for as long as the second run takes
        second = raymaps("trace", room, "-o", path, "--rays", RAYS, "--resume")
        process.send_signal(signal.SIGCONT)
    finally:
        error = process.communicate(timeout=60)[1]
    assert second.returncode == 3, second.stderr
    assert "another run" in second.stderr
    assert len(second.stderr.strip().splitlines()) == 1
    assert process.returncode == 0, error
    assert RayMap.open(path).content_hash == whole
    assert sound(path)


def test_the_map_is_free_again_after_a_run(room, tmp_path):
    path = tmp_path / "m.raymap"
    simulate(room, path, rays=100)
    faces = FaceIndex([], [], [])
    with (
        MapWriter(path, faces).alone(),
        pytest.raises(OutputError, match="another run"),
        MapWriter(path, faces).alone(),
    ):
        pass
    with MapWriter(path, faces).alone():
        pass
    assert simulate(room, path, rays=200, resume=True).n_rays == 200


# ---------------------------------------------------------------------------------------------------------------------
# A full disk


def test_a_file_that_may_not_grow(room, whole, tmp_path):
    """As on a full disk, every write past a limit fails; that needs no privilege."""
    path = tmp_path / "m.raymap"
    simulate(room, path, rays=5000, portion_rays=PORTION)

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (9000, 9000))

    done = raymaps("trace", room, "-o", path, "--rays", RAYS, "--resume", preexec_fn=limit)
    assert done.returncode == 3, done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert "can't be written" in done.stderr
    assert "--resume" in done.stderr
    assert RayMap.open(path).n_rays == 5000
    assert sound(path)
    assert [p.name for p in (path / "portions").iterdir() if not p.name.isdigit()] == []
    assert simulate(room, path, rays=RAYS, resume=True).content_hash == whole


def _can_mount() -> bool:
    unshare = shutil.which("unshare")
    if unshare is None:
        return False
    try_it = ["unshare", *_NAMESPACE, "sh", "-c", "mount -t tmpfs -o size=1m tmpfs /mnt"]
    return subprocess.run(try_it, capture_output=True, check=False).returncode == 0


_NAMESPACE = ["-m"] if os.geteuid() == 0 else ["-r", "-m"]


def test_a_full_disk(room, whole, tmp_path):
    """A real file system of 1 MB, in a mount namespace of its own that vanishes with the test."""
    if not _can_mount():
        pytest.skip("file systems can't be mounted here; the limit on file sizes stands in for a full disk")
    small, saved = tmp_path / "small", tmp_path / "saved.raymap"
    small.mkdir()
    trace = " ".join(f"'{part}'" for part in command("trace", room, "-o", small / "m.raymap", "--rays", RAYS,
                                                     "--portion", PORTION))  # fmt: skip
    script = (
        f"mount -t tmpfs -o size=1m tmpfs '{small}' && {trace}; code=$?; "
        f"ls -A '{small}/m.raymap/portions' | grep -v '^[0-9]*$' >&2; cp -a '{small}/m.raymap' '{saved}'; exit $code"
    )
    done = subprocess.run(
        ["unshare", *_NAMESPACE, "sh", "-c", script], capture_output=True, text=True, timeout=120, check=False,
        env=environment(),
    )  # fmt: skip
    assert done.returncode == 3, done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert "no space left on device" in done.stderr
    held = RayMap.open(saved)
    assert 0 < held.n_rays < RAYS
    assert sound(saved)
    assert simulate(room, saved, rays=RAYS, resume=True).content_hash == whole


# ---------------------------------------------------------------------------------------------------------------------
# The place


def test_an_output_that_exists_is_never_overwritten(room, tmp_path):
    simulate(room, tmp_path / "map.raymap", rays=100)
    (tmp_path / "file.raymap").write_text("mine")
    (tmp_path / "folder.raymap").mkdir()
    (tmp_path / "folder.raymap" / "notes.txt").write_text("mine")
    (tmp_path / "link.raymap").symlink_to(tmp_path / "nowhere")
    for name in ("map", "file", "folder", "link"):
        with pytest.raises(OutputError, match="exists already"):
            simulate(room, tmp_path / f"{name}.raymap", rays=50)
    assert RayMap.open(tmp_path / "map.raymap").n_rays == 100
    assert (tmp_path / "file.raymap").read_text() == "mine"
    assert (tmp_path / "folder.raymap" / "notes.txt").read_text() == "mine"


def test_resume_on_what_is_no_map(room, tmp_path):
    (tmp_path / "file.raymap").write_text("mine")
    (tmp_path / "folder.raymap").mkdir()
    for name in ("file", "folder"):
        with pytest.raises(MapError, match="not a Ray Map"):
            simulate(room, tmp_path / f"{name}.raymap", rays=50, resume=True)
    assert (tmp_path / "file.raymap").read_text() == "mine"
    assert list((tmp_path / "folder.raymap").iterdir()) == []


def test_places_that_can_not_be_written(room, tmp_path):
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file" / "m.raymap", tmp_path / ("x" * 300), Path("/proc/none/m.raymap")):
        with pytest.raises(OutputError, match="can't be written"):
            simulate(room, place, rays=50)


def test_a_folder_without_permission(room, tmp_path):
    """Also as root, which has permission everywhere: as nobody."""
    closed = tmp_path / "closed"
    closed.mkdir()
    closed.chmod(0o500)
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        scene = _in_memory()
        with pytest.raises(OutputError, match="permission denied"):
            simulate(scene, closed / "m.raymap", rays=50)
    finally:
        if root:
            os.seteuid(0)


def _in_memory():
    from raymaps.scene import scene_from_dict

    source = {"P": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}}
    return scene_from_dict({"format": "raymaps-scene", "version": 1, "sources": source})


def test_missing_folders_on_the_way_are_made(room, tmp_path):
    assert simulate(room, tmp_path / "new" / "er" / "m.raymap", rays=50).n_rays == 50
