"""Where a discrepancy sits: on which site, in which region, over the table's plane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.discovery.discrepancy import Free, spread
from compass_ros.discovery.evidence import evidences, log_sum
from compass_ros.discovery.maps import CELL_M, TableMap
from compass_ros.discovery.response import Response
from compass_ros.discovery.settings import FREE
from compass_ros.simulation.sites import JOINTS
from compass_ros.types import Floats, Region, Where

_HOLDS = 0.9
"""Share of the discrepancy's square that a region holds."""
_LABEL = "acceleration that the simulator lacks"


def whereabouts(response: Response, free: Free) -> Where:
    """Site and channel of a free discrepancy: the one site whose discrepancy has the highest evidence, or all."""
    if not free.of_forces:
        return Where("all", "all", "sensing")
    count = len(response.site_of)
    logs = []
    for chosen in (None, *range(len(response.sites))):
        on = np.zeros(len(response.unit))
        on[:count] = 1.0 if chosen is None else response.site_of == chosen
        found = evidences(response.tangent, [spread(response, s * on * response.unit) for s in FREE])
        logs.append(log_sum(np.array([f.log for f in found])))
    best = int(np.argmax(logs)) - 1
    name = response.sites[best].name if best >= 0 and len(response.sites) > 1 else "all"
    return Where(name, "free", "dynamics", _region(response, free))


def _planar(response: Response, free: Free) -> tuple[Floats, Floats]:
    """(n, 2) places of bodies in the plane at all moments, and the (n,) squared discrepancy there."""
    places, squares = [], []
    for n, site in enumerate(response.sites):
        own = np.flatnonzero(response.site_of == n)
        if site.kind not in JOINTS and len(own) == 2:
            places.append(response.states[:, :, n, :2].reshape(-1, 2))
            squares.append(np.sum(free.mean[:, :, own] ** 2, axis=2).ravel())
    if not places:
        return np.empty((0, 2)), np.empty(0)
    return np.concatenate(places), np.concatenate(squares)


def _region(response: Response, free: Free) -> Region | None:
    """A disc that holds most of the discrepancy, where it is smaller than half of where the bodies were; else none."""
    place, square = _planar(response, free)
    if not square.sum() > 0:
        return None
    centre = (square[:, None] * place).sum(axis=0) / square.sum()
    far = np.hypot(*(place - centre).T)
    order = np.argsort(far)
    inside = min(int(np.searchsorted(np.cumsum(square[order]), _HOLDS * square.sum())), len(far) - 1)
    radius = float(far[order][inside])
    return Region((float(centre[0]), float(centre[1])), radius) if np.mean(far <= radius) < 0.5 else None


def residual_map(response: Response, free: Free) -> TableMap | None:
    """Root mean square of the lacking acceleration over the plane; None where nothing slides in a plane."""
    place, square = _planar(response, free)
    if not len(square):
        return None
    cell = np.floor(place / CELL_M).astype(int)
    first, (columns, rows) = cell.min(axis=0), np.ptp(cell, axis=0) + 1
    at = (cell[:, 1] - first[1]) * columns + cell[:, 0] - first[0]
    count = np.bincount(at, minlength=rows * columns)
    total = np.bincount(at, square, minlength=rows * columns)
    value = np.where(count > 0, np.sqrt(total / np.maximum(count, 1)), np.nan).reshape(rows, columns)
    x, y = ((start + np.arange(n) + 0.5) * CELL_M for start, n in zip(first, (columns, rows), strict=True))
    return TableMap(_LABEL, "m/s^2", x, y, value)


def left_by(response: Response, free: Free) -> Free:
    """A free discrepancy whose mean is that of forces, whatever has the higher evidence: for a map."""
    if free.of_forces:
        return free
    solved = evidences(response.tangent, [spread(response, s * response.unit * response.forces) for s in FREE])
    best = max(solved, key=lambda s: s.log)
    return replace(free, mean=best.pushes.reshape(free.mean.shape), of_forces=True)
