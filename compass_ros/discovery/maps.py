"""What is left over as a push on the objects: where on the table, before an effect was added and after."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.discovery.screen import Space
from compass_ros.types import Floats

CELL_M = 0.05
"""Side of a cell of the map."""
SCALES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
"""Sizes of a push that are weighed against each other by their evidence [m/s^2]."""
MEMORY_S = 0.2
"""Time over which a push is alike."""
_LABEL = "acceleration that the simulator lacks"


@dataclass(frozen=True)
class TableMap:
    """A quantity over the table's plane, on a regular grid."""

    label: str
    unit: str
    x_m: Floats
    """(X,) centres of the cells."""
    y_m: Floats
    """(Y,) centres of the cells."""
    value: Floats
    """(Y, X); NaN where no recording passed."""


def accelerations(space: Space, residual: Floats | None = None) -> Floats:
    """(E, K, N, 2) accelerations of bodies in the plane that would explain the residual best, smooth and small [m/s^2].

    `residual`: (E, F, C) in sigma, where it is not that of the fit. The parameters stay where they are. A Gaussian
    process in time as prior; its size is the one of SCALES with the highest evidence.
    """
    pushes = space.pushes
    episodes, moments, movers = pushes.paths.shape[:3]
    rest = space.residual if residual is None else (residual.reshape(episodes, -1) * space.weight).ravel()
    rest = rest.reshape(episodes, -1)
    response = pushes.response * space.weight[:, :, None]
    apart = (pushes.moments[:, None] - pushes.moments) / MEMORY_S
    smooth = np.linalg.cholesky(np.exp(-0.5 * apart**2) + 1e-3 * np.eye(moments))
    spread = np.kron(smooth, np.eye(2 * movers))  # whitened to accelerations of one unit
    shaped = response @ spread
    gram, pull = shaped.transpose(0, 2, 1) @ shaped, np.einsum("edh,ed->eh", shaped, rest)
    gram, pull = gram / space.likelihood.correlation_time, pull / space.likelihood.correlation_time
    size = max(SCALES, key=lambda scale: _log_evidence(scale**2 * gram, scale * pull))
    white = -np.linalg.solve(size**2 * gram + np.eye(gram.shape[1]), size * pull[:, :, None])[:, :, 0]
    return np.asarray((size * white @ spread.T).reshape(episodes, moments, movers, 2))


def _log_evidence(gram: Floats, pull: Floats) -> float:
    """Of a unit normal prior on the weights, up to a constant."""
    inner = gram + np.eye(gram.shape[1])
    solved = np.linalg.solve(inner, pull[:, :, None])[:, :, 0]
    return float(0.5 * np.sum(pull * solved) - 0.5 * np.sum(np.linalg.slogdet(inner)[1]))


def residual_map(space: Space, residual: Floats | None = None) -> TableMap | None:
    """Root mean square of the lacking acceleration over the table; None where nothing slides in the plane."""
    pushes = space.pushes
    slides = ~pushes.joints
    if not slides.any():
        return None
    push = accelerations(space, residual)[:, :, slides]
    squared = np.sum(push**2, axis=3).ravel()
    place = pushes.paths[:, :, slides, :2].reshape(-1, 2)
    cell = np.floor(place / CELL_M).astype(int)
    first, (columns, rows) = cell.min(axis=0), np.ptp(cell, axis=0) + 1
    at = (cell[:, 1] - first[1]) * columns + cell[:, 0] - first[0]
    count = np.bincount(at, minlength=rows * columns)
    total = np.bincount(at, squared, minlength=rows * columns)
    value = np.where(count > 0, np.sqrt(total / np.maximum(count, 1)), np.nan).reshape(rows, columns)
    x, y = ((start + np.arange(n) + 0.5) * CELL_M for start, n in zip(first, (columns, rows), strict=True))
    return TableMap(_LABEL, "m/s^2", x, y, value)
