"""A clock of the sensor that runs fast or slow.

observed(t) = true(t (1 + rate)). Source: rate error of a free-running clock.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.simulation.site_kinds import SIGNALS
from compass_ros.types import Floats


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    return lambda time: sample(time * (1 + numbers[:, :1]))


def _ahead(numbers: Floats, last: float) -> float:
    return last * max(float(numbers.max()), 0.0)


EFFECT = Effect(
    name="clock_drift",
    channel="sensing",
    quantities=(Quantity("rate", "1", -0.1, 0.1, 0.005),),
    sentence="a drift of the sensor's clock",
    on=SIGNALS,
    sensing=_sensing,
    ahead=_ahead,
    of_message=True,
)
