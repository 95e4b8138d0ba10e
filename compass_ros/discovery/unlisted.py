"""Numbers of the scene that nobody listed and that act on what is tracked: each may be wrong.

Asked are those of the scene's own fields (`simulation.sites.NUMBERS`) that the cell's parameters do not write. What a
number does is told by inverse dynamics along the recorded motions (`simulation.balance`): one that does nothing there,
that parameters could make up for exactly, or that does the same as one before is left out. Of the others those that
could do most are asked, to bound what it costs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compass_ros.cells.auto import at_defaults, claimed, places
from compass_ros.simulation import Simulator
from compass_ros.simulation.balance import Change, law_written, values_written
from compass_ros.simulation.effects import Attached
from compass_ros.simulation.effects.parameter import deviates
from compass_ros.simulation.sites import Site
from compass_ros.simulation.visited import Visited
from compass_ros.types import Floats

MOST = 16
"""Numbers that are asked: a budget, for each is rolled out some times over all recordings."""
STEP = 1e-3
"""Of differences, in modest sizes and half widths: what is not linear stays below the next two."""
SAME = 1e-3
"""Sine of the angle below which two numbers do the same, and share that is left of one that others make up for: ten
times what such differences are off."""
ACTS = 1e-6
"""Share of the typical forces below which a number does nothing: rounding is 5e-13 of them (seven joints)."""


def unlisted(simulator: Simulator, values: Floats, visited: Visited) -> tuple[Attached, ...]:
    """The law `parameter` on each such number, for (P,) values. None where a cell writes more than its scene's fields.

    Of some that do the same the first is asked: what nobody can look up, of joints and drives, before what is drawn.
    """
    cell, dynamics = simulator.cell, simulator.physics.dynamics
    if cell.spec.dynamics != "mjcf":
        return ()
    scene = at_defaults(cell, dynamics)
    taken = claimed(cell, dynamics, scene)
    free = [s for s in simulator.places.numbers.values() if s.number and not places(scene, s.number, s.name) & taken]
    asked = [a for s in sorted(free, key=_order) if (a := _attached(s, simulator)) is not None]
    if not asked:
        return ()
    balance = visited.balance()
    moved = [balance.changed(_tuned(simulator, values, i)) for i in range(len(cell.parameters))]
    tuned = _basis(moved, balance.size)
    found: list[tuple[Attached, Floats]] = []
    for attached in asked:
        done = balance.changed(_deviating(attached, simulator)) / STEP
        own = done - tuned @ (tuned.T @ done)
        size = float(np.linalg.norm(own))
        if size > max(ACTS * np.sqrt(len(own)), SAME * float(np.linalg.norm(done))) and not _like(own, found):
            found.append((attached, own))
    return tuple(a for a, _ in sorted(found, key=lambda one: -float(np.linalg.norm(one[1])))[:MOST])


def _order(site: Site) -> int:
    field = site.number.field if site.number else ""
    return 0 if field.startswith(("dof_", "jnt_")) else 1 if field.startswith("servo_") else 2


def _attached(site: Site, simulator: Simulator) -> Attached | None:
    """The law on one number; None where it could not be another one."""
    if site.number is None:
        return None
    attached = Attached(deviates(site.number, simulator.places.model), (site.name,))
    (quantity,) = attached.effect.quantities
    return attached if quantity.low < 0 or quantity.high > 0 else None


def _tuned(simulator: Simulator, values: Floats, index: int) -> Change:
    """Writes one of the cell's parameters, a step off."""
    off = values.copy()
    off[index] += STEP * simulator.cell.parameters[index].half_width
    return values_written(simulator.physics.dynamics, off[: len(simulator.cell.parameters)])


def _deviating(attached: Attached, simulator: Simulator) -> Change:
    """Writes a number, a step off to where it can go."""
    (quantity,) = attached.effect.quantities
    step = STEP * quantity.scale * (1 if quantity.high > 0 else -1)
    return law_written(attached, np.array([step]), simulator.places)


def _basis(columns: Sequence[Floats], rows: int) -> Floats:
    """(R, n) orthonormal directions that span some of R numbers."""
    sizes = [float(np.linalg.norm(c)) for c in columns]
    acting = [c / size for c, size in zip(columns, sizes, strict=True) if size > STEP * ACTS * np.sqrt(len(c))]
    if not acting:
        return np.zeros((rows, 0))
    left, singular, _ = np.linalg.svd(np.stack(acting, axis=1), full_matrices=False)
    return np.asarray(left[:, singular > SAME * singular[0]])


def _like(own: Floats, found: Sequence[tuple[Attached, Floats]]) -> bool:
    """Whether a number does the same as one of some others."""
    return any(
        1 - abs(float(own @ other)) / float(np.linalg.norm(own) * np.linalg.norm(other)) < 0.5 * SAME**2
        for _, other in found
    )
