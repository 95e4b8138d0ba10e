"""What arms are told to do, or from where they are let go.

Waves: finite Fourier series from rest, Swevers, Ganseman, Tukel, De Schutter and Van Brussel, Optimal robot
excitation and identification, IEEE Transactions on Robotics and Automation 13(5), 1997. Moves: from point to point
with least jerk, Flash and Hogan, The coordination of arm movements, Journal of Neuroscience 5(7), 1985, with rests
between.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from compass_ros.types import Floats
from compass_ros.worlds.arms.motion import STEP_S, Drive

EPISODES = 12
RATE_HZ = 100.0
BEFORE_S = 1.5
"""The arm stands at its first command this long before it is recorded."""
AFTER_S = 0.1
"""Played beyond the last frame, for clocks that are slow."""
STILL_S = 0.2
"""A recording begins at rest."""


@dataclass(frozen=True)
class Range:
    """Where a joint is moved."""

    middle: float
    """Half-width of where its middle may be [rad]."""
    reach: float
    """Half-width of the motion around it [rad], at most."""


def sessions(rng: Generator, count: int = EPISODES) -> Floats:
    """(E,) when each recording begins: one to three minutes after the one before [s]."""
    return np.concatenate([[0.0], np.cumsum(rng.uniform(60, 180, count - 1))])


def let_go(ranges: list[Range], seconds: float, rng: Generator) -> Drive:
    """Poses at rest, at least half of the reach away from hanging down."""
    reach = np.array([r.reach for r in ranges])
    shares = rng.uniform(0.5, 1, (EPISODES, len(ranges))) * rng.choice([-1, 1], (EPISODES, len(ranges)))
    return Drive(None, reach * shares, 0.05, seconds + AFTER_S, RATE_HZ, sessions(rng))


def commands(ranges: list[Range], seconds: float, rng: Generator) -> tuple[Floats, Floats]:
    """(n,) times from 0 [s] and (E, n, J) targets [rad], at RATE_HZ; half of the recordings are waves, half moves."""
    time = np.arange(round(seconds * RATE_HZ) + 1) / RATE_HZ
    out = np.zeros((EPISODES, len(time), len(ranges)))
    kinds = rng.permutation(np.arange(EPISODES) % 2)
    for e, kind in enumerate(kinds):
        for j, own in enumerate(ranges):
            shape = waves if kind else moves
            out[e, :, j] = rng.uniform(-own.middle, own.middle) + own.reach * rng.uniform(0.4, 1) * shape(time, rng)
    return time, out


def waves(time: Floats, rng: Generator) -> Floats:
    """(n,) within -1 and 1, four frequencies of 0.1 to 0.8 Hz, swelling from rest within a second."""
    orders = rng.choice(np.arange(1, 9), 4, replace=False)
    series = np.sin(0.2 * np.pi * np.outer(time, orders) + rng.uniform(0, 2 * np.pi, 4))
    total = (series / np.sqrt(orders)).sum(axis=1)
    swell = np.clip((time - STILL_S) / 1.0, 0, 1)
    return np.asarray(total / np.abs(total).max() * swell**2 * (3 - 2 * swell))


def moves(time: Floats, rng: Generator) -> Floats:
    """(n,) within -1 and 1, moves of 0.6 to 1.6 s with rests of 0.2 to 0.8 s, from zero."""
    out, here, at = np.zeros_like(time), 0.0, STILL_S
    while at < time[-1]:
        there, long = float(rng.uniform(-1, 1)), float(rng.uniform(0.6, 1.6))
        share = np.clip((time - at) / long, 0, 1)
        out[time >= at] = (here + (there - here) * share**3 * (10 - 15 * share + 6 * share**2))[time >= at]
        here, at = there, at + long + float(rng.uniform(0.2, 0.8))
    return out


def driven(time: Floats, targets: Floats, delay: float, linear: bool, rng: Generator) -> Drive:
    """What the servos are told: the mean of the held commands over each step, `delay` later."""
    seconds = float(time[-1])
    steps = round((BEFORE_S + seconds + AFTER_S) / STEP_S) + 1
    edges = np.arange(steps + 1) * STEP_S - BEFORE_S - delay
    told = np.empty((len(targets), steps, targets.shape[2]))
    known = np.concatenate([[edges[0] - 1], time, [edges[-1] + 1]])
    for e, target in enumerate(targets):
        for j, own in enumerate(target.T):
            if linear:
                told[e, :, j] = np.interp(0.5 * (edges[1:] + edges[:-1]), time, own)
            else:
                held = np.concatenate([own[:1], own])
                area = np.concatenate([[0.0], np.cumsum(held * np.diff(known))])
                told[e, :, j] = np.diff(np.interp(edges, known, area)) / STEP_S
    return Drive(told, targets[:, 0], BEFORE_S, seconds + AFTER_S, RATE_HZ, sessions(rng, len(targets)))
