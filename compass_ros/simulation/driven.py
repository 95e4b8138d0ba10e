"""The joints that a recorded input drives: what they may do, and what a motion asks of them at the cell's values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.drives import Drive
from compass_ros.cells.keyframe import begun
from compass_ros.cells.series import OF_JOINTS, InputSpec
from compass_ros.errors import ConfigError
from compass_ros.simulation.simulator import Simulator
from compass_ros.simulation.sites import OF_JOINT
from compass_ros.types import Bools, Episode, Floats, Ints, Track

FIRST_NS = 1_700_000_000_000_000_000
_BETWEEN_NS = 10**11
"""From the start of one virtual recording to that of the next."""
SETTLED_S = 2.0
"""How long the first target was held before a recording begins; a torque is not held, an arm would fall."""
_NEAR = 0.1
"""Share of a joint's range: nearer to an end there is no room for a motion."""


@dataclass(frozen=True)
class Driven:
    """D joints that are driven by the one input of a cell."""

    spec: InputSpec
    joints: tuple[str, ...]
    units: tuple[str, ...]
    """Of their positions: rad or m."""
    home: Floats
    """(D,) where the scene begins; the middle of the range where that is outside it or near its end."""
    low: Floats
    high: Floats
    """(D,) range of the joint and of what its servo can be told; infinite where there is none."""
    effort: Floats
    """(D,) largest force of the drives [N m or N]; infinite where the scene says none."""
    force: Floats
    """(D,) joint force of a command of 1, where forces are commanded; else 1."""

    @property
    def without_range(self) -> tuple[str, ...]:
        """Joints that the scene lets turn or slide for ever."""
        free = np.isinf(self.low) | np.isinf(self.high)
        return tuple(joint for joint, one in zip(self.joints, free, strict=True) if one)

    @property
    def settled_s(self) -> float:
        return 0.0 if self.spec.quantity == "joint_effort" else SETTLED_S

    def between(self, seen: Mapping[str, tuple[float, float]]) -> Driven:
        """The same, with the least and largest place of a joint in the place of a range that the scene leaves open."""
        low, high, home = self.low.copy(), self.high.copy(), self.home.copy()
        for joint in self.without_range:
            if joint in seen:
                i = self.joints.index(joint)
                low[i], high[i] = seen[joint]
                home[i] = home[i] if low[i] < home[i] < high[i] else 0.5 * (low[i] + high[i])
        return replace(self, low=low, high=high, home=home)


@dataclass(frozen=True)
class Asked:
    """What B motions ask of D joints, in F frames."""

    position: Floats
    speed: Floats
    effort: Floats
    """(B, F, D) each, SI; the effort is what actuators and applied forces exert on the joint."""
    touches: Bools
    """(B,) whether geoms touch that do not where the motion begins."""


def driven_joints(simulator: Simulator) -> Driven:
    """Raises ConfigError where the cell's inputs are not one series for joints."""
    cell, model = simulator.cell, simulator.physics.model
    inputs = cell.spec.inputs
    if len(inputs) != 1 or inputs[0].quantity not in OF_JOINTS or inputs[0].to not in ("ctrl", "qfrc"):
        said = ", ".join(f"{i.name} ({i.quantity} to {i.to})" for i in inputs) or "none"
        raise ConfigError(f"{cell.path}: inputs: expected one of joint positions, velocities or efforts, found {said}")
    spec = inputs[0]
    if spec.measured:
        raise ConfigError(f"{cell.path}: inputs: {spec.name}: it was measured, and nobody can play it")
    actuators = [model.actuator(name).id for name in spec.targets] if spec.to == "ctrl" else []
    if any(int(model.actuator_trntype[a]) not in OF_JOINT for a in actuators):
        raise ConfigError(f"{cell.path}: inputs: {spec.name}: its actuators do not act on single joints")
    joints = [int(model.actuator_trnid[a, 0]) for a in actuators] or [model.joint(name).id for name in spec.targets]
    forces = spec.quantity == "joint_effort"
    low, high = _ranges(model, joints, [] if forces else actuators)
    home = begun(model).qpos[model.jnt_qposadr[joints]]
    limited = np.isfinite(low) & np.isfinite(high)
    near = limited & (np.minimum(home - low, high - home) < _NEAR * (high - low))
    home[near] = 0.5 * (low[near] + high[near])
    slides = model.jnt_type[joints] == mujoco.mjtJoint.mjJNT_SLIDE
    force = model.actuator_gear[actuators, 0] * model.actuator_gainprm[actuators, 0] if forces and actuators else 1.0
    return Driven(
        spec,
        tuple(model.joint(j).name for j in joints),
        tuple("m" if slide else "rad" for slide in slides),
        home,
        low,
        high,
        _efforts(model, joints, actuators, forces),
        np.broadcast_to(force, len(joints)).astype(float),
    )


def _ranges(model: mujoco.MjModel, joints: list[int], servos: list[int]) -> tuple[Floats, Floats]:
    """(D,) lowest and highest position of joints, and of what their servos can be told."""
    limited = model.jnt_limited[joints].astype(bool)
    low, high = (np.where(limited, model.jnt_range[joints, end], (-np.inf, np.inf)[end]) for end in (0, 1))
    for i, servo in enumerate(servos):
        if model.actuator_ctrllimited[servo] and model.actuator_biasprm[servo, 1]:
            low[i], high[i] = (
                max(low[i], model.actuator_ctrlrange[servo, 0]),
                min(high[i], model.actuator_ctrlrange[servo, 1]),
            )
    return low, high


def _efforts(model: mujoco.MjModel, joints: list[int], actuators: list[int], forces: bool) -> Floats:
    """(D,) largest joint force: of the joint, of the actuator, of what a motor can be told."""
    out = np.where(model.jnt_actfrclimited[joints], np.abs(model.jnt_actfrcrange[joints]).min(axis=1), np.inf)
    for i, a in enumerate(actuators):
        gear = abs(float(model.actuator_gear[a, 0]))
        if model.actuator_forcelimited[a]:
            out[i] = min(out[i], gear * np.abs(model.actuator_forcerange[a]).min())
        if forces and model.actuator_ctrllimited[a]:
            gain = gear * abs(float(model.actuator_gainprm[a, 0]))
            out[i] = min(out[i], gain * np.abs(model.actuator_ctrlrange[a]).min())
    return np.asarray(out, float)


def asked(simulator: Simulator, driven: Driven, time_s: Floats, series: Floats, posture: Floats) -> Asked:
    """What (B, F, D) series of the input at (F,) times [s] ask, at the cell's defaults.

    (B, D) posture in which they begin, at rest.
    """
    model = simulator.physics.model
    player = simulator.driven([_drive(driven, time_s, own) for own in series])
    values, inputs = np.tile(player.defaults, (len(series), 1)), _inputs(player.cell, driven, posture)
    states, controls = player.states(values, inputs, driven.settled_s + float(time_s[-1]))
    frames = np.round((driven.settled_s + time_s) / player.time_step).astype(int)
    frames = np.minimum(frames, states.shape[1] - 1)
    joints = [model.joint(name).id for name in driven.joints]
    places, dofs = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
    chosen = states[:, frames]
    effort, contacts = _forces(player, chosen, controls[:, np.minimum(frames, controls.shape[1] - 1)], dofs)
    position, speed = chosen[..., 1 + places], chosen[..., 1 + model.nq + dofs]
    return Asked(position, speed, effort, np.asarray(contacts.max(axis=1) > contacts[:, 0]))


def _forces(simulator: Simulator, states: Floats, controls: Floats, dofs: Ints) -> tuple[Floats, Ints]:
    """(B, F, D) forces of actuators and applied ones on some degrees of freedom, (B, F) numbers of contacts."""
    model, parts = simulator.physics.model, simulator.physics.drives.parts
    data = mujoco.MjData(model)
    effort, contacts = np.empty((*states.shape[:2], len(dofs))), np.empty(states.shape[:2], int)
    for place in np.ndindex(*states.shape[:2]):
        mujoco.mj_setState(model, data, states[place], mujoco.mjtState.mjSTATE_FULLPHYSICS.value)
        mujoco.mj_setState(model, data, controls[place], parts)
        mujoco.mj_forward(model, data)
        effort[place] = data.qfrc_actuator[dofs] + data.qfrc_applied[dofs]
        contacts[place] = data.ncon
    return effort, contacts


def virtual_recordings(
    simulator: Simulator,
    driven: Driven,
    values: Floats,
    time_s: Floats,
    series: Floats,
    posture: Floats,
    rng: np.random.Generator,
) -> list[Episode]:
    """What would be recorded of B motions at (P,) values: the (B, F, D) series and the signals at (F,) times [s].

    They begin in (B, D) postures, the first command having been held for SETTLED_S. Noise and steps of the signals are
    those that the cell states.
    """
    (seen,) = played(simulator, driven, values[None], time_s, series, posture)
    cell, spec = simulator.cell, driven.spec
    return [_episode(cell, spec, i, time_s, own, _measured(cell, seen[i], rng)) for i, own in enumerate(series)]


def played(
    simulator: Simulator, driven: Driven, values: Floats, time_s: Floats, series: Floats, posture: Floats
) -> Floats:
    """(N, B, F, C) signals of B motions at (N, P) values, without noise; motions as in `virtual_recordings`."""
    player = simulator.driven([_drive(driven, time_s, own) for own in series])
    inputs = player.inputs(_inputs(player.cell, driven, posture))
    seen_at = np.tile(driven.settled_s + time_s, (len(values) * len(series), 1))
    seen = player.observe(np.repeat(values, len(series), axis=0), np.tile(inputs, (len(values), 1)), seen_at)
    return np.asarray(seen.reshape(len(values), len(series), *seen.shape[1:]))


def _drive(driven: Driven, time_s: Floats, series: Floats) -> Drive:
    settled = driven.settled_s
    if not settled:
        return Drive((time_s,), (series,))
    return Drive((np.concatenate([[0.0], settled + time_s]),), (np.concatenate([series[:1], series]),))


def _inputs(cell: Cell, driven: Driven, posture: Floats) -> Floats:
    """(B, A) inputs of the cell: motions numbered, driven joints at rest in (B, D) postures."""
    out = np.zeros((len(posture), len(cell.input_names)))
    out[:, -1] = np.arange(len(posture))
    for column, name in enumerate(cell.input_names):
        joint = name.rpartition(".")[0].rpartition(".")[2]
        if name.endswith(".angle") and joint in driven.spec.of:
            out[:, column] = posture[:, driven.spec.of.index(joint)]
    return out


def _measured(cell: Cell, seen: Floats, rng: np.random.Generator) -> Floats:
    """(F, C) what the sensors say: white noise, then whole steps."""
    out = seen.copy()
    for signal in cell.signals:
        noisy = out[:, signal.columns] + (signal.noise or 0.0) * rng.normal(size=(len(seen), signal.size))
        out[:, signal.columns] = signal.step * np.round(noisy / signal.step) if signal.step else noisy
    return out


def _episode(cell: Cell, spec: InputSpec, index: int, time_s: Floats, series: Floats, measured: Floats) -> Episode:
    start = FIRST_NS + index * _BETWEEN_NS
    stamps = start + np.round(time_s * 1e9).astype(np.int64)
    tracks = tuple(Track(s.name, s.quantity, stamps, measured[:, s.columns]) for s in cell.signals)
    target = Track(spec.name, spec.quantity, stamps, series)
    return Episode(f"motion_{index:02d}", cell.name, cell.hash, {}, start, tracks, inputs=(target,))
