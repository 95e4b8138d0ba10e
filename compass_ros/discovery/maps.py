"""What is left over as a push on the objects: where on the table, before a law was added and after."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.discovery.response import Response
from compass_ros.simulation.site_kinds import PLANAR
from compass_ros.types import Floats

CELL_M = 0.05
"""Side of a cell of the map."""
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


def in_plane(response: Response, pushes: Floats) -> tuple[Floats, Floats]:
    """(n, 2) places [m] of all bodies in the plane at all moments, and (n,) size of (E, K, S) pushes there [m/s^2]."""
    places, sizes = [], []
    for n, site in enumerate(response.sites):
        if site.kind in PLANAR:
            places.append(response.states[:, :, n, :2].reshape(-1, 2))
            sizes.append(np.linalg.norm(pushes[:, :, np.flatnonzero(response.site_of == n)], axis=2).ravel())
    return np.concatenate([np.empty((0, 2)), *places]), np.concatenate([np.empty(0), *sizes])


def table_map(response: Response, pushes: Floats) -> TableMap | None:
    """Root mean square of the lacking acceleration over the table; None where nothing slides in the plane.

    `pushes`: (E, K, S) posterior mean of a discrepancy.
    """
    place, size = in_plane(response, pushes)
    if not len(place):
        return None
    cell = np.floor(place / CELL_M).astype(int)
    first, (columns, rows) = cell.min(axis=0), np.ptp(cell, axis=0) + 1
    at = (cell[:, 1] - first[1]) * columns + cell[:, 0] - first[0]
    count = np.bincount(at, minlength=rows * columns)
    total = np.bincount(at, size**2, minlength=rows * columns)
    value = np.where(count > 0, np.sqrt(total / np.maximum(count, 1)), np.nan).reshape(rows, columns)
    x, y = ((start + np.arange(n) + 0.5) * CELL_M for start, n in zip(first, (columns, rows), strict=True))
    return TableMap(_LABEL, "m/s^2", x, y, value)
