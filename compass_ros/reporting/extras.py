"""What the report can draw beyond a `Result`. All of it is optional; the report is complete without."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from compass_ros.types import Floats


@dataclass(frozen=True)
class Shape:
    """A thing that stands still in the plane that is drawn, in the frame `table`."""

    kind: Literal["rectangle", "circle"]
    role: Literal["table", "obstacle", "goal"]
    centre_m: tuple[float, float]
    size_m: tuple[float, float]
    """Full extent along x and y; for a circle its diameter, twice."""


@dataclass(frozen=True)
class Scene:
    """What trajectories are drawn on."""

    shapes: tuple[Shape, ...] = ()
    radius_m: Mapping[str, float] = field(default_factory=dict)
    """Radius of the moving objects by name, to draw them to scale."""


@dataclass(frozen=True)
class Candidate:
    """One effect that discovery tried, kept or not."""

    name: str
    channel: str
    log_evidence: float
    """Over the model without any effect."""
    held_out_gain: float
    """Share of the excess held-out error that it removes."""
    kept: bool
    note: str = ""
    """Why it was kept or dropped, in a few words."""


@dataclass(frozen=True)
class ResidualMap:
    """A quantity over the table's plane, on a regular grid."""

    label: str
    unit: str
    x_m: Floats
    """(X,) centres of the cells."""
    y_m: Floats
    """(Y,) centres of the cells."""
    value: Floats
    """(Y, X); NaN where no recording passed."""


@dataclass(frozen=True)
class ReportExtras:
    """What a caller knows beyond the result."""

    command: str = ""
    """The command line that repeats this calibration."""
    scene: Scene | None = None
    candidates: tuple[Candidate, ...] = ()
    residual_before: ResidualMap | None = None
    """What the calibrated simulator leaves over; None: the mean distance is drawn instead."""
    residual_after: ResidualMap | None = None
    """What is left with the effects."""
    truth: Mapping[str, float] = field(default_factory=dict)
    """True values by parameter name, where somebody planted them."""
