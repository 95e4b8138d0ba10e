"""An encoder whose disc is off the centre of its shaft.

observed = q + cosine cos(q) + sine sin(q), q the angle: an error that repeats once a turn.
Source: first harmonic of an eccentric scale (Ellin and Dolsak 2008), e / r for an eccentricity e of a disc of radius r.
"""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.simulation.sites import Site
from compass_ros.simulation.sizes import MODEST
from compass_ros.types import Floats


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    cosine, sine = numbers[:, None, :1], numbers[:, None, 1:]

    def eccentric(time: Floats) -> Floats:
        seen = sample(time)
        return np.asarray(seen + cosine * np.cos(seen) + sine * np.sin(seen))

    return eccentric


def _unable(model: mujoco.MjModel, site: Site) -> str:
    if site.units == ("rad",):
        return ""
    return "it is not one angle" + (f"; name one of its {len(site.units)} numbers" if len(site.units) > 1 else "")


EFFECT = Effect(
    name="eccentricity",
    channel="sensing",
    quantities=(Quantity("cosine", "rad", -0.2, 0.2, 0.1 * MODEST), Quantity("sine", "rad", -0.2, 0.2, 0.1 * MODEST)),
    sentence="an error of the encoder that repeats once a turn",
    on=("encoder",),
    sensing=_sensing,
    unable=_unable,
    by_name=True,
)
