# SPDX-License-Identifier: LGPL-2.1-or-later
"""Time and error by number of rays, as a trial foretells them; in plain Python, for curves and sliders.

error² = (a n^-p)² + bias²,        time = start + n (time of a ray),

where p is 1/2 for more rays than the trial knows it for.
"""

import math
from collections import namedtuple

from raymaps_wb.objects.study import EXACT, FACETED, RANDOM, SOBOL

FEWEST_RAYS, MOST_RAYS = 1000, 10**12
MOST_OF_SOBOL = 16 * 2**32
#: Rays of a decade that a slider offers.
STEPS = (1, 1.5, 2, 3, 5, 7)
#: What a final result is sure to, by chance alone; and the least number of rays that the slider reaches.
FINAL_ERROR, FINAL_RAYS = 5e-4, 1_000_000
#: A bias below so many of its standard errors may be none.
SEEN = 2.0

#: quantity: the flux that is meant, in words. outlooks: list of Outlook, that of the study's own settings first.
Forecast = namedtuple("Forecast", "quantity outlooks")


class Outlook:
    """What a choice costs.

    Attributes
    ----------
    words : str
    settings : dict of property of the study to its value, what is chosen
    is_known : bool
        Whether any light arrived; else there is no error to tell.
    """

    def __init__(self, answer):
        self.words = str(answer["choice"])
        self.settings = _properties(answer.get("settings") or {})
        self.is_even = self.settings.get("Sampling") == SOBOL
        at_one, exponent = answer.get("error_at_one_ray"), answer.get("exponent")
        self.is_known = at_one is not None and exponent is not None and at_one > 0
        self._at_one, self._exponent = (float(at_one), float(exponent)) if self.is_known else (0.0, 0.5)
        self._to_rays = float(answer.get("exponent_to_rays") or math.inf)
        bias, bias_stderr = answer.get("bias_percent"), answer.get("bias_stderr_percent")
        is_seen = bias is not None and abs(bias) >= SEEN * (bias_stderr or 0.0)
        self.bias = abs(float(bias)) / 100 if is_seen else 0.0
        self._start_s, self._ray_s = float(answer["start_s"]), float(answer["s_per_million_rays"]) / 1e6
        if not (self._start_s >= 0 and self._ray_s > 0):
            raise ValueError(f"times of the choice '{self.words}'")

    def noise(self, n_rays):
        """Relative error by chance."""
        held = min(n_rays, self._to_rays)
        return self._at_one * held**-self._exponent * (held / n_rays) ** 0.5

    def error(self, n_rays):
        """Relative standard error, what the choice is always off included."""
        return math.hypot(self.noise(n_rays), self.bias)

    def time_s(self, n_rays):
        """Time of a run."""
        return self._start_s + n_rays * self._ray_s

    def rays(self, time_s):
        """Rays of a run that takes so long."""
        return max(0.0, (time_s - self._start_s) / self._ray_s)

    def final_rays(self):
        """Rays of a final result."""
        if not self.is_known:
            return FINAL_RAYS
        needed = (self._at_one / FINAL_ERROR) ** (1 / self._exponent)
        if needed > self._to_rays:
            needed = self._to_rays * (self.noise(self._to_rays) / FINAL_ERROR) ** 2
        return int(min(max(needed, FINAL_RAYS), MOST_OF_SOBOL if self.is_even else MOST_RAYS))

    def stops(self, own_rays):
        """Numbers of rays that a slider offers, from draft to final; the study's own are among them.

        Points of a sequence are most even in powers of two.
        """
        last = max(self.final_rays(), own_rays)
        if self.is_even:
            first = FEWEST_RAYS.bit_length()
            found = {1 << power for power in range(first, (last - 1).bit_length() + 1)}
        else:
            first, decades = round(math.log10(FEWEST_RAYS)), math.ceil(math.log10(last))
            found = {round(step * 10**decade) for decade in range(first, decades + 1) for step in STEPS}
            found = {rays for rays in found if rays <= min(rays for rays in found if rays >= last)}
        return sorted({*found, own_rays})


def forecast_of(answer):
    """What the command answered; raises KeyError, TypeError or ValueError if that is no forecast."""
    # shares of rays are the sources' own, triangles those of the export, not the study's
    choices = [one for one in answer["choices"] if one.get("ray_share") is None and one.get("finer", 1) == 1]
    outlooks = [Outlook(choice) for choice in choices]
    if not outlooks:
        raise ValueError("no choices")
    return Forecast(str(answer["quantity"]), outlooks)


def _properties(settings):
    """Settings of a scene as properties of a study."""
    found = {}
    if "sampling" in settings:
        found["Sampling"] = SOBOL if settings["sampling"] == "sobol" else RANDOM
    if "roulette_threshold" in settings:
        found["RouletteThreshold"] = settings["roulette_threshold"]
    if "surfaces" in settings:
        found["Surfaces"] = FACETED if settings["surfaces"] == "faceted" else EXACT
    if "bands" in settings:
        found["Bands"] = settings["bands"]
    return found
