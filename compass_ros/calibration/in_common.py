"""What several bodies that one camera sees do at the same moment is no noise of theirs: a mast that sways moves all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import chdtri

from compass_ros.types import Floats, Ints

Bodies = Sequence[Sequence[int]]
"""Columns of the place of each of several bodies."""
LEVEL = 0.999
"""Of the test that bodies have nothing in common, a setting: one camera in a thousand that stands still is taken to
sway. That costs it little: a regression by chance on k columns in n moments takes k / 2n of sigma, 1 % of the two other
columns in 100 still frames."""


def of_its_own(values: Floats, bodies: Bodies, correlation: float = 0.0, apart: int = 1) -> Floats:
    """(E, T, C) deviations less what those of the other bodies predict at the same moment, where they predict anything.

    `correlation`: of neighbouring moments, an AR(1) process; two such processes seem to have
    something in common by chance, their innovations do not. `apart`: moments from one that is independent to the next.
    """
    columns = [c for body in bodies for c in body]
    if len(bodies) < 2:
        return values
    innovations = values[:, 1:] - correlation * values[:, :-1]
    body_of = np.array([i for i, body in enumerate(bodies) for _ in body])
    if not _in_common(_complete(innovations[:, ::apart, columns]), body_of):
        return values
    out = values.copy()
    for body in bodies:
        others = [c for c in columns if c not in body]
        rows = _complete(values[:, :, [*body, *others]])
        predicted, *_ = np.linalg.lstsq(rows[:, len(body) :], rows[:, : len(body)], rcond=None)
        out[:, :, list(body)] -= values[:, :, others] @ predicted
    return out


def _complete(values: Floats) -> Floats:
    """(n, c) the moments of all episodes at which each column was seen."""
    rows = values.reshape(-1, values.shape[2])
    return np.asarray(rows[~np.isnan(rows).any(axis=1)])


def _in_common(rows: Floats, body: Ints) -> bool:
    """Whether (n, c) columns of different bodies correlate: n r^2 of independent ones is chi-square of one degree."""
    spread = rows.std(axis=0) if len(rows) else np.zeros(rows.shape[1])
    if len(rows) <= rows.shape[1] + 1 or not spread.all():
        return False
    between = np.corrcoef(rows.T)[np.not_equal.outer(body, body)]  # each pair twice
    return bool(len(rows) * np.sum(between**2) / 2 > chdtri(len(between) / 2, 1 - LEVEL))
