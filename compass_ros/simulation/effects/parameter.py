"""A number of the scene that is wrong: an armature, a mass, a length, a gain that nobody tunes.

The deviation is added to what the scene says, in the number's own unit, and what belongs to the number follows, as it
does when a cell tunes it (`cells/fields.py`): a body's inertia its mass, a servo's stiffness its gain. Source: the
scene itself; bounds and prior are shares of how far off such a number is from a drawing or a datasheet
(`cells/auto_rules.py`).
"""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np

from compass_ros.cells.auto import specified
from compass_ros.cells.candidate import Candidate
from compass_ros.cells.fields import Fields
from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.types import Channel, Floats

MODEST, LARGEST = 0.2, 20.0
"""A modest deviation and the largest, in half widths. The prior is 20 modest ones wide: four half widths, so that a
mass from a datasheet (10 %) may be 40 % off, as a law may have 40 % of the force that a joint saw (`sizes.py`)."""
LEFT = 0.1
"""Share that is left at least of what cannot be zero."""
_OF_LENGTH = 0.01
"""Half width of a place of a link as a share of its distance from its parent, where a drawing would be more exact."""
_BY_A_LAW = ("dof_damping", "dof_frictionloss", "jnt_stiffness")
"""What a scene has too little of is what a law on the joint adds: of these only too much is a wrong number."""


def _model(model: mujoco.MjModel, numbers: Floats, context: Context) -> None:
    for site in context.sites if numbers[0] else ():
        if site.number is not None:
            one = specified(site.number, site.name)
            Fields(model, [(0, one)], site.name).write([model], np.array([[site.number.value + numbers[0]]]))


def deviates(number: Candidate, scene: mujoco.MjModel) -> Effect:
    """The law on one number of a scene, sized by it."""
    place = number.field.startswith("body_pos")
    length = float(np.linalg.norm(scene.body(number.of).pos)) if place else 0.0
    return replace(in_unit(number.unit, *_range(number, length)), channel=_channel(number.field))


def in_unit(unit: str, low: float = -1.0, high: float = 1.0, scale: float = 0.01) -> Effect:
    """The law on a number of some unit."""
    return replace(EFFECT, quantities=(Quantity("deviation", unit, low, high, scale),))


def _range(number: Candidate, length: float) -> tuple[float, float, float]:
    """Lowest, highest and modest deviation; `length`: from a body's parent to it, where that is its place [m]."""
    width = max(number.half_width, _OF_LENGTH * length)
    low, high, value = -LARGEST * width, LARGEST * width, number.value
    if number.low == 0:
        low = max(low, -value)
    elif number.low > 0:
        low = max(low, (LEFT - 1) * value)
    elif number.high < 0:
        high = min(high, (LEFT - 1) * value)
    if number.field in _BY_A_LAW:
        high = 0.0
    return low, high, MODEST * width


def _channel(field: str) -> Channel:
    if field.startswith("geom_"):
        return "contact"
    return "actuation" if field.startswith("servo_") else "dynamics"


EFFECT = Effect(
    name="parameter",
    channel="dynamics",
    quantities=(Quantity("deviation", "1", -1.0, 1.0, 0.01),),
    sentence="a right number of the scene",
    on=("field",),
    model=_model,
    by_name=True,
    apart=True,
)
