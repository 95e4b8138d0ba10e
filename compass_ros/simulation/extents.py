"""How large a law can be on a body in space, between two bodies or on a signal: from what the recorded episodes show.

Bounds, steps and priors are shares of a body's own mass, extent, speed and acceleration, as those on joints are shares
of a joint's force (`sizes.py`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from compass_ros.simulation.site_kinds import DRIVES, JOINTS, PAIRS, SIGNALS, SiteKind
from compass_ros.simulation.sites import Site
from compass_ros.simulation.sizes import COMMAND_UNITS, MODEST, SAMPLES, DriveSize, JointSize, unit_joint
from compass_ros.types import Floats

SIGNAL_UNITS = ("rad", "m", "rad/s", "m/s", "N m", "N", "m/s^2", "1")
"""Of what is measured."""
NOISE_STEPS = 4.0
"""A body that stands still is taken to move by its noise in so small a part of an episode: slower is not seen."""


@dataclass(frozen=True)
class BodySize:
    """Of one body over recorded episodes, or of several that a law acts on alike."""

    kind: SiteKind
    mass: float
    """[kg]"""
    extent: float
    """Root mean square distance of its mass from its centre [m]."""
    speed: float
    """Root mean square [m/s]."""
    fastest: float
    """[m/s]."""
    spin: float
    """Root mean square [rad/s]; at least what would turn it by MODEST while it goes its extent."""
    acceleration: float
    """The larger of gravity and of what turns its speed within the spread of its places [m/s^2]."""
    centred: bool = False
    """Whether MuJoCo has compiled it as a body whose mass is at its origin, for good."""
    turns: bool = True
    """Whether its orientation is measured, and so what spin it has."""
    middle: tuple[float, float] = (0.0, 0.0)
    """Between the ends of its x and y in the world [m]."""
    reach: float = 1.0
    """The larger distance of an end from there; at least its extent [m]."""


@dataclass(frozen=True)
class PairSize:
    """Of two bodies over recorded episodes, or of those of two geoms."""

    kind: SiteKind
    mass: float
    """Reduced mass [kg]."""
    extent: float
    """The smaller of theirs [m]."""
    nearest: float
    """Least distance of their centres of mass [m]."""
    distance: float
    """Mean [m]."""
    acceleration: float
    """The larger of theirs [m/s^2]."""
    speed: float
    """Root mean square of both together [m/s]."""


@dataclass(frozen=True)
class SignalSize:
    """Of one signal, or of one of its numbers, over recorded episodes."""

    kind: SiteKind
    unit: str
    spread: float
    """Standard deviation of a number around its mean, the largest of them."""
    middle: tuple[float, ...] = ()
    """Of what a camera sees: between the ends of its x, y and z [m]; without z where all lies in one plane."""
    reach: float = 0.0
    """Of the same: the largest distance of an end from there [m]."""


Size = JointSize | DriveSize | BodySize | PairSize | SignalSize


@dataclass(frozen=True)
class Path:
    """Of one body in M moments of E episodes."""

    position: Floats
    """(M, 3) its centre of mass in the world [m]."""
    velocity: Floats
    """(M, 3) [m/s]."""
    spin: Floats
    """(M, 3) in the world [rad/s]."""


def paths(model: mujoco.MjModel, bodies: Sequence[str], states: Floats) -> dict[str, Path]:
    """Of bodies in (E, T, s) full states of episodes, at SAMPLES moments of each."""
    return along(model, bodies, states[:, np.unique(np.linspace(0, states.shape[1] - 1, SAMPLES).astype(int))])


def along(model: mujoco.MjModel, bodies: Sequence[str], states: Floats) -> dict[str, Path]:
    """Of bodies in (E, T, s) full states, at each of them."""
    data, moments = mujoco.MjData(model), states.reshape(-1, states.shape[2])
    rows = np.stack([list(_moment(model, data, bodies, state)) for state in moments])  # (M, N, 9)
    return {name: Path(rows[:, i, :3], rows[:, i, 3:6], rows[:, i, 6:]) for i, name in enumerate(bodies)}


def body_size(model: mujoco.MjModel, site: Site, path: Path, seconds: float, noise: float, turns: bool) -> BodySize:
    """Of a body that went along a path in episodes of so many seconds, seen with a noise [m], with its orientation or
    without."""
    body = model.body(site.name).id
    mass = float(model.body_mass[body])
    extent = float(np.sqrt(model.body_inertia[body].sum() / (2 * mass)))
    spread = float(np.hypot(np.linalg.norm(path.position.std(axis=0)), noise))
    speeds = np.linalg.norm(path.velocity, axis=1)
    speed = float(np.hypot(_rms(speeds), NOISE_STEPS * noise / seconds))
    spin = max(_rms(np.linalg.norm(path.spin, axis=1)), MODEST * speed / extent)
    acceleration = max(float(np.linalg.norm(model.opt.gravity)), speed**2 / spread)
    centred = bool(model.body_simple[body])
    low, high = path.position[:, :2].min(axis=0), path.position[:, :2].max(axis=0)
    middle, reach = (low + high) / 2, max(float((high - low).max()) / 2, extent)
    return BodySize(site.kind, mass, extent, speed, max(float(speeds.max()), speed), spin, acceleration, centred, turns,
                    (float(middle[0]), float(middle[1])), reach)  # fmt: skip


def pair_size(kind: SiteKind, one: tuple[BodySize, Path], other: tuple[BodySize, Path]) -> PairSize:
    """Of two bodies. What stands has infinite mass (and extent)."""
    (a, of_a), (b, of_b) = one, other
    apart = np.linalg.norm(of_b.position - of_a.position, axis=1)
    reduced = 1 / (1 / a.mass + 1 / b.mass)
    return PairSize(kind, reduced, min(a.extent, b.extent), float(apart.min()), float(apart.mean()),
                    max(a.acceleration, b.acceleration), float(np.hypot(a.speed, b.speed)))  # fmt: skip


def alike_pairs(sizes: Sequence[PairSize]) -> PairSize:
    """Of several pairs of one kind: means of what is finite in all of them, and the least distance."""
    rows = np.mean([(s.mass, s.extent, s.distance, s.acceleration, s.speed) for s in sizes], axis=0)
    mass, extent, distance, acceleration, speed = rows.tolist()
    return PairSize(sizes[0].kind, mass, extent, min(s.nearest for s in sizes), distance, acceleration, speed)


def signal_size(site: Site, measured: Floats) -> SignalSize:
    """Of one signal, or of one of its numbers, in (E, F, C) measured rows, NaN where nothing was."""
    return SignalSize(site.kind, site.units[0], float(np.nanstd(measured[..., list(site.columns)], axis=(0, 1)).max()))


def camera_size(sites: Sequence[Site], measured: Floats, noise: float) -> SignalSize:
    """Of all that a camera sees, in (E, F, C) measured rows; noise [m]: less than it nobody sees along z."""
    axes = [[s.columns[i] for s in sites if i < len(s.columns)] for i in range(3)]
    ends = [(np.nanmin(measured[..., own]), np.nanmax(measured[..., own])) for own in axes if own]
    half = [float(high - low) / 2 for low, high in ends]
    seen = 2 if len(ends) < 3 or 2 * half[2] < noise else 3
    middle = tuple(float(high + low) / 2 for low, high in ends[:seen])
    return SignalSize("camera", "m", max(half), middle, max(*half, noise))


def standing(model: mujoco.MjModel) -> BodySize:
    """A body that never moves, as one of a pair."""
    return BodySize("body", np.inf, np.inf, 0.0, 0.0, 0.0, float(np.linalg.norm(model.opt.gravity)))


def unit_body(centred: bool = False, turns: bool = True) -> BodySize:
    """A body whose every number is one: for the names and units of quantities."""
    return BodySize("body", 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, centred, turns)


def unit_pair(kind: SiteKind) -> PairSize:
    """The same of a pair."""
    return PairSize(kind, *6 * [1.0])


def unit_sizes(kind: SiteKind) -> tuple[Size, ...]:
    """The same of any site of a kind, in each unit that such a one can have; none where laws have one size there."""
    if kind in JOINTS:
        return (unit_joint(kind),)
    if kind in DRIVES:
        return tuple(DriveSize(kind, 1.0, unit) for unit in COMMAND_UNITS)
    if kind == "camera":
        return tuple(SignalSize(kind, "m", 1.0, axes * (0.0,), 1.0) for axes in (3, 2))
    if kind in SIGNALS:
        return tuple(SignalSize(kind, unit, 1.0) for unit in SIGNAL_UNITS)
    if kind in PAIRS:
        return (unit_pair(kind),)
    return (unit_body(), unit_body(centred=True), unit_body(turns=False)) if kind == "body" else ()


def _moment(model: mujoco.MjModel, data: mujoco.MjData, bodies: Sequence[str], state: Floats) -> Iterator[Floats]:
    """(9,) position, velocity and spin of each body in a state."""
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    moving = np.zeros(6)
    for name in bodies:
        body = model.body(name).id
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, moving, 0)
        centre = data.xipos if model.body_mass[body] else data.xpos
        yield np.concatenate([centre[body], moving[3:], moving[:3]])


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
