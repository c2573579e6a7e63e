# SPDX-License-Identifier: LGPL-2.1-or-later
"""Tables of BRDF and BTDF: directions follow the table, shares and colours are right, and nothing creates light."""

import math

import numpy as np
import pytest

from raymaps.effects.bsdf import shares
from raymaps.formats.klems import KLEMS_BASES
from raymaps.kinds import EventKind
from raymaps.materials.bsdf import BsdfTable
from raymaps.materials.bsdf_directions import BsdfCells
from tests.bsdf_texts import csv, grid_rows, klems, klems_matrix, table_of
from tests.physics.scenes import agrees, ball, body, box, disc_source, follows, traced, unit
from tests.physics.surface_bench import (
    NORMAL,
    cells_agree,
    lambertian_angles,
    lines,
    lowered,
    meet,
    reciprocal,
    scene_with,
)

SPECULAR_REFLECTION, SPECULAR_REFRACTION = EventKind.BSDF_SPECULAR_REFLECTION, EventKind.BSDF_SPECULAR_REFRACTION
DIFFUSE_REFLECTION, DIFFUSE_REFRACTION = EventKind.BSDF_DIFFUSE_REFLECTION, EventKind.BSDF_DIFFUSE_REFRACTION
LIGHT = (0.5, 0.3, 0.2)
QUARTER = "LBNL/Klems Quarter"


def surface(table):
    return {"kind": "bsdf", "data": table.model_dump()}


def ground_metal(tmp_path, **fields):
    """Like a measured sample: a lobe about the specular direction that grows towards grazing, on a dull base."""

    def value(i, s, p):
        off = math.hypot(
            math.sin(math.radians(s)) * math.cos(math.radians(p)) - math.sin(math.radians(i)),
            math.sin(math.radians(s)) * math.sin(math.radians(p)),
        )
        return f"{0.04 + (0.25 + i / 200) * math.exp(-((off / 0.5) ** 2)):.6f}"

    return table_of(csv(grid_rows(value, (0, 30, 60, 80))), tmp_path, **fields)


def woven(tmp_path, **fields):
    """A blind without any symmetry: random patches, some dark, more light through than back."""
    rng = np.random.default_rng(5)
    matrices = {}
    for name, most in (("Transmission Front", 0.12), ("Reflection Front", 0.06), ("Transmission Back", 0.15)):
        matrix = rng.uniform(0, most, (41, 41))
        matrices[name] = np.where(rng.uniform(size=(41, 41)) < 0.2, 0.0, matrix)
    return table_of(klems(matrices), tmp_path, "blind.xml", **fields)


def axis_at(azimuth_deg, *, from_back=False):
    """An x axis from which the bench's light travels towards an azimuth."""
    outward = -NORMAL if from_back else NORMAL
    forward = np.cross(outward, [0.0, 0.0, 1.0])
    forward /= np.linalg.norm(forward)
    turn = math.radians(azimuth_deg)
    return tuple(math.cos(turn) * forward - math.sin(turn) * np.cross(NORMAL, forward))


def polar_and_azimuth(met, *, from_back=False):
    """Directions after the surface in degrees: from the normal on their side, and from the plane of incidence, as seen
    from the front.
    """
    x, y, z = met.direction.T
    return np.degrees(np.arccos(np.minimum(np.abs(z), 1))), np.degrees(np.arctan2(-y if from_back else y, x))


def cell_of(cells, polar_deg, azimuth_deg):
    """Cell of each direction, by the borders of the table."""
    cell = np.full(len(polar_deg), -1)
    for k, (low, high, start, end) in enumerate(cells.borders_deg):
        around = start + (azimuth_deg - start) % 360
        cell[(polar_deg >= low) & (polar_deg < high) & (around < end)] = k
    return cell


def share_of_cells(table, side, way, polar_deg, azimuth_deg, layer=0):
    """Share of light that each cell takes on, by the definition of the BSDF; one set of cells for all incidences."""
    lobe = table.lobe(side, way)
    assert len(lobe.outgoing) == 1
    row = sum(w * np.array(lobe.value[layer][i]) for i, w in lobe.incoming.weights(polar_deg, azimuth_deg))
    low, high, start, end = np.radians(lobe.outgoing[0].borders_deg).T
    return row * (np.sin(high) ** 2 - np.sin(low) ** 2) * (end - start) / 2


@pytest.mark.parametrize("degrees", [0.0, 30.0, 52.0, 88.0])
def test_directions_follow_a_measured_table(tmp_path, degrees):
    """Cells by their energy, between measured angles of incidence linear; uniform in projected solid angle within."""
    table = ground_metal(tmp_path)
    n = 200_000
    met = meet("bsdf", lowered("bsdf", scene_with(surface(table))), math.radians(degrees), n)
    scattered = met.kind == DIFFUSE_REFLECTION
    assert (scattered | (met.kind == EventKind.ABSORPTION)).all()
    assert (met.direction[scattered, 2] > 0).all()
    polar, azimuth = (a[scattered] for a in polar_and_azimuth(met))
    cells = table.lobes[0].outgoing[0]
    counts = np.bincount(cell_of(cells, polar, azimuth), minlength=len(cells))
    cells_agree(
        f"cells at {degrees:g} degrees", counts, n * share_of_cells(table, "front", "reflection", degrees, 0), n=n
    )
    low, high, start, end = cells.borders_deg[cell_of(cells, polar, azimuth)].T
    low, high = np.sin(np.radians(low)) ** 2, np.sin(np.radians(high)) ** 2
    follows("place in the ring", (np.sin(np.radians(polar)) ** 2 - low) / (high - low))
    follows("place in the sector", ((azimuth - start) % 360) / (end - start))


@pytest.mark.parametrize(
    ("degrees", "azimuth", "from_back"),
    [(0, 0, False), (25, 77, False), (70, 200, False), (40, 310, True), (80, 20, True)],
)
def test_directions_follow_klems_patches(tmp_path, degrees, azimuth, from_back):
    """All azimuths count from the body's axis; light from the back meets the table of the back."""
    table = woven(tmp_path, x_axis=axis_at(azimuth, from_back=from_back))
    side = "back" if from_back else "front"
    n = 150_000
    data = lowered("bsdf", scene_with(surface(table)))
    met = meet("bsdf", data, math.radians(degrees), n, from_back=from_back)
    out_polar, out_azimuth = polar_and_azimuth(met, from_back=from_back)
    for way, kind, sign in (("reflection", DIFFUSE_REFLECTION, 1), ("transmission", DIFFUSE_REFRACTION, -1)):
        mine = met.kind == kind
        if table.lobe(side, way) is None:
            assert not mine.any()
            continue
        assert (sign * met.direction[mine, 2] > 0).all()
        assert (met.side[mine] == sign).all()
        cells = table.lobe(side, way).outgoing[0]
        counts = np.bincount(cell_of(cells, out_polar[mine], out_azimuth[mine] + azimuth), minlength=len(cells))
        expected = n * share_of_cells(table, side, way, degrees, azimuth)
        if kind == DIFFUSE_REFLECTION or from_back:
            cells_agree(f"{way}", counts, expected, n=n)
        else:
            cells_agree(f"{way}", counts, expected * counts.sum() / expected.sum())


def test_what_one_side_does_both_do(tmp_path):
    """A table without light from the back: seen from there azimuths stay where they are on the body."""
    rng = np.random.default_rng(9)
    matrix = rng.uniform(0, 0.2, (41, 41))
    table = table_of(klems({"Transmission Front": matrix}), tmp_path, "x.xml", x_axis=axis_at(130, from_back=True))
    n = 150_000
    met = meet("bsdf", lowered("bsdf", scene_with(surface(table))), math.radians(35), n, from_back=True)
    polar, azimuth = (a[met.kind == DIFFUSE_REFRACTION] for a in polar_and_azimuth(met, from_back=True))
    cells = table.lobes[0].outgoing[0]
    counts = np.bincount(cell_of(cells, polar, azimuth + 130), minlength=len(cells))
    cells_agree("cells", counts, n * share_of_cells(table, "front", "transmission", 35, 130), n=n)


def test_an_anisotropic_sample_turns_with_its_azimuth(tmp_path):
    """Given at four azimuths of incidence, linear in between; azimuths of scattering count from that of incidence."""
    rows = [
        f"60,{i},{s},{(i + p) % 360},{0.02 + (s > 0) * (0.04 * i / 90 * (p < 100) + 0.01 * (p == 180)):.6f}"
        for i in (0, 90, 180, 270) for s in (0, 40, 80) for p in (0, 90, 180, 270)
    ]  # fmt: skip
    table = table_of(csv(rows, "theta_i,phi_i,theta_s,phi_s,bsdf"), tmp_path, x_axis=axis_at(215))
    n = 150_000
    met = meet("bsdf", lowered("bsdf", scene_with(surface(table))), math.radians(60), n)
    polar, azimuth = (a[met.kind == DIFFUSE_REFLECTION] for a in polar_and_azimuth(met))
    cells = table.lobes[0].outgoing[0]
    counts = np.bincount(cell_of(cells, polar, azimuth), minlength=len(cells))
    cells_agree("cells", counts, n * share_of_cells(table, "front", "reflection", 60, 215), n=n)


@pytest.mark.parametrize("threshold", [0.0, 0.1, 1.0])
def test_bands_share_a_direction_and_keep_their_own_shares(tmp_path, threshold):
    """Blue scatters forward, red backward, green evenly: the light of each band in each cell is what its table says,
    and the light of all bands together never grows.
    """

    def value(i, s, p):
        forward = math.cos(math.radians(p)) * (s > 0)
        return ",".join(f"{v:.6f}" for v in (0.1 - 0.1 * forward, 0.2, 0.12 + 0.12 * forward))

    text = csv(grid_rows(value), "theta_i,theta_s,phi_s,r,g,b")
    table = table_of(text, tmp_path)
    n = 150_000
    data = lowered("bsdf", scene_with(surface(table)))
    met = meet("bsdf", data, math.radians(40), n, light=LIGHT, threshold=threshold)
    scattered = met.kind == DIFFUSE_REFLECTION
    assert met.light.sum(axis=1).max() <= 1 + 1e-6
    assert not met.light[~scattered].any()
    polar, azimuth = polar_and_azimuth(met)
    cells = table.lobes[0].outgoing[0]
    cell = np.where(scattered, cell_of(cells, polar, azimuth), len(cells))
    for band in range(3):
        light = met.light[:, band]
        mean = np.bincount(cell, light, minlength=len(cells) + 1)[:-1] / n
        square = np.bincount(cell, light**2, minlength=len(cells) + 1)[:-1] / n
        expected = LIGHT[band] * share_of_cells(table, "front", "reflection", 40, 0, band)
        agrees(f"band {band}", mean, np.sqrt((square - mean**2) / n), expected, rounding=1e-6)


def test_wavelengths_of_a_table_reach_the_bands_of_a_spectrum(tmp_path):
    """Laser lines on the nodes of the table and halfway between them: linear interpolation, exact in a line's band."""
    text = csv(grid_rows(lambda i, s, p: "0.1,0.3"), "theta_i,theta_s,phi_s,400nm,600nm")
    table = table_of(text, tmp_path)
    data = lowered("bsdf", scene_with(surface(table)), lines(400.0, 500.0, 600.0))
    n = 100_000
    met = meet("bsdf", data, 0.3, n, light=(0.3, 0.4, 0.3))
    expected = np.array([0.3, 0.4, 0.3]) * np.array([0.1, 0.2, 0.3]) * math.pi
    agrees("bands", met.light.mean(axis=0), met.light.std(axis=0) / math.sqrt(n), expected, rounding=1e-6)


def coated(tmp_path):
    """Specular and diffuse parts in both ways."""
    rows = ["0,specular,0.1", "80,specular,0.5", "0,0,0.05", "0,80,0.05", "80,0,0.02", "80,80,0.02"]
    through = ["0,specular,0.5", "80,specular,0.1", "0,0,0.04", "0,80,0.04", "80,0,0.01", "80,80,0.01"]
    columns = "theta_i,theta_s,bsdf"
    return table_of(csv(rows, columns) + csv(through, columns, ("to: transmission",)), tmp_path)


@pytest.mark.parametrize("degrees", [0.0, 40.0, 80.0])
def test_specular_and_diffuse_shares(tmp_path, degrees):
    """Each outcome takes on its share; specular light is reflected, or refracted by Snell's law into n = 1.5."""
    table = coated(tmp_path)
    share = shares(table, "front", (degrees, 0))
    part = degrees / 80
    assert share["specular reflection"] == pytest.approx(0.1 + 0.4 * part)
    assert share["diffuse transmission"] == pytest.approx(math.pi * (0.04 - 0.03 * part))
    n = 150_000
    met = meet("bsdf", lowered("bsdf", scene_with(surface(table))), math.radians(degrees), n)
    kinds = (SPECULAR_REFLECTION, DIFFUSE_REFLECTION, SPECULAR_REFRACTION, DIFFUSE_REFRACTION)
    cells_agree("outcomes", [(met.kind == kind).sum() for kind in kinds], n * np.array(list(share.values())), n=n)
    sine = math.sin(math.radians(degrees))
    mirrored, refracted = met.kind == SPECULAR_REFLECTION, met.kind == SPECULAR_REFRACTION
    assert np.abs(met.direction[mirrored] - [sine, 0, math.cos(math.radians(degrees))]).max() < 1e-12
    assert np.abs(met.direction[refracted] - [sine / 1.5, 0, -math.sqrt(1 - (sine / 1.5) ** 2)]).max() < 1e-12
    through = np.isin(met.kind, kinds[2:])
    assert (met.side == np.where(through, -1, 1))[met.kind != EventKind.ABSORPTION].all()
    assert (met.medium == through).all()


def test_total_reflection_reflects_what_would_be_refracted(tmp_path):
    """From n = 1.5 into 1 at 60 degrees, beyond the critical angle of 41.8 degrees."""
    table = coated(tmp_path)
    share = shares(table, "front", (60, 0))
    n = 100_000
    data = lowered("bsdf", scene_with(surface(table)))
    met = meet("bsdf", data, math.radians(60), n, n_near=1.5, n_far=1.0)
    expected = [
        share["specular reflection"] + share["specular transmission"],
        share["diffuse reflection"],
        share["diffuse transmission"],
    ]
    counts = [(met.kind == kind).sum() for kind in (SPECULAR_REFLECTION, DIFFUSE_REFLECTION, DIFFUSE_REFRACTION)]
    cells_agree("outcomes", counts, n * np.array(expected), n=n)


def test_nothing_goes_into_a_metal(tmp_path):
    table = coated(tmp_path)
    metal = {"inside": {"refractive_index": 0.2, "extinction": 3.4}}
    n = 100_000
    met = meet("bsdf", lowered("bsdf", scene_with(surface(table), metal)), math.radians(40), n)
    share = shares(table, "front", (40, 0))
    assert not np.isin(met.kind, (SPECULAR_REFRACTION, DIFFUSE_REFRACTION)).any()
    counts = [(met.kind == kind).sum() for kind in (SPECULAR_REFLECTION, DIFFUSE_REFLECTION)]
    cells_agree("outcomes", counts, n * np.array([share["specular reflection"], share["diffuse reflection"]]), n=n)


@pytest.mark.parametrize("degrees", [0.0, 50.0, 89.0])
def test_a_white_table_is_a_lambertian_surface(tmp_path, degrees):
    """BSDF 1/pi in all directions: no light is lost, sin² of the angle and the azimuth are uniform (Lambert's law)."""
    text = klems({"Reflection Front": klems_matrix("LBNL/Klems Full", 1 / math.pi)}, "LBNL/Klems Full")
    table = table_of(text, tmp_path, "white.xml")
    n = 100_000
    met = meet("bsdf", lowered("bsdf", scene_with(surface(table))), math.radians(degrees), n, threshold=0.0)
    assert (met.kind == DIFFUSE_REFLECTION).all()
    assert np.abs(met.light.sum(axis=1) - 1).max() < 1e-6
    polar, azimuth = polar_and_azimuth(met)
    follows("sin²", np.sin(np.radians(polar)) ** 2)
    follows("azimuth", azimuth / 360 + 0.5)


def test_furnace_of_a_white_sheet(tmp_path):
    """A closed ball with a table that reflects all light, part of it specularly: nothing is lost, nothing gained."""
    rows = [f"{i},specular,0.25" for i in (0, 80)] + [f"{i},{s},{0.75 / math.pi:.9f}" for i in (0, 80) for s in (0, 80)]
    (tmp_path / "white.csv").write_text(csv(rows, "theta_i,theta_s,bsdf"))
    h = traced(
        tmp_path,
        {"Ball": body(ball(10, 2).inside_out, "white")},
        rays=5_000,
        settings={"max_events": 8},
        surfaces={"white": {"kind": "bsdf", "data": {"file": "white.csv"}}},
        sources={"S": {"kind": "point", "flux_w": 1, "position_mm": [0, 0, 0]}},
    )
    assert (h.kind[h.last] == EventKind.KILLED_DEPTH).all()
    assert np.abs(h.light[h.last].sum(axis=1) - 1).max() < 1e-5


def rings_table(matrix, goes_to="reflection"):
    """A table over rings only, the same rings for incoming and outgoing light."""
    edges = (0.0, 25.0, 40.0, 55.0, 70.0, 90.0)
    cells = {"ring_deg": edges, "azimuth_deg": [[0.0, 360.0]] * 5}
    lobe = {"comes_from": "front", "goes_to": goes_to, "incoming": cells, "outgoing": [cells], "value": [matrix]}
    return BsdfTable.model_validate({"lobes": [lobe]}), np.array(edges)


@pytest.mark.parametrize("goes_to", ["reflection", "transmission"])
def test_a_symmetric_table_is_reciprocal(goes_to):
    """f(i, s) = f(s, i) (Helmholtz reciprocity): under even light from all sides as much goes from ring to ring as
    back, and through the sheet as much from the front as from the back.
    """
    rng = np.random.default_rng(2)
    half = rng.uniform(0, 0.3, (5, 5))
    table, edges = rings_table(((half + half.T) / 2).tolist(), goes_to)
    n = 300_000
    kind = DIFFUSE_REFLECTION if goes_to == "reflection" else DIFFUSE_REFRACTION
    data = lowered("bsdf", scene_with(surface(table)))
    counts = []
    for seed, from_back in ((3, False), (4, goes_to == "transmission")):
        angles = lambertian_angles(n, seed)
        met = meet("bsdf", data, angles, n, from_back=from_back, seed=seed)
        mine = met.kind == kind
        polar, _ = polar_and_azimuth(met)
        counts.append(np.histogram2d(np.degrees(angles)[mine], polar[mine], (edges, edges))[0].astype(np.int64))
    reciprocal(goes_to, counts[0], counts[1], n, n, 1.0)


def test_ledger_of_a_scene_with_tables(tmp_path):
    """A blind in front of a wall, one a table for itself and one part of a mixture: the ledger closes."""
    (tmp_path / "blind.xml").write_text(
        klems({"Transmission Front": klems_matrix(QUARTER, 0.1, 0.4), "Reflection Front": klems_matrix(QUARTER, 0.08)})
    )
    (tmp_path / "dull.csv").write_text(csv(grid_rows(lambda i, s, p: "0.2")))
    sheet = box((-20, -20, -1), (20, 20, 0))
    sheet = sheet._replace(triangles=sheet.triangles[-2:], faces=(("+z", 2),))
    direction = unit(np.array([0.3, 0.1, -1.0]))
    h = traced(
        tmp_path,
        {"Blind": body(sheet, "blind"), "Wall": body(sheet.moved(0, 0, -10), "wall")},
        rays=20_000,
        surfaces={
            "blind": {"kind": "bsdf", "data": {"file": "blind.xml"}},
            "dull": {"kind": "bsdf", "data": {"file": "dull.csv"}},
            "mirror": {"kind": "mirror", "reflectance": 0.9},
            "wall": {
                "kind": "mixture",
                "parts": [{"weight": 0.6, "surface": "dull"}, {"weight": 0.4, "surface": "mirror"}],
            },
        },
        sources={"S": disc_source(-20 * direction, direction, 5)},
    )
    lost = (h.light_before - h.light)[h.number > 0].sum() + h.light[h.last].sum()
    assert lost / h.n_rays == pytest.approx(1, abs=1e-6)
    wall = h.on_body("Wall")
    assert set(np.unique(h.kind[wall])) <= {DIFFUSE_REFLECTION, EventKind.SPECULAR_REFLECTION, EventKind.ABSORPTION}
    through = h.kind[h.first + 1] == DIFFUSE_REFRACTION
    basis = BsdfCells.model_validate(KLEMS_BASES[QUARTER].cells)
    index = basis.index(math.degrees(math.acos(-direction[2])), math.degrees(math.atan2(direction[1], direction[0])))
    expected = 0.1 * math.pi + 0.4 * basis.projected_sr[index]
    agrees(
        "light through", *h.flux_w(h.per_ray(h.first[through] + 1, h.light[h.first[through] + 1]).sum(axis=1)), expected
    )
