"""A field of a scene that could be a parameter, and the two usual ways to bound one."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Candidate:
    """A field that could be a parameter."""

    name: str
    """object@type@field"""
    field: str
    of: str
    value: float
    low: float
    high: float
    half_width: float
    unit: str


def around(name: str, field: str, of: str, value: float, reach: float, width: float, unit: str) -> Candidate:
    return Candidate(name, field, of, value, value - reach, value + reach, width, unit)


def times(name: str, field: str, of: str, value: float, share: float, width: float, unit: str) -> Candidate:
    """Bounds and half width as shares of the value; a value of zero stays small."""
    size = abs(value) or 1e-6
    return Candidate(name, field, of, value, value - share * size, value + share * size, width * size, unit)


def from_zero(name: str, field: str, of: str, value: float, scale: float, unit: str) -> Candidate:
    """What cannot be negative and is often left out of a scene."""
    width = max(0.2 * value, scale, 1e-9)
    return Candidate(name, field, of, value, 0.0, value + 10 * width, width, unit)
