"""A network on top of a simulator that is stepped: what it leaves of each control step of recordings.

Neural-augmented simulation (Golemo et al., 2018, Sim-to-real transfer with neural-augmented robot simulation, CoRL),
with the ensemble of `residual.py` in the place of their recurrent network: after each step the bar is moved on by what
the network says, and the next step begins there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.interpolate import make_smoothing_spline

from compass_ros.policy.belief import Belief
from compass_ros.policy.residual import Ensemble
from compass_ros.simulation.replay import Recordings
from compass_ros.types import Floats

POSE, SPEED, TURN = slice(3, 10), slice(12, 14), 17
"""In a state of the cell `pushed_bar`: bar's x, y, z and quaternion, its velocity in x and y, its rate about z."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Augmented(Belief):
    """Simulators of a pushed bar with a correction of each control step."""

    left: Ensemble
    control_s: float

    def observe(self, commands: Floats, time_s: Floats, rng: Generator) -> Floats:
        """As of any belief; with one case alone."""
        (case,) = self.cases
        simulator, values = case.simulator, case.drawn(len(commands), rng)
        inputs = simulator.inputs(commands)
        own, state, controls, steps = simulator.begun(values, inputs, float(time_s[-1]) + self.control_s)
        assert controls is not None  # a tool is driven
        each = round(self.control_s / simulator.time_step)
        path = [state[:, None]]
        for first in range(0, steps, each):
            told = controls[:, first : first + each]
            played = simulator.play(own, state, told, told.shape[1])[0]
            state = played[:, -1] = self.corrected(state, told[:, 0], played[:, -1])
            path.append(played)
        raw = np.concatenate(path, axis=1)[:, :, 1 + simulator.physics.dynamics.columns()]
        return simulator.sensed(values, inputs, np.tile(time_s, (len(commands), 1)), raw)

    def corrected(self, before: Floats, told: Floats, after: Floats) -> Floats:
        """(B, s) states after a control step, from (B, s) before it and (B, 2) velocities that were told [m/s]."""
        return _moved(after, yaw(before), self.left(_features(before, told)))


def augmented(base: Belief, data: Recordings, control_s: float, seed: int) -> Augmented:
    """Learned from recordings of pushes, which the simulator plays as they were commanded.

    What it leaves grows smoothly, whatever hits what: it is smoothed by a spline (generalised cross-validation,
    Craven and Wahba 1978), and the network learns by how much it grows in each control step. (Steps that begin at
    measured poses teach it less: a tenth of a millimetre too near, and the tool throws the bar. On 50 pushes of Push-I
    that leaves 0.40 m, this 0.26 m, the simulator alone 0.28 m.)
    """
    (case,) = base.cases
    simulator, count, each = case.simulator, len(data.steps_s) - 1, round(control_s / case.simulator.time_step)
    values, inputs = case.drawn(len(data.inputs), np.random.default_rng(0)), case.simulator.inputs(data.inputs)
    own, start, controls, steps = simulator.begun(values, inputs, count * control_s)
    assert controls is not None  # a tool is driven
    states = np.concatenate([start[:, None], simulator.play(own, start, controls, steps)[0]], axis=1)
    before = states[:, : count * each : each].reshape(-1, start.shape[1])
    over = _flat(data.measured) - _flat(simulator.observe(values, inputs, data.time_s))
    smooth = [_smooth(time_s, of, data.steps_s) for time_s, of in zip(data.time_s, over, strict=True)]
    left = np.diff(np.stack(smooth), axis=1).reshape(-1, 3)
    left[:, :2] = _turned(left[:, :2], -yaw(before))
    told = controls[:, : count * each : each].reshape(len(before), -1)
    recording = np.repeat(np.arange(len(values)), count)
    network = Ensemble(_features(before, told), left, recording, seed)
    return Augmented(base.cases, left=network, control_s=control_s)


def _flat(pose: Floats) -> Floats:
    """(..., 3) x, y [m] and yaw [rad] of (..., 7) poses."""
    return np.concatenate([pose[..., :2], yaw_of(pose[..., 3:])[..., None]], axis=-1)


def _smooth(time_s: Floats, left: Floats, at_s: Floats) -> Floats:
    """(S, 3) at (S,) times of (F, 3) at (F,) times, NaN where not seen."""
    known = ~np.isnan(left).any(axis=1) & (np.diff(time_s, prepend=-np.inf) > 0)
    return np.stack([make_smoothing_spline(time_s[known], column)(at_s) for column in left[known].T], axis=1)


def _features(state: Floats, told: Floats) -> Floats:
    """(B, 7) in the bar's axes: where the tool is, what it is told, how the bar moves."""
    angle = yaw(state)
    flat = [_turned(v, -angle) for v in (state[:, 1:3] - state[:, POSE][:, :2], told, state[:, SPEED])]
    return np.concatenate([*flat, state[:, TURN, None]], axis=1)


def _moved(state: Floats, axes: Floats, by: Floats) -> Floats:
    """(B, s) with the bar moved on by (B, 3): x and y along axes that are turned by (B,), and an angle."""
    out = state.copy()
    out[:, POSE.start : POSE.start + 2] += _turned(by[:, :2], axes)
    half, (w, x, y, z) = by[:, 2] / 2, state[:, POSE][:, 3:].T
    c, s = np.cos(half), np.sin(half)
    out[:, POSE.start + 3 : POSE.stop] = np.stack([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w], axis=1)
    return out


def yaw(state: Floats) -> Floats:
    """(...,) of (..., s) states [rad]."""
    return yaw_of(state[..., POSE][..., 3:])


def yaw_of(quaternion: Floats) -> Floats:
    """(...,) of (..., 4) quaternions of what lies flat, w first [rad]."""
    return np.asarray(2 * np.arctan2(quaternion[..., 3], quaternion[..., 0]))


def _turned(vector: Floats, angle: Floats) -> Floats:
    """(..., 2) vectors turned by (...,) [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * vector[..., 0] - s * vector[..., 1], s * vector[..., 0] + c * vector[..., 1]], axis=-1)
