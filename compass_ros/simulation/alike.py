"""Rollouts that repeat the beginning of others: only what comes after is simulated.

What a wall is made of does nothing before a puck touches it. A finite difference of such a parameter is the undisturbed
rollout until then, to the bit, and need not be simulated again.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from compass_ros.types import Floats, Ints

GRID = 64
"""Rollouts branch off at multiples of so many steps: rollouts of one length are played together."""
STRIDE = 16
"""States are compared at every so many steps."""

Play = Callable[[Ints, Floats, int], Floats]
"""(b,) rows, (b, s) their states after `step` steps, `step` -> (b, T - step, s) states after each further step."""


def roll_alike(
    play: Play, start: Floats, steps: int, columns: Ints, like: Ints, until: Ints, most: int
) -> tuple[Floats, Ints]:
    """(B, T + 1, n) columns of the states of T steps from (B, s) starts, at most `most` rows at a time.

    Row b is as row like[b] up to step until[b]; a row that others are like is like itself. Returned is also the (B,)
    step up to which each row was seen to be. A row that differs as soon as it is looked at had begun to differ before:
    it is rolled out from its start.
    """
    models = np.unique(like)
    states = np.concatenate([start[models, None], play(models, start[models], 0)], axis=1)
    out = np.empty((len(start), steps + 1, len(columns)))
    out[models] = states[:, :, columns]
    same = np.full(len(start), steps)
    others = np.setdiff1d(np.arange(len(start)), models)
    begin = np.minimum(until[others], steps - 1) // GRID * GRID
    todo = [(others[begin == step], int(step)) for step in np.unique(begin)]
    while todo:
        rows, step = todo.pop()
        rows, rest = rows[:most], rows[most:]
        if len(rest):
            todo.append((rest, step))
        known = states[np.searchsorted(models, like[rows])]
        known[:, 0] = start[rows]
        after = play(rows, known[:, step], step)
        out[rows] = np.concatenate([known[:, : step + 1, columns], after[:, :, columns]], axis=1)
        differs = (after[:, STRIDE - 1 :: STRIDE] != known[:, step + STRIDE :: STRIDE]).any(axis=2)
        ever = differs.any(axis=1)
        same[rows] = np.where(ever, step + STRIDE * differs.argmax(axis=1), steps) if differs.size else steps
        if step and (early := rows[ever & (same[rows] == step)]).size:
            todo.append((early, 0))
    return out, same
