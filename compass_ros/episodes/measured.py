"""Which rows of a track say where the object was: one rule for bags and tables."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from compass_ros.types import QUANTITY_SIZE, Bools, Floats, Quantity

ONE_BY_ONE: frozenset[Quantity] = frozenset({"joint_position", "joint_velocity", "joint_effort", "scalar"})
"""Quantities of several things: a row may lack some of them."""
LEAST = 0.25
"""Largest number of a quaternion that still says an orientation: of a unit quaternion it is 0.5 or more, of one that
was never set 0."""


def _number(index: int) -> str:
    return f"number {index + 1}"


def measured(values: Floats, quantity: Quantity) -> Bools:
    """(F,) of rows (F, D): all numbers finite (of several joints: any), and of a pose a quaternion that is no zero.

    Motion capture writes NaN, an empty cell or zeros for a body that it does not see, and a driver that knows no
    orientation leaves ROS's default of zeros.
    """
    finite = np.isfinite(values)
    enough = finite.any(axis=1) if quantity in ONE_BY_ONE else finite.all(axis=1)
    return np.asarray(enough & oriented(values, quantity))


def oriented(values: Floats, quantity: Quantity) -> Bools:
    """(F,) whether a row's quaternion says an orientation; True for quantities without one."""
    if quantity != "pose" or values.shape[1] < QUANTITY_SIZE["pose"]:  # an input may be of some of its numbers
        return np.ones(len(values), bool)
    return np.asarray(~(np.abs(values[:, 3:]).max(axis=1) < LEAST))


def left_out(values: Floats, quantity: Quantity, what: str, place: Callable[[int], str] = _number) -> str:
    """One sentence on the rows that are not measured; empty where all are. `what`: `messages of cube on /tf`."""
    lost = np.flatnonzero(~measured(values, quantity)).tolist()
    if not lost:
        return ""
    unset = int(np.sum(~oriented(values[lost], quantity)))
    reasons = {"without a number": len(lost) - unset, "with an orientation of zeros": unset}
    why = ", ".join(f"{count} {reason}" for reason, count in reasons.items() if count)
    which = ", ".join(place(index) for index in lost[:6]) + ", ..." * (len(lost) > 6)
    return f"{len(lost)} of {len(values)} {what} are left out ({why}): {which}"
