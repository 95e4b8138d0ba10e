"""A drive that makes more or less of its command than its model.

u -> (1 + error) u. Source: error of a torque constant, of a gear's ratio or of a converter's scale.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.site_kinds import SINGLE_DRIVES
from compass_ros.simulation.sizes import MODEST
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    return np.asarray(controls * (1 + numbers[:, None, :1]))


EFFECT = Effect(
    name="gain_error",
    channel="actuation",
    quantities=(Quantity("error", "1", -0.5, 0.5, MODEST),),
    sentence="an error of the drive's gain",
    on=SINGLE_DRIVES,
    controls=_controls,
)
