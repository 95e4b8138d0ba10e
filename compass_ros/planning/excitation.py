"""Which motions to record: what recordings tell of the parameters before any fit, and motions that tell more.

Of the same length of recording those motions are looked for from which the most is learned: the expected gain of
information, half of log det(1 + G) with G the information in prior widths (Bayesian D-optimality; Lindley 1956,
Chaloner and Verdinelli 1995). Information adds up over windows, so that sets compare without a rollout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.calibration.cost import start
from compass_ros.calibration.differences import Linear, difference_steps, linearise
from compass_ros.calibration.identifiability import information, told
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.settle import FINE
from compass_ros.errors import DataError
from compass_ros.planning.motions import Limits, Motions, motions, size
from compass_ros.posing import noise_of, pose
from compass_ros.simulation import Simulator
from compass_ros.simulation.driven import Driven, virtual_recordings
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.windows import windows
from compass_ros.types import Episode, Floats, Parameter, Progress, Report, Told, silent

STEP = 0.05
"""First finite difference [prior widths]."""
SOME_WINDOWS, MOST_WINDOWS = 2, 24
"""Windows of recordings that are looked at for the lengths of differences, and for information."""
POPULATION = 8
"""Motions that are tried at a time."""
ORDINARY = 4
"""Motions around home, drawn by chance: what is compared with where nothing was recorded."""


@dataclass(frozen=True)
class Shown:
    """What some recordings show of P parameters: to first order at the cell's defaults, disturbed by noise alone."""

    name: str
    seconds: float
    """Of recording."""
    covariance: Floats
    """(P, P) in prior widths."""
    gained: float
    """Expected gain of information [nats]."""
    told: Told


@dataclass(frozen=True)
class Proposal:
    """K motions, and how often to play each."""

    driven: Driven
    within: Limits
    motions: Motions
    times: tuple[int, ...]
    """(K,)"""
    expected: tuple[Episode, ...]
    """What would be recorded at the cell's defaults."""


@dataclass(frozen=True)
class Plan:
    """What was recorded or would be by chance; what the proposed motions show, and both together."""

    parameters: tuple[Parameter, ...]
    shown: tuple[Shown, ...]
    proposal: Proposal | None
    warnings: tuple[str, ...] = ()

    def std(self, which: Shown) -> Floats:
        """(P,) expected standard deviations in the parameters' units."""
        return np.asarray(np.sqrt(np.diag(which.covariance)) * [p.half_width for p in self.parameters])


def information_of(simulator: Simulator, episodes: Sequence[Episode], steps: Floats) -> Floats:
    """(W, P, P) information of each window of recordings of a cell, in prior widths, at its defaults.

    As a calibration takes it: noise measured, first states free within theirs. Of more than MOST_WINDOWS windows an
    even choice, each with the weight of those that it stands for. `steps`: of the differences, as `steps_for` has them.
    """
    likelihood, share = _likelihood(simulator, episodes, MOST_WINDOWS)
    linear = _linear(likelihood, steps)
    flat = linear.jacobian.reshape(len(likelihood.inputs), -1, len(steps))
    of_start = linear.launch_jacobian.reshape(*flat.shape[:2], -1)
    return information(flat, of_start) / (share * likelihood.correlation_time)


def steps_for(simulator: Simulator, episodes: Sequence[Episode]) -> Floats:
    """(P,) finite differences [prior widths] that move what such episodes show by a tenth of a sigma.

    As short as those at the end of a fit: where mass and lever show only as a product, the curvature of long ones would
    pass for information.
    """
    likelihood, _ = _likelihood(simulator, episodes, SOME_WINDOWS)
    return FINE[0] * difference_steps(_linear(likelihood, np.full(len(likelihood.parameters), STEP)))


def _likelihood(simulator: Simulator, episodes: Sequence[Episode], most: int) -> tuple[Likelihood, float]:
    """Of some windows of recordings, and which share of all they are."""
    cell = simulator.cell
    every = windows(cell, episodes)
    chosen = np.unique(np.round(np.linspace(0, len(every) - 1, min(len(every), most))).astype(int))
    data = recordings(cell, [every[i] for i in chosen])
    noise = noise_of(cell, data)
    return pose(simulator.driven(data.drives), data, noise).likelihood, len(chosen) / len(every)


def _linear(likelihood: Likelihood, steps: Floats) -> Linear:
    return linearise(likelihood, start(likelihood, likelihood.prior_mean), np.arange(len(steps)), steps)


def gain(total: Floats) -> float:
    """Expected gain of information [nats] of a (P, P) matrix in prior widths."""
    return float(0.5 * np.linalg.slogdet(np.eye(len(total)) + total)[1])


def shown(simulator: Simulator, name: str, seconds: float, total: Floats) -> Shown:
    """What (P, P) information shows."""
    covariance = np.linalg.inv(np.eye(len(total)) + total)
    return Shown(name, seconds, covariance, gain(total), told(covariance, simulator.defaults, simulator.parameters))


def recorded(simulator: Simulator, episodes: Sequence[Episode]) -> tuple[Shown, Floats]:
    """What recordings show before any fit, and their (P, P) information. Raises DataError where they are unfit."""
    steps = steps_for(simulator, episodes)
    seconds = sum(w.tracks[0].stamp_ns[-1] - w.start_ns for w in windows(simulator.cell, episodes)) * 1e-9
    total = information_of(simulator, episodes, steps).sum(axis=0)
    return shown(simulator, "recorded", float(seconds), total), total


def plan_motions(
    simulator: Simulator,
    driven: Driven,
    within: Limits,
    count: int,
    tries: int,
    seed: int,
    known: tuple[Shown, Floats] | None = None,
    report: Report = silent,
) -> Plan:
    """`count` motions as long as a window, out of `tries`, beside what was recorded or would be by chance.

    Raises DataError where no motion keeps to the limits.
    """
    search = _Search(simulator, driven, within, seed)
    rng = np.random.default_rng([seed, 17])
    if known is None:
        numbers = rng.normal(size=(ORDINARY, size(driven)))
        numbers[:, : len(driven.joints)] = 0
        search.look(numbers)
        total = count / ORDINARY * np.sum(search.information, axis=0)
        known = shown(simulator, "by chance, around home", count * search.seconds, total), total
    import cma  # with matplotlib, a second of every other command

    strategy = cma.CMAEvolutionStrategy(
        np.zeros(size(driven)), 1.0, {"seed": seed + 1, "popsize": POPULATION, "verbose": -9}
    )
    best: list[int] = []
    while (done := len(search.information) / (tries + ORDINARY)) < 1:
        report(Progress("motions", len(search.information), min(done, 1.0), float("nan"), float("nan")))
        asked = np.array(strategy.ask())
        strategy.tell(list(asked), [-worth for worth in search.look(asked, best)])
        best = search.chosen(count)
    if not best:
        raise DataError(f"{simulator.cell.name}: no motion was found that keeps to all limits in the simulator")
    numbers, times = np.unique(best, return_counts=True)
    total = np.sum([search.information[i] for i in best], axis=0)
    proposed = shown(simulator, "proposed", count * search.seconds, total)
    told_of = [known[0], proposed]
    if known[0].name == "recorded":
        told_of.append(shown(simulator, "both", known[0].seconds + proposed.seconds, known[1] + total))
    return Plan(simulator.parameters, tuple(told_of), search.proposal(numbers.tolist(), tuple(times.tolist())))


class _Search:
    """Motions that were tried, and what each shows."""

    def __init__(self, simulator: Simulator, driven: Driven, within: Limits, seed: int) -> None:
        spec = simulator.cell.spec.windows
        self.seconds = simulator.cell.duration if spec is None else spec.length_s
        self.information: list[Floats] = []
        self._of = (simulator, driven, within)
        self._seed = seed
        self._steps: Floats | None = None
        self._motions: list[tuple[Motions, Episode]] = []

    def look(self, numbers: Floats, beside: Sequence[int] = ()) -> list[float]:
        """Try motions; the gain of each in the place of the last of those that it is to stand beside."""
        simulator, driven, within = self._of
        tried = motions(simulator, driven, within, self.seconds, numbers)
        rng = np.random.default_rng([self._seed, len(self.information)])
        episodes = virtual_recordings(
            simulator, driven, simulator.defaults, tried.time_s, tried.series, tried.posture, rng
        )
        found = np.zeros((len(numbers), len(simulator.parameters), len(simulator.parameters)))
        sound = np.flatnonzero(tried.sound)
        if len(sound):
            moving = [episodes[i] for i in sound]
            self._steps = steps_for(simulator, moving) if self._steps is None else self._steps
            found[sound] = information_of(simulator, moving, self._steps)
        others = np.sum([self.information[i] for i in beside[:-1]], axis=0) if beside else 0.0
        self.information += list(found)
        for i, episode in enumerate(episodes):
            own = slice(i, i + 1)
            one = Motions(tried.time_s, tried.posture[own], tried.series[own], tried.sound[own])
            self._motions.append((one, episode))
        return [gain(others + one) for one in found]

    def chosen(self, count: int) -> list[int]:
        """Indices of the motions that together show most, the same one perhaps several times; the least one last.

        Empty where none keeps to the limits.
        """
        picked: list[int] = []
        sound = [i for i, (motion, _) in enumerate(self._motions) if motion.sound.all()]
        total = np.zeros_like(self.information[0])
        for _ in range(count if sound else 0):
            best = max(sound, key=lambda i: gain(total + self.information[i]))
            picked.append(best)
            total = total + self.information[best]
        return picked

    def proposal(self, numbers: Sequence[int], times: tuple[int, ...]) -> Proposal:
        _, driven, within = self._of
        parts = [self._motions[i] for i in numbers]
        series, posture = (np.concatenate([getattr(m, name) for m, _ in parts]) for name in ("series", "posture"))
        together = Motions(parts[0][0].time_s, posture, series, np.ones(len(parts), bool))
        expected = [replace(e, name=f"motion_{i + 1:02d}") for i, (_, e) in enumerate(parts)]
        return Proposal(driven, within, together, times, tuple(expected))
