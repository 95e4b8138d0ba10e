"""What is measured, in one form: objects and signals of the YAML as columns of an observation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.cells.series import OF_JOINTS, ControllerPart, SignalSpec, size_of
from compass_ros.types import NUMBERS, Quantity, Track

POSITIONS: frozenset[Quantity] = frozenset({"xy", "xyz", "position", "pose", "joint", "joint_position"})
"""Quantities that say where something is: a first state can come from them."""


@dataclass(frozen=True)
class Signal:
    """One object or signal, and its columns."""

    name: str
    quantity: Quantity
    topic: str
    of: tuple[str, ...]
    """What a message calls it: joints, or one frame; empty: the signal's own name."""
    at: tuple[str, ...]
    """Elements of the scene: joints, or one body or site."""
    first: int
    """First column of an observation."""
    noise: float | None = None
    step: float | None = None
    fitted: bool = True
    frame: str = ""
    """Frame of its positions in the bags; empty: the one with most messages."""
    part: ControllerPart | None = None
    """Which part of a controller's state."""

    @property
    def jointed(self) -> bool:
        """Whether its numbers are of joints, one each."""
        return self.quantity in OF_JOINTS or self.quantity == "joint"

    @property
    def size(self) -> int:
        return size_of(self.quantity, self.at)

    @property
    def columns(self) -> slice:
        return slice(self.first, self.first + self.size)

    @property
    def together(self) -> tuple[tuple[int, ...], ...]:
        """Columns that say together where one thing is: of joints each alone."""
        columns = tuple(range(self.first, self.first + self.size))
        return tuple((column,) for column in columns) if self.jointed else (columns,)

    @property
    def numbers(self) -> tuple[str, ...]:
        """(D,) what its numbers are called."""
        return self.of or self.at if self.jointed else NUMBERS[self.quantity]

    @property
    def places(self) -> bool:
        """Whether it says where something is."""
        return self.quantity in POSITIONS

    @property
    def filmed(self) -> bool:
        """Whether a camera sees it: where a body is."""
        return self.places and not self.jointed


def of_object(name: str, quantity: Quantity, body: str, topic: str, frame: str, first: int) -> Signal:
    """An object of the short form."""
    return Signal(name, quantity, topic, (), (body or name,), first, frame=frame)


def of_spec(spec: SignalSpec, first: int) -> Signal:
    """A signal of the YAML."""
    at = spec.at or spec.of or (spec.name,)
    own = (spec.noise, spec.step, spec.fitted, spec.frame, spec.part)
    return Signal(spec.name, spec.quantity, spec.topic, spec.of, at, first, *own)


def turned(tracks: Sequence[Track]) -> bool:
    """Whether the orientations of poses ever differ: what tracks positions alone often writes the identity."""
    return bool(np.ptp(np.concatenate([track.value[:, 3:] for track in tracks]), axis=0).any())
