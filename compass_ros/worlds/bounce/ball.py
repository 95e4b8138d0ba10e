"""The ball of the cell `bouncing_ball` in its vertical plane: x, z, their rates, and a spin about y."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats
from compass_ros.worlds import soft
from compass_ros.worlds.soft import Give

STEP_S = 0.0005
MASS_KG = 0.057
"""Of the drawing; stiffness and damping of rubber hold for it, and count less for a heavier ball."""
SURFACES = ("table", "plate1", "plate2", "basket_left", "basket_right", "basket_floor")
_HALF_WIDTH = {"plate1": 0.08, "plate2": 0.12, "basket_floor": 0.065}
_HALF_HEIGHT = ("basket_left", "basket_right")
_PITCH = {"plate1": 0.35, "plate2": -0.15}
_PLACE = {"table": (0.0, 0.0), "basket_floor": (0.445, 0.03)}
"""Of the drawing [m, rad], where no parameter says it."""
_GIVE = Give(30000.0, 40.0, 0.01, 0.95, 0.02)


@dataclass(frozen=True)
class Boxes:
    """C bars across the plane: centres (C, 2) in x and z, half sizes (C, 2) along their own axes, turns (C,)."""

    centre: Floats
    half: Floats
    pitch: Floats

    def meet(self, place: Floats, radius: float) -> tuple[Floats, Floats]:
        """(S, C) depths of balls at (S, 2), negative apart, and (S, C, 2) the directions that part them."""
        c, s = np.cos(self.pitch), np.sin(self.pitch)
        x, z = np.moveaxis(place[:, None] - self.centre, 2, 0)
        local = np.stack([c * x - s * z, s * x + c * z], axis=2)
        away = local - np.clip(local, -self.half, self.half)
        distance = np.maximum(np.sqrt(np.sum(away**2, axis=2)), 1e-12)
        u, w = np.moveaxis(away / distance[:, :, None], 2, 0)
        return radius - distance, np.stack([c * u + s * w, -s * u + c * w], axis=2)


@dataclass(frozen=True)
class Contact:
    """Where the ball touches one surface, in S shots."""

    depth: Floats
    closing: Floats
    """Speed of approach of the ball's centre [m/s]."""
    slip: Floats
    """Of the ball's surface along the tangent (n_z, -n_x) [m/s]."""
    force: Floats
    """Normal force of the plain contact [N]."""


Extra = Callable[[Contact], Floats]
"""Further normal force [N] (S,)."""
Grip = Callable[[Contact, Floats], Floats]
"""Contact and total normal force -> force along the tangent (S,) [N]."""
Push = Callable[[float, Floats, Floats, Floats], Floats]
"""Time, place (S, 2), velocity (S, 2), spin (S,) -> force (S, 2) [N]."""


@dataclass(frozen=True)
class Loose:
    """A surface on a spring along its normal."""

    surface: str
    mass_kg: float
    stiffness: float
    damping: float


@dataclass(frozen=True)
class Physics:
    """What a world has beyond its cell."""

    extras: Mapping[str, tuple[Extra, ...]]
    """By surface."""
    grips: Mapping[str, Grip]
    pushes: tuple[Push, ...] = ()
    shape: float = 2 / 3
    """Moment of inertia over m r^2: a hollow ball."""
    loose: Loose | None = None


PLAIN = Physics({}, {})


@dataclass(frozen=True)
class Rig:
    """The cell with its true parameters."""

    values: Mapping[str, float]

    @property
    def mass(self) -> float:
        return self.values["ball@dyna@mass"]

    @property
    def radius(self) -> float:
        return self.values["ball@shape@radius"]

    def boxes(self) -> Boxes:
        return Boxes(*(np.array(part) for part in zip(*map(self._box, SURFACES), strict=True)))

    def _box(self, name: str) -> tuple[tuple[float, float], tuple[float, float], float]:
        """Centre, half sizes and pitch."""
        v = self.values
        x, z = (v.get(f"{name}@pose@{axis}", fall) for axis, fall in zip("xz", _PLACE.get(name, (0, 0)), strict=True))
        if name == "table":
            return (x, z - 1.0), (10.0, 1.0), v["table@pose@pitch"]
        thin = v[f"{name}@shape@half_thickness"]
        tall = v.get(f"{name}@shape@half_height", thin)
        half = (_HALF_WIDTH.get(name, thin), tall if name in _HALF_HEIGHT else thin)
        return (x, z), half, _PITCH.get(name, 0.0) + v[f"{name}@pose@pitch"]

    def give(self, name: str) -> Give:
        """Of ball and surface together."""
        return soft.mean(self._own("ball"), self._own(name))

    def _own(self, name: str) -> Give:
        v, heavier = self.values, MASS_KG / self.mass
        return Give(
            -v[f"{name}@dyna@stiffness"] * heavier,
            -v[f"{name}@dyna@damping"] * heavier,
            v[f"{name}@dyna@impedance"],
            v.get(f"{name}@dyna@impedance_full", _GIVE.full),
            v[f"{name}@dyna@impedance_width"],
            v[f"{name}@dyna@impedance_middle"],
            v[f"{name}@dyna@impedance_power"],
        )


def play(rig: Rig, heights: Floats, spins: Floats, duration_s: float, physics: Physics = PLAIN) -> Floats:
    """(T + 1, S, 7) x, z, their rates, spin, and place and rate of a loose plate along its normal, of S balls that are
    let go `heights` above the first plate."""
    v = rig.values
    first = np.zeros((len(heights), 7))
    first[:, 0] = -0.4 + v["release@actuation@offset_x"]
    first[:, 1] = 0.29 + heights + v["release@actuation@offset_z"]
    first[:, 2], first[:, 3] = v["release@actuation@velocity_x"], v["release@actuation@velocity_z"]
    first[:, 4] = spins
    return soft.march(motion(rig, physics), first, duration_s, STEP_S)


def motion(rig: Rig, physics: Physics) -> Callable[[float, Floats], Floats]:
    """Time and (S, 7) states -> their rates."""
    v, radius = rig.values, rig.radius
    inertia = rig.mass + v["ball@dyna@added_mass"]
    boxes, gives = rig.boxes(), [rig.give(name) for name in SURFACES]
    weight = np.array([0.0, v["env@dyna@gravity"] * rig.mass])
    wind = np.array([v["env@dyna@wind_x"], v["env@dyna@wind_z"]])
    area, density = np.pi * radius**2, v["env@dyna@air_density"]
    stokes = 6 * np.pi * v["env@dyna@air_viscosity"] * radius

    def rate(time: float, state: Floats) -> Floats:
        place, velocity, spin = state[:, :2], state[:, 2:4], state[:, 4]
        relative = velocity - wind
        speed = np.linalg.norm(relative, axis=1)[:, None]
        force = weight - (density * v["ball@dyna@drag"] * area * speed + stokes) * relative
        for push in physics.pushes:
            force = force + push(time, place, velocity, spin)
        met = boxes.meet(place, radius)
        pressed, turned, plate = _pressed(physics, met, gives, force, state, inertia, radius)
        moment = physics.shape * rig.mass * radius**2
        rest = np.stack([turned / moment, state[:, 6], plate], axis=1)
        return np.concatenate([velocity, (force + pressed) / inertia, rest], axis=1)

    return rate


def _pressed(
    physics: Physics,
    met: tuple[Floats, Floats],
    gives: list[Give],
    force: Floats,
    state: Floats,
    inertia: float,
    radius: float,
) -> tuple[Floats, Floats, Floats]:
    """(S, 2) force of all contacts, (S,) torque about y, (S,) acceleration of the loose plate."""
    velocity, loose = state[:, 2:4], physics.loose
    total, torque, plate = np.zeros_like(velocity), np.zeros(len(velocity)), np.zeros(len(velocity))
    depth, normal = met
    if loose is None and not (depth > 0).any():
        return total, torque, plate
    closing = -np.einsum("sck,sk->sc", normal, velocity)
    free = np.einsum("sck,sk->sc", normal, force) / inertia
    if loose is not None:
        c = SURFACES.index(loose.surface)
        plate = -(loose.stiffness * state[:, 5] + loose.damping * state[:, 6]) / loose.mass_kg
        depth[:, c] += state[:, 5]
        closing[:, c] += state[:, 6]
    touching = (depth > 0).astype(float)
    if not touching.any():
        return total, torque, plate
    impedance = np.stack([g.impedance(depth[:, c]) for c, g in enumerate(gives)], axis=1)
    aim = np.stack([g.reference(depth[:, c], closing[:, c]) for c, g in enumerate(gives)], axis=1)
    inverse = np.einsum("sck,sdk->scd", normal, normal) / inertia
    plain = soft.forces(inverse, (1 - impedance) / impedance / inertia, aim - free, touching)
    for c, name in enumerate(SURFACES):
        if not touching[:, c].any():
            continue
        n = normal[:, c]
        along = np.stack([n[:, 1], -n[:, 0]], axis=1)
        slip = np.sum(along * velocity, axis=1) - radius * state[:, 4]
        contact = Contact(np.maximum(depth[:, c], 0.0), closing[:, c], slip, plain[:, c])
        pressing = plain[:, c] + sum((x(contact) for x in physics.extras.get(name, ())), np.zeros(len(n)))
        pressing = pressing * touching[:, c]
        total = total + pressing[:, None] * n
        if loose is not None and name == loose.surface:
            plate = plate - pressing / loose.mass_kg
        if name in physics.grips:
            rubbed = physics.grips[name](contact, np.maximum(pressing, 0.0))
            total = total + rubbed[:, None] * along
            torque = torque - radius * rubbed
    return total, torque, plate
