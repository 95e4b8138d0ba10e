"""Contacts that yield, as MuJoCo's documentation states them (chapter "Computation": impedance, reference acceleration,
after E. Todorov (2014), ICRA), and a march through time that knows nothing of MuJoCo. A world's plain contacts are its
cell's: what a world lacks or has beyond them is then a law and not a difference between engines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats

_SWEEPS = 60
"""Of Gauss-Seidel where a shot has several contacts at once: they converge to 1e-9 within."""


@dataclass(frozen=True)
class Give:
    """How a pair of surfaces yields: direct stiffness [1/s^2] and damping [1/s], and the impedance over the depth."""

    stiffness: float
    damping: float
    touch: float
    full: float
    width_m: float
    middle: float = 0.5
    power: float = 2.0

    def impedance(self, depth: Floats) -> Floats:
        """Between `touch` and `full`: two powers that meet at `middle` of the width."""
        x = np.clip(depth / self.width_m, 0.0, 1.0)
        low = x**self.power / self.middle ** (self.power - 1)
        high = 1 - (1 - x) ** self.power / (1 - self.middle) ** (self.power - 1)
        return np.asarray(self.touch + np.where(x <= self.middle, low, high) * (self.full - self.touch))

    def reference(self, depth: Floats, closing: Floats) -> Floats:
        """Acceleration of separation that the contact aims at [m/s^2]."""
        stiffness = self.stiffness / self.full**2 * self.impedance(depth)
        return np.asarray(stiffness * depth + self.damping / self.full * closing)


def mean(a: Give, b: Give) -> Give:
    """What two surfaces make of a contact: the mean of each number."""
    pairs = zip(vars(a).values(), vars(b).values(), strict=True)
    return Give(*(0.5 * (x + y) for x, y in pairs))


def forces(inverse: Floats, softness: Floats, lacking: Floats, touching: Floats) -> Floats:
    """(S, C) normal forces of C contacts in S shots, none negative.

    Args:
        inverse: (S, C, C) acceleration of separation of each contact for a unit force in each [1/kg].
        softness: (S, C) what the contacts give beyond that [1/kg].
        lacking: (S, C) reference acceleration less the one without contacts [m/s^2].
        touching: (S, C) 1 where there is contact.
    """
    own = np.einsum("scc->sc", inverse) + softness
    alone = np.maximum(lacking / own, 0.0) * touching
    for shot in np.flatnonzero(touching.sum(axis=1) > 1):
        active = np.flatnonzero(touching[shot])
        matrix = inverse[shot][np.ix_(active, active)] + np.diag(softness[shot, active])
        alone[shot, active] = _projected(matrix, lacking[shot, active])
    return np.asarray(alone)


def _projected(matrix: Floats, aim: Floats) -> Floats:
    force = np.zeros(len(aim))
    for _ in range(_SWEEPS):
        for i in range(len(aim)):
            force[i] = max(0.0, force[i] + (aim[i] - matrix[i] @ force) / matrix[i, i])
    return force


def march(rate: Callable[[float, Floats], Floats], state: Floats, duration_s: float, step_s: float) -> Floats:
    """(T + 1, S, n) states of S shots from (S, n), by the classical fourth-order Runge-Kutta rule in equal steps."""
    count = round(duration_s / step_s)
    out = np.empty((count + 1, *state.shape))
    out[0] = state
    for i in range(count):
        time = i * step_s
        k1 = rate(time, state)
        k2 = rate(time + 0.5 * step_s, state + 0.5 * step_s * k1)
        k3 = rate(time + 0.5 * step_s, state + 0.5 * step_s * k2)
        k4 = rate(time + step_s, state + step_s * k3)
        state = state + step_s / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        out[i + 1] = state
    return out


def at(path: Floats, step_s: float, time_s: Floats) -> Floats:
    """(F, n) states of one shot (T + 1, n) at (F,) moments, along straight lines; before the start it stands still."""
    place = np.clip(time_s / step_s, 0.0, len(path) - 1.0)
    below = np.minimum(place.astype(int), len(path) - 2)
    share = (place - below)[:, None]
    return np.asarray((1 - share) * path[below] + share * path[below + 1])
