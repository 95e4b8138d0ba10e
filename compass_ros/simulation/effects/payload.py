"""A mass that the scene lacks: what a gripper holds, a load, a housing.

The body grows by a point `mass` at (moment_x, moment_y, moment_z) / mass from its centre of mass, in its own frame:
weight, inertia and centre of mass follow. First moments of mass are what motion is linear in (base parameters:
Atkeson, An and Hollerbach 1986); a place is not known where the mass is not. It is within three extents of the body: a
moment that asks for more brings the mass that it needs there. On an arm it belongs on the last link. MuJoCo compiles a
body whose mass is at its origin as centred for good; on such a one the mass is at the centre.
Source: rigid-body dynamics, parallel axes.
"""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.errors import ConfigError
from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.extents import BodySize, unit_body
from compass_ros.simulation.sizes import LARGEST, MODEST
from compass_ros.types import Floats

_REACH = 3.0
"""How far off the centre it may be, in extents of the body."""


def _model(model: mujoco.MjModel, numbers: Floats, context: Context) -> None:
    for site in context.sites if numbers.any() else ():
        body = model.body(site.name).id
        added, offset = lump(model, body, numbers)
        if offset.any():
            _off_centre(model, body, added, offset)
        model.body_mass[body] += added


def lump(model: mujoco.MjModel, body: int, numbers: Floats) -> tuple[float, Floats]:
    """Mass [kg] and (3,) place from the body's centre of mass [m] of a load with these numbers.

    One that would be farther away than a load may be has the mass that it needs at that distance.
    """
    moment = np.zeros(3)
    moment[: len(numbers) - 1] = numbers[1:]
    extent = float(np.sqrt(model.body_inertia[body].sum() / (2 * model.body_mass[body])))
    mass = max(float(numbers[0]), float(np.linalg.norm(moment)) / (_REACH * extent))
    return mass, moment / max(mass, 1e-300)


def _off_centre(model: mujoco.MjModel, body: int, added: float, offset: Floats) -> None:
    """Centre and moments of inertia, with the axes of the largest first as MuJoCo has them."""
    if model.body_simple[body]:
        raise ConfigError(
            f"effect 'payload' cannot act beside the centre of '{model.body(body).name}': MuJoCo has compiled it as "
            "centred for good; give it an <inertial> some micrometres off the centre"
        )
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[body])
    axes = turn.reshape(3, 3)
    own = float(model.body_mass[body])
    reduced = own * added / (own + added)
    tensor = axes @ np.diag(model.body_inertia[body]) @ axes.T
    tensor += reduced * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    moments, columns = np.linalg.eigh(tensor)
    columns = columns[:, ::-1]
    columns[:, 2] = np.cross(columns[:, 0], columns[:, 1])
    model.body_ipos[body] += offset * added / (own + added)
    model.body_inertia[body] = moments[::-1]
    mujoco.mju_mat2Quat(model.body_iquat[body], np.ascontiguousarray(columns).ravel())
    model.body_sameframe[body] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE


def _on_body(size: BodySize) -> tuple[Quantity, ...]:
    mass = Quantity("mass", "kg", 0.0, LARGEST * size.mass, MODEST * size.mass)
    most, modest = (share * size.mass * size.extent for share in (LARGEST, MODEST))
    moments = [Quantity(f"moment_{axis}", "kg m", -most, most, modest) for axis in "xyz"]
    return (mass,) if size.centred else (mass, *moments)


EFFECT = Effect(
    name="payload",
    channel="dynamics",
    quantities=_on_body(unit_body()),
    sentence="a load that the scene lacks",
    on=("body",),
    model=_model,
    on_body=_on_body,
    on_links="each last",
)
