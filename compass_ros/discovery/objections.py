"""What speaks against recordings as an answer to what is missing: a slow camera, few shots, shots that are alike."""

from __future__ import annotations

import numpy as np

from compass_ros.cells import Cell
from compass_ros.errors import DataError
from compass_ros.types import Floats

REFUSED_HZ, SLOW_HZ = 25.0, 30.0
REFUSED_SHOTS, FEW_SHOTS = 3, 8
SAME, ALIKE = 0.01, 0.05
"""Distance of two commands, in parts of what the robot can do: the same shot again; hardly another one."""


def frame_rate(time_s: Floats) -> float:
    """Frames a second, as is usual in (E, F) times [s]; 0 where none has two. Short ones repeat their last time."""
    steps = np.diff(time_s, axis=1)
    return 1 / float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0


def objections(cell: Cell, inputs: Floats, rate_hz: float, touching: bool = True) -> tuple[str, ...]:
    """What speaks against (E, A) shots recorded at a rate, as warnings. Raises DataError where they cannot answer.

    `touching`: things of the scene can touch; where they cannot, the rate is no objection.
    """
    if touching and rate_hz < REFUSED_HZ:
        raise DataError(
            f"{rate_hz:.3g} frames a second are too slow: contacts last less than a frame, and parameters come out "
            f"40-56 % wrong at 15; expected {REFUSED_HZ:g} or more"
        )
    out = []
    if touching and rate_hz < SLOW_HZ:
        out.append(f"{rate_hz:.3g} frames a second are few; {SLOW_HZ:g} or more show contacts")
    shots = "shots" if cell.action else "episodes"
    if len(inputs) < REFUSED_SHOTS:
        raise DataError(f"{len(inputs)} {shots} are too few: expected {REFUSED_SHOTS} or more, better {FEW_SHOTS}")
    if len(inputs) < FEW_SHOTS:
        out.append(
            f"{len(inputs)} {shots} are few: with less than {FEW_SHOTS} hardly any is left to check a verdict on"
        )
    out.extend(_alike(cell, inputs))
    return tuple(out)


def _alike(cell: Cell, inputs: Floats) -> list[str]:
    fields = len(cell.action)
    if not fields:
        return []
    span = np.diff(cell.reach, axis=1)[:, 0]
    apart = np.abs(inputs[:, None, :fields] - inputs[None, :, :fields]) / span
    far = apart.max(axis=2) + np.diag(np.full(len(inputs), np.inf))
    if np.all(apart.max(axis=2) < SAME):
        raise DataError("all shots are the same: nothing tells what depends on speed, place or direction")
    twice = int(np.sum(far.min(axis=1) < ALIKE))
    if 2 * twice > len(inputs):
        return [f"{twice} of {len(inputs)} shots have another one that differs by less than {ALIKE:.0%} of the reach"]
    narrow = [a.name for a, wide in zip(cell.action, apart.max(axis=(0, 1)) < ALIKE, strict=True) if wide]
    return [f"the shots are alike in {', '.join(narrow)}: what depends on it stays unseen"] if narrow else []
