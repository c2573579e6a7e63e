# SPDX-License-Identifier: LGPL-2.1-or-later
"""Maps of every released version of the format stay readable: each version leaves one here, never to be changed."""

from pathlib import Path

import pytest

from raymaps.check import check_map
from raymaps.criterion import query
from raymaps.results.info import map_info
from raymaps.store import RayMap

OLD = sorted((Path(__file__).parent / "old").iterdir())


@pytest.mark.parametrize("path", OLD, ids=lambda path: path.name)
def test_an_old_map_is_read_as_it_was_written(path):
    """All checksums and the hash of the rays fit, and every ray is accounted for."""
    assert not any(finding.is_fault for finding in check_map(path))
    raymap = RayMap.open(path)
    facts = map_info(raymap)
    assert raymap.n_rays == facts.rays_asked == 120
    ends = [query(raymap, f"ended({how})").rays for how in ("absorbed", "left", "killed")]
    assert sum(ends) == 120
    ledger = facts.ledger
    ended_w = ledger.absorbed_w + ledger.escaped_w + ledger.killed_w
    assert ended_w == pytest.approx(ledger.emitted_w, rel=1e-9)


def test_each_version_of_the_format_has_left_a_map():
    assert [path.name for path in OLD] == ["map-version-1"]
