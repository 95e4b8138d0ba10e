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

from compass_ros.cells.rotors import ANCHOR, PREFIX
from compass_ros.errors import ConfigError
from compass_ros.simulation.native.compiled import compiled_forces
from compass_ros.simulation.site_kinds import DRIVES, JOINTS, PLANAR
from compass_ros.simulation.sites import Site
from compass_ros.types import Floats

NUMBERS = 8
_CALLED = ("applyFT", "fwdActuation", "rne", "solveM", "isSparse", "island", "projectConstraint")
"""What fields.c calls of MuJoCo, as `compass_init` takes them."""
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
    SPRING = 21
    ASYMMETRIC = 22
    LOAD_FRICTION = 23
    COGGING = 24
    GRAVITY_TILT = 25
    WIND = 26
    BUOYANCY = 27
    SERVO_DEAD_BAND = 28
    ADHESION = 29
    ROLLING = 30
    PAIR_ATTRACTION = 31
    TETHER = 32
    WINDUP = 33
    TORQUE_SPEED = 34


SLIDING = (Kind.STRIBECK, Kind.FRICTION_PATCH, Kind.FRICTION_GRADIENT, Kind.ANISOTROPIC)
"""Of a body in space these change the friction of its contacts (sliding.h); they are no force at its centre."""


_BESIDE = {
    Kind.STRIBECK: (mujoco.mjtObj.mjOBJ_JOINT, ANCHOR),
    Kind.WINDUP: (mujoco.mjtObj.mjOBJ_TENDON, PREFIX),
}
"""What lies beside a joint (`cells/rotors.py`) and is a term's fifth number: kind of object, and prefix of its name."""


class Placement(IntEnum):
    """Where a force goes: joints that slide along x and y (and turn about z), any moving body, a joint, an actuator, or
    both of two geoms or bodies."""

    PLANAR = 0
    BODY = 1
    JOINT = 2
    PLANAR_YAW = 3
    ACTUATOR = 4
    GEOM_PAIR = 5
    BODY_PAIR = 6


@dataclass(frozen=True)
class Term:
    """One kind of force on one object (contact kinds: on all contacts), with numbers for each rollout of a batch."""

    kind: Kind
    site: Site | None
    """The body or joint in the scene; None for contact kinds."""
    numbers: Floats
    """(B, up to NUMBERS) in the order that fields.c documents for the kind."""


class Programs:
    """The programs of a batch of models that are alike, registered while the context is open.

    Keeps the memory that C reads alive. Raises ConfigError where a model has a program already.
    """

    def __init__(self, models: Sequence[mujoco.MjModel], terms: Sequence[Term]) -> None:
        self._models = list(models) if terms else []
        self._block = np.zeros((len(models), len(terms)), _TERM)
        for i, term in enumerate(terms):
            row = self._block[:, i]
            row["kind"] = term.kind
            if term.site is not None:
                row["object"], row["id"], row["dof"] = _place(models[0], term.site)
            row["number"][:, : term.numbers.shape[1]] = term.numbers
            if term.kind in _BESIDE and term.site is not None and term.site.kind in JOINTS:
                kind, prefix = _BESIDE[term.kind]
                row["number"][:, 4] = mujoco.mj_name2id(models[0], kind, prefix + term.site.name)
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
    """(B, F, 2) forces [N] of a term in (B, F, 6) states (x, y, vx, vy, mass, time); the code of a rollout.

    Of a joint, states are (angle, 0, rate, 0, anything, time) and forces torques, in the first of the two.
    """
    batch, frames = states.shape[:2]
    rows = np.zeros((batch, frames), _TERM)
    rows["kind"] = term.kind
    rows["object"] = Placement.JOINT if term.site is not None and term.site.kind in JOINTS else Placement.PLANAR
    rows["number"][:, :, : term.numbers.shape[1]] = term.numbers[:, None]
    given = np.ascontiguousarray(states, dtype=np.float64)
    out = np.zeros((batch, frames, 2))
    _library().compass_evaluate(
        batch * frames, rows.ctypes.data, given.ctypes.data, ctypes.c_double(gravity), out.ctypes.data
    )
    return out


def profile(told: Floats, limits: Floats, before: Floats, time_step: float) -> Floats:
    """(B, T) what drives make of commands with (B, 2) limits of rate and acceleration, one over each, 0 for none; from
    rest at (B,) places."""
    out = np.array(told, dtype=np.float64, order="C")
    given = np.array(limits, dtype=np.float64).reshape(len(out), 2), np.array(before, dtype=np.float64)
    _library().compass_profile(*out.shape, out.ctypes.data, *(one.ctypes.data for one in given), time_step)
    return out


def _address(model: mujoco.MjModel | mujoco.MjSpec) -> int:
    """Of what C calls mjModel (the one that the callback will see) or mjSpec."""
    return int(model._address)  # noqa: SLF001 - MuJoCo offers it under this name alone


def _place(model: mujoco.MjModel, site: Site) -> tuple[Placement, int, int]:
    """How the forces on a body or joint reach the degrees of freedom; its id; the first of them."""
    if site.kind in JOINTS:
        joint = model.joint(site.name).id
        return Placement.JOINT, joint, int(model.jnt_dofadr[joint])
    if site.kind in DRIVES:
        return Placement.ACTUATOR, site.actuators[0], 0
    if site.kind == "geom_pair":
        one, other = (model.geom(name).id for name in site.names)
        return Placement.GEOM_PAIR, one, other
    if site.kind == "body_pair":
        one, other = (model.body(name).id for name in site.names)
        return Placement.BODY_PAIR, one, other
    body = model.body(site.name).id
    placement = Placement.BODY
    if site.kind in PLANAR:
        placement = Placement.PLANAR if model.body_jntnum[body] == 2 else Placement.PLANAR_YAW
    return placement, body, int(model.body_dofadr[body])


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
    path = compiled_forces()
    library = ctypes.PyDLL(str(path))  # keeps Python's lock: registering is not made for two threads at once
    library.compass_register.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    library.compass_register.restype = ctypes.c_int
    library.compass_forget.argtypes = [ctypes.c_void_p]
    library.compass_forget.restype = None
    library.compass_evaluate.argtypes = [ctypes.c_int64, *2 * [ctypes.c_void_p], ctypes.c_double, ctypes.c_void_p]
    library.compass_evaluate.restype = None
    library.compass_profile.argtypes = [*2 * [ctypes.c_int64], *3 * [ctypes.c_void_p], ctypes.c_double]
    library.compass_profile.restype = None
    library.compass_init.argtypes = len(_CALLED) * [ctypes.c_void_p]
    library.compass_init.restype = ctypes.c_int
    mj = mujoco_library()
    called = [ctypes.cast(getattr(mj, f"mj_{name}"), ctypes.c_void_p) for name in _CALLED]
    if library.compass_init(*called) != max(Kind):
        raise ConfigError(f"{path}: was compiled from another version of fields.c; run `make install`")
    callback = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
    mujoco.set_mjcb_passive(ctypes.cast(library.compass_passive, callback))
    return library


def path_columns(
    model: mujoco.MjModel, site: Site
) -> tuple[tuple[int, int, int, int], tuple[float, float, float, float]]:
    """Where a body in the plane (or a joint) is in (qpos, qvel): x, y, vx, vy, -1 for none; and its place at qpos 0."""
    _, identity, dof = _place(model, site)
    if site.kind in JOINTS:
        return (int(model.jnt_qposadr[identity]), -1, model.nq + dof, -1), (0.0, 0.0, 0.0, 0.0)
    position = int(model.jnt_qposadr[model.body_jntadr[identity]])
    x, y = (float(p) for p in model.body_pos[identity][:2])
    return (position, position + 1, model.nq + dof, model.nq + dof + 1), (x, y, 0.0, 0.0)
