"""Programs of compiled forces, one a model, and the one place that installs MuJoCo's global passive-force callback."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from pathlib import Path

import mujoco
import numpy as np

from compass_ros.errors import ConfigError, nearest
from compass_ros.types import Floats

NUMBERS = 8
_TERM = np.dtype([("kind", "i4"), ("object", "i4"), ("id", "i4"), ("dof", "i4"), ("number", "f8", (NUMBERS,))])
_PROGRAM = np.dtype([("n", "i8"), ("term", "u8")])


class Kind(IntEnum):
    """Forces that fields.c knows; same order and values there."""

    TABLE_FRICTION = 1
    UNIFORM = 2
    VISCOUS = 3
    QUADRATIC = 4
    CROSSWIND = 5
    FAN = 6
    SWIRL = 7
    ATTRACTION = 8
    FRICTION_PATCH = 9
    FRICTION_GRADIENT = 10
    ANISOTROPIC = 11
    STRIBECK = 12
    COULOMB = 13
    MAGNUS = 14
    PULSATING = 15
    RATE_RESTITUTION = 16
    TANGENTIAL = 17
    LIBRARY = 18
    HAT = 19
    TILT = 20


class Placement(IntEnum):
    """Where a force goes: joints that slide along x and y (and turn about z), any moving body, or a joint."""

    PLANAR = 0
    BODY = 1
    JOINT = 2
    PLANAR_YAW = 3


@dataclass(frozen=True)
class Term:
    """One kind of force on one object (contact kinds: on all contacts), with numbers for each rollout of a batch."""

    kind: Kind
    object: str
    """Name of the body or joint in the scene; empty for contact kinds."""
    numbers: Floats
    """(B, up to NUMBERS) in the order that fields.c documents for the kind."""


class Programs:
    """The programs of a batch of models that are alike, registered while the context is open.

    Keeps the memory that C reads alive. Raises ConfigError where an object of a term is no moving body or joint of the
    models, or where a model has a program already.
    """

    def __init__(self, models: Sequence[mujoco.MjModel], terms: Sequence[Term]) -> None:
        self._models = list(models) if terms else []
        self._block = np.zeros((len(models), len(terms)), _TERM)
        for i, term in enumerate(terms):
            row = self._block[:, i]
            row["kind"] = term.kind
            if term.object:
                row["object"], row["id"], row["dof"] = _place(models[0], term.object)
            row["number"][:, : term.numbers.shape[1]] = term.numbers
        self._programs = np.zeros(len(models), _PROGRAM)
        self._programs["n"] = len(terms)
        self._programs["term"] = self._block.ctypes.data + self._block.strides[0] * np.arange(len(models))

    def __enter__(self) -> Programs:
        library = _library()
        at, stride = self._programs.ctypes.data, self._programs.strides[0]
        for b, model in enumerate(self._models):
            if not library.compass_register(_address(model), at + b * stride):
                self._forget(self._models[:b])
                raise ConfigError(
                    "forces cannot be attached: the model has forces already (detach those first), "
                    "or too many models have some"
                )
        return self

    def __exit__(self, *_: object) -> None:
        self._forget(self._models)

    @staticmethod
    def _forget(models: Sequence[mujoco.MjModel]) -> None:
        library = _library()
        for model in models:
            library.compass_forget(_address(model))


def evaluate(term: Term, states: Floats, gravity: float) -> Floats:
    """(B, F, 2) planar forces [N] of a term in (B, F, 6) states (x, y, vx, vy, mass, time); the code of a rollout."""
    batch, frames = states.shape[:2]
    rows = np.zeros((batch, frames), _TERM)
    rows["kind"] = term.kind
    rows["number"][:, :, : term.numbers.shape[1]] = term.numbers[:, None]
    given = np.ascontiguousarray(states, dtype=np.float64)
    out = np.zeros((batch, frames, 2))
    _library().compass_evaluate(
        batch * frames, rows.ctypes.data, given.ctypes.data, ctypes.c_double(gravity), out.ctypes.data
    )
    return out


def _address(model: mujoco.MjModel | mujoco.MjSpec) -> int:
    """Of what C calls mjModel (the one that the callback will see) or mjSpec."""
    return int(model._address)  # noqa: SLF001 - MuJoCo offers it under this name alone


def _place(model: mujoco.MjModel, name: str) -> tuple[Placement, int, int]:
    """How the forces on a body (or joint) of that name reach the degrees of freedom; its id; the first of them."""
    joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if joint >= 0:
        return Placement.JOINT, joint, int(model.jnt_dofadr[joint])
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    if body < 0 or not model.body_weldid[body]:
        moving = [model.body(i).name for i in range(1, model.nbody) if model.body_weldid[i]]
        raise ConfigError(f"the scene has no moving body or joint '{name}'; it moves {moving}{nearest(name, moving)}")
    return _joints_of(model, body), body, int(model.body_dofadr[body])


def _joints_of(model: mujoco.MjModel, body: int) -> Placement:
    """PLANAR or PLANAR_YAW for a body of the world that slides along x and y; BODY for anything else that moves."""
    count = int(model.body_jntnum[body])
    own = slice(model.body_jntadr[body], model.body_jntadr[body] + count)
    planar = [mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE]
    if (
        count in (2, 3)
        and model.body_parentid[body] == 0
        and model.jnt_type[own].tolist() == planar[:count]
        and np.array_equal(model.jnt_axis[own], np.eye(3)[:count])
        and np.array_equal(model.body_quat[body], [1, 0, 0, 0])
        and not model.jnt_pos[own].any()
    ):
        return Placement.PLANAR if count == 2 else Placement.PLANAR_YAW
    return Placement.BODY


@cache
def mujoco_library() -> ctypes.CDLL:
    """MuJoCo's own functions, the few that the package for Python does not hand on."""
    library = ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("libmujoco.so*"))))
    library.mj_copyBack.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    library.mj_saveXML.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_char_p, ctypes.c_int]
    return library


def save_numbers(spec: mujoco.MjSpec, model: mujoco.MjModel, path: Path) -> None:
    """Write a scene as MJCF with the numbers of a model that was compiled from it and changed since."""
    library, said = mujoco_library(), ctypes.create_string_buffer(500)
    if library.mj_copyBack(_address(spec), _address(model)) != 1:
        raise RuntimeError("MuJoCo does not take the model for one of this scene")
    if library.mj_saveXML(_address(spec), str(path).encode(), said, len(said)):
        raise OSError(f"{path}: {said.value.decode()}")


@cache
def _library() -> ctypes.PyDLL:
    """Load the compiled forces and install the callback, once a process. Models without a program do not notice it."""
    folder = Path(__file__).parent
    (path,) = folder.glob("_fields*.so")
    library = ctypes.PyDLL(str(path))  # keeps Python's lock: registering is not made for two threads at once
    library.compass_register.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    library.compass_register.restype = ctypes.c_int
    library.compass_forget.argtypes = [ctypes.c_void_p]
    library.compass_forget.restype = None
    library.compass_evaluate.argtypes = [ctypes.c_int64, *2 * [ctypes.c_void_p], ctypes.c_double, ctypes.c_void_p]
    library.compass_evaluate.restype = None
    library.compass_init.argtypes = [ctypes.c_void_p]
    library.compass_init.restype = None
    library.compass_init(ctypes.cast(mujoco_library().mj_applyFT, ctypes.c_void_p))
    callback = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
    mujoco.set_mjcb_passive(ctypes.cast(library.compass_passive, callback))
    return library


def path_columns(
    model: mujoco.MjModel, name: str
) -> tuple[tuple[int, int, int, int], tuple[float, float, float, float]]:
    """Where a body on the table (or a joint) is in (qpos, qvel): x, y, vx, vy, -1 for none; and its place at qpos 0."""
    placement, identity, dof = _place(model, name)
    if placement is Placement.JOINT:
        return (int(model.jnt_qposadr[identity]), -1, model.nq + dof, -1), (0.0, 0.0, 0.0, 0.0)
    position = int(model.jnt_qposadr[model.body_jntadr[identity]])
    x, y = (float(p) for p in model.body_pos[identity][:2]) if placement is not Placement.BODY else (0.0, 0.0)
    return (position, position + 1, model.nq + dof, model.nq + dof + 1), (x, y, 0.0, 0.0)


def slides_or_turns(model: mujoco.MjModel, name: str) -> bool:
    """Whether a name is a body that slides in the plane, or a joint."""
    if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) >= 0:
        return True
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    return body >= 0 and model.body_jntnum[body] > 0 and _place(model, name)[0] is not Placement.BODY


def mover_masses(model: mujoco.MjModel, names: Sequence[str]) -> Floats:
    """(N,) mass of each mover [kg]; 1 for joints."""
    joints = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) >= 0 for name in names]
    return np.array(
        [1.0 if joint else float(model.body_mass[model.body(n).id]) for n, joint in zip(names, joints, strict=True)]
    )
