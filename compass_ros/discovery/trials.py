"""Fits of candidates, cheap ones first: what two steps from the plain fit come to, and where that leads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from compass_ros.calibration.least_squares import minimise
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.joint import Joint, best_of, fit_jointly
from compass_ros.discovery.screen import Score, Space
from compass_ros.types import Bools

Named = TypeVar("Named", Candidate, Joint, Score)

SKETCHED = 2
"""Steps of a sketch."""
TRIED = 5
"""Sketches that are fitted at once, the best first; as many again where none of them is enough."""
RATIOS = (0.7, 1.0, 1.4, 2.0)
"""Frequencies that are tried, as parts of the one that first order finds..."""
RIVALS = 0.5
"""...if the effect gains this share of the best, to first order."""
PROMISING = 0.02
"""Least first-order gain, as a share of the best, to be sketched: of contacts it says little."""


def sketched(space: Space, scores: Sequence[Score]) -> list[Joint]:
    """Sketches of the fits of promising candidates, the best first.

    What the simulator says of two cheap steps orders candidates, and places of one, better than first order does.
    """
    return sorted(
        (
            min((fit_jointly(space, [shape], SKETCHED, anew=False) for shape in (s, *s.elsewhere)), key=worth)
            for s in _promising(scores)
        ),
        key=worth,
    )


def further(joint: Joint, slight: float, iterations: int) -> Joint:
    """A promising fit, continued while a step gains more than is `slight` [log likelihood]."""
    fit, tolerance = joint.fit, max(1.0, slight)
    fit = minimise(joint.likelihood, fit.point, fit.free, iterations, fit.robust, tolerance, fit.linear, fresh=False)
    return replace(joint, fit=fit)


def at_other_rates(space: Space, scores: Sequence[Score]) -> Joint | None:
    """The best of fits of the most promising candidate that has a frequency, at several, from the first guess.

    A wrong frequency looks right where the plain fit has bent its parameters to stand for the right one.
    """
    best = next((s for s in scores if _rates(s).any()), None)
    if best is None or best.gain < RIVALS * scores[0].gain:
        return None
    quantities = best.candidate.attached.effect.quantities
    low, high = ([getattr(q, side) for q in quantities] for side in ("low", "high"))
    tried = [np.clip(np.where(_rates(best), ratio, 1.0) * best.numbers, low, high) for ratio in RATIOS]
    return next(best_of(space, [((best.candidate.attached,), numbers) for numbers in tried], 1))


def _rates(score: Score) -> Bools:
    """(q,) which quantities are frequencies."""
    return np.array([q.unit == "Hz" for q in score.candidate.attached.effect.quantities])


def worth(joint: Joint) -> float:
    """Order of models: what they leave, and what their numbers cost (Laplace); smaller is better."""
    return -joint.log_evidence(joint.likelihood.correlation_time)


def different(ordered: Sequence[Named]) -> list[Named]:
    """The first, and so the best, of each name."""
    seen: dict[str, Named] = {}
    for one in ordered:
        seen.setdefault(one.name, one)
    return list(seen.values())


def _promising(scores: Sequence[Score]) -> list[Score]:
    """Of scores, the best first: the best objects of each name, and all together where that is almost as good."""
    best: dict[str, list[Score]] = {}
    for s in scores:
        best.setdefault(s.candidate.name, []).append(s)
    top = max((s[0].gain for s in best.values()), default=0.0)
    out = []
    for group in best.values():
        if group[0].gain < max(PROMISING * top, 1e-9):
            continue
        out.append(group[0])
        together = max(group, key=lambda s: len(s.candidate.attached.objects))
        if together is not group[0] and together.gain > 0.6 * group[0].gain:
            out.append(together)
    return out
