"""The simulator as it is in force: the cell as configured, or with a version's parameters and effects."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.auto import with_auto
from compass_ros.episodes import Reading, Source, default_topic, find_each, read_each, read_episode
from compass_ros.episodes.bag import bag_name
from compass_ros.reporting.result_json import read_result
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects.exported import read_effects
from compass_ros.simulation.replay import Recordings, Replay, recordings
from compass_ros.simulation.windows import windows
from compass_ros.types import Episode, Floats

_ROUNDING = 1e-9
"""Share of a parameter's range that is no distance."""


@dataclass(frozen=True)
class Current:
    """A simulator and the values that it runs with."""

    simulator: Simulator
    values: Floats
    """(P,) the cell's parameters, then the quantities of its effects."""

    @property
    def cell(self) -> Cell:
        return self.simulator.cell

    def gap(self, episode: Episode) -> float:
        """Root mean square distance between an episode and its replay [m]. Raises DataError, ConfigError."""
        return self._replay([episode]).gap(self.values).rmse_m

    def residuals(self, episodes: Sequence[Episode]) -> Residuals:
        """Where and how far the recordings of planar objects are from their replay. Raises DataError, ConfigError."""
        replay = self._replay(episodes)
        every = np.arange(len(replay.data.names))
        predicted = replay.predict(np.tile(self.values, (len(every), 1)), every)
        return Residuals(self.cell, replay.data, predicted)

    def _replay(self, episodes: Sequence[Episode]) -> Replay:
        """Of the episodes, or of the windows of long recordings, each with what drove it."""
        data = recordings(self.cell, windows(self.cell, episodes))
        return Replay(self.simulator.driven(data.drives), data)


@dataclass(frozen=True)
class Residuals:
    """E episodes, F frames, C columns: what was measured and what the simulator says."""

    cell: Cell
    data: Recordings
    predicted: Floats
    """(E, F, C)."""

    def paths(self, name: str) -> tuple[Floats, Floats]:
        """(E, F, 2) measured and predicted x, y of an object after the command [m]; NaN where it was not seen."""
        columns = [i for i, c in enumerate(self.cell.channels) if c == name][:2]
        after = (self.data.time_s >= 0)[:, :, None]
        measured = np.where(after, self.data.measured[:, :, columns], np.nan)
        return measured, np.where(np.isnan(measured), np.nan, self.predicted[:, :, columns])

    def planar(self) -> tuple[str, ...]:
        """Objects that have a place in the plane."""
        return tuple(o.name for o in self.cell.objects if o.quantity != "joint")


def current(cell: Cell, version: Path | None = None, threads: int = 0) -> Current:
    """The cell as configured, or with the result.json and effects.yaml of a folder.

    Raises ConfigError, also for a folder of another cell.
    """
    if version is None or not (version / "result.json").exists():
        simulator = Simulator(cell, threads=threads)
        return Current(simulator, simulator.defaults)
    where = str(version / "result.json")
    result = read_result(version / "result.json", cell.name)
    rows, holds = result["parameters"], result.get("friction_holds", False)
    cell = replace(cell, time_step=result.get("time_step_s"), holds=holds)
    own = {p.name for p in cell.parameters}
    if any(row["name"] not in own for row in rows):
        cell = with_auto(cell)  # calibrated with `--parameters auto`
    values = cell.values({row["name"]: _inside(cell, row["name"], row["value"]) for row in rows}, where)
    if not (version / "effects.yaml").is_file():
        return Current(Simulator(cell, threads=threads), values)
    fitted = read_effects(version / "effects.yaml").effects
    simulator = Simulator(cell, [one.attached for one in fitted], threads)
    expected = [one.attached.expected(one.values) for one in fitted]
    return Current(simulator, np.concatenate([values, *expected]))


def _inside(cell: Cell, name: str, value: float) -> float:
    """A value at a bound may lie beyond it by its last digits. Raises ConfigError for an unknown name."""
    parameter = cell.parameters[cell.index(name)]
    nearest = min(max(value, parameter.low), parameter.high)
    return nearest if abs(value - nearest) <= _ROUNDING * (parameter.high - parameter.low) else value


def sources(cell: Cell) -> list[Source]:
    """Where a cell's objects, signals and inputs are in its bags; by default where tracker, robots and import put them.

    A controller's state gives an input what was asked for, and a signal what was measured, unless the cell says else.
    """
    found = [
        Source(
            s.topic or default_topic(s.name, s.quantity),
            s.name,
            s.quantity,
            entry="" if s.jointed or not s.of else s.of[0],
            frame=s.frame,
            of=s.of if s.jointed else (),
            part=s.part or "feedback",
        )
        for s in cell.signals
    ]
    return found + [
        Source(
            i.topic or default_topic(i.name, i.quantity, drives=True),
            i.name,
            i.quantity,
            frame=i.frame,
            of=i.of,
            part=i.part or "reference",
            drives=True,
        )
        for i in cell.spec.inputs
    ]


def read(cell: Cell, bag: Path | str) -> Episode:
    """One episode of the cell. Raises BagError."""
    return read_episode(bag, sources(cell), cell.name, cell.hashes)


def read_usable(cell: Cell, paths: Iterable[Path | str]) -> Reading:
    """All episodes of the cell that can be compared with its simulator, and why the others cannot.

    Raises BagError where there is none.
    """

    def compare(episode: Episode) -> object:
        return recordings(cell, windows(cell, [episode]))

    return read_each(paths, sources(cell), cell.name, cell.hashes, compare)


def held_out_bags(bags: Sequence[str], names: Sequence[str]) -> tuple[Path, ...]:
    """Those bags among the paths that are named as these episodes are. Raises BagError where there is no bag at all."""
    return tuple(bag for bag in find_each(bags).bags if bag_name(bag) in names)
