"""Recorded inputs as what MuJoCo is driven with: controls, joint forces, wrenches and mocap poses at each time step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np

from compass_ros.cells.cell import Cell
from compass_ros.cells.fields import rows
from compass_ros.cells.series import InputSpec, Numbers
from compass_ros.errors import ConfigError, nearest
from compass_ros.types import Floats, Ints

_STATE = mujoco.mjtState
_PARTS = (_STATE.mjSTATE_CTRL, _STATE.mjSTATE_QFRC_APPLIED, _STATE.mjSTATE_XFRC_APPLIED, _STATE.mjSTATE_MOCAP_POS,
          _STATE.mjSTATE_MOCAP_QUAT)  # fmt: skip
"""In the order in which MuJoCo packs them."""
_OF_TARGET = {"ctrl": 0, "qfrc": 1, "xfrc": 2, "mocap": 3}
_ONE = {int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)}
FIELDS = {"input_delay_s": "delay_s", "input_scale": "scale", "input_offset": "offset"}
"""Parameters of an input, and the number of its YAML that each takes the place of."""
RUN_IN_S = 1.0
"""How long before a window its commands count, for drives that remember them (a lag, a play, a profile): a robot under
position control forgets where it began within a second. A lag of 0.1 s, a play and a profile that can follow are then
as if they had followed the whole recording, to 1 mrad (`pytest test/series/test_windows.py -k memory`)."""
KEPT = 256
"""Series at time steps that are kept, since every rollout of a window asks for them: a budget of memory, 36 MB for
seven joints in windows of 5 s at 2 ms. Working them out anew takes a tenth of a search on a two-joint arm."""


@dataclass(frozen=True, eq=False)
class Drive:
    """The recorded inputs of one episode or window, one for each input of the cell."""

    time_s: tuple[Floats, ...]
    """(n,) each, since its start, increasing."""
    value: tuple[Floats, ...]
    """(n, D) each, without gaps."""


class Drives:
    """The inputs of a cell, bound to its scene. Raises ConfigError where they name what the scene lacks."""

    def __init__(self, cell: Cell, model: mujoco.MjModel) -> None:
        where = str(cell.path)
        _check_parameters(cell, where)
        self._column = cell.input_names.index("window") if cell.spec.inputs else -1
        used = {0} if model.nu else set()
        for spec in cell.spec.inputs:
            used.add(_OF_TARGET[spec.to])
            used |= {4} if spec.to == "mocap" else set()
        self._offsets: dict[int, int] = {}
        self.size, parts = 0, 0
        for i in sorted(used):
            self._offsets[i] = self.size
            self.size += mujoco.mj_stateSize(model, _PARTS[i].value)
            parts |= _PARTS[i].value
        self.parts = parts
        """mjtState bits of a row of controls."""
        self._rest = _at_rest(model, self._offsets, self.size)
        self._bound = [
            _Bound(cell, spec, self._places(model, spec, where), _followers(model, spec, where), where)
            for spec in cell.spec.inputs
        ]
        self.commanded = frozenset(range(model.nu)) - {a for b in self._bound for a in b.followers}
        """Actuators that are told what to do; the others follow what was measured."""

    def begin(self, positions: Floats, values: Floats, inputs: Floats, bank: Sequence[Drive]) -> None:
        """Put the joints that follow a measured path where it begins, in (B, nq) positions."""
        if not bank:
            return
        window = inputs[:, self._column].astype(int)
        for i, bound in enumerate(self._bound):
            bound.begin(positions, values, window, [d.time_s[i] for d in bank], [d.value[i] for d in bank])

    def fill(
        self, controls: Floats, values: Floats, inputs: Floats, bank: Sequence[Drive], time_step: float, early: int = 0
    ) -> Floats:
        """(B, T, size) what drives MuJoCo: (B, T, nu) controls with the recorded inputs of each row's window in place.

        (B, P) values of the cell's parameters, (B, A) inputs; the last of these says which Drive of the bank. Without a
        bank nothing is recorded, and what is driven rests. `early`: how many of the steps lie before the window.
        """
        batch, steps, nu = controls.shape
        out = np.empty((batch, steps, self.size))
        out[:] = self._rest
        out[..., :nu] = controls
        window = inputs[:, self._column].astype(int)
        for i, bound in enumerate(self._bound if bank else ()):
            bound.write(out, values, window, bank, i, (time_step, early))
        return out

    def _places(self, model: mujoco.MjModel, spec: InputSpec, where: str) -> Ints:
        """(D,) places of the numbers in a row of controls."""
        here, part = f"{where}: inputs: {spec.name}", _OF_TARGET[spec.to]
        kind = {"ctrl": "actuator", "qfrc": "dof"}.get(spec.to, "body")
        if part <= 1:
            found = [int(rows(model, kind, target, here)[0]) for target in spec.targets]
            return np.array(found, dtype=np.int64) + int(self._offsets[part])
        body = int(rows(model, "body", spec.at[0], here)[0])
        if spec.to == "xfrc":
            return np.arange(6, dtype=np.int64)[: len(spec.numbers)] + int(self._offsets[part] + 6 * body)
        mocap = int(model.body_mocapid[body])
        if mocap < 0:
            raise ConfigError(f"{here}: body '{spec.at[0]}' is no mocap body")
        position = np.arange(3, dtype=np.int64) + int(self._offsets[3] + 3 * mocap)
        turn = np.arange(4, dtype=np.int64) + int(self._offsets[4] + 4 * mocap)
        places: Ints = np.concatenate([position, turn])[: len(spec.numbers)]
        return places


class _Bound:
    """One input: where it goes, which parameters move it, and which actuators only follow it."""

    def __init__(
        self, cell: Cell, spec: InputSpec, places: Ints, followers: Mapping[int, _Follower], where: str
    ) -> None:
        self._spec, self._places, self.followers = spec, places, followers
        self._rated = np.array([f.rated for f in followers.values()] or [False] * len(places))
        self._numbers = {name: _Number(cell, spec, name, getattr(spec, name), where) for name in FIELDS.values()}

    def write(
        self, out: Floats, values: Floats, window: Ints, bank: Sequence[Drive], which: int, clock: tuple[float, int]
    ) -> None:
        delay, scale, offset = (self._numbers[name].of(values) for name in ("delay_s", "scale", "offset"))
        # Rows of one window with one delay share their series: of a Jacobian's rows nearly all do.
        keys, same = np.unique(np.column_stack([window, delay]), axis=0, return_inverse=True)
        rated, linear = tuple(self._rated), self._spec.hold == "linear"
        for k, key in enumerate(keys):
            means = _at_steps(bank[int(key[0])], which, tuple(key[1:]), rated, linear, out.shape[1], clock)
            for row in np.flatnonzero(same.ravel() == k):
                out[row][:, span(self._places)] = means * scale[row] + np.where(self._rated, 0.0, offset[row])

    def begin(self, positions: Floats, values: Floats, window: Ints, time_s: list[Floats], value: list[Floats]) -> None:
        scale, offset = (self._numbers[name].of(values) for name in ("scale", "offset"))
        for number, follower in enumerate(self.followers.values()):
            first = [float(np.interp(0.0, time_s[own], value[own][:, number])) for own in window]
            positions[:, follower.joint] = np.array(first) * scale[:, number] + offset[:, number]


@dataclass(frozen=True)
class _Follower:
    """An actuator that follows a measured path."""

    joint: int
    """Place of its joint in qpos."""
    rated: bool
    """Whether it is told a velocity."""


def _followers(model: mujoco.MjModel, spec: InputSpec, where: str) -> dict[int, _Follower]:
    """By actuator, in the order of the numbers; empty where the input is a command."""
    out = {}
    for target in spec.targets if spec.measured else ():
        actuator = int(rows(model, "actuator", target, f"{where}: inputs: {spec.name}")[0])
        joint, bias = int(model.actuator_trnid[actuator, 0]), model.actuator_biasprm[actuator]
        servo = int(model.actuator_biastype[actuator]) == mujoco.mjtBias.mjBIAS_AFFINE and (bias[1] or bias[2])
        on_joint = int(model.actuator_trntype[actuator]) == mujoco.mjtTrn.mjTRN_JOINT
        if not (servo and on_joint and int(model.jnt_type[joint]) in _ONE):
            said = "expected a position or velocity servo of a hinge or slide"
            raise ConfigError(f"{where}: inputs: {spec.name}: measured: actuator '{target}': {said}")
        out[actuator] = _Follower(int(model.jnt_qposadr[joint]), not bias[1])
    return out


class _Number:
    """Delay, scale or offset of an input: what the YAML says, or parameters of the cell."""

    def __init__(self, cell: Cell, spec: InputSpec, name: str, given: Numbers, where: str) -> None:
        size = len(spec.numbers)
        self._fixed = np.broadcast_to(np.asarray(given, float), size).copy()
        self._parameter = np.full(size, -1)
        for p, parameter in enumerate(cell.spec.parameters):
            field, _, index = parameter.field.rstrip("]").partition("[")
            if FIELDS.get(field) != name or parameter.of != spec.name:
                continue
            if index and int(index) >= size:
                raise ConfigError(f"{where}: {parameter.name}: '{spec.name}' has {size} numbers, found index {index}")
            self._parameter[int(index) if index else slice(None)] = p

    def of(self, values: Floats) -> Floats:
        """(B, D) for (B, P) values."""
        out = np.tile(self._fixed, (len(values), 1))
        tuned = np.flatnonzero(self._parameter >= 0)
        out[:, tuned] = values[:, self._parameter[tuned]]
        return out


@lru_cache(maxsize=KEPT)
def _at_steps(
    drive: Drive,
    which: int,
    delay: tuple[float, ...],
    rated: tuple[bool, ...],
    linear: bool,
    steps: int,
    clock: tuple[float, int],
) -> Floats:
    """(T, D) of one input of a drive, each number late by its delay: its mean over each time step; its rate, where that
    is asked for. `clock`: the time step, and how many of the steps lie before time 0. Not to be changed."""
    time_s, value = drive.time_s[which], drive.value[which]
    edges, late = clock[0] * np.arange(-clock[1], steps - clock[1] + 1), np.array(delay)
    means = held(time_s, value, edges, late, linear)
    if any(rated):
        means = np.where(rated, _rates(time_s, value, edges, late), means)
    means.flags.writeable = False
    return means


def held(time_s: Floats, value: Floats, edges: Floats, delay: Floats, linear: bool) -> Floats:
    """(T, D) of a series, each number late by its delay: its mean over each time step.

    The mean and not the value at the beginning: so a delay of a part of a step counts, and motion is smooth in it.
    Before the first stamp and after the last the series holds.
    """
    out = np.empty((len(edges) - 1, value.shape[1]))
    for delayed in np.unique(delay):
        columns = np.flatnonzero(delay == delayed)
        at = edges - delayed
        known = np.concatenate([[min(time_s[0], at[0]) - 1.0], time_s, [max(time_s[-1], at[-1]) + 1.0]])
        first = np.concatenate([value[:1], value])[:, columns]
        rise = np.zeros_like(first)
        if linear:
            rise[1:-1] = np.diff(value[:, columns], axis=0)
        place = np.clip(np.searchsorted(known, at, side="right") - 1, 0, len(first) - 1)
        # A step that lies between two stamps has the held value itself, to the last bit.
        steps = np.arange(len(out)) if linear else np.flatnonzero(place[1:] != place[:-1])
        values = np.take(first, place[:-1], axis=0)  # several times as fast as an index
        area = _area(
            known, first, rise, np.stack([at[steps], at[steps + 1]]), np.stack([place[steps], place[steps + 1]])
        )
        values[steps] = np.diff(area, axis=0)[0] / (at[steps + 1] - at[steps])[:, None]
        out[:, span(columns)] = values
    return out


def _rates(time_s: Floats, value: Floats, edges: Floats, delay: Floats) -> Floats:
    """(T, D) mean rate of the lines between a series' rows over each time step, each number late by its delay."""
    rates = [np.diff(np.interp(edges - late, time_s, own)) for late, own in zip(delay, value.T, strict=True)]
    return np.asarray(np.stack(rates, axis=1) / np.diff(edges)[:, None])


def _area(known: Floats, first: Floats, rise: Floats, at: Floats, place: Ints) -> Floats:
    """(..., D) integral of a series up to (...) times, which lie in (...) intervals between (n + 1,) known stamps.

    (n, D) what it is at the beginning of each interval, and by how much it rises in it.
    """
    length = np.diff(known)[:, None]
    whole = np.concatenate([np.zeros((1, first.shape[1])), np.cumsum((first + 0.5 * rise) * length, axis=0)])
    since = (at - known[place])[..., None]
    slope = rise[place] / length[place]
    return np.asarray(whole[place] + (first[place] + 0.5 * slope * since) * since)


def span(places: Ints) -> Ints | slice:
    """The same places as a slice where they follow each other, which numpy copies several times as fast."""
    if len(places) and (np.diff(places) == 1).all():
        return slice(int(places[0]), int(places[-1]) + 1)
    return places


def _check_parameters(cell: Cell, where: str) -> None:
    """Parameters of inputs name one that there is."""
    known = [spec.name for spec in cell.spec.inputs]
    for parameter in cell.spec.parameters:
        if parameter.field.partition("[")[0] in FIELDS and parameter.of not in known:
            listed = ", ".join(known) or "none"
            said = f"the cell has no input '{parameter.of}'; it has {listed}{nearest(parameter.of, known)}"
            raise ConfigError(f"{where}: {parameter.name}: of: {said}")


def _at_rest(model: mujoco.MjModel, offsets: dict[int, int], size: int) -> Floats:
    """(size,) a row of controls where nothing is driven: mocap bodies where the scene has them."""
    data, rest = mujoco.MjData(model), np.zeros(size)
    for part, offset in offsets.items():
        count = mujoco.mj_stateSize(model, _PARTS[part].value)
        mujoco.mj_getState(model, data, rest[offset : offset + count], _PARTS[part].value)
    return rest
