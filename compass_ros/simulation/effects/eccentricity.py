"""An encoder whose disc or magnet is off the centre of its shaft.

observed = q + cosine (cos(q) - 1) + sine sin(q) + cosine_2 (cos(2 q) - 1) + sine_2 sin(2 q), q the angle: an error that
repeats with the turn, and none at the angle 0, where its zero was set (another one is `offset`, or a number of the
cell). Source: first harmonic of an eccentric scale (Ellin and Dolsak 2008), e / r for an eccentricity e of a disc of
radius r; the second one is that of two heads or fields that are not square, or of unequal gain.
"""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.simulation.sites import Site
from compass_ros.simulation.sizes import MODEST
from compass_ros.types import Floats


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    cosine, sine, cosine_2, sine_2 = (numbers[:, None, i : i + 1] for i in range(4))

    def eccentric(time: Floats) -> Floats:
        seen = sample(time)
        across, along = np.sin(seen), np.cos(seen)
        twice = 2 * across * (sine_2 * along - cosine_2 * across)  # cos(2 q) - 1 = -2 sin(q)^2
        return np.asarray(seen + cosine * (along - 1) + sine * across + twice)

    return eccentric


def _unable(model: mujoco.MjModel, site: Site) -> str:
    if site.units == ("rad",):
        return ""
    return "it is not one angle" + (f"; name one of its {len(site.units)} numbers" if len(site.units) > 1 else "")


_MOST, _SCALE = 0.2, 0.1 * MODEST

EFFECT = Effect(
    name="eccentricity",
    channel="sensing",
    quantities=(
        Quantity("cosine", "rad", -_MOST, _MOST, _SCALE),
        Quantity("sine", "rad", -_MOST, _MOST, _SCALE),
        Quantity("cosine_2", "rad", -_MOST / 2, _MOST / 2, _SCALE / 2, later=True),
        Quantity("sine_2", "rad", -_MOST / 2, _MOST / 2, _SCALE / 2, later=True),
    ),
    sentence="an error of the encoder that repeats once a turn",
    on=("encoder",),
    sensing=_sensing,
    unable=_unable,
    by_name=True,
)
