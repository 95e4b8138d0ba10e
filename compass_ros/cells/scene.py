"""From a cell to its compiled scene: with sensors for what is tracked, and no shortcut where something is tuned."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

from compass_ros.cells.cell import Beside, Cell
from compass_ros.cells.fields import names
from compass_ros.cells.rotors import add_beside
from compass_ros.cells.scene_source import scene_source
from compass_ros.cells.sensors import add_sensors
from compass_ros.cells.signals import Signal
from compass_ros.cells.spec import ParameterSpec
from compass_ros.errors import ConfigError
from compass_ros.types import Ints

_NUDGE_M = 1e-9
_KEPT = 4
"""Compiled scenes that are kept: a cell is asked for several times, and a robot's meshes take seconds."""


def compiled(cell: Cell) -> tuple[mujoco.MjModel, Ints]:
    """The scene's model, of the caller's own, and the tendons whose spring rests at the length that is drawn.

    Raises ConfigError with MuJoCo's own words in one line.
    """
    nominal, _ = _model(str(cell.model_path), cell.hash)
    simple = _tuned_though_simple(nominal, cell.spec.parameters)
    model, as_drawn = _model(str(cell.model_path), cell.hash, cell.signals, simple, str(cell.path), cell.beside)
    return copy.copy(model), as_drawn


@lru_cache(_KEPT)
def _model(
    path: str,
    content: str,
    signals: tuple[Signal, ...] = (),
    simple: tuple[str, ...] = (),
    where: str = "",
    beside: Beside = ((), ()),
) -> tuple[mujoco.MjModel, Ints]:
    """A scene's model, not to be changed; `content`: hash of its files; `beside`: as `add_beside` has it.

    Raises ConfigError.
    """
    try:
        spec = scene_source(Path(path)).spec
        add_beside(spec, beside)
        if signals:
            add_sensors(spec, _model(path, content)[0], signals, where)
        for name in simple:
            _not_simple(spec.body(name), _model(path, content)[0].body(name))
        model = spec.compile()
    except ValueError as error:
        raise ConfigError(f"{path}: {' '.join(str(error).split())}") from error
    if simple:
        _same_numbers(model, _model(path, content, beside=beside)[0])
    as_drawn = [tendon.id for tendon in spec.tendons if tendon.springlength[0] < 0]
    return model, np.array(as_drawn, np.int64)


def _tuned_though_simple(nominal: mujoco.MjModel, parameters: Sequence[ParameterSpec]) -> tuple[str, ...]:
    """Bodies whose inertial frame or joint's place is tuned, and whose inertia matrix MuJoCo has taken for diagonal."""
    tuned: list[str] = []
    for p in parameters:
        of = [one.strip() for one in p.of.split(",")]
        if p.field.startswith(("body_ipos", "body_iquat", "inertia_turn", "inertia_log_cholesky")):
            tuned += of
        elif p.field.startswith(("jnt_pos", "jnt_axis")):
            found = [mujoco.mj_name2id(nominal, mujoco.mjtObj.mjOBJ_JOINT, one) for one in of]
            tuned += [nominal.body(nominal.jnt_bodyid[joint]).name for joint in found if joint >= 0]
    known = names(nominal, mujoco.mjtObj.mjOBJ_BODY)
    return tuple(n for n in dict.fromkeys(tuned) if n in known and nominal.body_simple[nominal.body(n).id])


def _not_simple(body: mujoco.MjsBody, own: object) -> None:
    """Let MuJoCo take a body's inertia for a full matrix: by saying so, and before MuJoCo 4.0 by placing its centre a
    little beside its frame, whatever its inertia was read from."""
    if hasattr(body, "simple"):
        body.simple = 0
        return
    body.explicitinertial = True
    body.mass, body.inertia, body.iquat = float(own.mass[0]), own.inertia, own.iquat  # type: ignore[attr-defined]
    body.ipos = own.ipos + _NUDGE_M  # type: ignore[attr-defined]
    body.fullinertia = np.full(6, np.nan)  # unset: what it said is in the inertia and the orientation of its axes now
    body.ialt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT


def _same_numbers(model: mujoco.MjModel, nominal: mujoco.MjModel) -> None:
    """Give a model the numbers of another one; what is not a number (structure, flags) and sensors stay its own."""
    for name in dir(nominal):
        numbers = getattr(nominal, name, None)
        if isinstance(numbers, np.ndarray) and numbers.dtype.kind == "f" and not name.startswith("sensor"):
            getattr(model, name)[:] = numbers
