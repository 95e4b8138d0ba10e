"""Which rows of a track say where the object was: one rule for bags and tables."""

from __future__ import annotations

import numpy as np

from compass_ros.types import Bools, Floats, Quantity

LEAST_NORM = 0.5
"""Norm of a quaternion that still says an orientation: halfway between those that do (1) and one never set (0)."""


def measured(values: Floats, quantity: Quantity) -> Bools:
    """(F,) of rows (F, D): all numbers finite, and of a pose a quaternion that is no zero.

    Motion capture writes NaN, an empty cell or zeros for a body that it does not see, and a driver that knows no
    orientation leaves ROS's default of zeros.
    """
    return np.asarray(np.isfinite(values).all(axis=1) & oriented(values, quantity))


def oriented(values: Floats, quantity: Quantity) -> Bools:
    """(F,) whether a row's quaternion says an orientation; True for quantities without one."""
    if quantity != "pose":
        return np.ones(len(values), bool)
    return np.asarray(~(np.linalg.norm(values[:, 3:], axis=1) < LEAST_NORM))


def left_out(values: Floats, quantity: Quantity, what: str) -> str:
    """One sentence on the rows that are not measured; empty where all are. `what`: `messages of cube on /tf`."""
    lost = np.flatnonzero(~measured(values, quantity))
    if not lost.size:
        return ""
    unset = int(np.sum(~oriented(values[lost], quantity)))
    why = [f"{lost.size - unset} not finite"] * (unset < lost.size) + [f"{unset} with an orientation of zeros"] * (
        unset > 0
    )
    which = ", ".join(str(index + 1) for index in lost[:6]) + ", ..." * (lost.size > 6)
    return f"{lost.size} of {len(values)} {what} are left out ({'; '.join(why)}): number {which}"
