"""A robot cell: scene, parameters, actions, what is tracked, which factors count."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from compass_ros.cells.spec import CellSpec, FactorSpec, ObjectSpec
from compass_ros.cells.start import first_state, input_names, input_std
from compass_ros.errors import ConfigError, nearest
from compass_ros.types import QUANTITY_SIZE, ActionField, Episode, Floats, Parameter, Quantity


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

    @cached_property
    def input_names(self) -> tuple[str, ...]:
        """(A,) what `inputs` holds: the action's fields, first states as `object.vx`, `release`."""
        names = tuple(a.name for a in self.action)
        for spec in self.spec.start:
            names += input_names(spec, self.quantity(spec.object))
        return names + (("release",) if self.spec.release else ())

    @cached_property
    def launch_std(self) -> Floats:
        """(A,) standard deviation of each input around what was commanded or measured; 0 = exact."""
        std = [self.spec.launch_noise.get(a.name, 0.0) for a in self.action]
        for spec in self.spec.start:
            std += input_std(spec, self.quantity(spec.object))
        return np.array(std + ([self.spec.release.noise_s] if self.spec.release else []))

    def quantity(self, name: str) -> Quantity:
        """What is tracked of an object."""
        return next(o.quantity for o in self.objects if o.name == name)

    def simulated_time(self, inputs: Floats, time_s: Floats) -> Floats:
        """(B, F) times since the release for (B, F) times since the start and (B, A) inputs; before it, negative."""
        return np.asarray(time_s - inputs[:, -1:]) if self.spec.release else time_s

    def index(self, parameter: str) -> int:
        """Position of a parameter. Raises ConfigError with the nearest known name."""
        names = [p.name for p in self.parameters]
        if parameter not in names:
            raise ConfigError(f"{self.name}: unknown parameter '{parameter}'{nearest(parameter, names)}")
        return names.index(parameter)

    def values(self, given: Mapping[str, float], where: str = "parameters") -> Floats:
        """(P,) the defaults with the given ones in place. Raises ConfigError for unknown names and for bad values."""
        values = self.defaults.copy()
        for name, value in given.items():
            parameter = self.parameters[self.index(name)]
            if not parameter.low <= value <= parameter.high:
                bounds = f"[{parameter.low:g}, {parameter.high:g}] {parameter.unit}"
                raise ConfigError(f"{where}: {name} = {value:g} is outside its bounds {bounds}")
            values[self.index(name)] = value
        return values

    def inputs(self, episode: Episode) -> Floats:
        """(A,) what `input_names` names. Raises ConfigError or DataError where the episode does not say it."""
        missing = [a.name for a in self.action if a.name not in episode.action]
        if missing:
            raise ConfigError(
                f"episode {episode.name}: action has no {missing}; expected {[a.name for a in self.action]}"
            )
        rows = [np.array([episode.action[a.name] for a in self.action], float)]
        rows += [first_state(spec, self.quantity(spec.object), episode) for spec in self.spec.start]
        rows += [np.array([self.spec.release.default_s])] if self.spec.release else []
        return np.concatenate(rows)
