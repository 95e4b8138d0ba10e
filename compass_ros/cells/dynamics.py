"""What the simulator needs from a cell: model fields, start, controls and observations, all for a batch at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import mujoco

from compass_ros.types import Floats, Ints


@dataclass(frozen=True)
class Sliding:
    """How the table slows a body that lies on it: Coulomb friction, faded in at a creep speed."""

    body: str
    friction: Floats
    """(B,) coefficient."""
    creep: Floats
    """(B,) speed under which it fades [m/s]."""
    load: Floats
    """(B,) share of the weight that the table carries."""


class Dynamics(Protocol):
    """A cell's meaning in MuJoCo. B rollouts, P parameters, A inputs, T steps, F frames, C observed columns."""

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled scene at its defaults. Never changed."""
        ...

    def apply(self, models: Sequence[mujoco.MjModel], values: Floats) -> None:
        """Write (B, P) parameter values into B models. What MuJoCo derives from them (mj_setConst) is the caller's."""
        ...

    @property
    def first(self) -> Floats:
        """(s,) state (mjSTATE_FULLPHYSICS) in which the scene begins, before `start` says where it is and moves to."""
        ...

    def start(self, values: Floats, inputs: Floats) -> tuple[Floats, Floats]:
        """(B, nq) positions and (B, nv) velocities at simulated time 0."""
        ...

    def controls(self, values: Floats, inputs: Floats, steps: int) -> Floats:
        """(B, T, nu) controls at the scene's time step."""
        ...

    def sliding(self, values: Floats) -> tuple[Sliding, ...]:
        """Bodies that lie on the table, with (B,) coefficients each; empty where friction is the scene's own."""
        ...

    def columns(self) -> Ints:
        """(C,) places of the observed columns in a row of (qpos, qvel, act, sensordata)."""
        ...

    def observe(self, values: Floats, positions: Floats) -> Floats:
        """(B, F, C) what the tracker would say, from (B, F, C) raw columns, each moment for itself."""
        ...

    def poses(self, values: Floats, positions: Floats) -> Mapping[str, Floats]:
        """(B, F, 3) x, y [m] and yaw [rad] of each body that moves in the plane, in the tracker's frame, for drawings.

        From (B, F, nq) positions; empty for cells that are not planar.
        """
        ...
