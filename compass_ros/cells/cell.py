"""A robot cell as its YAML describes it: scene, parameters, actions, what is tracked, which factors count."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as validated

from compass_ros.config import read_yaml
from compass_ros.errors import ConfigError, nearest
from compass_ros.types import QUANTITY_SIZE, ActionField, Episode, Floats, Parameter, Quantity

_strict = ConfigDict(extra="forbid")
_builtin = Path(__file__).parents[1] / "config" / "cells"


@validated(frozen=True, config=_strict, kw_only=True)
class ObjectSpec:
    """A tracked object."""

    name: str
    quantity: Quantity
    topic: str = ""
    body: str = ""
    """Body (quantity `joint`: joint) of the scene; the object's own name where empty."""


@validated(frozen=True, config=_strict, kw_only=True)
class FactorSpec:
    """One of the K parts of the state whose trajectory difference is measured."""

    name: str
    object: str
    part: str = "all"
    """Which numbers of the object's row: all, position, orientation, roll, pitch or yaw."""


@validated(frozen=True, config=_strict, kw_only=True)
class ActionSpec:
    name: str
    unit: str
    low: float
    high: float
    reach: tuple[float, float] | None = None
    """What the robot could do, where that is more than the action space; `compass plan` looks there."""
    description: str = ""


@validated(frozen=True, config=_strict, kw_only=True)
class ParameterSpec:
    name: str
    default: float
    bounds: tuple[float, float]
    unit: str
    half_width: float = Field(gt=0)
    target: float | None = None
    """Value in the "real" simulator of the paper's sim-to-sim experiment."""
    description: str = ""
    field: str = ""
    """Where the cell has no code of its own: field of mjModel, with its index as in `geom_friction[0]`."""
    of: str = ""
    """Name of the element whose field it is."""


@validated(frozen=True, config=_strict, kw_only=True)
class CellSpec:
    """The YAML, field by field."""

    name: str
    dynamics: str
    model: str
    control_dt_s: float = Field(gt=0)
    horizon: int = Field(ge=1)
    objects: tuple[ObjectSpec, ...]
    factors: tuple[str | FactorSpec, ...]
    parameters: tuple[ParameterSpec, ...]
    action: tuple[ActionSpec, ...] = ()
    noise_m: float = Field(0.001, gt=0)
    launch_noise: Mapping[str, float] = Field(default_factory=dict)
    causal: tuple[str, ...] = ()
    """Parameters that the paper found to be causes; used by benchmarks only."""


@dataclass(frozen=True)
class Cell:
    """A validated cell. Arrays of parameters, actions and observations follow the order of the YAML."""

    spec: CellSpec
    path: Path
    hash: str

    @property
    def name(self) -> str:
        return self.spec.name

    @property
    def model_path(self) -> Path:
        return self.path.parent / self.spec.model

    @property
    def objects(self) -> tuple[ObjectSpec, ...]:
        return self.spec.objects

    @property
    def control_dt(self) -> float:
        """Seconds between two control steps."""
        return self.spec.control_dt_s

    @property
    def horizon(self) -> int:
        """Control steps of an episode."""
        return self.spec.horizon

    @property
    def duration(self) -> float:
        """Seconds of an episode."""
        return self.control_dt * self.horizon

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(p.name, p.default, p.bounds[0], p.bounds[1], p.unit, p.half_width, p.description)
            for p in self.spec.parameters
        )

    @cached_property
    def action(self) -> tuple[ActionField, ...]:
        return tuple(ActionField(a.name, a.unit, a.low, a.high) for a in self.spec.action)

    @cached_property
    def factors(self) -> tuple[FactorSpec, ...]:
        return tuple(FactorSpec(name=f, object=f) if isinstance(f, str) else f for f in self.spec.factors)

    @cached_property
    def defaults(self) -> Floats:
        """(P,) default values."""
        return np.array([p.default for p in self.parameters])

    @cached_property
    def reach(self) -> Floats:
        """(A, 2) lowest and highest value that the robot can do."""
        return np.array([a.reach or (a.low, a.high) for a in self.spec.action]).reshape(-1, 2)

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """(C,) object of each column of an observation."""
        return tuple(o.name for o in self.objects for _ in range(QUANTITY_SIZE[o.quantity]))

    def index(self, parameter: str) -> int:
        """Position of a parameter. Raises ConfigError with the nearest known name."""
        names = [p.name for p in self.parameters]
        if parameter not in names:
            raise ConfigError(f"{self.name}: unknown parameter '{parameter}'{nearest(parameter, names)}")
        return names.index(parameter)

    def values(self, given: Mapping[str, float], where: str = "parameters") -> Floats:
        """(P,) the defaults with the given ones in place. Raises ConfigError for unknown names and values out of bounds."""
        values = self.defaults.copy()
        for name, value in given.items():
            parameter = self.parameters[self.index(name)]
            if not parameter.low <= value <= parameter.high:
                raise ConfigError(
                    f"{where}: {name} = {value:g} is outside its bounds [{parameter.low:g}, {parameter.high:g}] {parameter.unit}"
                )
            values[self.index(name)] = value
        return values

    def inputs(self, episode: Episode) -> Floats:
        """(A,) the episode's action in the order of the YAML. Raises ConfigError where a field is missing."""
        missing = [a.name for a in self.action if a.name not in episode.action]
        if missing:
            raise ConfigError(
                f"episode {episode.name}: action has no {missing}; expected {[a.name for a in self.action]}"
            )
        return np.array([episode.action[a.name] for a in self.action])


def load(name_or_path: str | Path) -> Cell:
    """A cell by its name in config/cells or by the path of its YAML. Raises ConfigError with one line."""
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        known = sorted(p.stem for p in _cells_folder().glob("*.yaml"))
        if str(name_or_path) not in known:
            raise ConfigError(
                f"unknown cell '{name_or_path}'; known: {', '.join(known)}{nearest(str(name_or_path), known)}"
            )
        path = _cells_folder() / f"{name_or_path}.yaml"
    spec = _validated(read_yaml(path), str(path))
    model = path.parent / spec.model
    if not model.is_file():
        raise ConfigError(f"{path}: model: no file {model}")
    _check_meaning(spec, str(path))
    return Cell(spec, path, hashlib.sha256(path.read_bytes() + model.read_bytes()).hexdigest()[:16])


def _cells_folder() -> Path:
    """Folder of the cells that come with the suite: installed inside the package, or at the root of a checkout."""
    return _builtin if _builtin.is_dir() else Path(__file__).parents[2] / "config" / "cells"


def _validated(content: Mapping[str, object], where: str) -> CellSpec:
    try:
        return TypeAdapter(CellSpec).validate_python(dict(content))
    except ValidationError as error:
        first = error.errors()[0]
        name = ".".join(str(part) for part in first["loc"])
        fields = [f for spec in (CellSpec, ParameterSpec, ActionSpec, ObjectSpec) for f in spec.__annotations__]
        hint = nearest(name.rsplit(".", 1)[-1], fields) if first["type"] == "unexpected_keyword_argument" else ""
        raise ConfigError(f"{where}: {name}: {first['msg']}, found {str(first['input'])[:80]!r}{hint}") from error


def _check_meaning(spec: CellSpec, where: str) -> None:
    names = [p.name for p in spec.parameters]
    twice = {n for n in names if names.count(n) > 1}
    if twice:
        raise ConfigError(f"{where}: parameters: {sorted(twice)} stand twice")
    for p in spec.parameters:
        if not p.bounds[0] <= p.default <= p.bounds[1]:
            raise ConfigError(f"{where}: {p.name}: default {p.default:g} is outside its bounds {list(p.bounds)}")
    objects = [o.name for o in spec.objects]
    for f in spec.factors:
        name = f if isinstance(f, str) else f.object
        if name not in objects:
            raise ConfigError(f"{where}: factors: unknown object '{name}'; known: {objects}{nearest(name, objects)}")
    for name in spec.causal:
        if name not in names:
            raise ConfigError(f"{where}: causal: unknown parameter '{name}'{nearest(name, names)}")
