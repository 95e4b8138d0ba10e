"""Whether something is missing at all: more than noise, by an amount that matters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compass_ros.calibration.noise import Noise
from compass_ros.discovery.null import Null
from compass_ros.discovery.remainder import smooth_excess
from compass_ros.discovery.screen import Score, Space
from compass_ros.discovery.unseen import HeldOut

LEAST_GAIN = 10.0
"""Log likelihood that an effect must gain, whatever the null says."""
SOMETHING = 0.06
"""Excess of chi-square (`smooth_excess`) from which something is there although no candidate stands out."""
NOTICED = 0.25
"""Least rms movement by what is missing, as a share of the cell's expected noise: less is the tracker's own error."""


def noticed(space: Space, scores: Sequence[Score], null: Null, noise: Noise, unseen: HeldOut) -> bool:
    """Whether a candidate or the sum of residuals stands out from the noise, and what is missing moves something.

    What parameters take up in the fitted episodes may move the others alone.
    """
    gain = scores[0].gain if scores else 0.0
    excess = smooth_excess(space.likelihood, space.fit.point, space.fit.robust)
    gained = 2 * gain / space.likelihood.measurements
    ahead = 2 * unseen.excess / unseen.likelihood.measurements
    moved = float(np.sqrt(max(excess, gained, ahead, 0.0)) * np.median(noise.sigma))
    if moved < NOTICED * space.simulator.cell.spec.noise_m:
        return False
    stands_out = gain / noise.correlation_time > max(LEAST_GAIN, 1.2 * null.largest)
    return stands_out or excess > SOMETHING * noise.correlation_time
