# SPDX-License-Identifier: LGPL-2.1-or-later
"""How a relative error falls with the number of rays: of independent rays, and of points of a sequence."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Law", "law_of_points"]

Float = NDArray[np.float64]

#: Exponents of a law, and up to how many times its rays the pilot knows them.
LEAST_EXPONENT, MOST_EXPONENT, TRUSTED = 0.5, 1.5, 16
#: Powers of 1/n of which the variance of n points may be a sum: of light that is rough, cut by edges, and smooth.
POWERS = (1.0, 1.5, 2.0, 3.0)


@dataclass(frozen=True)
class Law:
    """Relative error of n rays: ``at_one n^-exponent``; with more rays than ``to_rays`` it falls as n^-1/2."""

    at_one: float
    exponent: float = 0.5
    to_rays: float = math.inf

    def error(self, n_rays: float) -> float:
        """Relative error of so many rays."""
        held = min(n_rays, self.to_rays)
        return float(self.at_one * held**-self.exponent * (held / n_rays) ** 0.5)

    def rays(self, error: float) -> float:
        """Rays that have the relative error."""
        if self.at_one == 0:
            return 0.0
        if not error > 0:
            return math.inf
        rays = (self.at_one / error) ** (1 / self.exponent)
        return float(rays if rays <= self.to_rays else self.to_rays * (self.error(self.to_rays) / error) ** 2)


def law_of_points(rays: Float, variance: Float, n_rays: int) -> Law:
    """How the error of points of a sequence goes on after ``n_rays``, by the relative variances of these and fewer.

    A power of the number of rays, fitted to them, goes on as steeply as it began. In a sum of powers the slowest takes
    over, of which few rays show next to nothing. The truth lies between, and so does the law: midway between both where
    the pilot ends and where it is trusted no further.

    Parameters
    ----------
    rays, variance : (n,) float64
    n_rays : int
        Rays of the pilot.
    """
    if not variance.min() > 0:
        return Law(0.0)
    from scipy.optimize import nnls

    steepness, at_one = np.polyfit(np.log(rays), np.log(variance), 1)
    powers = np.array(POWERS)
    parts, _ = nnls((rays[:, None] / n_rays) ** -powers / variance[:, None], np.ones(len(rays)))

    def error(n: float) -> float:
        power, sum_of_powers = math.exp(at_one) * n**steepness, parts @ (n / n_rays) ** -powers
        return float(power * sum_of_powers) ** 0.25

    exponent = math.log(error(n_rays) / error(TRUSTED * n_rays)) / math.log(TRUSTED)
    exponent = min(max(exponent, LEAST_EXPONENT), MOST_EXPONENT)
    return Law(error(n_rays) * n_rays**exponent, exponent, TRUSTED * n_rays)
