"""Motions for identification: finite Fourier series of each driven joint, from rest to rest in a posture.

Fourier series after Swevers et al., IEEE Transactions on Robotics and Automation 13(5), 1997: smooth, with few
frequencies, below those of the structure. An envelope lets each begin and end at rest. Limits are kept by construction
where the series itself says what is asked (position, speed, commanded force), and by rehearsal in the simulator where
it does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.simulation.driven import Asked, Driven, asked
from compass_ros.types import Bools, Floats

RATE_HZ = 100.0
"""Of the series: what drivers of arms take at least."""
HARMONICS = 3
"""From one period a motion to FASTEST_HZ; slow ones show friction and gravity, fast ones inertia."""
FASTEST_HZ = 1.0
"""Closed loops of robots have bandwidths of some hertz."""
ROOM, POSTURES = 0.95, 0.8
"""Shares of the way to the end of a joint's range: for motions, and for the postures around which they go."""
EFFORT = 0.8
"""Share of a drive's force that is asked for at the scene's own values, which may well be a fifth wrong."""
OVER = 1.1
"""How much faster than its target a joint may be for a moment: servos overshoot."""
_RISE_S = 0.8
"""How long the envelope takes to open: a tenth of a window, at most a fifth of it."""
_SHRINKS = 8
"""How often a motion is made smaller that asks too much in the simulator: by what it asked, within these shares."""
_SHRINK = (0.3, 0.95)


@dataclass(frozen=True)
class Limits:
    """What motions keep to, for D joints."""

    low: Floats
    high: Floats
    """(D,) [rad or m]."""
    speed: Floats
    """(D,) [rad/s or m/s]."""
    effort: Floats
    """(D,) [N m or N]; infinite: none."""


@dataclass(frozen=True)
class Motions:
    """B motions of D joints in F frames."""

    time_s: Floats
    """(F,)"""
    posture: Floats
    """(B, D) in which each begins and ends [rad or m]."""
    series: Floats
    """(B, F, D) of the cell's input."""
    sound: Bools
    """(B,) whether the simulator keeps to the limits and touches nothing."""


def limits(driven: Driven, speed: float, effort: float = np.inf) -> Limits:
    """Of the scene, with `speed` for all joints [rad/s or m/s] and at most `effort` [N m or N].

    Raises ConfigError where a slide has no range, or a commanded force no limit.
    """
    free = np.isinf(driven.low) | np.isinf(driven.high)
    slides = [
        name for name, unit, open_ in zip(driven.joints, driven.units, free, strict=True) if open_ and unit == "m"
    ]
    if slides:
        raise ConfigError(f"{', '.join(slides)}: no range in the scene; expected one to plan motions in")
    low = np.where(np.isinf(driven.low), driven.home - np.pi, driven.low)
    high = np.where(np.isinf(driven.high), driven.home + np.pi, driven.high)
    most = np.minimum(driven.effort, effort)
    unlimited = [name for name, one in zip(driven.joints, most, strict=True) if np.isinf(one)]
    if driven.spec.quantity == "joint_effort" and unlimited:
        raise ConfigError(f"{', '.join(unlimited)}: no largest force in the scene; say one with --effort")
    return Limits(low, high, np.full(len(low), speed), most)


def size(driven: Driven) -> int:
    """Numbers that say a motion: a posture, and sine and cosine of each harmonic, for each joint."""
    return len(driven.joints) * (1 + 2 * HARMONICS)


def motions(simulator: Simulator, driven: Driven, within: Limits, seconds: float, numbers: Floats) -> Motions:
    """Motions from (B, size) numbers, normally distributed ones giving all that there are.

    Each joint goes as far as its limits let it, around the posture in which its motion begins and ends. A posture of 0
    is home.
    """
    time = np.arange(round(seconds * RATE_HZ) + 1) / RATE_HZ
    chosen = numbers.reshape(len(numbers), -1, len(driven.joints))
    posture = _posture(driven, within, chosen[:, 0])
    shapes = _shapes(time, chosen[:, 1:])
    scale, sound = np.ones(len(shapes)), np.zeros(len(shapes), bool)
    series = _series(driven, within, time, posture, shapes, scale)
    for _ in range(_SHRINKS):
        left = np.flatnonzero(~sound)
        shown = asked(simulator, driven, time, series[left], posture[left])
        excess = _excess(driven, within, shown)
        sound[left] = ~shown.touches & (excess <= 1)
        if sound.all():
            break
        left, shrink = np.flatnonzero(~sound), np.clip(1 / excess[~sound[left]], *_SHRINK)
        scale[left] *= shrink
        posture[left] = driven.home + shrink[:, None] * (posture[left] - driven.home)
        series[left] = _series(driven, within, time, posture[left], shapes[left], scale[left])
    return Motions(time, posture, series, sound)


def _posture(driven: Driven, within: Limits, numbers: Floats) -> Floats:
    """(B, D) of numbers whose normal distribution fills the room to both sides of home evenly.

    A commanded force holds no posture: its motions begin at home.
    """
    if driven.spec.quantity == "joint_effort":
        return np.tile(driven.home, (len(numbers), 1))
    share = POSTURES * (2 * ndtr(numbers) - 1)
    room = np.where(share > 0, within.high - driven.home, driven.home - within.low)
    return np.asarray(driven.home + share * room)


def _shapes(time: Floats, numbers: Floats) -> Floats:
    """(B, F, D) of (B, 2 H, D) numbers; 0 at both ends, with its first two derivatives."""
    length = time[-1]
    orders = np.linspace(1, max(FASTEST_HZ * length, 1), HARMONICS)
    turns = 2 * np.pi * np.outer(time, orders) / length
    basis = np.concatenate([np.sin(turns), np.cos(turns)], axis=1)
    rise = np.clip(np.minimum(time, length - time) / min(_RISE_S, 0.2 * length), 0, 1)
    envelope = rise**3 * (10 - 15 * rise + 6 * rise**2)
    return np.asarray(envelope[:, None] * np.einsum("fh,bhd->bfd", basis, numbers))


def _series(driven: Driven, within: Limits, time: Floats, posture: Floats, shapes: Floats, scale: Floats) -> Floats:
    """(B, F, D) of the input: each shape as large as position and speed, or the commanded force, allow."""
    if driven.spec.quantity == "joint_effort":
        largest = np.maximum(np.abs(shapes).max(axis=1, keepdims=True), 1e-12)
        return np.asarray(scale[:, None, None] * shapes / largest * EFFORT * within.effort / np.abs(driven.force))
    up, down = ROOM * (within.high - posture), ROOM * (posture - within.low)
    rates = np.gradient(shapes, time, axis=1)
    shares = [shapes.max(axis=1) / up, -shapes.min(axis=1) / down, np.abs(rates).max(axis=1) / within.speed]
    scaled = (scale[:, None] / np.maximum(np.max(shares, axis=0), 1e-12))[:, None]
    moved = scaled * shapes + posture[:, None]
    return np.asarray(moved if driven.spec.quantity == "joint_position" else scaled * rates)


def _excess(driven: Driven, within: Limits, shown: Asked) -> Floats:
    """(B,) the largest share of a limit that a motion takes in the simulator."""
    middle, half = 0.5 * (within.low + within.high), 0.5 * (within.high - within.low)
    position, speed = np.abs(shown.position - middle) / half, np.abs(shown.speed) / (OVER * within.speed)
    effort = np.abs(shown.effort) / (EFFORT * within.effort)
    shares = [position, speed] if driven.spec.quantity == "joint_effort" else [position, speed, effort]
    return np.asarray(np.nan_to_num(np.max(shares, axis=0), nan=np.inf).max(axis=(1, 2)))
