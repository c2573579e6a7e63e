# SPDX-License-Identifier: LGPL-2.1-or-later
import csv
import json
import math
from html.parser import HTMLParser

import numpy as np
import pytest

from raymaps.criterion import query
from raymaps.errors import CriterionError, OutputError
from raymaps.kinds import ENDINGS, EventKind
from raymaps.results.incidence import incidence_angles_rad
from raymaps.results.report import ray_histories, report
from raymaps.results.words import describe_event
from raymaps.run import simulate
from tests.criterion_maps import NAMES, OFF_SURFACES, random_map
from tests.face_maps import corner_mesh, map_of


@pytest.fixture(scope="module")
def raymap():
    return random_map(seed=40, n_rays=300, portion_rays=37)


@pytest.fixture(scope="module")
def traced(repository, tmp_path_factory):
    """A small real map of a lens in a barrel."""
    scene = repository / "examples" / "singlet_barrel.scene.json"
    return simulate(scene, tmp_path_factory.mktemp("report") / "singlet.raymap", rays=3000, seed=5, threads=1)


def test_every_event_is_told_as_it_is_stored(raymap):
    told = report(raymap, limit=300)
    assert [ray.ray for ray in told.rays] == list(range(300))
    for history, ray in zip(told.rays, raymap.rays, strict=True):
        assert history.source == NAMES.sources[ray[0].source]
        assert history.flux_w == raymap.ray_flux_w[ray[0].source]
        assert ray[-1].kind in ENDINGS[history.ended]
        assert len(history.events) == len(ray)
        for i, (told_event, event) in enumerate(zip(history.events, ray, strict=True)):
            assert told_event.kind == event.kind.label
            assert told_event.position_mm == event.position_mm
            assert told_event.rgb == pytest.approx(event.light, rel=1e-7)
            assert told_event.flux_left_w == pytest.approx(history.flux_w * sum(event.light), rel=1e-6)
            if event.face >= 0 and event.kind not in OFF_SURFACES:
                body, face = NAMES.faces[event.face]
                assert (told_event.body, told_event.face) == (NAMES.bodies[body], face)
                assert told_event.surface == NAMES.surfaces[event.surface]
            else:
                assert (told_event.body, told_event.face, told_event.surface) == (None, None, None)
            assert told_event.medium == (NAMES.media[event.medium] if i + 1 < len(ray) else None)
            assert [c.detector for c in told_event.detectors] == [NAMES.detectors[c.detector] for c in event.crossings]
            for crossing, stored in zip(told_event.detectors, event.crossings, strict=True):
                assert (crossing.x_mm, crossing.y_mm) == (stored.x_mm, stored.y_mm)
                assert crossing.registered == stored.registered
                assert 0 <= crossing.angle_deg <= 90
                assert crossing.side == ("front" if stored.angle_rad < math.pi / 2 else "back")
                from_front = crossing.angle_deg if crossing.side == "front" else 180 - crossing.angle_deg
                assert from_front == pytest.approx(math.degrees(stored.angle_rad), rel=1e-12)


def test_only_the_first_matching_rays_are_told(raymap):
    told = report(raymap, "hit(Lens)", limit=7)
    found = query(raymap, "hit(Lens)")
    assert [ray.ray for ray in told.rays] == found.ids[:7].tolist()
    assert (told.found.rays, told.found.scanned) == (found.rays, found.scanned)  # all are counted
    assert told.found.flux_w == found.flux_w
    assert len(report(raymap).rays) == 20
    assert report(raymap, "~true").rays == ()


def test_rays_by_number_in_any_order(raymap):
    assert [ray.ray for ray in ray_histories(raymap, [250, 3, 250, 120])] == [250, 3, 250, 120]
    with pytest.raises(CriterionError, match="Ray 300 is not in the map, which holds 300 rays"):
        ray_histories(raymap, [1, 300])


def test_every_kind_of_event_has_words():
    for kind in EventKind:
        if kind is not EventKind.CROSSING:
            assert describe_event(kind, "air", "glass")
    assert describe_event(EventKind.FRESNEL_REFRACTION, "air", "glass") == "refracted into glass"
    assert describe_event(EventKind.MEDIUM_ABSORPTION, "glass", None) == "absorbed inside glass"
    assert describe_event(EventKind.ABSORPTION, "glass", None) == "absorbed"


def test_json(raymap):
    data = json.loads(json.dumps(report(raymap, "hit(Lens)", limit=2).to_dict()))
    assert {"criterion", "matching", "scanned", "flux_w", "flux_stderr_w", "rays"} <= set(data)
    ray = data["rays"][0]
    assert set(ray) == {"ray", "source", "flux_w", "ended", "events", "wavelength_nm"}
    assert {
        "kind",
        "text",
        "body",
        "face",
        "surface",
        "medium",
        "position_mm",
        "rgb",
        "flux_left_w",
        "flux_left_lm",
        "detectors",
    } <= set(ray["events"][0])


def test_text_tells_every_event(raymap):
    told = report(raymap, "detector(Sensor)", limit=5)
    text = told.to_text()
    assert "criterion  detector(Sensor)" in text
    assert "±" in text
    for ray in told.rays:
        assert f"Ray {ray.ray} of {ray.source}" in text
    n_events = sum(len(ray.events) for ray in told.rays)
    n_crossings = sum(len(event.detectors) for ray in told.rays for event in ray.events)
    assert text.count(" mm ") >= n_events
    assert text.count("    through ") == n_crossings


def test_csv_has_a_line_an_event(raymap):
    told = report(raymap, limit=30)
    lines = told.to_csv().splitlines(keepends=True)
    rows = list(csv.DictReader(line for line in lines if not line.startswith("# ")))
    assert len(rows) == sum(len(ray.events) for ray in told.rays)
    for row in rows:
        bands = sum(float(row[band]) for band in ("red_w", "green_w", "blue_w"))
        assert bands == pytest.approx(float(row["flux_left_w"]), rel=1e-12, abs=1e-300)
    assert {row["source"] for row in rows} == set(NAMES.sources)


class Page(HTMLParser):
    """Counts what stands in a page, and sees that every element that is opened is closed."""

    VOID = ("meta", "br", "wbr")

    def __init__(self, text):
        super().__init__()
        self.open, self.seen, self.text, self.colours = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.seen.append(tag)
        self.colours += [value for name, value in attrs if name == "bgcolor"]
        assert not [name for name, value in attrs if name in ("src", "href")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def test_html_is_one_whole_page(raymap):
    told = report(raymap, "hit(Lens) & ~from(Beam)", limit=4)
    page = Page(told.to_html())
    assert page.open == []
    words = " ".join(page.text)
    assert "hit(Lens) & ~from(Beam)" in words
    assert "±" in words
    assert page.seen.count("table") == 1 + 4
    for ray in told.rays:
        assert f"Ray {ray.ray}" in words
    assert not {"script", "img", "link", "div"} & set(page.seen)  # what Qt's text browser would not show


def test_html_shows_the_colour_of_the_light(traced):
    page = Page(report(traced, "from(Stray)", limit=3).to_html())
    orange = [c for c in page.colours if int(c[1:3], 16) > int(c[3:5], 16) > int(c[5:7], 16)]
    assert orange


def test_names_cannot_break_the_page(raymap):
    evil = '<b onclick="x">&\'</table>'
    names = type(NAMES)(**{**vars(NAMES), "bodies": (evil, "Barrel", "Plate"), "sources": (evil, "b", "c")})
    other = random_map(seed=41, n_rays=20)
    other.names = names
    page = Page(report(other, limit=20).to_html())
    assert page.open == []
    assert page.seen.count("b") == 1 + 20  # the flux, and a title a ray
    assert evil in "".join(page.text)


@pytest.mark.parametrize("suffix", [".html", ".csv", ".txt"])
def test_written_to_files(raymap, tmp_path, suffix):
    told = report(raymap, limit=3)
    path = told.write(tmp_path / f"rays{suffix}")
    with open(path, encoding="utf-8", newline="") as stream:
        assert stream.read() == {".html": told.to_html, ".csv": told.to_csv, ".txt": told.to_text}[suffix]()


def test_files_of_other_kinds_are_refused(raymap, tmp_path):
    with pytest.raises(OutputError, match=r"must end in \.html, \.csv, \.txt"):
        report(raymap).write(tmp_path / "rays.pdf")
    (tmp_path / "rays.txt").mkdir()
    with pytest.raises(OutputError, match="it is a folder"):
        report(raymap).write(tmp_path / "rays.txt")


@pytest.mark.parametrize("angle_deg", [0.0, 1e-6, 30.0, 60.0, 89.9, 90.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_angle_of_incidence(angle_deg, sign):
    raymap = map_of(corner_mesh("A", 0))
    angle = math.radians(angle_deg)
    way = 10.0 * np.array([sign * math.cos(angle), math.sin(angle), 0.0])
    found = incidence_angles_rad(raymap, np.stack([-way, np.zeros(3)]), np.array([0, 0], np.int32))
    assert math.isnan(found[0])
    assert found[1] == pytest.approx(angle, rel=1e-9, abs=1e-15)


def test_no_angle_off_a_surface_or_without_a_way():
    raymap = map_of(corner_mesh("A", 0))
    positions = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0]])
    assert np.isnan(incidence_angles_rad(raymap, positions, np.array([0, -1, 0], np.int32))).all()


def test_refraction_in_the_report_obeys_snell(traced):
    """n1 sin(incidence) = n2 sin(refraction), both taken from what the report tells."""
    media = traced.scene.media
    checked = 0
    for ray in report(traced, "hit(Lens, fresnel_refraction)", limit=100).rays:
        for before, event, after in zip(ray.events, ray.events[1:], ray.events[2:], strict=False):
            if event.kind != "fresnel_refraction":
                continue
            n1, n2 = (media[name].refractive_index if name in media else 1.0 for name in (before.medium, event.medium))
            arriving, leaving = (
                np.subtract(b.position_mm, a.position_mm) for a, b in ((before, event), (event, after))
            )
            lengths = np.linalg.norm(arriving), np.linalg.norm(leaving)
            # the refracted direction differs from n1 / n2 times the arriving one along the normal only
            shift = n2 * leaving / lengths[1] - n1 * arriving / lengths[0]
            # positions are rounded to the map's grid: each direction is off by up to sqrt(3) grid steps over its length
            blur = 2 * traced.manifest.grid_mm * (n1 / lengths[0] + n2 / lengths[1])
            sine = np.linalg.norm(np.cross(arriving / lengths[0], shift)) / np.linalg.norm(shift)
            assert abs(sine - math.sin(math.radians(event.incidence_deg))) < 5 * blur / np.linalg.norm(shift)
            checked += 1
    assert checked > 100
