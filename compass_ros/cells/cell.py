"""A robot cell: scene, parameters, actions, what is tracked, which factors count."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from compass_ros.cells.signals import Signal, of_object, of_spec
from compass_ros.cells.spec import CellSpec, FactorSpec, ObjectSpec
from compass_ros.cells.start import StartSpec, first_state, input_names, input_std, stated_error
from compass_ros.errors import ConfigError, nearest
from compass_ros.types import ActionField, Bools, Episode, Floats, Parameter

Beside = tuple[tuple[str, ...], tuple[str, ...]]
"""Names of joints that get rotors, and of what gets anchors (`cells/rotors.py`)."""


@dataclass(frozen=True)
class Cell:
    """A validated cell. Arrays of parameters, actions and observations follow the order of the YAML."""

    spec: CellSpec
    path: Path
    hash: str
    rotors: tuple[str, ...] = ()
    """Joints whose motors are bodies of their own in the compiled scene (`cells/rotors.py`)."""
    anchors: tuple[str, ...] = ()
    """Joints whose dry friction may be a spring before it slides, with an anchor in the compiled scene."""
    time_step: float | None = None
    """Of the simulation where it is not the scene's [s]."""
    holds: bool = False
    """Whether dry friction holds a joint that is at rest, where the scene's lets it creep."""

    @property
    def beside(self) -> Beside:
        """What the compiled scene has beside the drawing."""
        return self.rotors, self.anchors

    @property
    def name(self) -> str:
        return self.spec.name

    @property
    def hashes(self) -> tuple[str, ...]:
        """Configurations whose recordings are this cell's: its own first."""
        return self.hash, *self.spec.recorded_as

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
        """Control steps of an episode, or of a window."""
        windows = self.spec.windows
        return self.spec.horizon if windows is None else max(round(windows.length_s / self.control_dt), 1)

    @cached_property
    def signals(self) -> tuple[Signal, ...]:
        """Objects, then signals, with their columns of an observation."""
        out: list[Signal] = []
        for o in self.spec.objects:
            out.append(of_object(o.name, o.quantity, o.body, o.topic, o.frame, _end(out)))
        for s in self.spec.signals:
            out.append(of_spec(s, _end(out)))
        return tuple(out)

    def signal(self, name: str) -> Signal:
        """An object or signal by its name."""
        return next(s for s in self.signals if s.name == name)

    @cached_property
    def starts(self) -> tuple[StartSpec, ...]:
        """What begins where it was seen; of windows, without being told: joints, or bodies where no joint is seen."""
        if self.spec.start or self.spec.windows is None:
            return self.spec.start
        placed = [s for s in self.signals if s.places and s.fitted]
        joints = [s for s in placed if s.jointed]
        return tuple(StartSpec(object=s.name) for s in joints or placed)

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
        if self.spec.factors:
            return tuple(FactorSpec(name=f, object=f) if isinstance(f, str) else f for f in self.spec.factors)
        out: list[FactorSpec] = []
        for s in self.signals:
            several = s.jointed and s.size > 1
            parts = s.numbers if several else ("all",)
            names = [f"{s.name}.{part}" if several else s.name for part in parts]
            out += [FactorSpec(name=n, object=s.name, part=p) for n, p in zip(names, parts, strict=True) if s.fitted]
        return tuple(out)

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
        return tuple(s.name for s in self.signals for _ in range(s.size))

    @cached_property
    def filmed(self) -> tuple[tuple[int, ...], ...]:
        """Columns of where each body is that a camera sees [m]: x and y, or x, y and z."""
        return tuple(tuple(range(s.first, s.first + min(s.size, 3))) for s in self.signals if s.filmed)

    @cached_property
    def fitted(self) -> Bools:
        """(C,) whether a column is of what parameters are fitted to."""
        return np.concatenate([np.full(s.size, s.fitted) for s in self.signals])

    @cached_property
    def input_names(self) -> tuple[str, ...]:
        """(A,) what `inputs` holds: the action's fields, first states as `object.vx`, `release`, `window`.

        The last is the number of the episode's recorded inputs among those that the simulator was given.
        """
        names = tuple(a.name for a in self.action)
        for spec in self.starts:
            names += input_names(spec, self.signal(spec.object))
        return names + (("release",) if self.spec.release else ()) + (("window",) if self.spec.inputs else ())

    @cached_property
    def launch_std(self) -> Floats:
        """(A,) standard deviation of each input around what was commanded or measured.

        0 = exact, NaN: the recording says it (`stated_std`).
        """
        std: list[float] = [self.spec.launch_noise.get(a.name, 0.0) for a in self.action]
        for spec in self.starts:
            std += input_std(spec, self.signal(spec.object))
        std += [self.spec.release.noise_s] if self.spec.release else []
        return np.array(std + [0.0] * bool(self.spec.inputs))

    def stated_std(self, episode: Episode) -> Floats:
        """(A,) the same as the recording says it, or its first frames beside what the cell states; 0: nothing."""
        std, at = np.zeros(len(self.input_names)), len(self.action)
        for spec in self.starts:
            signal = self.signal(spec.object)
            noise = self.spec.noise_m if signal.noise is None else signal.noise
            stated = episode.initial_std.get(spec.object, ()) or stated_error(spec, signal, episode, noise)
            std[at : at + len(stated)] = stated
            at += len(input_names(spec, signal))
        return std

    def simulated_time(self, inputs: Floats, time_s: Floats) -> Floats:
        """(B, F) times since the release for (B, F) times since the start and (B, A) inputs; before it, negative."""
        if not self.spec.release:
            return time_s
        release = self.input_names.index("release")
        return np.asarray(time_s - inputs[:, release : release + 1])

    def index(self, parameter: str) -> int:
        """Position of a parameter. Raises ConfigError with the nearest known name."""
        if parameter not in self._places:
            raise ConfigError(f"{self.name}: unknown parameter '{parameter}'{nearest(parameter, list(self._places))}")
        return self._places[parameter]

    @cached_property
    def _places(self) -> dict[str, int]:
        return {parameter.name: i for i, parameter in enumerate(self.parameters)}

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
        rows += [first_state(spec, self.signal(spec.object), episode) for spec in self.starts]
        rows += [np.array([self.spec.release.default_s])] if self.spec.release else []
        rows += [np.zeros(1)] if self.spec.inputs else []
        return np.concatenate(rows)


def _end(signals: list[Signal]) -> int:
    """First column after these."""
    return signals[-1].columns.stop if signals else 0
