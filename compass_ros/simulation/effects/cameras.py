"""Where a camera looks, as shapes of its laws: nobody told the cell where its optical axis meets what it sees.

Bodies that only move in the plane of x and y are seen along z; in space the axis is the direction of z turned by the
vector (tilt_x, tilt_y, 0), and a point on it has three numbers, of which the one along the axis means nothing.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Quantity
from compass_ros.simulation.extents import SignalSize
from compass_ros.types import Floats

SEEN = SignalSize("camera", "m", 1.0, (0.0, 0.0, 0.0), 1.0)
"""A camera that sees a metre to each side of the origin: for names and units."""
_ASIDE = 3.0
"""How far beside the middle of what was seen the axis may be, in its reach: within the picture, where what moves fills
a third of it. An assumption on how cameras are set up."""
_TILTED = 1.04 * np.pi / 2
"""Largest tilt about x or y [rad]; a quarter turn is enough, and a fit should not lie on a bound."""
_PLACES, _TILTS = 5, 3
"""Of grids: a reach and a half apart; along each axis of the scene, to both sides, and between them."""


def centre(size: SignalSize, axes: str, searched: bool = False) -> tuple[Quantity, ...]:
    """Shapes of where the axis meets what is seen, of some of the scene's axes that are seen."""
    far, grid = _ASIDE * size.reach, _PLACES if searched else 0
    return tuple(
        Quantity(f"centre_{axis}", "m", middle - far, middle + far, size.reach, False, middle, later=True, grid=grid)
        for axis, middle in zip("xyz", size.middle, strict=False)
        if axis in axes
    )


def tilt() -> tuple[Quantity, ...]:
    """Shapes of the direction of the axis."""
    return tuple(
        Quantity(f"tilt_{axis}", "rad", -_TILTED, _TILTED, 0.3, amplitude=False, later=True, grid=_TILTS)
        for axis in "xy"
    )


def away(seen: Floats, columns: tuple[int, ...], centre: Floats) -> Floats:
    """(B, F, a) from a point of the axis to a body, of (B, F, C) what is seen and (B, 3) points."""
    return np.asarray(seen[:, :, columns] - centre[:, None, : len(columns)])


def along(tilts: Floats) -> Floats:
    """(B, 3) directions of axes, of (B, 2) tilts [rad]."""
    angle = np.linalg.norm(tilts, axis=1)
    sine = np.sinc(angle / np.pi)  # over the angle
    return np.stack([sine * tilts[:, 1], -sine * tilts[:, 0], np.cos(angle)], axis=1)


def filled(numbers: Floats, count: int) -> Floats:
    """(B, count) numbers: in a plane those that come last in space are missing, and zero."""
    return np.pad(numbers, ((0, 0), (0, count - numbers.shape[1])))
