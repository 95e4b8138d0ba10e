"""From a calibrated simulator to a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from compass_ros.simulation import Simulator
from compass_ros.types import Floats, Mismatch


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
    warnings: Sequence[str] = ()


def not_evaluated(reason: str) -> Discovery:
    """No verdict, said plainly."""
    return Discovery(Mismatch("not_evaluated", None, (), (), "", f"Missing physics was not looked for: {reason}."))


def discover(simulator, problem, estimate, judge, noise, report):
    return not_evaluated("pending")
