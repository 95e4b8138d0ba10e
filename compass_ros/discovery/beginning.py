"""Effects screened on the beginning of the episodes, where the plain simulator has only begun to fail.

What is missing bends a trajectory a little at first; some collisions later a fit without it is somewhere else, and what
a first-order argument says there means nothing. The beginning names candidates and their sizes; the fit of each then
grows with the horizon, its effect inside from the start.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import Refined, growing, polish
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.joint import Joint, grown
from compass_ros.discovery.tangents import screen
from compass_ros.discovery.trials import TRIED, different, further, sketched, worth
from compass_ros.simulation import Simulator

POOR = 4.0
"""Mean squared residual of a plain fit from which nothing near it is of use."""
BEGUN = 1.3
"""Mean squared residual, over the noise's, at which a simulator has begun to fail."""
SLIGHT = 2.0
"""Log likelihood that a further step of these first fits must promise."""
FEW = 2
"""Candidates that are followed to the end."""


def from_the_beginning(simulator: Simulator, refined: Refined, asked: Sequence[Candidate]) -> Iterator[Joint]:
    """Models of one effect that explain the beginning, each fitted to the whole episodes; none for a fair fit."""
    likelihood, fit = refined.likelihood, refined.fit
    if 2 * fit.point.cost < POOR * likelihood.measurements:
        return
    failed = _where_it_fails(likelihood)
    if failed is None:
        return
    space, scores = screen(simulator, failed, asked)
    tried = sorted((further(j, SLIGHT, 4) for j in sketched(space, scores)[:TRIED]), key=worth)
    for joint in different(tried)[:FEW]:
        yield grown(joint, simulator, likelihood, fit.robust)


def _where_it_fails(likelihood: Likelihood) -> Refined | None:
    """The plain fit to the shortest beginning that it does not explain; None where it explains all of them."""
    noise = np.broadcast_to(likelihood.sigma.min(axis=(0, 1)), likelihood.sigma.shape)
    plain = replace(likelihood, sigma=noise.copy())
    for part, fit in growing(plain, likelihood.prior_mean):
        if 2 * fit.point.cost > BEGUN * part.measurements:
            there = polish(part, fit.point)
            if there.chi_square > BEGUN:
                return there
    return None
