"""The cells on a table in robosuite, arm and controller included; importing this registers them with robosuite.

`robosuite.make("MiniAirHockey", robots="Kinova3")`, and likewise `DoubleBouncingBall` and `PushI`.
"""

from compass_ros.simulation.robosuite_env.tasks import DoubleBouncingBall, MiniAirHockey, PushI

__all__ = ["DoubleBouncingBall", "MiniAirHockey", "PushI"]
