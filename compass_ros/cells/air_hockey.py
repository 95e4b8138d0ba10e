"""Mini-Air-Hockey: how its 64 parameters act on the scene, and how a shot command moves the pusher."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from compass_ros.cells.cell import Cell
from compass_ros.cells.dynamics import Sliding
from compass_ros.cells.keyframe import begun, first_state
from compass_ros.cells.sensors import columns_of
from compass_ros.errors import ConfigError, nearest
from compass_ros.types import Floats, Ints

_PUCKS = ("puck1", "puck2")
_UNYIELDING = 1e4
"""Mass and gain of a tool that follows a measured path, in those of one that is commanded: it lags as that one does,
and a puck does not push it beyond what was measured, which holds the recoil already."""
_MOVING = ("pusher", *_PUCKS)
_WALLS = ("front_wall", "back_wall", "left_wall", "right_wall")
_FIXED = (*_WALLS, "obstacle")
_MIXED = {
    "damping": ("pair_solref", 1),
    "impedance": ("pair_solimp", 0),
    "impedance_width": ("pair_solimp", 2),
    "impedance_power": ("pair_solimp", 4),
}
"""Contact parameters of each partner; the contact takes the mean of the two."""
_CAMERA_BIAS = ("env@camera@bias_x", "env@camera@bias_y")
PARAMETERS = frozenset(
    [f"{name}@dyna@{contact}" for name in (*_MOVING, *_FIXED) for contact in _MIXED]
    + [f"{name}@shape@radius" for name in _MOVING]
    + [f"{name}@pose@yaw" for name in _FIXED]
    + [f"obstacle@{what}" for what in ("pose@x", "pose@y", "shape@length", "shape@width")]
    + [f"{name}@dyna@{what}" for name in _PUCKS for what in ("friction_sliding", "friction_creep", "mass", "armature")]
    + [f"pusher@dyna@{what}" for what in ("mass", "armature", "joint_damping")]
    + [f"pusher@actuation@{what}" for what in ("vel_discount", "servo_gain", "ramp_time", "stroke", "settle_time")]
    + [*_CAMERA_BIAS, "env@dyna@gravity", "table@dyna@lift"]
)
"""Names that the cell's YAML has to list, all of them."""


class AirHockey:
    """`Dynamics` of the air-hockey table."""

    def __init__(self, cell: Cell) -> None:
        _check(cell)
        self._cell = cell
        try:
            self._model = mujoco.MjModel.from_xml_path(str(cell.model_path))
        except ValueError as error:
            raise ConfigError(f"{cell.model_path}: MuJoCo refuses it: {' '.join(str(error).split())}") from error
        # MuJoCo skips the own frame of a geom that was compiled parallel to its body, and so its yaw.
        self._model.geom_sameframe[:] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
        self._partners = np.stack([self._model.pair_geom1, self._model.pair_geom2])  # (2, npair)
        self._rest = {name: self._model.body(name).pos[:2].copy() for name in _MOVING}
        self._first = first_state(begun(self._model), self._model)
        self._tool = _UNYIELDING if any(spec.measured for spec in cell.spec.inputs) else 1.0
        further = [columns_of(self._model, signal, str(cell.path)) for signal in cell.signals[len(_PUCKS) :]]
        self._columns: Ints = np.concatenate([*map(self._of_puck, _PUCKS), *further])

    @property
    def model(self) -> mujoco.MjModel:
        return self._model

    def apply(self, models: Sequence[mujoco.MjModel], values: Floats) -> None:
        fields = self.fields(values)
        gravity = values[:, self._cell.index("env@dyna@gravity")]
        for b, model in enumerate(models):
            for name, of_batch in fields.items():
                getattr(model, name)[:] = of_batch[b]
            model.opt.gravity[2] = -gravity[b]

    def fields(self, values: Floats) -> dict[str, Floats]:
        """(B, ...) each array of the model that parameters change, whole, for (B, P) values."""
        m, batch = self._model, len(values)

        def column(name: str) -> Floats:
            return np.asarray(values[:, self._cell.index(name)])

        names = (
            *("pair_solref", "pair_solimp", "geom_size", "geom_rbound", "geom_pos", "geom_quat", "geom_friction"),
            *("body_mass", "body_inertia", "dof_armature", "dof_damping", "actuator_gainprm", "actuator_biasprm"),
        )
        f: dict[str, Floats] = {name: np.repeat(getattr(m, name)[None], batch, axis=0) for name in names}
        for parameter, (field, number) in _MIXED.items():
            f[field][:, :, number] = self._mixed(parameter, values)
        for name in _MOVING:
            geom, body, dof = m.geom(name).id, m.body(name).id, m.joint(f"{name}_x").dofadr[0]
            f["geom_size"][:, geom, 0] = f["geom_rbound"][:, geom] = column(f"{name}@shape@radius")
            mass = column(f"{name}@dyna@mass") * (self._tool if name == "pusher" else 1.0)
            f["body_mass"][:, body] = mass
            f["body_inertia"][:, body] *= (mass / m.body_mass[body])[:, None]
            f["dof_armature"][:, dof : dof + 2] = column(f"{name}@dyna@armature")[:, None]
        for name in _PUCKS:
            f["geom_friction"][:, m.geom(name).id, 0] = column(f"{name}@dyna@friction_sliding")
        for name in _FIXED:
            geom = m.geom(name).id
            f["geom_quat"][:, geom] = _turned(column(f"{name}@pose@yaw"), m.geom_quat[geom])
        bar = m.geom("obstacle").id
        f["geom_pos"][:, bar, :2] = np.stack([column("obstacle@pose@x"), column("obstacle@pose@y")], axis=1)
        sizes = (column("obstacle@shape@width"), column("obstacle@shape@length"))
        f["geom_size"][:, bar, :2] = 0.5 * np.stack(sizes, axis=1)
        f["geom_rbound"][:, bar] = np.linalg.norm(f["geom_size"][:, bar], axis=1)
        gain, pusher = column("pusher@actuation@servo_gain")[:, None] * self._tool, m.joint("pusher_x").dofadr[0]
        f["actuator_gainprm"][:, :, 0] = gain
        f["actuator_biasprm"][:, :, 2] = -gain
        f["dof_damping"][:, pusher : pusher + 2] = column("pusher@dyna@joint_damping")[:, None]
        return f

    def _mixed(self, parameter: str, values: Floats) -> Floats:
        """(B, npair) the mean of the two partners' values; walls and bar are geoms of the world."""
        of_geom = np.zeros((len(values), self._model.ngeom))
        for geom in set(self._partners.ravel().tolist()):
            of_geom[:, geom] = values[:, self._cell.index(f"{self._model.geom(geom).name}@dyna@{parameter}")]
        return np.asarray(0.5 * (of_geom[:, self._partners[0]] + of_geom[:, self._partners[1]]))

    @property
    def first(self) -> Floats:
        return self._first

    def start(self, values: Floats, inputs: Floats) -> tuple[Floats, Floats]:
        positions = np.zeros((len(values), self._model.nq))
        positions[:, :2] = inputs[:, :2]  # qpos of the pusher; pucks start at their places in the scene
        return positions, np.zeros((len(values), self._model.nv))

    def controls(self, values: Floats, inputs: Floats, steps: int) -> Floats:
        """Velocity of the pusher: up in `ramp_time`, constant until the stroke is done, then back out of the way.

        The heading is the line from the pusher's start to puck 1, turned by the commanded angle. The stroke is timed by
        the commanded speed; the arm reaches only `vel_discount` of it. The turn at the end takes `settle_time`.
        """
        discount, ramp, stroke, settle = (
            values[:, self._cell.index(f"pusher@actuation@{name}"), None]
            for name in ("vel_discount", "ramp_time", "stroke", "settle_time")
        )
        speed = inputs[:, 3, None]
        time = self._model.opt.timestep * np.arange(steps)
        out = ramp + stroke / speed
        back = out + settle + stroke / speed
        forth = np.clip(np.minimum(time / ramp, 1 - 2 * (time - out) / settle), -1, 1)
        share = np.where(time < out + settle, forth, -np.clip(1 - (time - back) / ramp, 0, 1))
        target = self._rest["puck1"]
        heading = np.arctan2(target[1] - inputs[:, 1], target[0] - inputs[:, 0]) + inputs[:, 2]
        direction = np.stack([np.cos(heading), np.sin(heading)], axis=1)
        return np.asarray((discount * speed * share)[:, :, None] * direction[:, None, :])

    def sliding(self, values: Floats) -> tuple[Sliding, ...]:
        load = 1 - values[:, self._cell.index("table@dyna@lift")]
        return tuple(
            Sliding(
                name,
                values[:, self._cell.index(f"{name}@dyna@friction_sliding")],
                values[:, self._cell.index(f"{name}@dyna@friction_creep")],
                load,
            )
            for name in _PUCKS
        )

    def columns(self) -> Ints:
        return self._columns

    def observe(self, values: Floats, positions: Floats) -> Floats:
        """The camera sees the pucks with its bias; encoders say what they are at."""
        rest = np.concatenate([self._rest[name] for name in _PUCKS])
        seen = positions[:, :, :4] + rest + np.tile(self._bias(values), 2)[:, None, :]
        return np.concatenate([seen, positions[:, :, 4:]], axis=2)

    def _of_puck(self, name: str) -> Ints:
        return np.array([self._model.joint(f"{name}_{axis}").qposadr[0] for axis in "xy"])

    def poses(self, values: Floats, positions: Floats) -> Mapping[str, Floats]:
        out = {}
        for name in _MOVING:
            x, y = (positions[:, :, self._model.joint(f"{name}_{axis}").qposadr[0]] for axis in "xy")
            yaw = positions[:, :, self._model.joint(f"{name}_yaw").qposadr[0]] if name in _PUCKS else np.zeros_like(x)
            out[name] = np.stack([x, y, yaw], axis=2)
            out[name][:, :, :2] += self._rest[name] + self._bias(values)[:, None, :]
        return out

    def _bias(self, values: Floats) -> Floats:
        """(B, 2) offset of what the camera says [m]."""
        return np.asarray(values[:, [self._cell.index(name) for name in _CAMERA_BIAS]])


def _check(cell: Cell) -> None:
    names = [p.name for p in cell.parameters]
    for name in names:
        if name not in PARAMETERS:
            raise ConfigError(f"{cell.path}: parameters: unknown '{name}'{nearest(name, PARAMETERS)}")
    missing = sorted(PARAMETERS.difference(names))
    if missing:
        raise ConfigError(f"{cell.path}: parameters: {missing[0]} is missing; the table has {len(PARAMETERS)}")
    tracked = [(o.name, o.quantity) for o in cell.objects]
    if tracked != [(name, "xy") for name in _PUCKS]:
        raise ConfigError(f"{cell.path}: objects: expected {' and '.join(_PUCKS)}, each xy")
    if others := [s.name for s in cell.spec.signals if s.quantity not in ("joint_position", "joint_velocity")]:
        raise ConfigError(f"{cell.path}: signals: {others[0]}: the table has positions and velocities of joints")
    actions = [a.name for a in cell.action]
    if actions != ["x", "y", "angle", "velocity"]:
        raise ConfigError(f"{cell.path}: action: expected x, y, angle, velocity, found {', '.join(actions)}")


def _turned(yaw: Floats, quaternion: Floats) -> Floats:
    """(B, 4) a quaternion after a further turn about z by (B,) angles."""
    w, x, y, z = quaternion
    cos, sin = np.cos(0.5 * yaw)[:, None], np.sin(0.5 * yaw)[:, None]
    return np.asarray(cos * [w, x, y, z] + sin * [-z, -y, x, w])
