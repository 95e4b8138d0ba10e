"""The search for a law's shapes (a centre, a radius, a frequency) where a gain is cheap to ask."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from compass_ros.simulation.effects import Quantity
from compass_ros.types import Floats

APART = 0.1
"""How far off another shape is, as a share of a range."""


def best_shapes(
    quantities: Sequence[Quantity],
    gain: Callable[[Floats], float],
    starts: int,
    evaluations: int,
    smooth: bool = False,
) -> list[Floats]:
    """(q,) shapes that gain most, each in its neighbourhood, the best first; zeros for amplitudes.

    A grid, then simplexes from `starts` points of which no two are neighbours in the grid: they lead to different
    places. `evaluations`: of each simplex, for each shape. `smooth`: the gain has slopes, which lead on where there are
    more shapes than a simplex can turn about.
    """
    begun_at = np.array([0.0 if q.amplitude else q.start for q in quantities])
    shape_of = [i for i, q in enumerate(quantities) if not q.amplitude and q.grid != 1]
    if not shape_of:
        return [begun_at]

    def at(point: Floats) -> Floats:
        shapes = begun_at.copy()
        shapes[shape_of] = point
        return shapes

    def fall(point: Floats) -> float:
        return -gain(at(point))

    grids = [np.clip(shape_grid(quantities[i]), quantities[i].low, quantities[i].high) for i in shape_of]
    nodes = np.array(list(product(*(range(len(grid)) for grid in grids))))
    points = np.array(list(product(*grids)))
    falls = np.array([fall(point) for point in points])
    begun: list[int] = []
    for i in np.argsort(falls, kind="stable"):
        if len(begun) < starts and all(np.abs(nodes[i] - nodes[k]).max() > 1 for k in begun):
            begun.append(int(i))
    low, high = np.array([(quantities[i].low, quantities[i].high) for i in shape_of]).T
    wide = high - low
    bounds = np.stack([low, high], axis=1) / wide[:, None]
    options = {"maxfev": evaluations * len(shape_of), "xatol": 1e-4, "fatol": 1e-2}
    on_grids = all(quantities[i].grid for i in shape_of)

    def corners(begins: Floats) -> dict[str, Floats]:
        near = np.array([0.5 * (grid[1] - grid[0]) for grid in grids]) / wide
        return {"initial_simplex": np.vstack([begins, begins + np.diag(near)])}

    def down(point: Floats) -> OptimizeResult:
        """In shares of the ranges: where all shapes are searched on grids, from a simplex within these."""
        begins = point / wide
        if smooth:
            found = minimize(lambda x: fall(x * wide), begins, method="L-BFGS-B", bounds=bounds)
        else:
            found = minimize(
                lambda x: fall(x * wide),
                begins,
                method="Nelder-Mead",
                bounds=bounds,
                options=options | (corners(begins) if on_grids else {}),
            )
        return OptimizeResult(x=found.x * wide, fun=found.fun)

    found = [down(points[i]) for i in begun]
    apart = APART * wide
    best: list[Floats] = []
    for one in sorted(found, key=lambda one: float(one.fun)):
        if all(np.any(np.abs(one.x - other) > apart) for other in best):
            best.append(one.x)
    return [at(point) for point in best]


def shape_grid(shape: Quantity) -> Floats:
    """Where a search begins: a shape's own grid; places evenly, sizes and rates in equal ratios, a tail at one."""
    low, high = shape.low, shape.high
    if shape.grid:
        return np.linspace(low, high, shape.grid)
    if shape.name == "tail":
        return np.array([shape.start])
    if low < 0 < high:
        return np.linspace(0.85 * low, 0.85 * high, 9 if high - low > 0.6 else 5)
    return np.geomspace(max(low, 0.02 * high), 0.8 * high, 12 if shape.name == "frequency" else 4)
