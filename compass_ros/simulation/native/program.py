"""Programs of compiled forces, one a model, and the one place that installs MuJoCo's global passive-force callback."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cache
from pathlib import Path

import mujoco
import numpy as np

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


class Placement(IntEnum):
    """Where a force goes: two sliding joints in the plane, a free body, or a joint of its own."""

    PLANAR = 0
    BODY = 1
    JOINT = 2


@dataclass(frozen=True)
class Term:
    """One kind of force on one object (contact kinds: on all contacts), with numbers for each rollout of a batch."""

    kind: Kind
    object: str
    """Name of the body or joint in the scene; empty for contact kinds."""
    numbers: Floats
    """(B, up to NUMBERS) in the order that fields.c documents for the kind."""


@dataclass(frozen=True)
class Programs:
    """The programs of a batch, registered while the context is open. Keeps the memory that C reads alive."""

    models: Sequence[mujoco.MjModel]
    terms: Sequence[Term]
    _memory: list[np.ndarray] = field(default_factory=list)

    def __enter__(self) -> Programs:
        library = _library()
        if not self.terms:
            return self
        block = np.zeros((len(self.models), len(self.terms)), _TERM)
        for i, term in enumerate(self.terms):
            block["kind"][:, i] = term.kind
            if term.object:
                placement, identity, dof = _place(self.models[0], term.object)
                block["object"][:, i], block["id"][:, i], block["dof"][:, i] = placement, identity, dof
            block["number"][:, i, : term.numbers.shape[1]] = term.numbers
        programs = np.zeros(len(self.models), _PROGRAM)
        programs["n"] = len(self.terms)
        programs["term"] = block.ctypes.data + block.strides[0] * np.arange(len(self.models))
        self._memory.extend((block, programs))
        for b, model in enumerate(self.models):
            library.compass_register(model._address, programs.ctypes.data + b * programs.strides[0])
        return self

    def __exit__(self, *_: object) -> None:
        library = _library()
        for model in self.models:
            library.compass_register(model._address, None)
        self._memory.clear()


def evaluate(term: Term, states: Floats, gravity: float) -> Floats:
    """(B, F, 2) planar forces [N] of a term in (B, F, 6) states: x, y, vx, vy, mass, time. Same code as in a rollout."""
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


def _place(model: mujoco.MjModel, name: str) -> tuple[Placement, int, int]:
    """How the forces on a body (or joint) of that name reach the model's degrees of freedom."""
    joint_id = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if joint_id >= 0:
        return Placement.JOINT, joint_id, int(model.jnt_dofadr[joint_id])
    body = model.body(name)
    dof = int(body.dofadr[0])
    kinds = model.jnt_type[body.jntadr[0] : body.jntadr[0] + body.jntnum[0]].tolist()
    planar = kinds[:2] == [mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_SLIDE]
    return Placement.PLANAR if planar else Placement.BODY, int(body.id), dof


@cache
def _library() -> ctypes.CDLL:
    """Load the compiled forces and install the callback, once a process. Models without a program do not notice it."""
    folder = Path(__file__).parent
    (path,) = folder.glob("_fields*.so")
    library = ctypes.CDLL(str(path))
    core = ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("libmujoco.so*"))))
    library.compass_register.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    library.compass_register.restype = None
    library.compass_evaluate.argtypes = [ctypes.c_int64, *2 * [ctypes.c_void_p], ctypes.c_double, ctypes.c_void_p]
    library.compass_evaluate.restype = None
    library.compass_init.argtypes = [ctypes.c_void_p]
    library.compass_init(ctypes.cast(core.mj_applyFT, ctypes.c_void_p))
    callback = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
    mujoco.set_mjcb_passive(ctypes.cast(library.compass_passive, callback))
    return library
