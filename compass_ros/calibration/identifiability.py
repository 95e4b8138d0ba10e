"""Which parameters the recordings tell alone, and which only together.

A posterior that is narrower than its prior is no proof: of a pendulum's mass, damping and dry friction only the ratios
show, and the prior of each then narrows the two others. The answer of such a parameter moves with the guesses that the
others began with. So each is asked once more with wider guesses for all others: what the recordings say stays, what was
inherited goes.

Covariances are those of the parameters at the fit, in the standard deviations of their priors, whose own is then 1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse.csgraph import connected_components

from compass_ros.types import Bools, Floats, Ints, Parameter, Together, Told

IDENTIFIED = 0.5
"""A parameter is identified where the recordings shrink its prior width at least to this share."""
WIDER = 10.0
"""Factor on the prior widths of the others. Widths are guesses from a datasheet's 10 % to a textbook's order of
magnitude. The three numbers of the free pendulum stand at 0.96 and more of their own width then (0.33 to 0.80 before),
those that the shipped bags tell at 0.002 to 0.44."""
_LINKED = 0.1
"""Correlation along the open directions from which two parameters are of one group: among N that add up it is
1 / (N - 1)."""
_OF_LARGEST = 0.05
"""A direction that moves the parameters of a group by less, beside the largest, is another group's."""
_ALIKE = 0.98
"""Cosine between relative changes along an open direction and equal ones, from which it is a common factor."""

UNSEEN = 0.9
"""Share of its prior width above which the recordings are said not to show a parameter at all."""


def told(covariance: Floats, values: Floats, parameters: Sequence[Parameter]) -> Told:
    """From the (p, p) covariance of all parameters at (p,) values."""
    identified = alone(covariance) < IDENTIFIED
    groups = together(covariance, identified, values, parameters)
    grouped = {name for group in groups for name in group.parameters}
    unseen = np.sqrt(np.diag(covariance)) > UNSEEN
    rest = [(p.name, hidden) for p, known, hidden in zip(parameters, identified, unseen, strict=True) if not known]
    return Told(
        alone=tuple(p.name for p, known in zip(parameters, identified, strict=True) if known),
        together=groups,
        weakly=tuple(name for name, hidden in rest if name not in grouped and not hidden),
        not_at_all=tuple(name for name, hidden in rest if name not in grouped and hidden),
    )


def information(changes: Floats, of_start: Floats) -> Floats:
    """(E, n, n) products of the changes of E episodes by n numbers, without what their first states could do instead.

    (E, m, n) changes of m measurements [sigma] by one prior width of each number; (E, m, l) by one standard deviation
    of what is free in each episode. Schur complement, the prior of the first states included, that of the n not.
    """
    both = changes.transpose(0, 2, 1)
    cross = of_start.transpose(0, 2, 1) @ changes
    inner = of_start.transpose(0, 2, 1) @ of_start + np.eye(of_start.shape[2])
    return np.asarray(both @ changes - cross.transpose(0, 2, 1) @ np.linalg.solve(inner, cross))


def alone(covariance: Floats, coupled: Floats | float = 1.0) -> Floats:
    """(p,) standard deviation of each parameter with the prior of all others WIDER, from a (p, p) covariance.

    `coupled`: (p,) factors by which parameters that are not among these make them less certain (`screen.coupling`).
    """
    own = np.diag(_widened(covariance)) * coupled**2
    return np.asarray(np.sqrt(own / (1 + (1 - WIDER**-2) * own)))  # its own prior back (Sherman and Morrison 1950)


def _widened(covariance: Floats) -> Floats:
    """(p, p) covariance with all priors WIDER."""
    return np.asarray(np.linalg.inv(np.linalg.inv(covariance) - (1 - WIDER**-2) * np.eye(len(covariance))))


def together(
    covariance: Floats, identified: Bools, values: Floats, parameters: Sequence[Parameter]
) -> tuple[Together, ...]:
    """Groups of parameters that are told only together; all (p,), `values` in their units.

    Of a group are those that the recordings do not tell alone, and would tell very well if the others were known: by
    WIDER better than is asked of one that is identified. Weak ones that are only blurred by others stay out: on the
    shipped bags, shapes would be told to 0.06 to 0.5 of their widths, the pendulum's three numbers to 0.003.
    """
    if identified.all():
        return ()
    with_others_known = 1 / np.sqrt(np.diag(np.linalg.inv(covariance)))
    members = np.flatnonzero((with_others_known < IDENTIFIED / WIDER) & ~identified)
    variance, directions = np.linalg.eigh(_widened(covariance)[np.ix_(members, members)])
    directions = directions[:, variance > 1]  # not even as well known as one of them was before
    width = np.array([parameters[i].half_width for i in members])
    found = []
    for group in _linked(directions @ directions.T):
        names = tuple(parameters[i].name for i in members[group])
        moves = (directions * width[:, None])[group]
        found.append(Together(names, ratios=_scales(moves, values[members[group]])))
    return tuple(found)


def _linked(projection: Floats) -> list[Ints]:
    """Groups of at least two, connected where the (m, m) projection on the open directions connects them."""
    length = np.sqrt(np.maximum(np.diag(projection), 1e-12))
    _, label = connected_components(np.abs(projection) > _LINKED * np.outer(length, length), directed=False)
    groups = [np.flatnonzero(label == which) for which in dict.fromkeys(label.tolist())]
    return [group for group in groups if len(group) > 1]


def _scales(moves: Floats, values: Floats) -> bool:
    """Whether the open directions of a (g, d) group are one, a common factor: then all that shows are its ratios."""
    along, size, _ = np.linalg.svd(moves, full_matrices=False)
    if not values.all() or np.sum(size > _OF_LARGEST * size[0]) > 1:
        return False
    relative = along[:, 0] / values
    return bool(abs(relative.sum()) > _ALIKE * np.sqrt(len(relative)) * np.linalg.norm(relative))
