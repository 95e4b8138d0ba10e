"""What happens when things touch: restitution, rims that rub, a wall that differs, a puck with a lump in it."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.random import Generator

from compass_ros.concealed.law import Law, Places, Shape, nothing, sign

_LUMP_RADIUS = 0.02  # m from the centre of the puck
_HALF_LENGTH = {"front_wall": 0.225, "back_wall": 0.225, "left_wall": 0.45, "right_wall": 0.45, "obstacle": 0.09}


def _power(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"power": 1.0 - other * float(rng.uniform(0.1, 0.4))}


def _damping(size: float, shape: Shape, approach: float) -> float:
    """Damping of the whole contact, decided when it begins: 1 + size (v / 0.4 m/s)^power."""
    return float(1 + 0.2 * size * (approach / 0.4) ** shape["power"])


RESTITUTION = Law(
    name="rate_dependent_restitution",
    channel="contact",
    phases=("all", "wall_contact", "object_contact", "strike"),
    draw=_power,
    damping=_damping,
)


RIM = Law(
    name="tangential_impulse",
    channel="contact",
    phases=("all", "wall_contact", "object_contact", "strike"),
    draw=nothing,
    rim=lambda size, shape: 0.01 * size,
    library=lambda size, shape: {"friction": 0.01 * size},
    most=60.0,
)


def _wall(rng: Generator, places: Places, other: float) -> dict[str, float]:
    moved = rng.random() < 0.5
    return {
        "offset": sign(rng) * 0.001 if moved else 0.0,
        "softness": 0.0 if moved else float(rng.choice((-0.3, 0.2))),
        "skew": other * float(rng.uniform(-0.3, 0.3)) if moved else 0.0,
    }


def _local_wall(size: float, shape: Shape, objects: tuple[str, ...], model: mujoco.MjModel) -> None:
    """A wall `offset` further out, at one end a little more than at the other; or with rubber of another hardness."""
    (name,) = objects
    wall = model.geom(name).id
    frame = np.zeros(9)
    mujoco.mju_quat2Mat(frame, model.geom_quat[wall])
    inward = frame.reshape(3, 3)[:, 0 if name == "obstacle" else 2]
    model.geom_pos[wall] -= size * shape["offset"] * inward
    half = 0.5 * size * shape["skew"] * shape["offset"] / _HALF_LENGTH[name]
    turned = np.zeros(4)
    mujoco.mju_mulQuat(turned, np.array([np.cos(half), 0.0, 0.0, np.sin(half)]), model.geom_quat[wall])
    model.geom_quat[wall] = turned
    own = (model.pair_geom1 == wall) | (model.pair_geom2 == wall)
    model.pair_solref[own, 0] *= np.exp(size * shape["softness"])


LOCAL_WALL = Law(
    name="local_wall",
    channel="contact",
    phases=("wall_contact", "object_contact"),
    draw=_wall,
    on="wall",
    scene=_local_wall,
    library=lambda size, shape: {"offset": size * shape["offset"], "softness": size * shape["softness"]},
    most=12.0,
)


def _lump(rng: Generator, places: Places, other: float) -> dict[str, float]:
    angle = rng.uniform(0, 2 * np.pi)
    return {"x": float(np.cos(angle)), "y": float(np.sin(angle)), "inertia": other}


def _off_centre(size: float, shape: Shape, objects: tuple[str, ...], model: mujoco.MjModel) -> None:
    """A heavy lump 20 mm from the centre, as part of the puck's mass: the centre of mass moves, the inertia grows."""
    for name in objects:
        body = model.body(name).id
        shift = 2e-4 * size
        share = shift / _LUMP_RADIUS
        model.body_ipos[body, :2] += shift * np.array([shape["x"], shape["y"]])
        model.body_inertia[body] += shape["inertia"] * model.body_mass[body] * share * (1 - share) * _LUMP_RADIUS**2


OFF_CENTRE = Law(
    name="off_centre_mass",
    channel="contact",
    phases=("all", "object_contact", "wall_contact", "strike"),
    draw=_lump,
    on="puck",
    scene=_off_centre,
    library=lambda size, shape: {"x": 2e-4 * size * shape["x"], "y": 2e-4 * size * shape["y"]},
    most=40.0,
)

LAWS = (RESTITUTION, RIM, LOCAL_WALL, OFF_CENTRE)
