"""Where on the table simulator and recordings differ: mean distance by place, as a grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.errors import DataError
from compass_ros.operation.current import Residuals
from compass_ros.types import Floats

_MARGIN_M = 0.02
_MOST_CELLS = 250_000


@dataclass(frozen=True)
class MismatchMap:
    """Cell (0, 0) begins at `origin_m`; rows go along y, columns along x, as in nav_msgs/OccupancyGrid."""

    origin_m: tuple[float, float]
    size_m: float
    """Side of a cell [m]."""
    mean_m: Floats
    """(rows, columns) mean distance between recorded and simulated position [m]; NaN where no object was."""

    def percent(self, full_m: float) -> list[int]:
        """Row by row: -1 where nothing is known, else 0 to 100 for 0 to `full_m` [m]."""
        share = np.clip(self.mean_m / full_m, 0, 1)
        return [int(x) for x in np.where(np.isnan(share), -1, np.round(100 * np.nan_to_num(share))).ravel()]


def mismatch_map(residuals: Residuals, size_m: float = 0.02) -> MismatchMap:
    """Mean distance of all planar objects by the place where they were recorded.

    Raises DataError for a cell without planar objects, or for recordings that are spread over more than the grid holds.
    """
    places, distances = [], []
    for name in residuals.planar():
        measured, predicted = residuals.paths(name)
        seen = ~np.isnan(measured).any(axis=2)
        places.append(measured[seen])
        distances.append(np.linalg.norm(predicted[seen] - measured[seen], axis=1))
    if not places or not sum(map(len, places)):
        raise DataError(f"{residuals.cell.name}: no object with a place in the plane: there is no mismatch map")
    xy, distance = np.concatenate(places), np.concatenate(distances)
    low = np.floor((xy.min(axis=0) - _MARGIN_M) / size_m) * size_m
    columns, rows = (np.ceil((xy.max(axis=0) + _MARGIN_M - low) / size_m)).astype(int)
    if rows * columns > _MOST_CELLS:
        raise DataError(f"{residuals.cell.name}: recordings are spread over {rows} x {columns} cells of the map")
    column, row = np.floor((xy - low) / size_m).astype(int).T
    index = row * columns + column
    count = np.bincount(index, minlength=rows * columns)
    total = np.bincount(index, distance, minlength=rows * columns)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return MismatchMap((float(low[0]), float(low[1])), size_m, mean.reshape(rows, columns))
