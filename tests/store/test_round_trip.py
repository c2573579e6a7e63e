# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the tracer hands over is what a map gives back, column by column and bit by bit."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as pq
import pytest

from raymaps.bands import RGB_BANDS
from raymaps.kinds import EventKind
from raymaps.names import Names
from raymaps.store import Portion, RayMap
from raymaps.store.columns import COLUMNS
from raymaps.store.writing import write_portion
from raymaps.traced import FaceIndex

N_SOURCES, N_MEDIA, N_DETECTORS = 3, 2, 2
FACE_BODY = np.array([0, 0, 1, 2, 2], np.int32)
FACE_SURFACE = np.array([1, 0, 2, 2, 0], np.int16)
TRIANGLE_FACE = np.array([0, 0, 1, 2, 2, 2, 3, 4], np.int32)
NAMES = Names(
    ("A", "B", "C"), ("b0", "b1", "b2"), ("s0", "s1", "s2"), ("m0", "m1"), ("d0", "d1"),
    tuple((int(b), f"F{i}") for i, b in enumerate(FACE_BODY)),
)  # fmt: skip


def random_history(rng: np.random.Generator, first_ray: int, n_rays: int, position=np.float32) -> SimpleNamespace:
    """Histories that no scene would give: any kind after any other, any number of crossings."""
    n_of_ray = rng.integers(2, 7, n_rays)
    offsets = np.concatenate([[0], np.cumsum(n_of_ray)]).astype(np.int64)
    n = int(offsets[-1])
    kind = rng.integers(1, 14, n).astype(np.uint8)
    kind[offsets[:-1]] = EventKind.EMISSION
    kind[offsets[1:] - 1] = rng.choice([11, 12, 14, 15, 16, 17], n_rays)
    starts_segment = np.ones(n, bool)
    starts_segment[offsets[1:] - 1] = False
    crossing_row = np.repeat(np.arange(n), np.where(starts_segment, rng.integers(0, 3, n), 0)).astype(np.int64)
    m = len(crossing_row)
    return SimpleNamespace(
        first_ray=first_ray,
        source=rng.integers(0, N_SOURCES, n_rays).astype(np.int16),
        event_offsets=offsets,
        kind=kind,
        triangle=rng.integers(-1, len(TRIANGLE_FACE), n).astype(np.int32),
        medium=rng.integers(-1, N_MEDIA, n).astype(np.int16),
        position_mm=rng.normal(0, 100, (n, 3)).astype(position),
        light=rng.choice(rng.random((20, 3)), n).astype(np.float32),
        wavelength_nm=np.zeros(n_rays, np.float32),
        replicate=np.zeros(0, np.uint8),
        seconds={"intersection": 0.25},
        crossing_row=crossing_row,
        crossing_detector=rng.integers(0, N_DETECTORS, m).astype(np.int16),
        crossing_xy_mm=rng.normal(0, 5, (m, 2)).astype(np.float32),
        crossing_angle_rad=rng.uniform(0, np.pi, m).astype(np.float32),
        crossing_registered=rng.random(m) < 0.5,
    )


def cut(history: SimpleNamespace, begin: int, end: int) -> SimpleNamespace:
    """The rays ``begin`` to ``end`` - 1 of a history."""
    rows = slice(history.event_offsets[begin], history.event_offsets[end])
    chosen = (history.crossing_row >= rows.start) & (history.crossing_row < rows.stop)
    parts = {name: getattr(history, name)[rows] for name in ("kind", "triangle", "medium", "position_mm", "light")}
    parts |= {name: value[chosen] for name, value in vars(history).items() if name.startswith("crossing_")}
    parts["crossing_row"] = parts["crossing_row"] - rows.start
    return SimpleNamespace(
        first_ray=history.first_ray + begin,
        source=history.source[begin:end],
        event_offsets=history.event_offsets[begin : end + 1] - rows.start,
        wavelength_nm=history.wavelength_nm[begin:end],
        replicate=history.replicate,
        seconds={},
        **parts,
    )


def written(folder, history) -> Portion:
    write_portion(folder, history, NAMES, FaceIndex(TRIANGLE_FACE, FACE_BODY, FACE_SURFACE), RGB_BANDS, "rgb")
    return Portion.open(folder / f"{history.first_ray:012d}", NAMES, RGB_BANDS)


def assert_same(portion: Portion, history) -> None:
    """Every column of a portion against what it was written from."""
    steps, table = portion.event_step, portion.signatures
    face = np.where(history.triangle >= 0, TRIANGLE_FACE[history.triangle], -1)
    crossing_ray = np.searchsorted(history.event_offsets, history.crossing_row, side="right") - 1
    expected = {
        "source": (table.ray_source[portion.ray_signature], history.source),
        "event_offsets": (portion.event_offsets, history.event_offsets),
        "kind": (table.kind[steps], history.kind),
        "face": (table.face[steps], face),
        "body": (table.body[steps], np.where(face >= 0, FACE_BODY[face], -1)),
        "surface": (table.surface[steps], np.where(face >= 0, FACE_SURFACE[face], -1)),
        "medium": (table.medium[steps], history.medium),
        "detector of an event": (table.detector[steps], np.full(len(face), -1)),
        "triangle": (portion.triangle, history.triangle),
        "position": (portion.position_mm, history.position_mm),
        "light": (portion.light, history.light),
        "crossing_row": (portion.crossing_row, history.crossing_row),
        "crossing_ray": (portion.crossing_ray, crossing_ray),
        "crossing_detector": (portion.crossing_detector, history.crossing_detector),
        "crossing_xy": (portion.crossing_xy_mm, history.crossing_xy_mm),
        "crossing_angle": (portion.crossing_angle_rad, history.crossing_angle_rad),
        "crossing_registered": (portion.crossing_registered, history.crossing_registered),
    }
    for name, (found, wanted) in expected.items():
        assert found.shape == np.shape(wanted), name
        assert np.array_equal(found, wanted), name
    for name in ("position_mm", "light", "crossing_xy_mm", "crossing_angle_rad", "triangle"):
        assert getattr(portion, name).dtype == getattr(history, name).dtype, name
    assert portion.n_rays == len(history.source)
    assert portion.n_events == len(history.kind)
    assert portion.n_crossings == len(history.crossing_row)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("position", [np.float32, np.float64])
def test_every_column_comes_back(tmp_path, seed, position):
    rng = np.random.default_rng(seed)
    history = random_history(rng, int(rng.integers(0, 10**11)), int(rng.integers(1, 400)), position)
    portion = written(tmp_path, history)
    assert_same(portion, history)
    portion.forget()
    assert_same(portion, history)


def test_a_portion_without_crossings(tmp_path):
    history = random_history(np.random.default_rng(0), 0, 50)
    for name in [name for name in vars(history) if name.startswith("crossing_")]:
        setattr(history, name, getattr(history, name)[:0])
    assert_same(written(tmp_path, history), history)


def test_real_traced_portions_come_back(workshop_map):
    """Traced again, each portion of a map is what its files say, to the bit."""
    tracer = workshop_map.tracer()
    tables = workshop_map.compiled.tables
    for portion in workshop_map.raymap.portions:
        history = tracer.trace_portion(portion.first_ray, portion.n_rays)
        steps, table = portion.event_step, portion.signatures
        assert np.array_equal(table.ray_source[portion.ray_signature], history.source)
        assert np.array_equal(table.kind[steps], history.kind)
        assert np.array_equal(table.medium[steps], history.medium)
        on_face = history.triangle >= 0
        face = tables.triangle_face[history.triangle]
        assert np.array_equal(table.face[steps], np.where(on_face, face, -1))
        assert np.array_equal(table.body[steps], np.where(on_face, tables.face_body[face], -1))
        assert np.array_equal(table.surface[steps], np.where(on_face, tables.face_surface[face], -1))
        for name in (
            "event_offsets", "triangle", "position_mm", "light", "crossing_row", "crossing_detector", "crossing_xy_mm",
            "crossing_angle_rad", "crossing_registered",
        ):  # fmt: skip
            assert getattr(portion, name).tobytes() == getattr(history, name).tobytes(), name


def test_columns_are_read_only(workshop_map):
    portion = workshop_map.raymap.portions[0]
    for name in ("ray_signature", "triangle", "position_mm", "light", "crossing_row", "crossing_xy_mm",
                 "crossing_angle_rad", "crossing_registered", "crossing_detector", "crossing_ray"):  # fmt: skip
        assert not getattr(portion, name).flags.writeable, name
    assert not portion.signatures.kind.flags.writeable


def test_signatures_are_distinct_and_numbered_as_they_appear(workshop_map):
    for portion in workshop_map.raymap.portions:
        table = portion.signatures
        columns = [getattr(table, name) for name in COLUMNS["signatures"] if name != "signature"]
        rows = np.stack([column.astype(np.int64) for column in columns], axis=1)
        each = [tuple(map(tuple, rows[a:b])) for a, b in zip(table.offsets, table.offsets[1:], strict=False)]
        assert len(set(each)) == len(each) == portion.summary.n_signatures
        first_seen = [int(np.flatnonzero(portion.ray_signature == s)[0]) for s in range(len(each))]
        assert first_seen == sorted(first_seen)


# ---------------------------------------------------------------------------------------------------------------------
# The hash of the content


def content_of(*portions: Portion) -> tuple[int, int]:
    return tuple(sum(p.summary.content[i] for p in portions) % 2**64 for i in range(2))


@pytest.mark.parametrize("seed", range(3))
def test_content_hash_does_not_depend_on_portions(tmp_path, seed):
    history = random_history(np.random.default_rng(seed), 700, 120)
    whole = written(tmp_path, history)
    (tmp_path / "cut").mkdir()
    edges = [0, 1, 40, 41, 119, 120]
    parts = [written(tmp_path / "cut", cut(history, a, b)) for a, b in zip(edges, edges[1:], strict=False)]
    assert content_of(*parts) == content_of(whole)
    assert whole.content() == whole.summary.content
    assert all(part.content() == part.summary.content for part in parts)


def changed_histories(history):
    """One figure of a history changed at a time, in the smallest step: (what, history)."""
    for name, value in vars(history).items():
        if name in ("event_offsets", "crossing_row", "replicate"):
            continue
        for at in (0, -1):
            other = SimpleNamespace(
                **{k: np.copy(v) if isinstance(v, np.ndarray) else v for k, v in vars(history).items()}
            )
            if name == "first_ray":
                other.first_ray += 1
            elif name == "seconds":
                continue  # how long it took is no part of what is stored of rays
            elif value.dtype.kind == "f":
                column = getattr(other, name).reshape(len(value), -1)
                column[at, -1] = np.nextafter(column[at, -1], np.float32(9e9))
            elif value.dtype == bool:
                getattr(other, name)[at] ^= True
            else:
                getattr(other, name)[at] = int(value[at]) + (1 if value[at] < 1 else -1)
            yield f"{name}[{at}]", other


def test_content_hash_depends_on_every_figure(tmp_path):
    history = random_history(np.random.default_rng(5), 3, 9)
    before = written(tmp_path, history).summary.content
    for i, (what, other) in enumerate(changed_histories(history)):
        if what == "kind[0]":
            other.kind[0] = EventKind.EMISSION
            other.kind[1] = 1 + other.kind[1] % 10
        folder = tmp_path / f"other{i}"
        folder.mkdir()
        after = written(folder, other)
        assert after.summary.content != before, what
        assert (after.summary.content[0] != before[0]) == (after.summary.content[1] != before[1]), what


def test_content_hash_depends_on_the_order_of_events_and_crossings(tmp_path):
    history = random_history(np.random.default_rng(6), 0, 9)
    before = written(tmp_path, history).summary.content
    swapped = cut(history, 0, 9)
    ray = int(np.argmax(np.diff(history.event_offsets)))
    at = history.event_offsets[ray] + 1
    swapped.position_mm = swapped.position_mm.copy()
    swapped.position_mm[[at, at + 1]] = swapped.position_mm[[at + 1, at]]
    (tmp_path / "s").mkdir()
    assert written(tmp_path / "s", swapped).summary.content != before


def test_two_rays_exchanged_are_another_content(tmp_path):
    """The hash is a sum over rays, and each knows its number."""
    history = random_history(np.random.default_rng(7), 0, 2)
    one = [cut(history, 0, 1), cut(history, 1, 2)]
    one[0].first_ray, one[1].first_ray = 1, 0
    (tmp_path / "x").mkdir()
    exchanged = [written(tmp_path / "x", part) for part in one]
    assert content_of(*exchanged) != content_of(written(tmp_path, history))


# ---------------------------------------------------------------------------------------------------------------------
# Files and summaries


def test_files_hold_the_declared_columns(workshop_map):
    for portion in workshop_map.raymap.portions:
        for table, columns in COLUMNS.items():
            schema = pq.read_schema(portion.folder / f"{table}.parquet")
            spectral = {"wavelength_nm", "power", "lumen_per_w"}
            expected = [name for name in columns if name not in spectral and not name.startswith("band_")]
            assert schema.names == expected
            for name in expected:
                column, found = columns[name], schema.field(name).type.to_pandas_dtype()
                assert found == column.dtype if column.dtype else found in (np.float32, np.float64), name
        assert sorted(p.name for p in portion.folder.iterdir()) == sorted(
            [*(f"{t}.parquet" for t in COLUMNS), "portion.json"]
        )
        assert portion.summary.file_bytes == {
            f"{table}.parquet": (portion.folder / f"{table}.parquet").stat().st_size for table in COLUMNS
        }


def test_pages_have_checksums_and_are_compressed(workshop_map):
    portion = workshop_map.raymap.portions[0]
    for table in COLUMNS:
        group = pq.read_metadata(portion.folder / f"{table}.parquet").row_group(0)
        assert {group.column(i).compression for i in range(group.num_columns)} == {"ZSTD"}


def test_every_column_says_what_it_means():
    assert all(column.meaning for columns in COLUMNS.values() for column in columns.values())


def test_ledger_of_a_portion_is_what_its_events_lost(workshop_map):
    """Summed here event by event, in Python."""
    for portion in workshop_map.raymap.portions:
        steps, table = portion.event_step, portion.signatures
        sums: dict[tuple, float] = {}
        for ray in range(portion.n_rays):
            source = int(table.ray_source[portion.ray_signature[ray]])
            rows = range(portion.event_offsets[ray], portion.event_offsets[ray + 1])
            for before, row in zip(rows, rows[1:], strict=False):
                step = steps[row]
                kind = EventKind(table.kind[step])
                arriving, left = (float(portion.light[r].astype(float).sum()) for r in (before, row))
                lost = arriving - left
                if kind == EventKind.LEFT:
                    key, lost = (source, "escaped", 0), arriving
                elif kind in (EventKind.FRESNEL_REFLECTION, EventKind.FRESNEL_REFRACTION):
                    key = (source, "medium", int(table.medium[steps[before]]))
                elif kind == EventKind.MEDIUM_ABSORPTION:
                    key = (source, "medium", int(table.medium[step]))
                elif kind >= EventKind.KILLED_DEPTH:
                    key, lost = (source, "killed", int(kind)), arriving
                else:
                    key = (source, "body", int(table.body[step]))
                sums[key] = sums.get(key, 0.0) + lost
        found = {(e.source, e.what, e.index): e.light for e in portion.summary.ledger}
        keys = sorted(found.keys() | sums.keys())
        assert [found.get(key, 0.0) for key in keys] == pytest.approx([sums.get(key, 0.0) for key in keys], abs=1e-9)


def test_counts_of_a_map_are_those_of_its_portions(workshop_map):
    raymap = workshop_map.raymap
    assert raymap.n_rays == 3000
    assert [p.first_ray for p in raymap.portions] == [0, 1000, 2000]
    assert raymap.n_events == sum(len(p.light) for p in raymap.portions)
    assert raymap.rays_of_source.sum() == 3000
    assert raymap.ray_flux_w * raymap.rays_of_source == pytest.approx([2.0, 1.0, 0.5, 0.25])
    assert raymap.source_flux_w.tolist() == [2.0, 1.0, 0.5, 0.25]
    on_disk = sum(f.stat().st_size for f in (workshop_map.path / "portions").rglob("*.parquet"))
    assert raymap.n_bytes == on_disk


def test_missing_rays_fill_the_gaps_and_no_more(workshop_map):
    raymap = workshop_map.raymap
    first, last = raymap.portions[0], raymap.portions[2]
    holed = RayMap(raymap.path, raymap.manifest, [first, last])
    assert list(holed.missing_rays(3000)) == [(1000, 1000)]
    assert list(holed.missing_rays(1500)) == [(1000, 500)]
    assert list(holed.missing_rays(4500)) == [(1000, 1000), (3000, 1000), (4000, 500)]
    assert list(holed.missing_rays(900)) == []
    assert list(RayMap(raymap.path, raymap.manifest, []).missing_rays(2500)) == [(0, 1000), (1000, 1000), (2000, 500)]
