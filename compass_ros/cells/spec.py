"""A cell's YAML, field by field."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as validated

from compass_ros.cells.refusal import refusal
from compass_ros.cells.series import InputSpec, Name, SignalSpec, WindowSpec, check_series
from compass_ros.cells.start import ReleaseSpec, StartSpec
from compass_ros.errors import ConfigError, nearest
from compass_ros.types import Quantity

_strict = ConfigDict(extra="forbid", allow_inf_nan=False)


@validated(frozen=True, config=_strict, kw_only=True)
class ObjectSpec:
    """A tracked object."""

    name: Name
    quantity: Quantity
    topic: Name = ""
    frame: Name = ""
    """Frame of its positions in the bags (`header.frame_id`); empty: the one with most messages."""
    body: Name = ""
    """Body (quantity `joint`: joint) of the scene; the object's own name where empty."""


@validated(frozen=True, config=_strict, kw_only=True)
class FactorSpec:
    """One of the K parts of the state whose trajectory difference is measured."""

    name: Name
    object: Name
    """An object, or a signal."""
    part: Name = "all"
    """Which numbers of its row: `all`, of a pose `position`, `orientation`, `roll`, `pitch`, `yaw`, of a signal of
    joints one of its joints."""


@validated(frozen=True, config=_strict, kw_only=True)
class ActionSpec:
    name: Name
    unit: Name
    low: float
    high: float
    reach: tuple[float, float] | None = None
    """What the robot could do, where that is more than the action space; `compass plan` looks there."""
    description: str = ""
    field: Name = ""
    """Cells without code: what it sets, `qpos[0]` or `qvel[0]` of a joint at the start, or `ctrl` of an actuator."""
    of: Name = ""
    """Name of that joint or actuator."""
    from_s: float = Field(0.0, ge=0)
    """When a `ctrl` begins."""
    until_s: float = Field(math.inf, gt=0)
    """When it is 0 again."""


@validated(frozen=True, config=_strict, kw_only=True)
class ParameterSpec:
    name: Name
    default: float
    bounds: tuple[float, float]
    unit: Name
    half_width: float = Field(gt=0)
    target: float | None = None
    """Value in the "real" simulator of the paper's sim-to-sim experiment."""
    description: str = ""
    field: Name = ""
    """Where the cell has no code of its own: field of mjModel, with its index as in `geom_friction[0]`."""
    of: Name = ""
    """Name of the element whose field it is."""

    @property
    def truth(self) -> float:
        """Value in that "real" simulator: the target, or the default where it has none."""
        return self.default if self.target is None else self.target


@validated(frozen=True, config=_strict, kw_only=True)
class CellSpec:
    """The YAML, field by field."""

    name: Name
    dynamics: Name
    model: Name
    control_dt_s: float = Field(0.05, gt=0)
    """Between two moments at which trajectories are compared for the trajectory difference."""
    horizon: int = Field(0, ge=0)
    """How many of them; with `windows` it follows from their length."""
    objects: tuple[ObjectSpec, ...] = ()
    signals: tuple[SignalSpec, ...] = ()
    """What was measured; an object is a short form for the pose of a body or the position of a joint."""
    inputs: tuple[InputSpec, ...] = ()
    """Recorded series that drive the simulation."""
    windows: WindowSpec | None = None
    """How long recordings are cut; None: an episode is compared from its start on, for `horizon` steps."""
    factors: tuple[Name | FactorSpec, ...] = ()
    """Empty: one for each object, and for each joint of each fitted signal."""
    parameters: tuple[ParameterSpec, ...] = ()
    action: tuple[ActionSpec, ...] = ()
    noise_m: float = Field(0.001, gt=0)
    launch_noise: Mapping[Name, float] = Field(default_factory=dict)
    start: tuple[StartSpec, ...] = ()
    """First states that an episode brings with it."""
    release: ReleaseSpec | None = None
    """When the motion begins, where that differs from episode to episode."""
    auto: bool = False
    """Every other tunable field of the scene becomes a parameter too."""
    recorded_as: tuple[str, ...] = ()
    """Other configurations (the hashes in their bags) whose recordings are this cell's too: the same topics and sensors
    were told in another file, or in this one before it was changed."""
    causal: tuple[Name, ...] = ()
    """Parameters that the paper found to be causes; used by benchmarks only."""


def validated_spec(content: Mapping[str, object], where: str) -> CellSpec:
    """Check a YAML's content. Raises ConfigError that names the field, what was found, and the nearest known name."""
    try:
        spec = TypeAdapter(CellSpec).validate_python(dict(content))
    except ValidationError as error:
        specs = (CellSpec, ParameterSpec, ActionSpec, ObjectSpec, FactorSpec, StartSpec, ReleaseSpec)
        known = [f.name for spec in (*specs, InputSpec, SignalSpec, WindowSpec) for f in fields(spec)]
        raise ConfigError(f"{where}: {refusal(error, content, known)}") from error
    _check_values(spec, where)
    _check_names(spec, where)
    _check_measured(spec, where)
    check_series(spec.inputs, spec.signals, where)
    return spec


def _check_measured(spec: CellSpec, where: str) -> None:
    """Something is measured, and for how long is said once."""
    if not (spec.objects or spec.signals):
        raise ConfigError(f"{where}: objects, signals: both empty; say what was measured")
    if not spec.objects and not any(s.fitted for s in spec.signals):
        raise ConfigError(f"{where}: signals: none is fitted")
    if spec.windows is None and spec.horizon < 1:
        raise ConfigError(f"{where}: horizon: missing; say how many steps of control_dt_s an episode has, or `windows`")
    if spec.windows is not None and spec.horizon:
        raise ConfigError(f"{where}: horizon, windows: one of them; windows of {spec.windows.length_s:g} s say it")
    if spec.windows is not None and (spec.action or spec.release):
        raise ConfigError(f"{where}: windows: an `action` or `release` begins an episode, and a window is cut anywhere")


def _check_values(spec: CellSpec, where: str) -> None:
    """Defaults and targets inside bounds, intervals the right way round."""
    for p in spec.parameters:
        if p.bounds[0] > p.bounds[1]:
            low, high = p.bounds
            raise ConfigError(f"{where}: {p.name}: bounds: the lower bound {low:g} is above the upper one {high:g}")
        for what, value in (("default", p.default), ("target", p.target)):
            if value is not None and not p.bounds[0] <= value <= p.bounds[1]:
                raise ConfigError(f"{where}: {p.name}: {what} {value:g} is outside its bounds {list(p.bounds)}")
    for a in spec.action:
        if not a.low < a.high:
            raise ConfigError(f"{where}: action {a.name}: expected low < high, found {a.low:g} and {a.high:g}")
        if a.reach and not (a.reach[0] <= a.low and a.high <= a.reach[1]):
            raise ConfigError(f"{where}: action {a.name}: reach {list(a.reach)} does not hold [{a.low:g}, {a.high:g}]")


def _parts(measured: ObjectSpec | SignalSpec) -> tuple[str, ...]:
    """What a factor can be of it."""
    if measured.quantity == "pose":
        return ("all", "position", "orientation", "roll", "pitch", "yaw")
    return ("all", "position", *(measured.of if isinstance(measured, SignalSpec) else ()))


def _check_names(spec: CellSpec, where: str) -> None:
    """Names stand once, and what refers to a name finds it."""
    parameters = [p.name for p in spec.parameters]
    measured: tuple[ObjectSpec | SignalSpec, ...] = (*spec.objects, *spec.signals)
    objects = {one.name: one for one in measured}
    actions, factors = [a.name for a in spec.action], [f if isinstance(f, str) else f.name for f in spec.factors]
    everything = {"parameters": parameters, "action": actions, "inputs": [i.name for i in spec.inputs]}
    everything |= {"objects and signals": [one.name for one in measured]}
    starts = [s.object for s in spec.start]
    for section, names in (everything | {"factors": factors, "start": starts}).items():
        twice = sorted({n for n in names if names.count(n) > 1})
        if twice:
            raise ConfigError(f"{where}: {section}: {', '.join(twice)} stands twice")
    for f in spec.factors:
        name = f if isinstance(f, str) else f.object
        if name not in objects:
            raise ConfigError(f"{where}: factors: unknown object '{name}'; known: {[*objects]}{nearest(name, objects)}")
        if not isinstance(f, str) and f.part not in _parts(objects[name]):
            kind = objects[name].quantity
            raise ConfigError(f"{where}: factors: {f.name}: '{name}' is tracked as {kind}, without {f.part}")
    for start in spec.start:
        if start.object not in objects:
            hint = nearest(start.object, objects)
            raise ConfigError(f"{where}: start: unknown object '{start.object}'; known: {[*objects]}{hint}")
    for section, given, known in (("causal", spec.causal, parameters), ("launch_noise", spec.launch_noise, actions)):
        for name in given:
            if name not in known:
                raise ConfigError(f"{where}: {section}: unknown name '{name}'{nearest(name, known)}")
