"""A pause between the command and the motion.

u(t) -> u(t - delay); before the first command u = 0, or the position where a position servo stood.
Source: transport delay of a command chain.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, told_before
from compass_ros.simulation.site_kinds import DRIVES
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    steps = controls.shape[1]
    at = np.arange(steps) - numbers[:, :1] / context.time_step  # where to read, in steps
    low = np.floor(at).astype(int)
    share = (at - low)[:, :, None]
    padded = np.concatenate([told_before(controls, context)[:, None], controls], axis=1)
    rows = np.arange(len(controls))[:, None]
    early, late = (np.clip(low + shift, 0, steps) for shift in (1, 2))
    return np.asarray((1 - share) * padded[rows, early] + share * padded[rows, late])


EFFECT = Effect(
    name="actuation_delay",
    channel="actuation",
    quantities=(Quantity("delay", "s", 0.0, 0.3, 0.005),),
    sentence="a delay between command and motion",
    on=DRIVES,
    controls=_controls,
)
