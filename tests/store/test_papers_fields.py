# SPDX-License-Identifier: LGPL-2.1-or-later
"""The eleven fields that the paper stores of a segment (its section 2), each read or derived from a map's files alone.

Nothing of the library reads the map here: `Plain` uses pyarrow, json and numpy, as somebody with another program would.
Each field is then held against the scene, or against what physics or geometry says that it must be.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from raymaps.effects.crossings import rectangle_crossing
from raymaps.kinds import EventKind
from raymaps.ray_numbers import source_of_rays
from raymaps.scene import load_scene
from tests.store.small_scenes import BLOCK_MM, BUBBLE_MM, read_ply

CROSSING = 32


class Plain:
    """A map read with pyarrow and json. One row of each array is an event, which is where a segment starts."""

    def __init__(self, path: Path):
        self.manifest = json.loads((path / "manifest.json").read_text(encoding="utf-8"))
        self.scene = json.loads((path / "scene.json").read_text(encoding="utf-8"))
        self.names = self.manifest["names"]
        bodies = self.scene["bodies"].values()
        self.corners_mm = np.concatenate([read_ply(path / body["geometry"]["file"]) for body in bodies])
        counts = [[face["triangles"] for face in body["geometry"]["faces"]] for body in bodies]
        self.triangle_body = np.repeat(np.arange(len(counts)), [sum(c) for c in counts])
        flat = [n for c in counts for n in c]
        self.triangle_face = np.repeat(np.arange(len(flat)), flat)

        events: dict[str, list] = {}
        crossings: dict[str, list] = {}
        self.n_before = 0
        for folder in sorted((path / "portions").iterdir()):
            self._read_portion(folder, events, crossings)
        self.event = {name: np.concatenate(parts) for name, parts in events.items()}
        self.crossing = {name: np.concatenate(parts) for name, parts in crossings.items()}
        self.position_mm = np.stack([self.event[c] for c in ("x_mm", "y_mm", "z_mm")], axis=1).astype(float)
        self.light = np.stack([self.event[c] for c in "rgb"], axis=1).astype(float)
        self.is_last = np.append(self.event["ray"][1:] != self.event["ray"][:-1], True)
        self.starts_segment = np.flatnonzero(~self.is_last)  # its segment ends at the next row

    def _read_portion(self, folder: Path, events: dict, crossings: dict) -> None:
        files = ("rays", "signatures", "events", "lights", "crossings")
        table = {n: pq.read_table(folder / f"{n}.parquet") for n in files}
        columns = {n: {c: t.column(c).to_numpy() for c in t.column_names} for n, t in table.items()}
        steps = columns["signatures"]
        of_signature = {int(s): np.flatnonzero(steps["signature"] == s) for s in np.unique(steps["signature"])}
        chosen = [of_signature[int(s)] for s in columns["rays"]["signature"]]
        rows = np.concatenate(chosen)  # every step of every ray, in order
        source = np.concatenate([np.full(len(c), steps["source"][c[0]]) for c in chosen])
        is_crossing = steps["kind"][rows] == CROSSING
        found = dict(columns["events"])
        light = found.pop("light")
        found |= {band: columns["lights"][band][light] for band in "rgb"}
        for name in ("kind", "body", "face", "surface", "medium"):
            found[name] = steps[name][rows[~is_crossing]]
        found["source"] = source[~is_crossing]
        assert len({len(column) for column in found.values()}) == 1
        across = dict(columns["crossings"])
        across["registered"] = steps["registered"][rows[is_crossing]]
        assert (steps["detector"][rows[is_crossing]] == across["detector"]).all()
        first_row = np.searchsorted(found["ray"], across["ray"])
        across["row"] = first_row + across["event"] + self.n_before
        self.n_before += len(found["ray"])
        for into, part in ((events, found), (crossings, across)):
            for name, column in part.items():
                into.setdefault(name, []).append(column)

    def normal(self, rows: np.ndarray) -> np.ndarray:
        """Field 6: outward unit normal of the events' triangles, from their corners."""
        a, b, c = np.moveaxis(self.corners_mm[self.event["triangle"][rows]], 1, 0)
        normal = np.cross(b - a, c - a)
        return normal / np.linalg.norm(normal, axis=1)[:, None]

    def direction(self, rows: np.ndarray) -> np.ndarray:
        """Direction of the segments that start at events, from their two ends."""
        way = self.position_mm[rows + 1] - self.position_mm[rows]
        return way / np.linalg.norm(way, axis=1)[:, None]

    def rows(self, *kinds: EventKind) -> np.ndarray:
        return np.flatnonzero(np.isin(self.event["kind"], kinds))


@pytest.fixture(scope="module")
def plain(workshop_map) -> Plain:
    return Plain(workshop_map.path)


@pytest.fixture(scope="module")
def scene(workshop_map):
    return load_scene(workshop_map.scene_file)


SURFACE_KINDS = {
    EventKind.DIFFUSE_REFLECTION: {"lambertian"},
    EventKind.DIFFUSE_REFRACTION: {"lambertian"},
    EventKind.SPECULAR_REFLECTION: {"mirror"},
    EventKind.FRESNEL_REFLECTION: {"fresnel"},
    EventKind.FRESNEL_REFRACTION: {"fresnel"},
    EventKind.ABSORPTION: {"absorber", "mirror", "lambertian"},
}


def test_the_map_holds_every_kind_of_event_that_is_simulated(plain):
    """Else the tests below would say little."""
    kinds = {EventKind(k) for k in np.unique(plain.event["kind"])}
    assert kinds == {
        EventKind.EMISSION, EventKind.MEDIUM_ABSORPTION, EventKind.LEFT, EventKind.KILLED_DEPTH, *SURFACE_KINDS,
    }  # fmt: skip
    assert len(plain.crossing["ray"]) > 500


def test_field_1_colour(plain, scene):
    """Stored per event, relative to the emission; in W by the flux of the source and the number of its rays."""
    start = plain.rows(EventKind.EMISSION)
    for i, source in enumerate(scene.sources.values()):
        mine = start[plain.event["source"][start] == i]
        assert plain.light[mine] == pytest.approx(
            np.tile(np.array(source.rgb) / sum(source.rgb), (len(mine), 1)), abs=1e-7
        )
        flux_w = source.flux_w / len(mine) * plain.light[mine]
        assert flux_w.sum() == pytest.approx(source.flux_w, rel=1e-12)
    assert (plain.light >= 0).all()
    total = plain.light.sum(axis=1)
    assert (total[plain.starts_segment + 1] <= total[plain.starts_segment] * (1 + 1e-6)).all()  # never grows
    gone = plain.rows(EventKind.ABSORPTION, EventKind.MEDIUM_ABSORPTION)
    assert (plain.light[gone] == 0).all()
    assert (total[plain.rows(EventKind.LEFT, EventKind.KILLED_DEPTH)] > 0).all()
    # a mirror's and a Lambertian surface's share, band by band, or roulette's: undiminished
    for kind, name, share in (
        (EventKind.SPECULAR_REFLECTION, "mirror", [0.9, 0.8, 0.7]),
        (EventKind.DIFFUSE_REFLECTION, "white", [0.8, 0.8, 0.8]),
    ):
        rows = plain.rows(kind)
        rows = rows[np.array(plain.names["surfaces"])[plain.event["surface"][rows]] == name]
        in_air = rows[plain.event["medium"][rows - 1] == plain.names["media"].index("air")]
        before = np.where(plain.light[in_air - 1] > 0, plain.light[in_air - 1], 1)
        kept = np.where(plain.light[in_air - 1] > 0, plain.light[in_air] / before, np.array(share))
        lost = np.isclose(kept, share, rtol=1e-5).all(axis=1)
        assert lost.mean() > 0.5, name
        assert (total[in_air][~lost] <= total[in_air - 1][~lost] * (1 + 1e-6)).all(), name


def test_field_2_source(plain, scene):
    first = plain.rows(EventKind.EMISSION)
    assert plain.event["ray"][first].tolist() == list(range(3000))
    assert plain.event["source"][first].tolist() == source_of_rays(scene, 0, 3000).tolist()
    lamp = first[plain.event["source"][first] == plain.names["sources"].index("Lamp")]
    assert np.abs(plain.position_mm[lamp] - [-12, 3, 2]).max() <= plain.manifest["grid_mm"]


def test_field_3_body_and_field_4_triangle(plain):
    """The triangle is stored, body and face stand in the signature and follow from the triangle too."""
    triangle = plain.event["triangle"]
    on = triangle >= 0
    assert (plain.event["body"][on] == plain.triangle_body[triangle[on]]).all()
    assert (plain.event["face"][on] == plain.triangle_face[triangle[on]]).all()
    assert (plain.event["body"][~on] == -1).all()
    assert (plain.event["face"][~on] == -1).all()
    free = {EventKind.EMISSION, EventKind.MEDIUM_ABSORPTION, EventKind.LEFT}
    assert {EventKind(k) for k in plain.event["kind"][~on]} == free
    assert {plain.names["bodies"][b] for b in plain.event["body"][on]} == set(plain.names["bodies"])
    emitting = plain.rows(EventKind.EMISSION)
    led = plain.event["source"][emitting] == plain.names["sources"].index("LED")
    assert ((triangle[emitting] >= 0) == led).all()
    faces = [(plain.names["bodies"][b], f) for b, f in plain.names["faces"]]
    assert {faces[f] for f in plain.event["face"][emitting][led]} == {("Chip", "top")}


def test_field_5_start_and_end_points(plain):
    """A segment ends where the next event of its ray is; points on surfaces lie in their triangles."""
    grid = plain.manifest["grid_mm"]
    on = np.flatnonzero(plain.event["triangle"] >= 0)
    a, b, c = np.moveaxis(plain.corners_mm[plain.event["triangle"][on]], 1, 0)
    point = plain.position_mm[on]
    assert np.abs(np.einsum("ij,ij->i", point - a, plain.normal(on))).max() <= grid
    whole = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    parts = sum(np.linalg.norm(np.cross(p - point, q - point), axis=1) for p, q in ((a, b), (b, c), (c, a)))
    assert np.abs(parts / whole - 1).max() < 1e-5  # inside: the three parts make up the triangle
    assert np.abs(plain.position_mm / grid - np.round(plain.position_mm / grid)).max() == 0
    assert math.frexp(grid)[0] == 0.5
    length = np.linalg.norm(
        plain.position_mm[plain.starts_segment + 1] - plain.position_mm[plain.starts_segment], axis=1
    )
    assert (length > 0).all()


def test_field_5_sources_and_the_scenes_end(plain, scene):
    beam = plain.rows(EventKind.EMISSION)
    beam = beam[plain.event["source"][beam] == plain.names["sources"].index("Beam")]
    axis = np.array([0.1, 1, 0]) / math.hypot(0.1, 1)
    off = plain.position_mm[beam] - [1, -18, 1]
    assert np.abs(off @ axis).max() <= 2 * plain.manifest["grid_mm"]
    assert np.linalg.norm(off, axis=1).max() <= 2 + plain.manifest["grid_mm"]
    assert plain.direction(beam) == pytest.approx(np.tile(axis, (len(beam), 1)), abs=1e-4)
    left = plain.position_mm[plain.rows(EventKind.LEFT)]
    corners = plain.corners_mm.reshape(-1, 3)
    outside = ((left < corners.min(axis=0)) | (left > corners.max(axis=0))).any(axis=1)
    assert outside.all()


def test_field_6_normal(plain):
    """Derived from the triangle; light that is reflected by it or refracted through it obeys the laws."""
    mirrored = plain.rows(EventKind.SPECULAR_REFLECTION, EventKind.FRESNEL_REFLECTION)
    incoming, outgoing, normal = plain.direction(mirrored - 1), plain.direction(mirrored), plain.normal(mirrored)
    assert np.linalg.norm(normal, axis=1) == pytest.approx(1)
    expected = incoming - 2 * np.einsum("ij,ij->i", incoming, normal)[:, None] * normal
    length = np.linalg.norm(plain.position_mm[mirrored] - plain.position_mm[mirrored - 1], axis=1)
    length = np.minimum(length, np.linalg.norm(plain.position_mm[mirrored + 1] - plain.position_mm[mirrored], axis=1))
    tolerance = 8 * plain.manifest["grid_mm"] / length
    assert (np.linalg.norm(outgoing - expected, axis=1) <= tolerance).all()

    n = np.array([plain.scene["media"][m]["refractive_index"] for m in plain.names["media"]])
    bent = plain.rows(EventKind.FRESNEL_REFRACTION)
    incoming, outgoing, normal = plain.direction(bent - 1), plain.direction(bent), plain.normal(bent)
    before, after = n[plain.event["medium"][bent - 1]], n[plain.event["medium"][bent]]
    length = np.linalg.norm(plain.position_mm[bent] - plain.position_mm[bent - 1], axis=1)
    length = np.minimum(length, np.linalg.norm(plain.position_mm[bent + 1] - plain.position_mm[bent], axis=1))
    across = before[:, None] * np.cross(incoming, normal) - after[:, None] * np.cross(outgoing, normal)
    assert (np.linalg.norm(across, axis=1) <= 12 * plain.manifest["grid_mm"] / length).all()  # Snell
    assert (np.sign(np.einsum("ij,ij->i", incoming, normal)) == np.sign(np.einsum("ij,ij->i", outgoing, normal))).all()


def test_field_7_surface_property(plain, scene):
    on = np.flatnonzero(plain.event["triangle"] >= 0)
    for row in on:
        body, face = plain.names["faces"][plain.event["face"][row]]
        entry = scene.bodies[plain.names["bodies"][body]]
        assert plain.names["surfaces"][plain.event["surface"][row]] == entry.face_surfaces.get(face, entry.surface)
    assert (plain.event["surface"][plain.event["triangle"] < 0] == -1).all()


def test_field_8_transformation_on_the_surface(plain, scene):
    """Each kind only on surfaces that can do it; a mixture can do what its parts can."""
    for kind, allowed in SURFACE_KINDS.items():
        rows = plain.rows(kind)
        assert len(rows), kind
        assert (plain.event["triangle"][rows] >= 0).all()
        for surface in np.unique(plain.event["surface"][rows]):
            prop = scene.surfaces[plain.names["surfaces"][surface]]
            parts = [scene.surfaces[p.surface] for p in prop.parts] if prop.kind == "mixture" else [prop]
            assert {part.kind for part in parts} & allowed, (kind, prop)
    # reflected light stays on its side of the surface, refracted light goes through
    for kinds, sign in (
        ((EventKind.DIFFUSE_REFLECTION, EventKind.SPECULAR_REFLECTION, EventKind.FRESNEL_REFLECTION), -1),
        ((EventKind.DIFFUSE_REFRACTION, EventKind.FRESNEL_REFRACTION), 1),
    ):
        rows = plain.rows(*kinds)
        normal = plain.normal(rows)
        before = np.einsum("ij,ij->i", plain.direction(rows - 1), normal)
        after = np.einsum("ij,ij->i", plain.direction(rows), normal)
        clear = np.minimum(np.abs(before), np.abs(after)) > 1e-3
        assert (np.sign(before * after)[clear] == sign).all()


def inside(points: np.ndarray, center: tuple, size: float, margin: float) -> np.ndarray:
    return (np.abs(points - center) < size / 2 - margin).all(axis=1)


def test_field_9_event_in_the_medium(plain):
    """Absorption in the glass: within the block and outside the bubble, on no triangle, medium named."""
    rows = plain.rows(EventKind.MEDIUM_ABSORPTION)
    assert len(rows) > 50
    assert inside(plain.position_mm[rows], (0, 0, 0), BLOCK_MM, 0).all()
    assert not inside(plain.position_mm[rows], (0, 0, 0.5), BUBBLE_MM, 1e-4).any()
    assert {plain.names["media"][m] for m in plain.event["medium"][rows]} == {"glass"}
    assert (plain.event["triangle"][rows] == -1).all()
    assert plain.is_last[rows].all()


def test_field_10_medium_along_the_segment(plain):
    """That of the event where the segment starts: glass between block and bubble, air elsewhere."""
    rows = plain.starts_segment
    middle = (plain.position_mm[rows] + plain.position_mm[rows + 1]) / 2
    in_block, in_bubble = inside(middle, (0, 0, 0), BLOCK_MM, 0), inside(middle, (0, 0, 0.5), BUBBLE_MM, 0)
    margin = 1e-3
    near_wall = in_block & ~inside(middle, (0, 0, 0), BLOCK_MM, margin)
    near_wall |= ~in_block & inside(middle, (0, 0, 0), BLOCK_MM, -margin)
    near_wall |= in_bubble & ~inside(middle, (0, 0, 0.5), BUBBLE_MM, margin)
    near_wall |= ~in_bubble & inside(middle, (0, 0, 0.5), BUBBLE_MM, -margin)
    medium = np.array(plain.names["media"])[plain.event["medium"][rows]]
    expected = np.where(in_block & ~in_bubble, "glass", "air")
    assert near_wall.mean() < 0.01
    assert (medium[~near_wall] == expected[~near_wall]).all()
    assert {"glass", "air"} == set(medium)


def test_field_11_detector_crossings(plain, scene):
    """Every segment against every detector by the slow reference: which, where, at which angle, registered or not."""
    grid = plain.manifest["grid_mm"]
    expected: dict[tuple[int, int], tuple[float, float, float]] = {}
    doubtful = set()
    for i, detector in enumerate(scene.detectors.values()):
        axes = detector.axes
        local = (plain.position_mm - np.array(detector.center_mm)) @ axes.T
        near = np.abs(local[:, 2]) < 3 * grid
        for row in plain.starts_segment[(local[plain.starts_segment, 2] * local[plain.starts_segment + 1, 2]) < 0]:
            found = rectangle_crossing(detector, plain.position_mm[row], plain.position_mm[row + 1])
            if found is not None:
                expected[row, i] = found
            through = local[row] + local[row, 2] / (local[row, 2] - local[row + 1, 2]) * (local[row + 1] - local[row])
            edge = np.abs(np.abs(through[:2]) - np.array([detector.width_mm, detector.height_mm]) / 2).min()
            if edge < 0.01:
                doubtful.add((row, i))
        doubtful |= {(row, i) for row in plain.starts_segment if near[row] or near[row + 1]}
    keys = list(zip(plain.crossing["row"].tolist(), plain.crossing["detector"].tolist(), strict=True))
    assert len(set(keys)) == len(keys)
    assert set(keys) - doubtful == set(expected) - doubtful
    assert len(set(keys) - doubtful) > 500

    for k, key in enumerate(keys):
        if key in doubtful:
            continue
        x, y, angle = expected[key]
        detector = list(scene.detectors.values())[key[1]]
        slope = 1 / max(abs(math.cos(angle)), 1e-3)
        assert plain.crossing["x_mm"][k] == pytest.approx(x, abs=6 * grid * slope)
        assert plain.crossing["y_mm"][k] == pytest.approx(y, abs=6 * grid * slope)
        length = np.linalg.norm(plain.position_mm[key[0] + 1] - plain.position_mm[key[0]])
        assert plain.crossing["angle_rad"][k] == pytest.approx(angle, abs=1e-5 + 4 * grid / length)
    # registered: front means against the normal, within the acceptance angle
    angle_deg = np.degrees(plain.crossing["angle_rad"])
    above = plain.crossing["detector"] == plain.names["detectors"].index("Above")
    assert (plain.crossing["registered"][above] == (angle_deg[above] <= 35)).all()
    assert 0 < plain.crossing["registered"][above].mean() < 1
    assert (plain.crossing["registered"][~above] == 1).all()


def test_field_11_cell(plain, workshop_map, scene):
    """Derived: the cell follows from the place, the detector's size and its resolution; first row lowest y."""
    from raymaps.results.detector import evaluate_detector

    flux_w = np.array([source.flux_w for source in scene.sources.values()])
    watts = flux_w / np.bincount(plain.event["source"][plain.rows(EventKind.EMISSION)])
    for i, (name, detector) in enumerate(scene.detectors.items()):
        mine = (plain.crossing["detector"] == i) & (plain.crossing["registered"] == 1)
        row = plain.crossing["row"][mine]
        (n_x, n_y), cells = detector.resolution, np.zeros(detector.resolution[::-1])
        column = np.floor((plain.crossing["x_mm"][mine].astype(float) / detector.width_mm + 0.5) * n_x).astype(int)
        line = np.floor((plain.crossing["y_mm"][mine].astype(float) / detector.height_mm + 0.5) * n_y).astype(int)
        np.add.at(cells, (line, column), plain.light[row].sum(axis=1) * watts[plain.event["source"][row]])
        assert (cells > 0).sum() > n_x * n_y / 2
        assert evaluate_detector(workshop_map.raymap, name).cell_flux_w == pytest.approx(cells, rel=1e-6)


def test_field_11_crossings_of_a_segment_stand_in_the_order_of_its_way(plain):
    row = plain.crossing["row"]
    for k in np.flatnonzero(row[1:] == row[:-1]):
        start = plain.position_mm[row[k]]
        distance = []
        for j in (k, k + 1):
            detector = list(plain.scene["detectors"].values())[plain.crossing["detector"][j]]
            axes = load_detector(detector).axes
            place = (
                np.array(detector["center_mm"])
                + plain.crossing["x_mm"][j] * axes[0]
                + plain.crossing["y_mm"][j] * axes[1]
            )
            distance.append(np.linalg.norm(place - start))
        assert distance[0] < distance[1]
    assert (np.diff(row) >= 0).all()


def load_detector(data: dict):
    from raymaps.scene import RectangleDetector

    return RectangleDetector(**data)


# ---------------------------------------------------------------------------------------------------------------------
# Other readers


def test_pyarrow_alone_gives_what_the_library_gives(plain, workshop_map):
    raymap = workshop_map.raymap
    for name in ("triangle", "kind", "body", "face", "surface", "medium"):
        parts = [
            p.triangle if name == "triangle" else getattr(p.signatures, name)[p.event_step] for p in raymap.portions
        ]
        assert np.array_equal(plain.event[name], np.concatenate(parts)), name
    assert np.array_equal(plain.light, np.concatenate([p.light for p in raymap.portions]))
    assert np.array_equal(plain.position_mm, np.concatenate([p.position_mm for p in raymap.portions]))
    registered = np.concatenate([p.crossing_registered for p in raymap.portions])
    assert np.array_equal(plain.crossing["registered"] == 1, registered)


def test_duckdb_answers_a_criterion_through_signatures(workshop_map):
    """Rays that met the block and then crossed the detector above it, by SQL alone."""
    duckdb = pytest.importorskip("duckdb")
    from raymaps.criterion import query

    raymap = workshop_map.raymap
    body, detector = raymap.names.bodies.index("Block"), raymap.names.detectors.index("Above")
    portions = workshop_map.path / "portions" / "*"
    folder = "regexp_extract(filename, 'portions[/\\\\](\\d+)', 1)"
    sql = f"""
        WITH rays AS (SELECT {folder} AS portion, * FROM read_parquet('{portions}/rays.parquet', filename = true)),
        steps AS (SELECT {folder} AS portion, * FROM read_parquet('{portions}/signatures.parquet', filename = true)),
        matching AS (SELECT portion, signature FROM steps GROUP BY portion, signature
                     HAVING bool_or(body = {body} AND kind <> 0) AND bool_or(detector = {detector} AND registered = 1))
        SELECT ray FROM rays JOIN matching USING (portion, signature) ORDER BY ray
    """
    found = [ray for (ray,) in duckdb.connect().sql(sql).fetchall()]
    assert found == query(raymap, "hit(Block) & detector(Above)").ids.tolist()
    assert 0 < len(found) < 3000


def test_a_segment_is_joined_to_its_crossings_by_ray_and_event(workshop_map):
    """Flux on a detector by SQL: the light of the event that starts the crossing segment."""
    duckdb = pytest.importorskip("duckdb")
    portions = workshop_map.path / "portions" / "*"
    folder = "regexp_extract(filename, 'portions[/\\\\](\\d+)', 1)"
    sql = f"""
        WITH lights AS (SELECT {folder} AS portion, * FROM read_parquet('{portions}/lights.parquet', filename = true)),
        events AS (SELECT {folder} AS portion, *,
                   row_number() OVER (PARTITION BY ray ORDER BY file_row_number) - 1 AS event
                   FROM read_parquet('{portions}/events.parquet', file_row_number = true, filename = true))
        SELECT sum(r + g + b) FROM read_parquet('{portions}/crossings.parquet') JOIN events USING (ray, event)
        JOIN lights USING (portion, light) WHERE detector = 1
    """
    ((total,),) = duckdb.connect().sql(sql).fetchall()
    raymap = workshop_map.raymap
    expected = sum(p.light[p.crossing_row[p.crossing_detector == 1]].astype(float).sum() for p in raymap.portions)
    assert total == pytest.approx(expected, rel=1e-6)
