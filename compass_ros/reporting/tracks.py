"""What the numbers of a drawn track are: coordinates of a place, or a signal's numbers, each with its unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from compass_ros.reporting.numbers import unit_text
from compass_ros.types import NUMBERS, Quantity, ReplayedTrack, Result

QUANTITY: Mapping[tuple[str, int], Quantity] = {
    ("rad/s", 3): "gyro",
    ("m/s^2", 3): "accelerometer",
    ("N", 6): "wrench",
}
"""What a signal of several numbers is, by the unit of its first one and how many there are."""
SECOND_HALF: Mapping[Quantity, str] = {"wrench": "N m"}
"""Unit of the last three numbers."""


@dataclass(frozen=True)
class Column:
    """One number of a signal over time."""

    name: str
    unit: str
    """As people write it; empty: none, or not known."""


@dataclass(frozen=True)
class Drawn:
    """How one track is drawn."""

    columns: tuple[Column, ...]
    """(D,) of a signal; empty: the track is where something is, and is drawn in a plane."""
    thousandth: str
    """Unit of a thousandth of its errors."""
    floor: float
    """Error that noise alone would leave, in the track's unit; NaN: not known."""


def drawn(track: ReplayedTrack, result: Result) -> Drawn:
    """How a track of a result is drawn. What the result says no unit of is a place, or a joint as its other ones."""
    size = track.real.shape[1]
    unit, floor = _said(result).get(track.object, ("", result.noise_floor_m))
    pooled = result.unit if result.unit in ("m", "rad") else ""
    of_errors = unit or pooled or result.unit
    thousandth = "10⁻³" if of_errors == "1" else f"m{unit_text(of_errors)}"
    placed = size >= 2 and unit in ("m", "")
    return Drawn(() if placed else _columns(track.object, size, unit or pooled), thousandth, floor)


def _said(result: Result) -> dict[str, tuple[str, float]]:
    """Unit and noise floor by signal, and by `signal.joint`."""
    parts = result.gap.get("nominal", {})
    gap = parts.get("held_out") or parts.get("fit")
    signals = gap.signals if gap is not None else {}
    joints = {f"{name}.{part}": one for name, one in signals.items() for part in one.parts}
    return {name: (one.unit, one.floor) for name, one in {**signals, **joints}.items()}


def _columns(name: str, size: int, unit: str) -> tuple[Column, ...]:
    if size == 1:
        return (Column(name, unit_text(unit)),)
    quantity = QUANTITY.get((unit, size))
    if quantity is None:
        return tuple(Column(f"{name} {i + 1}", unit_text(unit)) for i in range(size))
    second = SECOND_HALF.get(quantity, unit)
    return tuple(
        Column(f"{name} {number}", unit_text(unit if i < 3 else second)) for i, number in enumerate(NUMBERS[quantity])
    )
