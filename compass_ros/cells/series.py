"""Time series of a cell: the inputs that drive it, the signals that it is compared with, and how long ones are cut."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass as validated

from compass_ros.errors import ConfigError
from compass_ros.types import NUMBERS, QUANTITY_SIZE, Quantity

_strict = ConfigDict(extra="forbid", allow_inf_nan=False)
Name = Annotated[str, Field(max_length=200)]
"""Short enough for a message."""
Numbers = float | tuple[float, ...]
"""One number for all, or one for each number of the series."""
ControllerPart = Literal["reference", "feedback", "output"]
"""Of a controller's state: what it was asked for, what it measured, what it put out."""
OF_JOINTS: frozenset[Quantity] = frozenset({"joint_position", "joint_velocity", "joint_effort"})
PLACES = ("joint_position", "position", "pose")
"""What a measured path can be told in."""
_MOST_MOCAP, _MOST_WRENCH = 7, 6


@validated(frozen=True, config=_strict, kw_only=True)
class InputSpec:
    """A recorded series that drives the simulation."""

    name: Name
    topic: Name = ""
    quantity: Literal[
        "joint_position", "joint_velocity", "joint_effort", "scalar", "pose", "twist", "wrench", "position"
    ]
    of: tuple[Name, ...] = ()
    """Joints by their names in the message; of a pose, twist or wrench the numbers that are used (`x`, `vz`, ...; all
    where it is empty); of scalars a name for each number, in their order. In messages of types that are not known,
    paths of numbers (`motors[2].q`)."""
    part: ControllerPart | None = None
    """Of a controller's state; None: the reference."""
    frame: Name = ""
    """Of several frames on one topic (`header.frame_id`); empty: the one with most messages."""
    to: Literal["ctrl", "qfrc", "mocap", "xfrc"] = "ctrl"
    """What they set: controls of actuators, forces on joints, the pose of a mocap body, a wrench on a body (at its
    centre of mass, in the world's axes)."""
    actuators: tuple[Name, ...] = ()
    """`ctrl`: actuators of the scene, where they have other names than `of`."""
    at: tuple[Name, ...] = ()
    """`qfrc`: joints of the scene, where they have other names than `of`; `mocap`, `xfrc`: the body."""
    hold: Literal["zero", "linear"] = "zero"
    """Between two stamps: the last value, or a straight line."""
    delay_s: Numbers = 0.0
    scale: Numbers = 1.0
    offset: Numbers = 0.0
    measured: bool = False
    """`ctrl`: it says where the joints of the actuators really were, and not what was asked for. The joints begin
    there, velocity drives are told how fast it changes, and no law of actuation acts on what follows it."""

    @property
    def numbers(self) -> tuple[str, ...]:
        """(D,) names of the numbers of a row."""
        return self.of or NUMBERS.get(self.quantity, ())

    @property
    def targets(self) -> tuple[str, ...]:
        """Names of what is driven in the scene."""
        return self.actuators or self.at or self.of


@validated(frozen=True, config=_strict, kw_only=True)
class SignalSpec:
    """A recorded series that the simulation is compared with."""

    name: Name
    topic: Name = ""
    quantity: Literal[
        "joint_position", "joint_velocity", "joint_effort", "position", "pose", "wrench", "gyro", "accelerometer"
    ]
    of: tuple[Name, ...] = ()
    """Joints by their names in the message; else the tracked frame's name (TF), where it is not the signal's own."""
    at: tuple[Name, ...] = ()
    """Joints, body (`position`, `pose`) or site (`wrench`, `gyro`, `accelerometer`) of the scene, where they have other
    names than `of` (without `of`: than the signal)."""
    part: ControllerPart | None = None
    """Of a controller's state; None: the feedback."""
    frame: Name = ""
    """Of several frames on one topic (`header.frame_id`); empty: the one with most messages."""
    noise: float | None = Field(None, gt=0)
    """One standard deviation of the sensor, in the unit of the quantity, where the recordings cannot say it."""
    step: float | None = Field(None, gt=0)
    """What the sensor counts in."""
    fitted: bool = True
    """False: shown and judged, but no parameter is fitted to it."""


@validated(frozen=True, config=_strict, kw_only=True)
class WindowSpec:
    """Long recordings are cut into windows, each with its own measured first state."""

    length_s: float = Field(gt=0)
    rate_hz: float = Field(100.0, gt=0)
    """Frames that are compared in a second, at most: of a faster sensor every n-th, since a Jacobian over 1 kHz for
    minutes does not fit into memory and neighbours in a few milliseconds say the same."""


def check_series(inputs: Sequence[InputSpec], signals: Sequence[SignalSpec], where: str) -> None:
    """Raises ConfigError where an input or a signal contradicts itself."""
    for one in inputs:
        _check_input(one, f"{where}: inputs: {one.name}")
    for signal in signals:
        _check_signal(signal, f"{where}: signals: {signal.name}")


def _check_input(one: InputSpec, here: str) -> None:
    if not one.numbers:
        raise ConfigError(f"{here}: of: missing; say which joints (or numbers) the {one.quantity} is of")
    _known_numbers(one.of, one.quantity, here)
    for what in ("delay_s", "scale", "offset"):
        given = getattr(one, what)
        if isinstance(given, tuple) and len(given) != len(one.numbers):
            raise ConfigError(f"{here}: {what}: expected 1 or {len(one.numbers)} numbers, found {len(given)}")
    if one.to in ("ctrl", "qfrc") and len(one.targets) != len(one.numbers):
        raise ConfigError(
            f"{here}: {len(one.numbers)} numbers ({', '.join(one.numbers)}) for {len(one.targets)} targets "
            f"({', '.join(one.targets)})"
        )
    if one.measured and (one.to != "ctrl" or one.quantity not in PLACES or one.hold != "linear"):
        raise ConfigError(f"{here}: measured: expected positions ({', '.join(PLACES)}), to ctrl, hold linear")
    if one.to in ("mocap", "xfrc"):
        expected = "pose" if one.to == "mocap" else "wrench"
        size = _MOST_MOCAP if one.to == "mocap" else _MOST_WRENCH
        if one.quantity not in (expected, "position") or len(one.numbers) not in (size, 3) or len(one.at) != 1:
            raise ConfigError(f"{here}: to {one.to}: expected a whole {expected} and `at: [BODY]`")


def _check_signal(signal: SignalSpec, here: str) -> None:
    if signal.quantity in OF_JOINTS and not signal.of:
        raise ConfigError(f"{here}: of: missing; say which joints")
    if signal.quantity in OF_JOINTS and signal.at and len(signal.at) != len(signal.of):
        raise ConfigError(f"{here}: at: expected {len(signal.of)} joints, found {len(signal.at)}")
    if signal.quantity not in OF_JOINTS and max(len(signal.of), len(signal.at)) > 1:
        raise ConfigError(f"{here}: a {signal.quantity} is of one thing, found {list(signal.of or signal.at)}")


def _known_numbers(of: tuple[str, ...], quantity: Quantity, here: str) -> None:
    known = NUMBERS.get(quantity)
    unknown = [name for name in of if known and name not in known]
    if known and unknown:
        raise ConfigError(f"{here}: of: a {quantity} has no {', '.join(unknown)}; it has {', '.join(known)}")


def size_of(quantity: Quantity, of: Sequence[str]) -> int:
    """Numbers in a row."""
    return len(of) if quantity in OF_JOINTS or quantity == "scalar" else QUANTITY_SIZE[quantity]
