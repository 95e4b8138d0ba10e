"""Recordings that could be made next, shots or motions, and what a simulator predicts of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import yaml

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.errors import ConfigError
from compass_ros.planning.excitation import Proposal
from compass_ros.planning.motion_table import import_config, table
from compass_ros.planning.motions import Limits, Motions, limits, motions, size
from compass_ros.planning.planned import drawn
from compass_ros.simulation import Simulator
from compass_ros.simulation.driven import Driven, driven_joints, played, virtual_recordings
from compass_ros.types import Floats

SHOTS, MOTIONS = 32, 16
"""How many are tried."""
_FRAMES = 60
"""Of a shot."""
_SLOWER = 3.0
"""Half of the motions are so much slower: friction shows at low speeds, inertia at high ones."""
_ACROSS_S = 0.1
"""Time over which speeds are measured that the joints have reached: noise of single frames is none."""
SHOT, TABLE, IMPORT = "next_shot.yaml", "next_motion.csv", "next_motion_import.yaml"


class Trials(Protocol):
    """Some shots, or some motions."""

    @property
    def word(self) -> str: ...

    def predicted(self, simulator: Simulator, values: Floats) -> Floats:
        """(N, S, D) numbers that would be recorded [sigma], of S trials at (N, P) values of a simulator of the cell."""
        ...

    def ask(self, trial: int) -> str:
        """What to do, as the beginning of a sentence."""
        ...

    def action(self, trial: int) -> Mapping[str, float] | None:
        """A shot by the name of its fields."""
        ...

    def files(self, trial: int) -> Mapping[str, str]:
        """What the robot needs to do that, by name of the file."""
        ...


def trials(simulator: Simulator, likelihood: Likelihood, seed: int, count: int = 0) -> Trials | None:
    """Of the plain simulator and its recordings; None where the cell has neither shots nor motions to choose from.

    `count`: how many are tried; 0: SHOTS or MOTIONS.
    """
    sigma = np.median(likelihood.sigma[:, : max(likelihood.sigma.shape[1] // 4, 1)], axis=(0, 1))
    compared = ~np.isnan(likelihood.measured).all(axis=(0, 1))
    sigma = np.where(compared, sigma, np.inf)
    if simulator.cell.spec.inputs:
        return _motions(simulator, likelihood, sigma, seed, count or MOTIONS)
    if not simulator.cell.action or simulator.cell.spec.start:
        return None
    found = drawn(simulator, count or SHOTS, np.random.default_rng(seed))
    return Shots(simulator, found, sigma) if len(found) else None


@dataclass(frozen=True, eq=False)
class Shots:
    """(S, A) commands."""

    simulator: Simulator
    inputs: Floats
    sigma: Floats
    word: str = "shot"

    def predicted(self, simulator: Simulator, values: Floats) -> Floats:
        time = np.tile(np.linspace(0, simulator.cell.duration, _FRAMES), (len(values) * len(self.inputs), 1))
        seen = simulator.observe(
            np.repeat(values, len(self.inputs), axis=0), np.tile(self.inputs, (len(values), 1)), time
        )
        return np.asarray((seen / self.sigma).reshape(len(values), len(self.inputs), -1))

    def ask(self, trial: int) -> str:
        units = {a.name: a.unit for a in self.simulator.cell.action}
        fields = ", ".join(f"{name} {value:.3f} {units[name]}" for name, value in self.action(trial).items())
        return f"Play the shot {fields}"

    def action(self, trial: int) -> Mapping[str, float]:
        return {a.name: float(v) for a, v in zip(self.simulator.cell.action, self.inputs[trial], strict=False)}

    def files(self, trial: int) -> Mapping[str, str]:
        """As `compass plan --shots` and `compass conceal --commands` read it."""
        return {SHOT: yaml.safe_dump({"shots": [dict(self.action(trial))]}, sort_keys=False)}


@dataclass(frozen=True, eq=False)
class Driving:
    """Motions of a driven cell."""

    simulator: Simulator
    driven: Driven
    within: Limits
    motions: Motions
    sigma: Floats
    apart_s: float
    """Time between two frames that count."""
    word: str = "motion"

    def predicted(self, simulator: Simulator, values: Floats) -> Floats:
        own = self.motions
        every = max(round(self.apart_s / float(own.time_s[1])), 1)
        seen = played(simulator, self.driven, values, own.time_s, own.series, own.posture)[:, :, ::every]
        return np.asarray((seen / self.sigma).reshape(len(values), len(own.series), -1))

    def ask(self, trial: int) -> str:
        return f"Record the motion of {TABLE} ({self.motions.time_s[-1]:.1f} s)"

    def action(self, trial: int) -> None:
        return None

    def files(self, trial: int) -> Mapping[str, str]:
        cell, own = self.simulator.cell, slice(trial, trial + 1)
        one = replace(self.motions, **{n: getattr(self.motions, n)[own] for n in ("posture", "series", "sound")})
        rng = np.random.default_rng(0)
        expected = virtual_recordings(
            self.simulator, self.driven, self.simulator.defaults, one.time_s, one.series, one.posture, rng
        )
        proposal = Proposal(self.driven, self.within, one, (1,), tuple(expected))
        return {TABLE: table(cell, proposal), IMPORT: import_config(cell, proposal, TABLE)}


def _motions(simulator: Simulator, likelihood: Likelihood, sigma: Floats, seed: int, count: int) -> Driving | None:
    """Within the scene's ranges, else the places, and the speeds that the joints have reached in the recordings."""
    try:
        driven, speed = _reached(simulator, likelihood, driven_joints(simulator))
        within = replace(limits(driven, 1.0), speed=speed)
    except ConfigError:
        return None  # measured inputs, wrenches, forces without a limit: nobody can say what may be played
    spec = simulator.cell.spec.windows
    seconds = simulator.cell.duration if spec is None else spec.length_s
    numbers = np.random.default_rng([seed, 29]).normal(size=(count, size(driven)))
    slow = replace(within, speed=within.speed / _SLOWER)
    halves = zip((within, slow), np.array_split(numbers, 2), strict=True)
    both = [motions(simulator, driven, limit, seconds, own) for limit, own in halves]
    sound = np.concatenate([m.sound for m in both])
    if not sound.any():
        return None
    posture, series = (np.concatenate([getattr(m, name) for m in both])[sound] for name in ("posture", "series"))
    independent = float(np.nanmedian(np.diff(likelihood.time_s))) * likelihood.correlation_time
    return Driving(
        simulator, driven, within, Motions(both[0].time_s, posture, series, sound[sound]), sigma, independent
    )


def _reached(simulator: Simulator, likelihood: Likelihood, driven: Driven) -> tuple[Driven, Floats]:
    """The same joints, between the places that they were at where the scene gives no range, and (D,) the largest speed
    of each [rad/s or m/s]; one that was not measured has the least of the others', at most 1."""
    frames = max(round(_ACROSS_S / float(np.nanmedian(np.diff(likelihood.time_s)))), 1)
    apart = likelihood.time_s[:, frames:] - likelihood.time_s[:, :-frames]
    moved = np.abs(likelihood.measured[:, frames:] - likelihood.measured[:, :-frames]) / apart[:, :, None]
    speed, seen = np.full(len(driven.joints), np.nan), {}
    for signal in (s for s in simulator.cell.signals if s.quantity == "joint_position"):
        for column, joint in enumerate(signal.at, signal.first):
            places = likelihood.measured[:, :, column]
            if joint in driven.joints and not np.isnan(places).all():
                speed[driven.joints.index(joint)] = np.nanmax(moved[:, :, column])
                seen[joint] = (float(np.nanmin(places)), float(np.nanmax(places)))
    return driven.between(seen), np.where(np.isnan(speed), np.nanmin([*speed, 1.0]), speed)
