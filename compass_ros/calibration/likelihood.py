"""What was recorded, how well, and what was known before: the function that a fit maximises.

The residual is (predicted - measured) / sigma. Unknown are the parameters, which all episodes share, and the launch of
each episode (its true speed and angle differ a little from the command): small Gaussian offsets of the inputs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.types import Bools, Floats, Ints, Parameter

Predict = Callable[[Floats, Floats, Floats], Floats]
"""(B, P) values, (B, A) inputs, (B, F) times [s] -> (B, F, C) what the tracker would say: the door to a simulator."""

PredictAlike = Callable[[Floats, Floats, Floats, Ints, Floats], tuple[Floats, Floats]]
"""The same where row b is known to move as row like[b] does until until[b] [s of simulated time].

Returned is also until when it really did (`Simulator.observe_alike`).
"""

HOPELESS = 1e9
"""Residual [sigma] of a prediction that is no number, or farther away than that: the square of this still adds up, and
a simulator that has lost a body is never mistaken for one that agrees."""


GROWING = (0.16, 0.28, 0.4, 0.55, 0.75, 1.0)
"""Shares of an episode that are fitted in turn: through several collisions it has many minima, its beginning has
one."""
SMOOTH = 0.14
"""Roughness [sigma] below which differences of one length are as good as of another: it makes sigma a hundredth
larger."""
IN_WINDOWS = (0.28, 1.0)
"""The same of windows, which begin where they were measured: on a seven-joint arm with 64 wrong parameters the
trajectory difference after the first share was that of the last (0.366 m, 0.026, then 0.0257 five times)."""

Difference = Callable[[Floats, Floats], Floats]
"""(..., C) predicted, (..., C) measured -> (..., C) how far apart, on the manifold of each signal."""


def plain_difference(predicted: Floats, measured: Floats) -> Floats:
    """The difference of numbers that are what they are."""
    return np.asarray(predicted - measured)


@dataclass(frozen=True)
class Likelihood:
    """E episodes, F frames, C observed columns, P parameters, A inputs."""

    predict: Predict
    parameters: tuple[Parameter, ...]
    inputs: Floats
    """(E, A) commanded."""
    time_s: Floats
    """(E, F) since the command."""
    measured: Floats
    """(E, F, C), NaN where not seen; as `difference` takes it."""
    sigma: Floats
    """(E, F, C) standard deviation of one measurement, the simulator's own roughness included."""
    correlation_time: float
    """Frames that one independent measurement is worth (1 = white noise)."""
    launch_std: Floats
    """(A,) standard deviation of the launch around the command; 0 = exact."""
    prior_mean: Floats
    """(P,)"""
    prior_std: Floats
    """(P,)"""
    predict_alike: PredictAlike | None = None
    """The same model as `predict`: who replaces one replaces both. None: nothing is known of what rows share."""
    difference: Difference = plain_difference
    windowed: bool = False
    """Whether these are windows of long recordings, each with a first state of its own."""
    rough: Floats | None = None
    """(E, F, C) part of `sigma` that is the simulator's roughness [m or rad], as square root of variance; None: nobody
    has asked (`roughness`)."""
    systematic: Floats | None = None
    """(C,) standard deviation of the part of `sigma` that depends on the place and not on the frame [m or rad]: what
    the sensor states beyond its scatter (`Noise.systematic`); None: it states nothing."""

    @property
    def low(self) -> Floats:
        return np.array([p.low for p in self.parameters])

    @property
    def high(self) -> Floats:
        return np.array([p.high for p in self.parameters])

    @property
    def tunable(self) -> Bools:
        """(P,) False where the bounds leave a parameter no room."""
        return self.high > self.low

    @property
    def smooth(self) -> bool:
        """Whether the simulator has no roughness here: differences of one length are as good as of another."""
        return self.rough is not None and bool(np.max(self.rough / self.sigma) < SMOOTH)

    @property
    def roughness(self) -> float:
        """Root mean square of the simulator's roughness over what was measured [sigma]; 0 where nobody has asked."""
        seen = ~np.isnan(self.measured)
        if self.rough is None or not seen.any():
            return 0.0
        return float(np.sqrt(np.mean((self.rough / self.sigma)[seen] ** 2)))

    @property
    def horizons(self) -> tuple[float, ...]:
        """Shares of an episode that are fitted in turn."""
        return IN_WINDOWS if self.windowed else GROWING

    @property
    def measurements(self) -> int:
        """Numbers that were measured."""
        return int(np.sum(~np.isnan(self.measured)))

    def until(self, seconds: float) -> Likelihood:
        """The same for the first seconds after the command."""
        frames = int(np.max(np.sum(self.time_s <= seconds, axis=1)))
        frames = max(frames, 2)
        measured = np.where(self.time_s[:, :frames, None] <= seconds, self.measured[:, :frames], np.nan)
        rough = None if self.rough is None else self.rough[:, :frames]
        sigma = self.sigma[:, :frames]
        return replace(self, time_s=self.time_s[:, :frames], measured=measured, sigma=sigma, rough=rough)

    def of(self, episodes: Ints) -> Likelihood:
        """The same for some of the episodes."""
        return replace(
            self,
            inputs=self.inputs[episodes],
            time_s=self.time_s[episodes],
            measured=self.measured[episodes],
            sigma=self.sigma[episodes],
            rough=None if self.rough is None else self.rough[episodes],
        )

    def on(self, other: Likelihood) -> Likelihood:
        """The same model and prior for the recordings of another likelihood, which may lack the last inputs."""
        inputs = np.pad(other.inputs, ((0, 0), (0, self.inputs.shape[1] - other.inputs.shape[1])))
        seen = replace(self, inputs=inputs, time_s=other.time_s, measured=other.measured)
        return replace(seen, sigma=other.sigma, rough=other.rough)

    def residual(self, values: Floats, inputs: Floats, episode: Ints) -> Floats:
        """(B, F, C) residuals in sigma for (B, P) values and (B, A) inputs; 0 where nothing was measured."""
        return self._missed(self.predict(values, inputs, self.time_s[episode]), episode)

    def residual_alike(
        self, values: Floats, inputs: Floats, episode: Ints, like: Ints, until: Floats
    ) -> tuple[Floats, Floats]:
        """The same for rows that begin as others do, and until when they really do [s]; as in `PredictAlike`."""
        if self.predict_alike is None:
            return self.residual(values, inputs, episode), np.zeros(len(values))
        predicted, same = self.predict_alike(values, inputs, self.time_s[episode], like, until)
        return self._missed(predicted, episode), same

    def _missed(self, predicted: Floats, episode: Ints) -> Floats:
        measured = self.measured[episode]
        missed = np.nan_to_num(self.difference(predicted, measured) / self.sigma[episode], nan=HOPELESS)
        return np.where(np.isnan(measured), 0.0, np.clip(missed, -HOPELESS, HOPELESS))
