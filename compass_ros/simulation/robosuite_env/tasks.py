"""The paper's three tasks. Defining a class registers it with robosuite under its name."""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.robosuite_env.cell_env import CellEnv


class MiniAirHockey(CellEnv):
    """Puck 1 is shot so that puck 2 comes to rest in the goal."""

    cell_name = "air_hockey"

    def _check_success(self) -> bool:
        return self.in_site("goal", self.observed()[2:4])


class DoubleBouncingBall(CellEnv):
    """A ball falls over two inclined plates into a basket."""

    cell_name = "bouncing_ball"

    def _check_success(self) -> bool:
        seen = self.observed()
        rim = float(self._scene.site("goal").pos[2])
        return bool(self.in_site("goal", seen[:2]) and seen[2] < rim)


class PushI(CellEnv):
    """A slender cube is pushed to a place and an alignment."""

    cell_name = "push_i"
    near_m = 0.02
    near_rad = 0.2

    def _check_success(self) -> bool:
        seen, target = self.observed(), self._scene.site("target").pos
        turned = 2 * np.arccos(min(abs(float(seen[3])), 1.0))
        return bool(np.linalg.norm(seen[:2] - target[:2]) < self.near_m and turned < self.near_rad)
