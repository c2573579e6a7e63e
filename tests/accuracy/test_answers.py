# SPDX-License-Identifier: LGPL-2.1-or-later
"""The known answers against which `make bench` measures errors are those that rays find."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.accuracy import _root_mean_square
from benchmarks.answers import PIECES, ROUGH, SMOOTH, Runs, answers


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    return answers(tmp_path_factory.mktemp("answers"))


@pytest.mark.parametrize("sampling", ["random", "sobol"])
@pytest.mark.parametrize("name", [*SMOOTH, *ROUGH])
def test_rays_find_the_known_flux(known, name, sampling):
    answer = known[name]
    choice = answer.choices[0] if answer.choices[0].words == "exact" else answer.choices[-1]
    runs = Runs(answer, choice, sampling)
    errors = runs.errors(runs.trace(8192, 5))
    stderr = errors.std(ddof=1) / math.sqrt(PIECES)
    rounding = 4e-4  # of the sphere's facets, and of bands 3 nm wide
    assert abs(errors.mean()) < 6 * stderr + rounding


def test_root_mean_square_holds_chance_and_what_is_wrong():
    errors = np.random.default_rng(1).normal(0.03, 0.04 * math.sqrt(PIECES), (4000, PIECES))
    found, stderr = _root_mean_square(errors)
    assert found == pytest.approx(0.05, abs=5 * stderr)
    assert stderr < 0.001
