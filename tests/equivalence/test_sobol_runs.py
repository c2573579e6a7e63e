# SPDX-License-Identifier: LGPL-2.1-or-later
"""Rays of Sobol's points do not depend on threads, portions or interruptions; nor do figures and their errors."""

import numpy as np
import pytest

import raymaps
from raymaps.errors import MapError
from raymaps.kinds import EventKind
from raymaps.ray_numbers import REPLICATES
from raymaps.results.detector import evaluate_detector
from raymaps.results.ledger import energy_ledger
from raymaps.results.paths import distinct_paths
from raymaps.store import RayMap
from raymaps.target import Target
from tests.physics.scenes import body, box, rectangle, write_scene

N_RAYS = 6_000
SOBOL = {"sampling": "sobol"}


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """Two sources over a slab of glass that absorbs and a floor that scatters: all that draws, but for few rays."""
    return write_scene(
        tmp_path_factory.mktemp("scene"),
        {
            "Floor": body(box((-5, -5, -2), (5, 5, -1)), "white"),
            "Slab": body(box((-5, -5, 0), (5, 5, 1)), "clear", "glass"),
        },
        media={
            "glass": {"refractive_index": 1.5, "absorption_per_mm": 0.3, "scattering": [{"coefficient_per_mm": 0.2}]}
        },
        surfaces={"clear": {"kind": "fresnel"}, "white": {"kind": "lambertian", "reflectance": 0.6}},
        sources={
            name: {"kind": "point", "flux_w": flux, "position_mm": [0, 0, z]}
            for name, flux, z in (("A", 1.0, 2.0), ("B", 0.7, 3.0))
        },
        detectors={"D": rectangle((0, 0, 1.5), 4, 4, resolution=[3, 3], side="both")},
        settings=SOBOL,
    )


@pytest.fixture(scope="module")
def whole(scene, tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "m.raymap"
    return raymaps.simulate(scene, path, rays=N_RAYS, threads=1, portion_rays=N_RAYS)


def told(raymap):
    """Figures with errors, of every kind of sum."""
    found, ledger = evaluate_detector(raymap, "D"), energy_ledger(raymap)
    asked = raymaps.query(raymap, "from(A) & hit(Floor)")
    return [
        found.flux_w.value, found.flux_w.stderr, *found.interval_w, found.uniformity.stderr,
        *found.cell_stderr_w.ravel(), asked.flux_w, asked.flux_stderr_w, *asked.interval_w,
        ledger.absorbed.stderr_w, ledger.escaped.stderr_w, *ledger.absorbed_by_medium["glass"].interval_w,
        *(path.flux_stderr_w for path in distinct_paths(raymap, limit=5).paths),
    ]  # fmt: skip


@pytest.mark.parametrize(("threads", "portion_rays"), [(2, 1000), (2, 37), (1, 4096)])
def test_threads_and_portions_make_no_difference(scene, whole, tmp_path, threads, portion_rays):
    raymap = raymaps.simulate(scene, tmp_path / "m.raymap", rays=N_RAYS, threads=threads, portion_rays=portion_rays)
    assert raymap.content_hash == whole.content_hash
    assert raymap.rays_of_replicate.tolist() == whole.rays_of_replicate.tolist()
    assert told(raymap) == pytest.approx(told(whole), rel=1e-9)


def test_a_run_that_grows_is_one_that_was_long(scene, whole, tmp_path):
    path = tmp_path / "m.raymap"
    for rays in (1, 1777, N_RAYS):
        raymap = raymaps.simulate(scene, path, rays=rays, resume=True, threads=2, portion_rays=500)
    assert raymap.content_hash == whole.content_hash
    assert told(raymap) == pytest.approx(told(whole), rel=1e-9)


def test_replicates_share_the_rays_of_each_source(whole):
    rays = whole.rays_of_replicate
    assert rays.sum(axis=1).tolist() == whole.rays_of_source.tolist()
    assert (np.ptp(rays, axis=1) <= 1).all()
    groups = np.bincount(whole.group_of_rays(whole.portions[0]), minlength=2 * REPLICATES)
    assert groups.tolist() == rays.ravel().tolist()


def test_a_cell_is_as_sure_as_its_region(whole):
    """Cells, flux and query add up by replicate in three ways."""
    found = evaluate_detector(whole, "D", resolution=(4, 4))
    for i, j in ((0, 0), (1, 2), (3, 1)):
        rect = (i - 2, j - 2, i - 1, j - 1)
        region = evaluate_detector(whole, "D", rect=rect)
        assert found.cell_stderr_w[j, i] == pytest.approx(region.flux_w.stderr, rel=1e-6)
    assert evaluate_detector(whole, "D", resolution=(1, 1)).cell_stderr_w[0, 0] == pytest.approx(found.flux_w.stderr)
    left = evaluate_detector(whole, "D", where="~event(killed_depth)")
    assert left.flux_w.stderr == found.flux_w.stderr


def test_bands_and_lumens_are_as_sure_as_watts(tmp_path):
    scene = write_scene(
        tmp_path,
        {"Floor": body(box((-5, -5, -2), (5, 5, -1)), "black")},
        surfaces={"black": {"kind": "absorber"}},
        sources={
            "A": {
                "kind": "point", "flux_w": 1.0, "position_mm": [0, 0, 2],
                "spectrum": {"kind": "illuminant", "name": "E"},
            }
        },
        detectors={"D": rectangle((0, 0, 0), 4, 4, resolution=[2, 2])},
        settings={**SOBOL, "store": "spectral", "spectrum": {"from_nm": 545, "to_nm": 555, "bands": 1}},
    )  # fmt: skip
    found = evaluate_detector(raymaps.simulate(scene, tmp_path / "m.raymap", rays=2000), "D")
    assert found.spectrum.stderr_w[0] == pytest.approx(found.flux_w.stderr, rel=1e-6)
    lumen_per_w = found.flux_lm.value / found.flux_w.value
    assert found.flux_lm.stderr == pytest.approx(lumen_per_w * found.flux_w.stderr, rel=1e-6)
    assert found.cell_stderr_lm == pytest.approx(lumen_per_w * found.cell_stderr_w, rel=1e-6)


def test_a_part_of_a_map_knows_whose_its_rays_are(scene, whole, tmp_path):
    """Portions that are missing make no difference to which replicate a ray is in."""
    raymap = raymaps.simulate(scene, tmp_path / "m.raymap", rays=N_RAYS, threads=1, portion_rays=1000)
    part = raymap.of_portions([raymap.portions[1], raymap.portions[4]])
    groups = whole.group_of_rays(whole.portions[0])
    for portion in part.portions:
        expected = groups[portion.first_ray : portion.first_ray + portion.n_rays]
        assert part.group_of_rays(portion).tolist() == expected.tolist()
    of_both = np.concatenate([groups[1000:2000], groups[4000:5000]])
    assert part.rays_of_replicate.ravel().tolist() == np.bincount(of_both, minlength=2 * REPLICATES).tolist()


def test_the_stored_ledger_is_that_of_the_rays(whole):
    """Light that left, by replicate: that after the last event of the rays that did."""
    portion = whole.portions[0]
    group = whole.group_of_rays(portion)
    left = (portion.signatures.ending == EventKind.LEFT)[portion.ray_signature]
    light = np.where(left, portion.power[portion.event_offsets[1:] - 1], 0.0)
    expected = np.bincount(group, light, 2 * REPLICATES).reshape(2, REPLICATES)
    stored = {e.source: e.replicates for e in portion.summary.ledger if e.what == "escaped"}
    for source in (0, 1):
        assert stored[source] == pytest.approx(expected[source], rel=1e-12)


def test_a_random_map_is_another_and_is_not_continued(scene, whole, tmp_path):
    random = raymaps.load_scene(scene)
    random = random.model_copy(update={"settings": random.settings.model_copy(update={"sampling": "random"})})
    raymap = raymaps.simulate(random, tmp_path / "r.raymap", rays=N_RAYS)
    assert raymap.content_hash != whole.content_hash
    assert raymap.rays_of_replicate.shape == (2, 1)
    assert all(not entry.replicates for portion in raymap.portions for entry in portion.summary.ledger)
    with pytest.raises(MapError, match="another scene"):
        raymaps.simulate(scene, raymap.path, rays=2 * N_RAYS, resume=True)


def test_a_target_is_reached(scene, tmp_path):
    raymap = raymaps.simulate(scene, tmp_path / "m.raymap", target=Target(2, "D"))
    course = raymap.manifest.target
    told_flux = evaluate_detector(RayMap.open(raymap.path), "D").flux_w
    assert course["ended"] == "target"
    assert course["flux_stderr_w"] == pytest.approx(told_flux.stderr, rel=1e-9)
    assert told_flux.stderr <= 0.02 * told_flux.value
