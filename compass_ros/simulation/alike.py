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
    same = np.full(len(start), steps)
    out = np.empty((len(start), steps + 1, len(columns)))
    seen = states[:, :, columns]
    out[models] = seen

    def branch_off(rows: Ints, step: int) -> Ints:
        """Roll out from that step on. Returns the rows that had begun to differ before."""
        of = np.searchsorted(models, like[rows])
        begin = states[of, step] if step else start[rows]
        after = play(rows, begin, step)
        out[rows, :step], out[rows, step] = seen[of, :step], begin[:, columns]
        out[rows, step + 1 :] = after[:, :, columns]
        equal = (after[:, STRIDE - 1 :: STRIDE] == states[of, step + STRIDE :: STRIDE]).all(axis=2)
        until_then = step + STRIDE * np.logical_and.accumulate(equal, axis=1).sum(axis=1)
        same[rows] = np.where(equal.all(axis=1), steps, until_then)
        return rows[same[rows] == step] if step else rows[:0]

    others = np.setdiff1d(np.arange(len(start)), models)
    begin = np.minimum(until[others], steps - 1) // GRID * GRID
    late = [branch_off(rows, int(step)) for step in np.unique(begin) for rows in _parts(others[begin == step], most)]
    for rows in _parts(np.concatenate([others[:0], *late]), most):
        branch_off(rows, 0)
    return out, same


def _parts(rows: Ints, most: int) -> list[Ints]:
    return [rows[i : i + most] for i in range(0, len(rows), most)]
