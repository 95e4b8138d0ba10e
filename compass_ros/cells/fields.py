"""Parameters that are fields of a MuJoCo scene: `geom_friction[0]` of a geom, `opt.gravity[2]`, and a few made ones.

A plain field is an array of mjModel with the element's kind in front of it (geom_, body_, jnt_, dof_, actuator_, pair_,
tendon_, site_, eq_, qpos_), or one of `opt.`. Without an index all numbers of the element are set. What follows
from a field: derived.py. Made fields: made_fields.py.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from compass_ros.cells.derived import clear_shortcuts, followers
from compass_ros.cells.made_fields import ELEMENT, OUTSIDE, PARTS, WHOLE, Made, early_writers, late_writers
from compass_ros.cells.spec import ParameterSpec
from compass_ros.errors import ConfigError, nearest
from compass_ros.types import Floats, Ints

_OBJECT = mujoco.mjtObj
KINDS = {
    "geom": (_OBJECT.mjOBJ_GEOM, ("friction", "solref", "solimp", "size", "pos", "quat", "margin", "gap", "solmix",
                                  "condim", "fluid")),
    "body": (_OBJECT.mjOBJ_BODY, ("mass", "inertia", "ipos", "iquat", "pos", "quat", "gravcomp")),
    "jnt": (_OBJECT.mjOBJ_JOINT, ("stiffness", "stiffnesspoly", "range", "margin", "solref", "solimp",
                                   "pos", "axis")),
    "dof": (_OBJECT.mjOBJ_JOINT, ("damping", "dampingpoly", "armature", "frictionloss", "solref", "solimp")),
    "qpos": (_OBJECT.mjOBJ_JOINT, ("spring",)),
    "actuator": (_OBJECT.mjOBJ_ACTUATOR, ("gainprm", "biasprm", "dynprm", "gear", "damping", "armature",
                                                 "forcerange", "ctrlrange")),
    "pair": (_OBJECT.mjOBJ_PAIR, ("friction", "solref", "solreffriction", "solimp", "margin", "gap", "dim")),
    "tendon": (_OBJECT.mjOBJ_TENDON, ("stiffness", "damping", "frictionloss", "armature", "lengthspring", "range")),
    "site": (_OBJECT.mjOBJ_SITE, ("pos", "quat")),
    "eq": (_OBJECT.mjOBJ_EQUALITY, ("solref", "solimp", "data")),
}  # fmt: skip
OPTIONS = ("gravity", "wind", "magnetic", "density", "viscosity", "impratio", "cone", "integrator", "solver")
PLAIN = tuple(f"{kind}_{name}" for kind, (_, names) in KINDS.items() for name in names)
KNOWN = PLAIN + tuple(f"opt.{name}" for name in OPTIONS) + tuple(ELEMENT) + OUTSIDE
_FIELD = re.compile(r"(?P<name>[A-Za-z_.]+)(\[(?P<index>\d+)\])?")


@dataclass(frozen=True)
class Entry:
    """Numbers of one array of a model, set to one parameter together."""

    array: str
    """`geom_friction`, `opt.gravity`."""
    flat: Ints
    """Their places in the flattened array."""


def parse(field: str, where: str) -> tuple[str, int | None]:
    """Name and index of a field. Raises ConfigError with the nearest known name."""
    match = _FIELD.fullmatch(field)
    if match is None:
        raise ConfigError(f"{where}: field: expected NAME or NAME[INDEX] as in geom_friction[0], found '{field}'")
    name = match["name"]
    if name not in KNOWN:
        raise ConfigError(f"{where}: field: unknown '{name}'{nearest(name, KNOWN) or '; see docs/your-own-cell.md'}")
    return name, int(match["index"]) if match["index"] else None


def entry(model: mujoco.MjModel, field: str, of: str, where: str) -> Entry:
    """Where a plain field of an element is. `of` may name several elements, parted by commas. Raises ConfigError."""
    name, index = parse(field, where)
    kind, _, rest = name.partition("." if name.startswith("opt.") else "_")
    array = np.atleast_1d(getattr(model.opt, rest) if kind == "opt" else getattr(model, name))
    places = np.arange(array.size).reshape(array.shape)
    if kind == "opt":
        chosen = places
    else:
        chosen = places[rows_of(model, kind, of, where)]
    chosen = chosen.reshape(-1, array.shape[-1] if array.ndim > 1 or kind == "opt" else 1)
    if kind == "dof" and array.ndim == 1:
        chosen = chosen.reshape(1, -1)  # index: which degree of freedom of the joint
    if index is not None and index >= chosen.shape[1]:
        raise ConfigError(f"{where}: field: {name} of '{of}' has {chosen.shape[1]} numbers, found index {index}")
    return Entry(name, chosen.ravel() if index is None else chosen[:, index])


def rows(model: mujoco.MjModel, kind: str, name: str, where: str) -> Ints:
    """Rows of the arrays `kind_...` that belong to the element of that name. Raises ConfigError with the nearest."""
    objtype = KINDS[kind][0]
    known = names(model, objtype)
    if name not in known:
        raise ConfigError(
            f"{where}: of: the scene has no {_word(kind)} '{name}'; it has {_list(known)}{nearest(name, known)}"
        )
    identity = known.index(name) if kind == "pair" else mujoco.mj_name2id(model, objtype, name)
    if kind == "dof":
        first = model.jnt_dofadr[identity]
        return np.arange(first, first + _size(model, identity, (6, 3, 1, 1)))
    if kind == "qpos":
        first = model.jnt_qposadr[identity]
        return np.arange(first, first + _size(model, identity, (7, 4, 1, 1)))
    return np.array([identity])


def rows_of(model: mujoco.MjModel, kind: str, of: str, where: str) -> Ints:
    """The same for several names, parted by commas."""
    return np.concatenate([rows(model, kind, one.strip(), where) for one in of.split(",")])


def names(model: mujoco.MjModel, objtype: mujoco.mjtObj) -> list[str]:
    """Names of all elements of a kind that have one; a pair without one is `geom1+geom2`."""
    counts = {_OBJECT.mjOBJ_GEOM: model.ngeom, _OBJECT.mjOBJ_BODY: model.nbody, _OBJECT.mjOBJ_JOINT: model.njnt,
              _OBJECT.mjOBJ_ACTUATOR: model.nu, _OBJECT.mjOBJ_PAIR: model.npair, _OBJECT.mjOBJ_TENDON: model.ntendon,
              _OBJECT.mjOBJ_SITE: model.nsite, _OBJECT.mjOBJ_EQUALITY: model.neq}  # fmt: skip
    found = [mujoco.mj_id2name(model, objtype, i) for i in range(counts[objtype])]
    if objtype == _OBJECT.mjOBJ_PAIR:
        found = [name or _partners(model, i) for i, name in enumerate(found)]
    return [name for name in found if name]


def _partners(model: mujoco.MjModel, pair: int) -> str:
    """What a pair without a name is called."""
    return f"{model.geom(model.pair_geom1[pair]).name}+{model.geom(model.pair_geom2[pair]).name}"


def _size(model: mujoco.MjModel, joint: int, sizes: tuple[int, int, int, int]) -> int:
    return sizes[int(model.jnt_type[joint])]


def _word(kind: str) -> str:
    return {"jnt": "joint", "dof": "joint", "qpos": "joint", "eq": "equality"}.get(kind, kind)


def _list(known: Sequence[str]) -> str:
    return (", ".join(known[:12]) + ", ..." * (len(known) > 12)) or "none with a name"


class Fields:
    """Writes (B, P) values into B models; the column of each parameter is given with it."""

    def __init__(self, model: mujoco.MjModel, parameters: Sequence[tuple[int, ParameterSpec]], where: str) -> None:
        """`model`: the scene at its defaults."""
        made: list[Made] = []
        self._plain: dict[str, tuple[Ints, Ints]] = {}
        used = set()
        _check_inertias(parameters, where)
        for column, spec in parameters:
            here = f"{where}: {spec.name}"
            name, index = parse(spec.field, here)
            used.add(name)
            if name in ELEMENT:
                made += [
                    Made(column, name, index or 0, int(row)) for row in rows_of(model, ELEMENT[name], spec.of, here)
                ]
            elif name not in OUTSIDE:
                found = entry(model, spec.field, spec.of, here)
                flat, columns = self._plain.get(found.array, (np.zeros(0, int), np.zeros(0, int)))
                own = np.full(len(found.flat), column)
                self._plain[found.array] = (np.concatenate([flat, found.flat]), np.concatenate([columns, own]))
        self._early, self._late = early_writers(model, made, where), late_writers(model, made, where)
        self._followers = followers(model, {array: flat for array, (flat, _) in self._plain.items()}, where)
        clear_shortcuts(model, used)

    def write(self, models: Sequence[mujoco.MjModel], values: Floats) -> None:
        """Write every parameter; the rest of the models is left alone."""
        for model, row in zip(models, values, strict=True):
            for writer in self._early:
                writer(model, row)
            for array, (flat, columns) in self._plain.items():
                _set(model, array, flat, row[columns])
            for writer in self._late:
                writer(model, row)
            for follow in self._followers:
                follow(model)


def _check_inertias(parameters: Sequence[tuple[int, ParameterSpec]], where: str) -> None:
    """Raises ConfigError for a body whose inertia is tuned as a whole and in parts."""
    tuned = [(p.name, p.field.partition("[")[0], {o.strip() for o in p.of.split(",")}) for _, p in parameters]
    whole = set[str]().union(*(of for _, field, of in tuned if field == WHOLE))
    for name, field, of in tuned:
        if field in PARTS and of & whole:
            raise ConfigError(f"{where}: {name}: body '{min(of & whole)}' is tuned by {WHOLE} as well; use one of them")


def _set(model: mujoco.MjModel, array: str, flat: Ints, values: Floats) -> None:
    if array.startswith("opt."):
        name = array.removeprefix("opt.")
        current = getattr(model.opt, name)
        if isinstance(current, np.ndarray):
            current[flat] = values
        else:
            setattr(model.opt, name, type(current)(round(values[0]) if isinstance(current, int) else values[0]))
        return
    target = getattr(model, array).reshape(-1)
    target[flat] = np.round(values) if np.issubdtype(target.dtype, np.integer) else values
