# SPDX-License-Identifier: LGPL-2.1-or-later
"""The evaluation on signatures gives, ray for ray, what the definitions say event by event."""

import itertools

import numpy as np
import pytest

from raymaps.criterion import (
    And,
    Crosses,
    Ellipse,
    Ended,
    Everything,
    From,
    Happened,
    Hit,
    InMedium,
    Not,
    OnSurface,
    Or,
    Rectangle,
    Wavelength,
    bind,
    matching_rays,
    parse_criterion,
    query,
)
from raymaps.kinds import CRITERION_KINDS, ENDINGS, EventKind
from tests.criterion_maps import NAMES, OFF_SURFACES, SOURCE_FLUX_W, random_map

KINDS = sorted(CRITERION_KINDS)


def has_kind(event, kind):
    return kind is None or event.kind in CRITERION_KINDS[kind]


def in_area(area, crossing):
    if area is None:
        return True
    if isinstance(area, Rectangle):
        return area.x0_mm <= crossing.x_mm <= area.x1_mm and area.y0_mm <= crossing.y_mm <= area.y1_mm
    return ((crossing.x_mm - area.cx_mm) / area.rx_mm) ** 2 + ((crossing.y_mm - area.cy_mm) / area.ry_mm) ** 2 <= 1


def matches_slowly(criterion, ray):
    """The definition of every elementary event, one ray and one event at a time."""
    match criterion:
        case Everything():
            return True
        case From(source):
            return NAMES.sources[ray[0].source] == source
        case Hit(body, face, kind):
            return any(
                event.body >= 0
                and event.kind not in (EventKind.EMISSION, *OFF_SURFACES)
                and NAMES.bodies[event.body] == body
                and (face is None or NAMES.faces[event.face][1] == face)
                and has_kind(event, kind)
                for event in ray
            )
        case OnSurface(surface, kind):
            return any(
                event.surface >= 0
                and event.kind not in (EventKind.EMISSION, *OFF_SURFACES)
                and NAMES.surfaces[event.surface] == surface
                and has_kind(event, kind)
                for event in ray
            )
        case Happened(kind):
            return any(has_kind(event, kind) for event in ray)
        case InMedium(medium, what):
            kind = {"absorption": EventKind.MEDIUM_ABSORPTION, "scattering": EventKind.MEDIUM_SCATTERING}[what]
            return any(
                after.kind == kind and before.medium >= 0 and NAMES.media[before.medium] == medium
                for before, after in itertools.pairwise(ray)
            )
        case Crosses("Skin"):  # on face Top side of Plate
            return matches_slowly(Hit("Plate", "Top side"), ray)
        case Crosses("Sky"):
            return ray[-1].kind == EventKind.LEFT
        case Crosses(detector, area):
            return any(
                crossing.registered and NAMES.detectors[crossing.detector] == detector and in_area(area, crossing)
                for event in ray
                for crossing in event.crossings
            )
        case Ended(how):
            return ray[-1].kind in ENDINGS[how]
        case Wavelength(low_nm, high_nm):
            return low_nm <= ray[0].wavelength_nm <= high_nm
        case Not(operand):
            return not matches_slowly(operand, ray)
        case And(operands):
            return all(matches_slowly(operand, ray) for operand in operands)
        case Or(operands):
            return any(matches_slowly(operand, ray) for operand in operands)


def random_area(rng):
    x, y = rng.uniform(-2, 2, 2)
    if rng.random() < 0.5:
        return Rectangle(x, y, x + rng.uniform(0.1, 4), y + rng.uniform(0.1, 4))
    return Ellipse(x, y, rng.uniform(0.1, 3), rng.uniform(0.1, 3))


def random_event(rng):
    def pick(names):
        return names[int(rng.integers(len(names)))]

    kind = None if rng.random() < 0.5 else pick(KINDS)
    body, face = pick(NAMES.faces)
    return [
        lambda: Everything(),
        lambda: From(pick(NAMES.sources)),
        lambda: Hit(NAMES.bodies[body], face if rng.random() < 0.5 else None, kind),
        lambda: OnSurface(pick(NAMES.surfaces), kind),
        lambda: Happened(pick(KINDS)),
        lambda: InMedium(pick(NAMES.media), pick(("absorption", "scattering"))),
        lambda: Crosses(pick(("Sensor", "Wall")), random_area(rng) if rng.random() < 0.8 else None),
        lambda: Crosses(pick(("Skin", "Sky"))),
        lambda: Ended(pick(tuple(ENDINGS))),
        lambda: Wavelength(*sorted(float(nm) for nm in rng.uniform(350, 750, 2))),
    ][int(rng.integers(10))]()


def random_tree(rng, depth):
    shape = rng.random()
    if depth == 0 or shape < 0.2:
        return random_event(rng)
    if shape < 0.4:
        return ~random_tree(rng, depth - 1)
    operands = tuple(random_tree(rng, depth - 1) for _ in range(int(rng.integers(2, 5))))
    return And(operands) if shape < 0.7 else Or(operands)


def matching_ids(raymap, criterion):
    bound = bind(criterion, raymap.names, raymap.scene.detectors)
    return [int(portion.first_ray + ray) for portion in raymap.portions for ray in matching_rays(portion, bound)]


@pytest.fixture(scope="module")
def raymap():
    return random_map(seed=20)


@pytest.mark.parametrize("seed", range(60))
def test_elementary_events_mean_what_is_documented(raymap, seed):
    criterion = random_event(np.random.default_rng(seed))
    expected = [number for number, ray in enumerate(raymap.rays) if matches_slowly(criterion, ray)]
    assert matching_ids(raymap, criterion) == expected


@pytest.mark.parametrize("seed", range(150))
def test_random_trees(raymap, seed):
    criterion = random_tree(np.random.default_rng(1000 + seed), depth=4)
    expected = [number for number, ray in enumerate(raymap.rays) if matches_slowly(criterion, ray)]
    assert matching_ids(raymap, criterion) == expected


def test_the_random_trees_are_no_trivial_questions(raymap):
    shares = []
    for seed in range(150):
        criterion = random_tree(np.random.default_rng(1000 + seed), depth=4)
        shares.append(len(matching_ids(raymap, criterion)) / raymap.n_rays)
    assert sum(0 < share < 1 for share in shares) > len(shares) // 3


@pytest.mark.parametrize("portion_rays", [1, 13, 300])
def test_portions_make_no_difference(portion_rays):
    rng = np.random.default_rng(3)
    whole, parts = random_map(seed=4, portion_rays=10**6), random_map(seed=4, portion_rays=portion_rays)
    for _ in range(30):
        criterion = random_tree(rng, depth=3)
        one, other = query(whole, criterion), query(parts, criterion)
        assert one.ids.tolist() == other.ids.tolist()
        assert (one.rays, one.scanned, one.flux_w, one.flux_stderr_w) == (
            other.rays,
            other.scanned,
            other.flux_w,
            other.flux_stderr_w,
        )


@pytest.mark.parametrize("seed", range(30))
def test_laws_of_logic(raymap, seed):
    rng = np.random.default_rng(500 + seed)
    a, b, c = (random_tree(rng, 2) for _ in range(3))
    n_rays = raymap.n_rays

    def ids(criterion):
        return set(matching_ids(raymap, criterion))

    assert ids(~(a & b)) == ids(~a | ~b)
    assert ids(~(a | b)) == ids(~a & ~b)
    assert ids(a & (b | c)) == ids((a & b) | (a & c))
    assert ids(~~a) == ids(a)
    assert ids(a) | ids(~a) == set(range(n_rays))
    assert not ids(a) & ids(~a)
    assert len(ids(a & b)) + len(ids(a | b)) == len(ids(a)) + len(ids(b))


def test_flux_is_the_light_that_the_rays_were_emitted_with(raymap):
    rng = np.random.default_rng(8)
    for _ in range(40):
        criterion = random_tree(rng, 3)
        found = [ray for ray in raymap.rays if matches_slowly(criterion, ray)]
        expected_w = 0.0
        for source, flux_w in enumerate(SOURCE_FLUX_W):
            emitted = sum(ray[0].source == source for ray in raymap.rays)
            expected_w += flux_w * sum(ray[0].source == source for ray in found) / emitted
        # sums of a few hundred doubles in another order
        assert query(raymap, criterion).flux_w == pytest.approx(expected_w, rel=1e-13, abs=0)


def test_crossing_columns_are_read_only_where_signatures_leave_the_answer_open():
    raymap = random_map(seed=6, n_rays=400, portion_rays=100)

    class Untouchable:
        def __get__(self, portion, owner=None):
            raise AssertionError("a crossing column was read")

    untouched = type("Portion", (type(raymap.portions[0]),), {"crossing_xy_mm": Untouchable()})
    for portion in raymap.portions:
        vars(portion).pop("crossing_xy_mm")
        portion.__class__ = untouched
    area = "detector(Sensor, rect=(-1,-1,1,1))"
    for text in ("detector(Sensor)", "true", f"true | {area}", f"{area} & ~true", f"{area} & ~detector(Sensor)"):
        query(raymap, parse_criterion(text))
    with pytest.raises(AssertionError, match="was read"):
        query(raymap, parse_criterion(area))
