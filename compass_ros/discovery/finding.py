"""What a search for missing physics hands back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from compass_ros.calibration.launches import with_launches
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise
from compass_ros.cells import Cell
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.maps import TableMap
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import rms_distance
from compass_ros.types import Floats, Mismatch


@dataclass(frozen=True)
class Tried:
    """One candidate for the report's ranking."""

    name: str
    channel: str
    log_evidence: float
    held_out_gain: float
    kept: bool
    note: str


@dataclass(frozen=True, eq=False)
class Weighed:
    """One explanation as a simulator, for those who want all of them."""

    probability: float
    simulator: Simulator
    values: Floats
    """(P + Q,)"""
    root: Floats
    """(P + Q, n) a square root of their covariance: values + root @ z, z standard normal, are as likely."""


@dataclass(frozen=True)
class Discovery:
    """The verdict, and the simulator with the effects inside where some were found."""

    mismatch: Mismatch
    simulator: Simulator | None = None
    values: Floats | None = None
    """(P + Q,) parameters and effects of that simulator."""
    parameters: Floats | None = None
    """(P,) the parameters, fitted together with the effects."""
    std: Floats | None = None
    """(P,) one standard deviation of the parameters."""
    effect_std: Floats | None = None
    """(P + Q,) one standard deviation of `values`."""
    tried: tuple[Tried, ...] = ()
    before: TableMap | None = None
    after: TableMap | None = None
    warnings: Sequence[str] = ()
    noise: Noise | None = None
    """With what the fit has shown of it, where that is more than the recordings alone did."""
    weighed: tuple[Weighed, ...] = ()
    """Explanations of known laws, and that nothing is missing, down to a hundredth of the probability."""
    open_sigma: float = 0.0
    """What error bars, of parameters and of laws that are named, leave open in held-out episodes, over the noise."""
    instead: Cell | None = None
    """The cell with other numerics, with which a calibration has to be done anew before anything is said."""
    rivals: tuple[Hypothesis, ...] = ()
    """The models between which an ambiguous verdict leaves the choice."""
    files: Mapping[str, str] = field(default_factory=dict)
    """By name, what a robot needs for the next experiment."""


def not_evaluated(reason: str) -> Discovery:
    """No verdict, said plainly."""
    return Discovery(Mismatch("not_evaluated", None, (), (), "", f"Missing physics was not looked for: {reason}."))


def fit_failed(reason: str, instead: Cell | None = None) -> Discovery:
    """No verdict, for a fit of the search went wrong."""
    mismatch = Mismatch("fit_failed", None, (), (), "", f"No verdict on missing physics: {reason}.")
    return Discovery(mismatch, instead=instead)


def data_bad(sentence: str) -> Discovery:
    """No verdict, for the recordings are wrong."""
    return Discovery(Mismatch("data_bad", None, (), (), "", sentence))


def held_out_error(cell: Cell, judged: Likelihood, values: Floats) -> float:
    """rms distance on held-out episodes [m or rad], each with the launch that agrees best with it."""
    inputs = judged.inputs + with_launches(judged, values).launch
    predicted = judged.predict(np.tile(values, (len(inputs), 1)), inputs, judged.time_s)
    return rms_distance(cell, judged.difference(predicted, judged.measured))
