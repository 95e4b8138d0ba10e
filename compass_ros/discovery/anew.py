"""Effects of contacts, fitted from the cell's first guess.

Dampings, masses and friction stand for most of what an effect of contacts does. Where the plain fit has bent them for
it, first order knows nothing of the effect, and a fit from there stays where it is. From the first guess, with the
effect inside from the start, they never bend.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from compass_ros.discovery.joint import Joint, best_of
from compass_ros.discovery.screen import Score, Space
from compass_ros.types import Floats

KEPT = 3
"""Fits that are followed to the whole of it."""
SIZES = (0.1, 1.0)
"""What an effect begins with, in its scale or in what first order knows of it where that is more: with too much of it,
parameters bend against it before its size is found."""
WALLS = 2
"""Walls that are tried, those with the largest first-order gain: a wall's place is seen to first order."""


def contacts_anew(space: Space, scores: Sequence[Score]) -> Iterator[Joint]:
    """Fits of the effects of contacts that explain the first half of the episodes best, each made when it is asked for.

    `scores`: the best first.
    """
    of_contacts = [s for s in scores if s.candidate.attached.effect.channel == "contact"]
    of_walls = [s for s in of_contacts if s.candidate.attached.effect.on_walls]
    tried = [s for s in of_contacts if s not in of_walls[WALLS:]]
    starts = [((s.candidate.attached,), beginning(s, size)) for s in tried for size in SIZES]
    return best_of(space, starts, KEPT)


def beginning(score: Score, share: float) -> Floats:
    """(q,) numbers of some of an effect in the direction that first order knows; of its first amplitude if of none.

    To begin with none of it would leave its direction to chance: what an offset does at an impact is of second order.
    """
    quantities = score.candidate.attached.effect.quantities
    amplitude = np.array([q.amplitude for q in quantities])
    low, high, scale = (np.array([getattr(q, what) for q in quantities]) for what in ("low", "high", "scale"))
    size = float(np.linalg.norm((score.numbers / scale)[amplitude]))
    direction = score.numbers / scale / size if size > 0 else np.eye(len(quantities))[np.argmax(amplitude)]
    start = np.clip(share * max(size, 1.0) * direction * scale, low, high)
    return np.asarray(np.where(amplitude, start, score.numbers))
