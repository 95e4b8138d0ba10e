"""Made field of a whole rigid body: mass, centre and inertia together, so that they are those of a real one.

Ten numbers say how the body of the scene is deformed: its pseudo-inertia J (4 x 4: second moments, first moments, mass)
becomes exp(2 alpha) A J A^T with

    A = [exp(d1)  s12     s13     t1]
        [0        exp(d2) s23     t2]
        [0        0       exp(d3) t3]
        [0        0       0       1 ]

and `inertia_log_cholesky[0..9]` = (alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3): the log-Cholesky parameters of Rucker
and Wensing (IEEE RA-L 7(2), 2022), of which they show that any values are a body with positive mass and density, and
that every such body has exactly one. Frame: the principal axes at the centre of mass of the scene's body. alpha, d and
s have no unit (mass times exp(2 alpha); extent along an axis times exp(d); shear), t is in metres. 0 is the scene. A
body that is flat in the scene stays flat.

Half widths that say "as exact as a drawing": alpha 0.05 (10 % of the mass), d and s 0.05 (10 % of an inertia), t a
fiftieth of the body's size (that of the ball with its mass and largest inertia).
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from compass_ros.cells.made_drives import Writer
from compass_ros.errors import ConfigError
from compass_ros.types import Floats

NUMBERS = ("alpha", "d1", "d2", "d3", "s12", "s23", "s13", "t1", "t2", "t3")
HALF_WIDTH = 0.05
"""Of alpha, d and s."""
CENTRE = 0.02
"""Half width of t as a share of the body's size."""
REACH = 6.0
"""Half widths from 0 to a bound."""


def size_of(mass: float, largest_inertia: float) -> float:
    """Radius [m] of the ball with this mass [kg] and inertia [kg m^2]."""
    return float(np.sqrt(2.5 * largest_inertia / mass))


def moments(inertia: Floats) -> Floats:
    """(3,) second moments of a mass along its principal axes [kg m^2]: the integral of x^2 dm, ...; none is negative.

    Of (3,) principal inertias. No other numbers belong to a real body: that they are positive says the same as that no
    inertia is more than the sum of the other two (Wensing et al., IEEE RA-L 3(1), 2018).
    """
    return np.asarray(np.maximum(0.5 * inertia.sum() - inertia, 0.0))


def deformed(body: int, scene: mujoco.MjModel, columns: Sequence[int], indices: Sequence[int], where: str) -> Writer:
    """Writes mass, centre, inertia and its axes of a body from the numbers `indices`, which stand in `columns`.

    Raises ConfigError for a body without mass and for an index beyond 9.
    """
    nominal = [(array, getattr(scene, array)[body].copy()) for array in _ARRAYS]
    mass, place, inertia, axes = (value for _, value in nominal)
    if not mass > 0:
        raise ConfigError(f"{where}: body '{scene.body(body).name}' has no mass")
    if max(indices) >= len(NUMBERS):
        raise ConfigError(f"{where}: field: inertia_log_cholesky has 10 numbers, found index {max(indices)}")
    second = np.diag(moments(inertia))
    world_from_axes = np.zeros(9)
    mujoco.mju_quat2Mat(world_from_axes, axes)
    frame = world_from_axes.reshape(3, 3)

    def write(model: mujoco.MjModel, values: Floats) -> None:
        numbers = np.zeros(len(NUMBERS))
        numbers[list(indices)] = values[list(columns)]
        if not numbers.any():  # the scene's own numbers, to the last bit
            for array, value in nominal:
                getattr(model, array)[body] = value
            return
        stretch, grown = _stretch(numbers), np.exp(2 * numbers[0])
        along, turn = np.linalg.eigh(grown * stretch @ second @ stretch.T)
        along = np.maximum(along, 0.0)
        turn[:, 2] *= np.linalg.det(turn)  # a rotation
        model.body_mass[body] = grown * mass
        model.body_ipos[body] = place + frame @ numbers[7:]
        model.body_inertia[body] = along.sum() - along
        mujoco.mju_mat2Quat(model.body_iquat[body], (frame @ turn).ravel())

    return write


_ARRAYS = ("body_mass", "body_ipos", "body_inertia", "body_iquat")


def _stretch(numbers: Floats) -> Floats:
    """(3, 3) upper left part of A."""
    _, d1, d2, d3, s12, s23, s13, *_ = numbers
    return np.array([[np.exp(d1), s12, s13], [0.0, np.exp(d2), s23], [0.0, 0.0, np.exp(d3)]])
