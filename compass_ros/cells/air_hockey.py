"""Mini-Air-Hockey: how its 64 parameters act on the scene, and how a shot command moves the pusher."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from compass_ros.cells.cell import Cell
from compass_ros.cells.dynamics import Sliding
from compass_ros.types import Floats, Ints

_PUCKS = ("puck1", "puck2")
_MIXED = {
    "damping": ("solref", 1),
    "impedance": ("solimp", 0),
    "impedance_width": ("solimp", 2),
    "impedance_power": ("solimp", 4),
}
_CAMERA_BIAS = ("env@camera@bias_x", "env@camera@bias_y")


class AirHockey:
    """`Dynamics` of the air-hockey table."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._model = mujoco.MjModel.from_xml_path(str(cell.model_path))
        self._partners = np.stack([self._model.pair_geom1, self._model.pair_geom2])  # (2, npair)
        rest = [self._model.body(name).pos[:2] for name in _PUCKS]
        self._rest = np.concatenate(rest)  # (4,) where the pucks lie [m]

    @property
    def model(self) -> mujoco.MjModel:
        return self._model

    def apply(self, models: Sequence[mujoco.MjModel], values: Floats) -> None:
        mixed = {parameter: self._mixed(parameter, values) for parameter in _MIXED}
        column = {p.name: values[:, i] for i, p in enumerate(self._cell.parameters)}
        for b, model in enumerate(models):
            for parameter, (field, index) in _MIXED.items():
                getattr(model, f"pair_{field}")[:, index] = mixed[parameter][b]
            self._apply_one(model, {name: float(of_batch[b]) for name, of_batch in column.items()})

    def _mixed(self, parameter: str, values: Floats) -> Floats:
        """(B, npair) the mean of the two partners' values; walls and bar are geoms of the world."""
        of_geom = np.zeros((len(values), self._model.ngeom))
        for geom in set(self._partners.ravel().tolist()):
            of_geom[:, geom] = values[:, self._cell.index(f"{self._model.geom(geom).name}@dyna@{parameter}")]
        return 0.5 * (of_geom[:, self._partners[0]] + of_geom[:, self._partners[1]])

    def _apply_one(self, model: mujoco.MjModel, v: dict[str, float]) -> None:
        for name in ("pusher", *_PUCKS):
            geom, body, dof = model.geom(name).id, model.body(name).id, model.joint(f"{name}_x").dofadr[0]
            model.geom_size[geom, 0] = model.geom_rbound[geom] = v[f"{name}@shape@radius"]
            nominal = self._model.body_mass[body]
            model.body_mass[body] = v[f"{name}@dyna@mass"]
            model.body_inertia[body] = self._model.body_inertia[body] * v[f"{name}@dyna@mass"] / nominal
            model.dof_armature[dof : dof + 2] = v[f"{name}@dyna@armature"]
        for name in _PUCKS:
            model.geom_friction[model.geom(name).id, 0] = v[f"{name}@dyna@friction_sliding"]
        for name in ("front_wall", "back_wall", "left_wall", "right_wall", "obstacle"):
            geom = model.geom(name).id
            half = 0.5 * v[f"{name}@pose@yaw"]
            turn = np.array([np.cos(half), 0, 0, np.sin(half)])
            mujoco.mju_mulQuat(model.geom_quat[geom], turn, self._model.geom_quat[geom])
        bar = model.geom("obstacle").id
        model.geom_pos[bar, :2] = v["obstacle@pose@x"], v["obstacle@pose@y"]
        model.geom_size[bar, :2] = 0.5 * v["obstacle@shape@width"], 0.5 * v["obstacle@shape@length"]
        model.geom_rbound[bar] = np.linalg.norm(model.geom_size[bar])
        model.opt.gravity[2] = -v["env@dyna@gravity"]
        gain, pusher = v["pusher@actuation@servo_gain"], model.joint("pusher_x").dofadr[0]
        model.actuator_gainprm[:, 0] = gain
        model.actuator_biasprm[:, 2] = -gain
        model.dof_damping[pusher : pusher + 2] = v["pusher@dyna@joint_damping"]

    def start(self, values: Floats, inputs: Floats) -> tuple[Floats, Floats]:
        positions = np.zeros((len(values), self._model.nq))
        positions[:, :2] = inputs[:, :2]  # qpos of the pusher; pucks start at their places in the scene
        return positions, np.zeros((len(values), self._model.nv))

    def controls(self, values: Floats, inputs: Floats, steps: int) -> Floats:
        """Velocity of the pusher: up in `ramp_time`, constant until the commanded stroke is done, then back out of the way.

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
        heading = np.arctan2(self._rest[1] - inputs[:, 1], self._rest[0] - inputs[:, 0]) + inputs[:, 2]
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
        return np.array([self._model.joint(f"{name}_{axis}").qposadr[0] for name in _PUCKS for axis in "xy"])

    def observe(self, values: Floats, positions: Floats) -> Floats:
        bias = values[:, [self._cell.index(name) for name in _CAMERA_BIAS]]
        return np.asarray(positions + self._rest + np.tile(bias, 2)[:, None, :])
