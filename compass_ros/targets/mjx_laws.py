"""Laws that a simulator lacks, as forces for MJX: MuJoCo in JAX.

    model = mjx.put_model(prepare(mujoco.MjModel.from_xml_path("scene.xml")))
    data = jax.jit(step)(model, data)               # in place of mjx.step; vmap, grad and jvp go through

`force(model, data)` is the generalised force alone, for a step of your own that adds it to `qfrc_applied`. Needs jax
and mujoco-mjx, nothing else. Formulas: docs/effects.md of compass_ros.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import mjx


class Term(NamedTuple):
    """One kind of force on one object of the scene."""

    kind: str
    on: str
    """joint; planar: a body that slides along x and y of the world (and may turn about z); body; pair: two bodies."""
    names: tuple[str, ...]
    """Of the joint or of the bodies."""
    numbers: Sequence[Any]
    """In the order that the kind's formula below has them; may be traced."""


TERMS: tuple[Term, ...] = ()
CHANGED: dict[str, Any] = {}
"""Numbers of the model that laws change, by field."""

_DRY = ("coulomb", "stribeck", "asymmetric", "load_friction")
_PEAK = 1.5 * 3**0.5
"""Of the largest value of r / (r^2 + 1)^1.5, the inverse."""
_TINY = 1e-30
_NUMBERS = 8
"""Of a term; those that are not given are zero."""


class _State(NamedTuple):
    """What a force may depend on, in the world; of a joint its place and rate in x and vx, mass 1, no weight."""

    x: Any
    y: Any
    vx: Any
    vy: Any
    vz: Any
    mass: Any
    weight: Any
    time: Any
    load: Any
    spin: Any
    gravity: Any
    creep: Any
    """Of a dry friction on a joint: the rate at which it is whole, for a force of 1."""


def prepare(model: mujoco.MjModel) -> mujoco.MjModel:
    """Write what laws change in the numbers of the scene into its model, before `mjx.put_model`; the same model.

    Contacts without friction are the same in both friction cones, and MJX knows them in the pyramidal one alone.
    """
    for field, value in CHANGED.items():
        if field == "cone":
            model.opt.cone = value
        else:
            own = getattr(model, field)
            own[:] = np.asarray(value).reshape(own.shape)
    if CHANGED:
        mujoco.mj_setConst(model, mujoco.MjData(model))
    touching = model.geom_condim[(model.geom_contype | model.geom_conaffinity) != 0]
    if (model.pair_dim == 1).all() and (touching == 1).all():
        model.opt.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
    return model


def step(model: Any, data: Any, terms: Sequence[Term] | None = None) -> Any:
    """`mjx.step` with the laws; what else is in `qfrc_applied` acts too and stays."""
    applied = data.qfrc_applied
    pushed = data.replace(qfrc_applied=applied + force(model, data, terms))
    return mjx.step(model, pushed).replace(qfrc_applied=applied)


def force(model: Any, data: Any, terms: Sequence[Term] | None = None) -> Any:
    """(nv,) generalised force of all laws at the state (qpos, qvel, time, ctrl) of the data."""
    asked = TERMS if terms is None else terms
    if any(term.on != "joint" for term in asked):
        data = mjx.com_pos(model, mjx.kinematics(model, data))
    if any(term.kind == "load_friction" for term in asked):
        data = mjx.fwd_actuation(model, mjx.fwd_velocity(model, mjx.fwd_position(model, data)))
    total = jnp.zeros_like(data.qvel)
    for term in asked:
        total = total + _push(model, data, term, asked)
    return total


def _push(model: Any, data: Any, term: Term, asked: Sequence[Term]) -> Any:
    if term.on == "pair":
        return _between(model, data, term)
    if term.on == "joint":
        joint = mjx.name2id(model, mujoco.mjtObj.mjOBJ_JOINT, term.names[0])
        dof, place = int(model.jnt_dofadr[joint]), int(model.jnt_qposadr[joint])
        together = sum(other.kind in _DRY and other.names == term.names for other in asked)
        state = _State(
            data.qpos[place], 0.0, data.qvel[dof], 0.0, 0.0, 1.0, 0.0, data.time,
            _load(data, dof) if term.kind == "load_friction" else 0.0, None, None,
            together * model.opt.timestep * model.dof_invweight0[dof],
        )  # fmt: skip
        return jnp.zeros_like(data.qvel).at[dof].add(_evaluate(term, state)[0])
    body = mjx.name2id(model, mujoco.mjtObj.mjOBJ_BODY, term.names[0])
    centre, mass = data.xipos[body], model.body_mass[body]
    along, about = mjx.jac(model, data, centre, body)
    velocity, spin = along.T @ data.qvel, about.T @ data.qvel
    gravity = model.opt.gravity
    vz = velocity[2] if term.on == "body" else 0.0
    state = _State(
        centre[0], centre[1], velocity[0], velocity[1], vz, mass, -mass * gravity[2], data.time,
        0.0, spin, gravity, 0.0,
    )  # fmt: skip
    x, y, z = _evaluate(term, state)
    if term.on == "body":
        return along @ jnp.stack([x, y, z + 0.0 * x])
    first, turns = int(model.body_dofadr[body]), int(model.body_jntnum[body]) > 2
    out = jnp.zeros_like(data.qvel).at[first].add(x).at[first + 1].add(y)
    arm = centre - data.xpos[body]
    return out.at[first + 2].add(arm[0] * y - arm[1] * x) if turns else out


def _load(data: Any, dof: int) -> Any:
    return data.qfrc_actuator[dof] + data.qfrc_applied[dof]


def _between(model: Any, data: Any, term: Term) -> Any:
    """A pull between the centres of mass of two bodies, along the line that joins them."""
    bodies = [mjx.name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) for name in term.names]
    at = [jnp.where(model.body_mass[b] > 0, data.xipos[b], data.xpos[b]) for b in bodies]
    apart, p = at[1] - at[0], term.numbers
    r = _size(*apart)
    if term.kind == "tether":  # stiffness, length
        pull = jnp.where(r > p[1], p[0] * (r - p[1]) / jnp.maximum(r, _TINY), 0.0)
    elif term.kind == "pair_attraction":  # peak force, core radius
        c = r * r + p[1] * p[1]
        pull = p[0] * _PEAK * p[1] * p[1] / (c * jnp.sqrt(c))
    else:
        raise ValueError(f"no force between two bodies of the kind '{term.kind}'")
    one, other = (mjx.jac(model, data, point, body)[0] for point, body in zip(at, bodies, strict=True))
    return (one - other) @ (pull * apart)


def _size(*parts: Any) -> Any:
    """Length of a vector, whose derivative at zero is zero and not NaN."""
    square = sum(part * part for part in parts)
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)


def _along(s: _State, magnitude: Any, creep: Any) -> tuple[Any, Any, Any]:
    """Against the velocity, smooth through zero over the creep speed."""
    k = -magnitude / jnp.sqrt(s.vx * s.vx + s.vy * s.vy + s.vz * s.vz + creep * creep + _TINY)
    return k * s.vx, k * s.vy, k * s.vz


def _dry(s: _State, magnitude: Any, creep: Any) -> tuple[Any, Any, Any]:
    """The same; of a joint over the rate that the friction itself takes away in a step: so it cannot rattle."""
    return _along(s, magnitude, jnp.abs(magnitude) * s.creep if s.spin is None else creep)


def _falling(beyond: Any, tail: Any) -> Any:
    """exp(-beyond) without a tail, 1 / (1 + beyond) with a tail of 1."""
    none = jnp.abs(tail * beyond) < 1e-8
    safe = jnp.where(none, 1.0, tail)
    return jnp.exp(jnp.where(none, -beyond, -jnp.log1p(jnp.where(none, 0.0, safe * beyond)) / safe))


def _tilted(gravity: Any, one: Any, two: Any) -> Any:
    """(3,) gravity turned by two small angles about axes across it, less gravity."""
    size, angle = _size(*gravity), _size(one, two)
    up = -gravity / jnp.maximum(size, _TINY)
    seed = jnp.where(jnp.abs(up[0]) < 0.9, jnp.array([1.0, 0.0, 0.0]), jnp.array([0.0, 1.0, 0.0]))
    a = seed - (seed @ up) * up
    a = a / jnp.maximum(_size(*a), _TINY)
    b = jnp.cross(up, a)
    across = size * jnp.where(angle > 0, jnp.sin(angle) / jnp.where(angle > 0, angle, 1.0), 1.0)
    return -size * (jnp.cos(angle) - 1) * up + across * (one * a + two * b)


def _evaluate(term: Term, s: _State) -> tuple[Any, Any, Any]:  # noqa: PLR0911, PLR0912, PLR0915, C901 - a list of laws
    """(x, y, z) force of a term [N], or torque on a joint in the first; numbers in the order of each comment."""
    p, joint = [*term.numbers, *(_NUMBERS - len(term.numbers)) * (0.0,)], s.spin is None
    weight = 1.0 if joint else s.weight
    match term.kind:
        case "table_friction":  # friction, creep speed, share of the weight that the table carries
            return _along(s, p[0] * s.weight * p[2], p[1])
        case "coulomb":  # friction (joint: force), creep speed (joint: softness, left out), share of the weight
            return _dry(s, p[0] * weight * (1.0 if joint else p[2]), 0.0 if joint else p[1])
        case "stribeck":  # extra friction at rest, creep speed, share of the weight, Stribeck speed
            square = s.vx * s.vx + s.vy * s.vy + s.vz * s.vz
            extra = p[0] * weight * (1.0 if joint else p[2]) * jnp.exp(-square / (p[3] * p[3]))
            return _dry(s, extra, p[1])
        case "asymmetric":  # extra friction forwards
            x, _, _ = _dry(s, p[0], 0.0)
            return jnp.where(s.vx > 0, x, 0.0), 0.0, 0.0
        case "load_friction":  # friction as a share of the load, what is more at rest, speed over which that fades
            fades = jnp.where(p[2] == 0, 1.0, p[2])
            return _dry(s, (p[0] + p[1] * jnp.exp(-((s.vx / fades) ** 2))) * jnp.abs(s.load), 0.0)
        case "pulsating":  # cosine and sine amplitude, creep speed, share of the weight, frequency
            turn = 2 * jnp.pi * p[4] * s.time
            return _along(s, (p[0] * jnp.cos(turn) + p[1] * jnp.sin(turn)) * s.weight * p[3], p[2])
        case "friction_patch":  # extra friction, centre x, y, radius, creep speed, share of the weight
            r = _size(s.x - p[1], s.y - p[2])
            return _along(s, p[0] * jax.nn.sigmoid(-10.0 * (r / p[3] - 1.0)) * s.weight * p[5], p[4])
        case "friction_gradient":  # gradient along x, along y, creep speed, share of the weight
            return _along(s, (p[0] * s.x + p[1] * s.y) * s.weight * p[3], p[2])
        case "anisotropic":  # extra along x (less along y), along the diagonal, creep speed, share of the weight
            k = -s.weight * p[3] / jnp.sqrt(s.vx * s.vx + s.vy * s.vy + p[2] * p[2] + _TINY)
            return k * (p[0] * s.vx + p[1] * s.vy), k * (p[1] * s.vx - p[0] * s.vy), 0.0
        case "uniform":  # acceleration x, y, z
            return s.mass * p[0], s.mass * p[1], s.mass * p[2]
        case "tilt":  # slope x, y
            return s.weight * p[0], s.weight * p[1], 0.0
        case "viscous":  # rate
            return -s.mass * p[0] * s.vx, -s.mass * p[0] * s.vy, -s.mass * p[0] * s.vz
        case "quadratic":  # inverse length
            k = -s.mass * p[0] * _size(s.vx, s.vy, s.vz)
            return k * s.vx, k * s.vy, k * s.vz
        case "crosswind":  # acceleration at rest x, y, speed of the air
            a = _size(p[0], p[1])
            safe = jnp.where(a > 0, a, 1.0)
            ux, uy = p[2] * p[0] / safe - s.vx, p[2] * p[1] / safe - s.vy
            k = s.mass * a * _size(ux, uy) / (p[2] * p[2])
            return k * ux, k * uy, 0.0
        case "fan" | "swirl":  # peak acceleration, centre x, y, radius of the peak, tail
            rx, ry = s.x - p[1], s.y - p[2]
            k = s.mass * p[0] / p[3] * _falling(0.5 * ((rx * rx + ry * ry) / (p[3] * p[3]) - 1.0), p[4])
            return (k * rx, k * ry, 0.0) if term.kind == "fan" else (-k * ry, k * rx, 0.0)
        case "attraction":  # peak acceleration, centre x, y, core radius
            rx, ry = s.x - p[1], s.y - p[2]
            c = rx * rx + ry * ry + p[3] * p[3]
            k = -s.mass * p[0] * _PEAK * p[3] * p[3] / (c * jnp.sqrt(c))
            return k * rx, k * ry, 0.0
        case "magnus":  # rate; of a body in space: share of its spin, and a vector
            if term.on == "planar":
                return -s.mass * p[0] * s.vy, s.mass * p[0] * s.vx, 0.0
            x, y, z = (s.mass * (p[0] * s.spin[i] + p[1 + i]) for i in range(3))
            return y * s.vz - z * s.vy, z * s.vx - x * s.vz, x * s.vy - y * s.vx
        case "spring":  # stiffness, rest, softening, slack
            away, turn, soft = s.x - p[1], p[2] * (s.x - p[1]), jnp.where(p[2] == 0, 1.0, p[2])
            pull = jnp.where(p[2] > 0, jnp.sin(turn) / soft, jnp.where(p[2] < 0, jnp.sinh(turn) / soft, away))
            return -p[0] * pull * (1 - p[3] * jnp.maximum(p[2], 0.0) * jnp.cos(turn)), 0.0, 0.0
        case "cogging":  # cosine and sine amplitude, periods per turn, amplitudes of the second and third harmonic
            waves = ((p[0], p[1], p[2]), (p[3], p[4], 2 * p[2]), (p[5], p[6], 3 * p[2]))
            return sum(c * jnp.cos(k * s.x) + z * jnp.sin(k * s.x) for c, z, k in waves), 0.0, 0.0
        case "gravity_tilt":  # two angles
            x, y, z = s.mass * _tilted(s.gravity, p[0], p[1])
            return x, y, z
        case "wind":  # velocity of the air x, y, z, drag over mass and squared speed
            u = (p[0] - s.vx, p[1] - s.vy, p[2] - s.vz)
            moving, resting = s.mass * p[3] * _size(*u), s.mass * p[3] * _size(s.vx, s.vy, s.vz)
            return moving * u[0] + resting * s.vx, moving * u[1] + resting * s.vy, moving * u[2] + resting * s.vz
        case "buoyancy":  # share of the weight
            k = -s.mass * p[0]
            return k * s.gravity[0], k * s.gravity[1], k * s.gravity[2]
        case _:
            raise ValueError(f"no force of the kind '{term.kind}'")
