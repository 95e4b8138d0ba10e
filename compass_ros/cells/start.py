"""How an episode begins, where no shot command says it: the first state of each object, measured or left free.

Each number of a first state is an input of the cell beside the action's fields. Its standard deviation is what the fit
may move it by, in each episode anew; 0 keeps it as it was measured. An orientation is moved by a
small rotation vector.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass as validated
from scipy.spatial.transform import Rotation
from scipy.special import chdtri

from compass_ros.cells.series import Name
from compass_ros.cells.signals import Signal
from compass_ros.errors import DataError
from compass_ros.types import Episode, Floats, Quantity, Track

STATE: Mapping[Quantity, tuple[str, ...]] = {
    "joint": ("angle", "rate"),
    "xy": ("x", "y", "vx", "vy"),
    "xyz": ("x", "y", "z", "vx", "vy", "vz"),
    "position": ("x", "y", "z", "vx", "vy", "vz"),
    "pose": ("x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"),
}
"""Numbers of a first state [m, m/s, rad, rad/s]; w: angular velocity in the body's frame, as MuJoCo has it. Of a signal
of joints: all angles, then all rates."""
TURN = ("rx", "ry", "rz")
"""Rotation vector [rad] in the body's frame, after the first orientation of a pose; 0 as measured."""
_GROUPS: Mapping[str, tuple[str, ...]] = {
    "position": ("x", "y", "z", "angle"),
    "velocity": ("vx", "vy", "vz", "rate"),
    "orientation": TURN,
    "rate": ("wx", "wy", "wz"),
}
_UNIT = ("qw", "qx", "qy", "qz")
"""Numbers of an orientation: it is moved by a rotation vector instead."""
_NS = 1e-9
CHANCE = 1e-3
"""Probability with which noise alone scatters frames about a polynomial by more than it may: of a hundred first states
hardly one is taken for one that no polynomial goes through."""
FORM = 2.0
"""Error of a first state where no polynomial goes through the frames, in what they show of it: of oscillations up to
8 Hz in frames at 60 Hz the root mean square is 0.6 to 2.3 of that, with 5, 6 and 9 frames."""
Deviation = Annotated[float, Field(ge=0)]


@validated(frozen=True, config=ConfigDict(extra="forbid"), kw_only=True)
class StartSpec:
    """Where the first state of an object comes from, and how far it may be wrong."""

    object: Name
    velocity: Literal["track", "rest"] = "track"
    """Where the recording states no first velocity: from the first frames of the track, or zero."""
    frames: int = Field(default=6, ge=2)
    """Frames of the track from which a first velocity is taken. Six show what a parabola gets wrong."""
    noise: Mapping[Literal["position", "velocity", "orientation", "rate"], Deviation] | None = None
    """Standard deviation of the first position [m or rad], velocity [m/s or rad/s], orientation [rad], rate [rad/s].
    What is not named, or None: as exact as the frames from which it was read say; what the recording states is exact. A
    mapping without any: all of it is exact."""


@validated(frozen=True, config=ConfigDict(extra="forbid"), kw_only=True)
class ReleaseSpec:
    """When the motion begins, after the start of the recording; until then everything stands as it starts."""

    default_s: float = 0.0
    noise_s: Deviation = 0.0


def input_names(spec: StartSpec, signal: Signal) -> tuple[str, ...]:
    """Names of an object's inputs: its state, then the rotation vector of a pose."""
    return tuple(f"{spec.object}.{name}" for name in _names(signal))


def input_std(spec: StartSpec, signal: Signal) -> tuple[float, ...]:
    """Standard deviation of each of these inputs; NaN where the recording says it (`stated_error`, or a window)."""
    given: Mapping[str, float] = dict(spec.noise or {})  # type: ignore[arg-type]
    unsaid = 0.0 if spec.noise == {} else math.nan
    of_name = {name: given.get(group, unsaid) for group, names in _GROUPS.items() for name in names}
    return tuple(float(of_name.get(name.rpartition(".")[2], 0.0)) for name in _names(signal))


def state_names(signal: Signal) -> tuple[str, ...]:
    """Numbers of the first state of what a signal tracks."""
    if signal.quantity == "joint_position":
        return tuple(f"{joint}.{what}" for what in STATE["joint"] for joint in signal.numbers)
    return STATE[signal.quantity]


def positions_in_state(signal: Signal) -> int:
    """How many of them are positions; they come first."""
    return 7 if signal.quantity == "pose" else signal.size


def _names(signal: Signal) -> tuple[str, ...]:
    return state_names(signal) + (TURN if signal.quantity == "pose" else ())


def first_state(spec: StartSpec, signal: Signal, episode: Episode) -> Floats:
    """The inputs of an object at the start of an episode.

    What the recording states as initial state goes first; what it leaves out comes from the track. Raises DataError.
    """
    stated = np.array(episode.initial_state.get(spec.object, ()), float)
    names = state_names(signal)
    size, moving = len(names), positions_in_state(signal)
    if len(stated) not in (0, moving, size):
        raise DataError(
            f"{episode.source or episode.name}: initial state of {spec.object}: expected {moving} or {size} numbers "
            f"({', '.join(names)}), found {len(stated)}"
        )
    state = stated if len(stated) == size else _from_track(spec, signal.quantity, episode, stated)
    if signal.quantity == "pose":
        state[3:7] = _unit(state[3:7], spec, episode)
    return np.concatenate([state, np.zeros(len(TURN) if signal.quantity == "pose" else 0)])


def _unit(quaternion: Floats, spec: StartSpec, episode: Episode) -> Floats:
    """Of length one, with a positive scalar part."""
    length = float(np.linalg.norm(quaternion))
    if length < 1e-6:
        where = f"{episode.source or episode.name}: initial state of {spec.object}"
        raise DataError(f"{where}: no orientation in {quaternion}")
    return np.asarray(quaternion / (length if quaternion[0] >= 0 else -length))


def _from_track(spec: StartSpec, quantity: Quantity, episode: Episode, stated: Floats) -> Floats:
    """First state from the first frames: the line through them, or the parabola where there are at least five."""
    time, value = _beginning(spec, episode)
    linear = value[:, :3] if quantity == "pose" else value
    fit = _through(time, linear, _numbers(time))
    at_rest = spec.velocity == "rest"
    first = np.concatenate([linear[0] if at_rest else fit[0], value[0, linear.shape[1] :]])
    position = stated if len(stated) else first
    velocity = np.zeros(linear.shape[1]) if at_rest else fit[1]
    rate = np.zeros(0)
    if quantity == "pose":
        rate = np.zeros(3) if at_rest else _angular_velocity(time, value[:, 3:])
    return np.concatenate([position, velocity, rate])


def _beginning(spec: StartSpec, episode: Episode) -> tuple[Floats, Floats]:
    """(n,) times [s] and (n, D) values of the first frames. Raises DataError where there are none."""
    known = {track.object: track for track in episode.tracks}
    if spec.object not in known:
        raise DataError(f"{episode.source or episode.name}: no initial state and no track of {spec.object}")
    track: Track = known[spec.object]
    after = np.flatnonzero(track.stamp_ns >= episode.start_ns)[: spec.frames]
    if len(after) < 2:
        raise DataError(f"{episode.source or episode.name}: fewer than 2 frames of {spec.object} after the start")
    return (track.stamp_ns[after] - episode.start_ns) * _NS, track.value[after]


def _numbers(time: Floats) -> int:
    """Coefficients of the polynomial through so many first frames: a line's, from five on a parabola's."""
    return 3 if len(time) >= 5 else 2


def _through(time: Floats, value: Floats, numbers: int) -> Floats:
    """(numbers, D) coefficients of the polynomial in time through (n, D) values, by least squares."""
    return np.asarray(np.linalg.lstsq(np.vander(time, numbers, increasing=True), value, rcond=None)[0])


def stated_error(spec: StartSpec, signal: Signal, episode: Episode, noise: float) -> Floats:
    """(A,) error of the first state that a recording says, beside what the cell states; zero where it states the state.

    noise: of a number of the track [m or rad].
    """
    if len(episode.initial_state.get(spec.object, ())) == len(state_names(signal)):
        return np.zeros(len(_names(signal)))
    unsaid = np.isnan(input_std(spec, signal))
    form, read = (of(spec, signal, episode, noise) for of in (_form_error, _read_error))
    return np.where(unsaid, np.hypot(form, read), form)


def _read_error(spec: StartSpec, signal: Signal, episode: Episode, noise: float) -> Floats:
    """(A,) error of the first state by the noise of the frames; numbers of a quaternion are half angles."""
    time, _ = _beginning(spec, episode)
    position, velocity = noise * _gain(time)
    slope = np.linalg.pinv((time - time[0])[:, None])[0]  # of what each frame is turned from the first, which errs too
    rate = 2 * noise * math.hypot(np.linalg.norm(slope), np.sum(slope))
    at_rest = spec.velocity == "rest"
    if episode.initial_state.get(spec.object):
        position = turn = 0.0
    else:
        position, turn = noise if at_rest else position, 2 * noise
    if at_rest:
        velocity = rate = 0.0
    of_group = {"position": position, "velocity": velocity, "orientation": turn, "rate": rate}
    of_name = {name: of_group[group] for group, names in _GROUPS.items() for name in names}
    return np.array([of_name.get(name.rpartition(".")[2], 0.0) for name in _names(signal)])


def _gain(time: Floats) -> Floats:
    """(2,) standard deviation of the polynomial's first two coefficients by a unit of noise in each frame."""
    weights = np.linalg.pinv(np.vander(time, _numbers(time), increasing=True))[:2]
    return np.asarray(np.linalg.norm(weights, axis=1))


def _form_error(spec: StartSpec, signal: Signal, episode: Episode, noise: float) -> Floats:
    """(A,) error of the first state that a track says: no motion is a parabola.

    What a cubic through the same frames says differently, of six or more. Where the scatter about the parabola is no
    noise, FORM times that or what the scatter does to the coefficients (Birge 1932). Of a rate that is taken for
    steady, what one that changes says differently.
    """
    out = np.zeros(len(_names(signal)))
    if spec.velocity == "rest":
        return out
    time, value = _beginning(spec, episode)
    linear, numbers = value[:, :3] if signal.quantity == "pose" else value, _numbers(time)
    fit, free = _through(time, linear, numbers), max(len(time) - numbers, 1)
    scatter = np.sum((linear - np.vander(time, numbers, increasing=True) @ fit) ** 2, axis=0) / free
    cubic = np.abs(_through(time, linear, 4)[:2] - fit[:2]) if len(time) >= 5 else np.zeros_like(fit[:2])
    of_scatter = _gain(time)[:, None] * np.sqrt(scatter)
    none = scatter > noise**2 * chdtri(free, CHANCE) / free  # (d,) where no polynomial goes through
    error = np.where(none, FORM * np.maximum(cubic, of_scatter), cubic if len(time) >= 6 else 0.0)
    first, size = positions_in_state(signal), linear.shape[1]
    out[:size] = 0.0 if episode.initial_state.get(spec.object) else error[0]
    out[first : first + size] = error[1]
    if signal.quantity == "pose" and len(time) >= 5:
        out[first + size : first + size + 3] = np.abs(np.subtract(*_angular_velocities(time, value[:, 3:])))
    return out


def _angular_velocity(time: Floats, quaternion: Floats) -> Floats:
    """(3,) rate in the body's frame [rad/s] by least squares over the rotation from the first frame."""
    return _angular_velocities(time, quaternion)[0]


def _angular_velocities(time: Floats, quaternion: Floats) -> tuple[Floats, Floats]:
    """(3,) of a turn that is steady, and of one that changes steadily."""
    rotation = Rotation.from_quat(quaternion[:, [1, 2, 3, 0]])
    turned = (rotation[0].inv() * rotation).as_rotvec()
    since = time - time[0]
    changing = np.linalg.lstsq(np.stack([since, since**2], axis=1), turned, rcond=None)[0]
    return np.asarray(since @ turned / np.sum(since**2)), np.asarray(changing[0])
