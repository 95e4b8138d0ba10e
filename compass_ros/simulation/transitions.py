"""What a small push at any moment does to what is observed: state transitions between moments, chained.

Between two moments the state changes as x' = Phi x for small x, with Phi from one rollout of that stretch for each
degree of freedom. A push is a change of velocity at a moment; what it does later is a product of these matrices. So all
pushes at all moments cost as many rollouts as the scene has states (Griewank and Walther 2008, forward accumulation),
where pushes one by one would cost a rollout each.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from compass_ros.types import Floats, Ints

SMALL = 1e-7
"""Changes of a state, as a share of its rms speed (of a position: of the way in a stretch). Against 1e-8, responses
differ by 1e-6 (arm, ball that bounces) to 5e-5 (pucks, a bar on its feet), and errors fall in proportion down to there;
with 1e-3 they are 10 % wrong on pucks, and feet that a push lifts out of contact make them meaningless."""


@dataclass(frozen=True)
class Chart:
    """Where a scene's tangent numbers (nv positions, nv velocities, na activations) are in a row of full state."""

    nq: int
    nv: int
    na: int
    position: Ints
    """(nv,) place in qpos of a hinge, a slide or a translation; of a rotation that of its quaternion's first number."""
    axis: Ints
    """(nv,) which of three rotations; -1 for what is no rotation."""

    @staticmethod
    def of(model: mujoco.MjModel) -> Chart:
        position, axis = np.zeros(model.nv, int), np.full(model.nv, -1)
        for joint in range(model.njnt):
            at, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
            kind = int(model.jnt_type[joint])  # MuJoCo 4: no number of numpy is `in` a tuple of its constants
            free = kind == mujoco.mjtJoint.mjJNT_FREE
            shifts = 3 if free else 0 if kind == mujoco.mjtJoint.mjJNT_BALL else 1
            position[dof : dof + shifts] = at + np.arange(shifts)
            if kind in (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL):
                position[dof + shifts : dof + shifts + 3] = at + shifts
                axis[dof + shifts : dof + shifts + 3] = np.arange(3)
        return Chart(model.nq, model.nv, model.na, position, axis)

    @property
    def size(self) -> int:
        return 2 * self.nv + self.na

    def moved(self, states: Floats, number: int, by: float) -> Floats:
        """(..., s) states with one tangent number changed."""
        out = states.copy()
        if number >= self.nv:
            out[..., 1 + self.nq + number - self.nv] += by
        elif self.axis[number] < 0:
            out[..., 1 + self.position[number]] += by
        else:
            place = slice(1 + self.position[number], 5 + self.position[number])
            turned = states[..., place] + 0.5 * by * _times(states[..., place], self.axis[number])
            out[..., place] = turned / np.linalg.norm(turned, axis=-1, keepdims=True)
        return out

    def apart(self, base: Floats, other: Floats) -> Floats:
        """(..., n) small differences of (..., s) states in tangent numbers."""
        out = np.empty((*other.shape[:-1], self.size))
        plain = self.axis < 0
        change = other - base
        out[..., : self.nv][..., plain] = change[..., 1 + self.position[plain]]
        for dof in np.flatnonzero(~plain):
            place = slice(1 + self.position[dof], 5 + self.position[dof])
            out[..., dof] = 2 * np.sum(_times(base[..., place], self.axis[dof]) * other[..., place], axis=-1)
        out[..., self.nv :] = change[..., 1 + self.nq :][..., : self.nv + self.na]
        return out


def _times(quaternion: Floats, axis: int) -> Floats:
    """(..., 4) product of (..., 4) quaternions with the pure one along an axis."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    rows = ((-x, w, z, -y), (-y, -z, w, x), (-z, y, -x, w))[axis]
    return np.stack(rows, axis=-1)


def changes(chart: Chart, states: Floats, moments: Ints, time_step: float) -> Floats:
    """(n,) sizes of changes of the tangent numbers, from (E, T + 1, s) states and steps at which stretches begin."""
    speeds = states[..., 1 + chart.nq : 1 + chart.nq + chart.nv]
    rms = np.sqrt(np.mean(speeds**2, axis=(0, 1)))
    turns = chart.axis >= 0
    # A degree of freedom that stands still is moved as the others are: a puck before it is struck.
    for group in (turns, ~turns):
        if group.any():
            rms[group] = np.maximum(rms[group], 0.1 * max(float(rms[group].max()), 1e-6))
    stretch = float(np.max(np.diff(moments))) * time_step
    active = np.sqrt(np.mean(states[..., 1 + chart.nq + chart.nv :] ** 2, axis=(0, 1)))[: chart.na]
    return np.asarray(SMALL * np.concatenate([stretch * rms, rms, np.maximum(active, 1e-3)]))


def chained(
    stretches: Iterator[tuple[Floats, Floats]], kicks: int, degrees: int, size: int
) -> Iterator[tuple[Floats, Floats]]:
    """Of one episode, stretch by stretch: (L, C, K V) changes of raw rows by unit kicks, and the (n, K V) state's.

    `stretches`: (L, C, n) changes of raw rows in it and (n, n) of the state at its end, by each tangent number at its
    beginning. Kick k changes a velocity at the beginning of stretch k.
    """
    carried = np.zeros((size, kicks * degrees))
    for k, (rows, after) in enumerate(stretches):
        if k < kicks:
            carried[degrees : 2 * degrees, k * degrees : (k + 1) * degrees] += np.eye(degrees)
        yield rows @ carried, carried
        carried = after @ carried
