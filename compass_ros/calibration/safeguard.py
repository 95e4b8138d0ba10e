"""A fit that ends farther from the recordings than it began is none.

What is fitted and what is reported differ: the loss hardly counts what it takes for outliers, frames after a collision
that amplifies everything are trusted less, and the fit follows its solution from the beginning of each episode. Where
something else differs than the parameters, in chaotic bounces above all, that can end farther away in root mean square,
the distance that is reported. So that distance is asked of the fit and of where it began. The start is one of the
answers: by construction none is farther.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from compass_ros.calibration.cost import ROBUST, Point, launches_away, start
from compass_ros.calibration.launches import with_launches
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import Refined, calmed, concluded, freed, polish, scaled
from compass_ros.calibration.residuals import FLOOR
from compass_ros.calibration.roughness import with_roughness
from compass_ros.types import Floats

Distance = Callable[[Floats], float]
"""(P,) values -> how far they are from the recordings, as it is reported."""
MOVED_FAR = 2.0
"""How far first states are moved, in standard deviations of what is stated of them (rms), from which that is said:
three quarters of it, in mean square, are no such error. By chance eight numbers come that far once in ten thousand
fits (chi-square of eight degrees above 32)."""

FEW, MUCH = 0.1, 0.5
"""Share of the episodes in which so much of what a fit leaves above the noise is worth a word. Were it scattered over
them as an exponential, the largest tenth would have p (1 - log p), a third. They choose words and no verdict."""


def no_farther(likelihood: Likelihood, refined: Refined, values: Floats, distance: Distance) -> Refined:
    """A fit that is not farther than the (P,) values where it began: this one; else one that begins there with whole
    episodes, which has no beginning of theirs to be led astray by; else those values, with the errors that they have.
    """
    if not distance(refined.fit.point.values) > distance(values):
        return refined
    begun = freed(likelihood, start(likelihood, values), 0)[1]
    calm = calmed(likelihood, begun.linear)
    whole = polish(calm, begun.point)
    if not distance(whole.fit.point.values) > distance(values):
        return whole
    return _stayed(calm, with_launches(calm, values))


def farther(distance: Distance, reached: Floats, kept: Floats, begun: Floats) -> str:
    """What a user is told of a fit that was not kept."""
    times = [distance(values) / distance(begun) for values in (reached, kept)]
    instead = f"one that begins with whole episodes is at {times[1]:.2f}" if times[1] < 1 else "the defaults stay"
    return f"a fit ended {times[0]:.2f} times as far from the fitted episodes (rms) as the defaults are; {instead}"


def moved_starts(refined: Refined) -> str:
    """What a user is told of first states that a fit moved far from where they were measured; empty: it did not."""
    away = launches_away(refined.likelihood, refined.fit.point)
    far = float(np.sqrt(np.mean(away**2))) if away.size else 0.0
    if far < MOVED_FAR:
        return ""
    said = f"the fit moved the first states by {far:.1f} times the error that is stated of them (rms)"
    return f"{said}: the scene, a number that is not tuned, or what they were measured with is wrong"


def left_in_few(likelihood: Likelihood, residual: Floats, names: Sequence[str]) -> str:
    """What a user is told where half of the square of an (E, F, C) residual above the noise is in few of the episodes
    with these names; empty: it is not, or there is little."""
    seen = ~np.isnan(likelihood.measured)
    above = np.sum(np.where(seen, residual**2 - 1, 0.0), axis=(1, 2))
    if above.sum() <= (FLOOR - 1) * seen.sum():
        return ""
    order = np.argsort(-above, kind="stable")
    count = int(np.searchsorted(np.cumsum(above[order]), MUCH * above.sum())) + 1
    if count > FEW * len(names):
        return ""
    share, kind = min(above[order[:count]].sum() / above.sum(), 1.0), "windows" if likelihood.windowed else "episodes"
    listed = ", ".join(names[i] for i in order[:count])
    return f"{100 * share:.0f} % of what the fit leaves above the noise is in {count} of {len(names)} {kind}: {listed}"


def _stayed(likelihood: Likelihood, point: Point) -> Refined:
    """The errors at a point, without a step."""
    influence, fit = freed(likelihood, point, 0)
    rough = with_roughness(likelihood, fit)
    return concluded(rough, replace(fit, linear=scaled(fit.linear, likelihood, rough), robust=ROBUST), influence)
