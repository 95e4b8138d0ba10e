"""A cell as a robosuite environment: a robot behind the table moves the tool that the cell's servos stand for."""

from __future__ import annotations

import copy
import weakref
from contextlib import ExitStack
from typing import Any

import mujoco
import numpy as np
from robosuite.environments.manipulation.manipulation_env import ManipulationEnv
from robosuite.models.arenas import TableArena
from robosuite.models.tasks import ManipulationTask
from robosuite.utils.observables import Observable, sensor

from compass_ros.cells import load
from compass_ros.cells.registry import dynamics_of
from compass_ros.simulation.effects.effect import table_friction
from compass_ros.simulation.native.program import Programs
from compass_ros.simulation.robosuite_env.scene import GRIP, contact_force, mapping, reach, servo, tool_of, with_cell
from compass_ros.simulation.sites import Places
from compass_ros.types import Floats

TABLE_HEIGHT = 0.8
HAND = "gripper0_right_eef"
GRIP_SITE = "gripper0_right_grip_site"
HAND_ABOVE = 0.12
"""The hand holds the tool this high above its centre [m]."""
_KP = np.array([4e4, 4e4, 4e4, 150.0, 150.0, 150.0])
"""Stiffness with which the hand keeps to its place [1/s^2] and orientation, critically damped. What a time step of 1 ms
and the torques of the arm allow; robosuite's own 150 is made for people who steer."""


class CellEnv(ManipulationEnv):  # type: ignore[misc]  # robosuite is not annotated
    """One arm, a table and a cell's scene on it, stepped with the cell's time step and solver.

    `step` takes the actions of the robot's controller, as in any robosuite environment; the tool follows the hand.
    `play` rolls out a recorded action with given parameters, as the cell's own simulator does, but through the arm.
    """

    cell_name = ""

    def __init__(self, robots: str = "Kinova3", *, control_freq: float = 0.0, **options: Any) -> None:
        """`options`: as robosuite.make knows them; without a screen and without cameras unless they say so."""
        self.cell = load(self.cell_name)
        self._dynamics = dynamics_of(self.cell)
        self._scene = copy.copy(self._dynamics.model)
        self._scene_data = mujoco.MjData(self._scene)
        self._tool = tool_of(self._scene)
        self._forces = ExitStack()
        weakref.finalize(self, self._forces.close)
        self._height = TABLE_HEIGHT - float(self._scene.geom("table").pos[2])
        options = {"has_renderer": False, "has_offscreen_renderer": False, "use_camera_obs": False,
                   "gripper_types": None, "initialization_noise": None, "hard_reset": False,
                   "horizon": self.cell.horizon} | options  # fmt: skip
        super().__init__(robots=robots, control_freq=control_freq or 1.0 / self.cell.control_dt, **options)

    # --- what robosuite asks of an environment ------------------------------------------------------------------------

    def _load_model(self) -> None:
        super()._load_model()
        length, width = self.table_size()
        base = self.robots[0].robot_model
        base.set_base_xpos(base.base_xpos_offset["table"](length))
        arena = TableArena(table_full_size=(length, width, 0.05), table_offset=(0, 0, TABLE_HEIGHT))
        arena.set_origin([0, 0, 0])
        self.model = ManipulationTask(mujoco_arena=arena, mujoco_robots=[base], mujoco_objects=[])

    def table_size(self) -> tuple[float, float]:
        """Length and width of the table [m]: that of the cell's plane."""
        size = self._scene.geom("table").size
        return 2 * float(size[0]), 2 * float(size[1])

    def edit_model_xml(self, xml_str: str) -> str:
        return with_cell(super().edit_model_xml(xml_str), self.cell, self._height, HAND)

    def _initialize_sim(self, xml_string: str | None = None) -> None:
        self._forces.close()  # they belong to the model that goes
        super()._initialize_sim(xml_string)

    def close(self) -> None:
        """Let go of the simulation and of the forces on it."""
        self._forces.close()
        super().close()

    def initialize_time(self, control_freq: float) -> None:
        super().initialize_time(control_freq)
        self.model_timestep = float(self.native_model.opt.timestep)

    def _setup_references(self) -> None:
        super()._setup_references()
        self._map = mapping(self._scene, self.native_model, self._height)

    def _reset_internal(self) -> None:
        super()._reset_internal()
        middle = np.array([0.5 * (a.low + a.high) for a in self.cell.action])
        self._prepare(self.cell.defaults, middle)

    def _setup_observables(self) -> Any:
        observables = super()._setup_observables()
        for obj in self.cell.objects:
            observables[f"{obj.name}_state"] = Observable(
                f"{obj.name}_state", self._object_sensor(obj.name), sampling_rate=self.control_freq
            )
        return observables

    def _object_sensor(self, name: str) -> Any:
        columns = [i for i, owner in enumerate(self.cell.channels) if owner == name]

        @sensor(modality="object")  # type: ignore[untyped-decorator]
        def state(obs_cache: Any) -> Floats:
            return self.observed()[columns]

        state.__name__ = f"{name}_state"
        return state

    def reward(self, action: Any = None) -> float:
        """1 where the task is done."""
        return float(self._check_success())

    # --- the cell -----------------------------------------------------------------------------------------------------

    @property
    def native_model(self) -> mujoco.MjModel:
        """MuJoCo's own model inside robosuite's wrapper, which has no public name for it."""
        return self.sim.model._model  # noqa: SLF001

    @property
    def _data(self) -> mujoco.MjData:
        return self.sim.data._data  # noqa: SLF001

    def in_site(self, site: str, xy: Floats) -> bool:
        """Whether a point of the table [m] is within a round site of the cell's scene."""
        there = self._scene.site(site)
        return bool(np.linalg.norm(xy - there.pos[:2]) < there.size[0])

    def set_parameters(self, values: Floats) -> None:
        """Write (P,) values of the cell's parameters into robosuite's model, under the same names."""
        self._values = values
        self._dynamics.apply([self._scene], values[None])
        self._map.write(self._scene, self.native_model)
        mujoco.mj_setConst(self.native_model, mujoco.MjData(self.native_model))
        self._servo = servo(self._scene, self._tool)
        sliding = self._dynamics.sliding(values[None])
        terms = [table_friction(s, Places(self.native_model)) for s in sliding]
        self._forces.close()
        self._forces.enter_context(Programs([self.native_model], terms))

    def observed(self) -> Floats:
        """(C,) what the tracker would say now."""
        own = self._scene_data
        own.qpos[:], own.qvel[:] = self._map.get(self._data)
        mujoco.mj_forward(self._scene, own)
        row = np.concatenate([own.qpos, own.qvel, own.act, own.sensordata])[self._dynamics.columns()]
        return np.asarray(self._dynamics.observe(self._values[None], row[None, None])[0, 0])

    def play(self, values: Floats, inputs: Floats) -> Floats:
        """(S, C) what the tracker would say at times 0, dt, ..., horizon dt, for (P,) values and (A,) inputs."""
        self._prepare(values, inputs)
        per_step = round(self.cell.control_dt / self.model_timestep)
        steps = per_step * self.cell.horizon
        controls = self._dynamics.controls(values[None], inputs[None], steps)[0]
        speeds = np.zeros(controls.shape[1])
        seen = []
        for i in range(steps):
            if i % per_step == 0:
                seen.append(self.observed())
            speeds = self._drive(controls[i], speeds)
        return np.stack([*seen, self.observed()])

    def _prepare(self, values: Floats, inputs: Floats) -> None:
        """Parameters in, everything at its start, the hand above the tool (or the thing that it lets go)."""
        self.set_parameters(values)
        mujoco.mj_resetData(self.native_model, self._data)
        positions, velocities = self._dynamics.start(values[None], inputs[None])
        self._map.put(positions[0], velocities[0], self._data)
        held = self.native_model.body(self._tool or self.cell.objects[0].name).id
        robot = self.robots[0]
        joints = np.array(robot._ref_joint_pos_indexes)  # noqa: SLF001 - robosuite's environments do so too
        self._data.qpos[joints] = robot.init_qpos
        mujoco.mj_forward(self.native_model, self._data)
        target = self._data.xpos[held] + [0, 0, HAND_ABOVE]
        reach(self.native_model, self._data, self.native_model.site(GRIP_SITE).id, joints, target)
        mujoco.mj_forward(self.native_model, self._data)
        if self._tool:
            grip = self.native_model.equality(GRIP).id
            self.native_model.eq_data[grip, :3] = 0, 0, HAND_ABOVE
            hand = self.native_model.body(HAND).id
            place = self._data.xmat[hand].reshape(3, 3).T @ (target - self._data.xpos[hand])
            self.native_model.eq_data[grip, 3:6] = place
        self._place = target
        arm = robot.part_controllers["right"]
        arm.update(force=True)
        arm.update_initial_joints(self._data.qpos[joints].copy())

    def _drive(self, command: Floats, speed: Floats) -> Floats:
        """One physics step under (nu,) commands [m/s]; takes and returns the (nu,) speeds that the hand is to have.

        The hand moves as the cell's tool on its servos would, under the command and under the forces that push the tool
        (admittance control: the arm is heavier than the tool). robosuite's operational-space controller follows. It
        computes kp (goal - place) - kd velocity, so a goal that lies ahead makes up for speed and acceleration.
        """
        self.sim.step1()
        robot = self.robots[0]
        arm = robot.part_controllers["right"]
        arm.update()
        after, fast, feed = speed, np.zeros(3), np.zeros(3)
        if len(speed):
            axes = np.arange(len(speed))
            push = contact_force(self.native_model, self._data, self.native_model.geom(self._tool).id)[axes]
            after = self._servo.follow(command, push, speed, self.model_timestep)
            fast[axes], feed[axes] = after, (after - speed) / self.model_timestep
            self._place[axes] += after * self.model_timestep
        arm.kp, arm.kd = _KP, 2 * np.sqrt(_KP)
        goal = self._place + (feed + arm.kd[:3] * fast) / arm.kp[:3]
        arm.goal_pos = arm.world_to_origin_frame(goal)
        robot.control(np.zeros(robot.action_dim), policy_step=False)
        self.sim.step2()
        return after
