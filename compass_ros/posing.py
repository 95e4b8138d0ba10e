"""Recordings and a simulator as the problem that every method is given, and how far the two are apart."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from compass_ros.calibration.launches import unexpected, with_launches
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise, measure_noise
from compass_ros.calibration.problem import Problem
from compass_ros.calibration.refine import Refined
from compass_ros.cells import Cell
from compass_ros.simulation import Simulator
from compass_ros.simulation.factors import factor_distance
from compass_ros.simulation.manifold import apart, charted, on_manifold
from compass_ros.simulation.replay import Recordings, Replay, floored, rms_distance
from compass_ros.types import Floats, Gap


class Yardstick:
    """How far a simulator is from recordings, as it is reported; what was asked once is not simulated again."""

    def __init__(self, simulator: Simulator, data: Recordings, noise: Noise) -> None:
        self._asked = (simulator, data, noise)
        self._known: dict[bytes, tuple[Replay, Gap]] = {}

    def replay(self, values: Floats) -> Replay:
        """Of (P,) values, each episode with the launch that agrees best with it."""
        return self._at(values)[0]

    def gap(self, values: Floats, noise: Floats) -> Gap:
        """As `Replay.gap` has it."""
        return floored(self._asked[0], self._at(values)[1], noise)

    def distance(self, values: Floats) -> float:
        """rms distance [m or rad]."""
        return self._at(values)[1].rmse_m

    def _at(self, values: Floats) -> tuple[Replay, Gap]:
        key = values.tobytes()
        if key not in self._known:
            replay = launched(*self._asked, values)
            self._known[key] = replay, replay.gap(values)
        return self._known[key]


def noise_of(cell: Cell, data: Recordings) -> Noise:
    """Of the sensors that made recordings of a cell."""
    return measure_noise(data.time_s, data.measured, cell.spec.noise_m, data.stated, cell.filmed)


def pose(simulator: Simulator, data: Recordings, noise: Noise, yardstick: Yardstick | None = None) -> Problem:
    """Recordings and a simulator as the problem that every method is given."""
    cell = simulator.cell
    replay = Replay(simulator, data)
    likelihood = Likelihood(
        predict=simulator.observe,
        predict_alike=simulator.observe_alike,
        difference=partial(apart, cell),
        windowed=cell.spec.windows is not None,
        parameters=simulator.parameters,
        inputs=simulator.inputs(data.inputs),
        time_s=data.time_s,
        measured=np.where(cell.fitted, charted(cell, data.measured), np.nan),
        sigma=on_manifold(cell, noise.of(data.measured)),
        correlation_time=noise.correlation_time,
        launch_std=simulator.launch_std(simulator.defaults, data.start_std),
        prior_mean=simulator.defaults,
        prior_std=np.array([p.half_width for p in simulator.parameters]),
        systematic=noise.systematic,
    )
    return Problem(
        differences=replay.differences,
        trajectories=replay.predict,
        measured=np.nan_to_num(data.measured),
        weight=np.where(np.isnan(data.measured) | ~cell.fitted, 0.0, 1 / noise.of(data.measured)),
        actions=data.inputs,
        parameters=simulator.parameters,
        factors=tuple(f.name for f in cell.factors),
        start=simulator.defaults,
        simulated_seconds=cell.duration,
        apart=partial(factor_distance, cell),
        distance=(yardstick or Yardstick(simulator, data, noise)).distance,
        likelihood=likelihood,
    )


@dataclass(frozen=True, eq=False)
class Posed:
    """Recordings to fit and recordings to judge by, with the simulator that they are compared with."""

    simulator: Simulator
    data: Recordings
    judge: Recordings
    noise: Noise

    @cached_property
    def yardsticks(self) -> tuple[Yardstick, Yardstick]:
        """Of what is fitted, of what judges."""
        return Yardstick(self.simulator, self.data, self.noise), Yardstick(self.simulator, self.judge, self.noise)

    @cached_property
    def problem(self) -> Problem:
        return pose(self.simulator, self.data, self.noise, self.yardsticks[0])

    @cached_property
    def unseen(self) -> Likelihood:
        return pose(self.simulator, self.judge, self.noise, self.yardsticks[1]).likelihood

    def wider(self, refined: Refined | None) -> Posed | None:
        """The same where first states that were read off a track may be as wrong as a fit found them; None: they are
        not more wrong than was expected.

        How exact a cell calls its first states stands, unless the frames alone said more. So do windows' first states.
        """
        stated, read = self.simulator.cell.launch_std, self.data.start_std
        own = ~(stated >= read) & (read > 0)
        if refined is None or self.simulator.cell.spec.windows is not None or not own.any():
            return None
        found = unexpected(refined.likelihood, refined.fit)[: len(own)]
        own &= found > 0
        if not own.any():
            return None
        more = np.sqrt(np.maximum(found**2 - np.nan_to_num(stated) ** 2, read**2))
        std = np.where(own, more, read)
        data, judge = (replace(r, start_std=std) for r in (self.data, self.judge))
        return replace(self, data=data, judge=judge)


def launched(simulator: Simulator, data: Recordings, noise: Noise, values: Floats) -> Replay:
    """A replay of (P,) values in which each episode has the launch that agrees best with it.

    How an arm repeats itself, or a first state that was measured with noise, differs from shot to shot: it says
    nothing about a simulator. Where the cell calls its launches exact they stay as commanded.
    """
    likelihood = replace(
        pose(simulator, data, noise).likelihood, launch_std=simulator.launch_std(values, data.start_std)
    )
    return Replay(simulator, data, with_launches(likelihood, values).launch)


def noise_floor(cell: Cell, noise: Noise) -> float:
    """Root mean square distance that the noise alone leaves [m]: of positions, as in `Gap.rmse_m`."""
    return rms_distance(cell, noise.rms[None, None])
