"""Which series are what the robot measured, and which drove it: by names, then by who follows whom."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from typing import Literal

import numpy as np
from scipy.optimize import linear_sum_assignment

from compass_ros.cells.robot import Robot
from compass_ros.starter.motion import Column, Lag, lag
from compass_ros.starter.names import Match, matched, tokens
from compass_ros.starter.series import Recordings, Series, rates

Kind = Literal["position", "velocity", "effort"]
FOLLOWS = 0.7
"""Least correlation of a command and what came of it, at the best lag."""
_FEW = 3
"""Recordings from which a lag is taken."""
_EFFORT = {"effort", "efforts", "torque", "torques", "force", "forces", "current", "currents"}


@dataclass(frozen=True)
class Jointed:
    """A series whose numbers are known joints of the model."""

    series: Series
    joints: dict[str, Match]
    """By their names in the recordings."""

    @property
    def models(self) -> tuple[str, ...]:
        return tuple(match.model for match in self.joints.values())

    def columns(self, model: str) -> list[Column]:
        """The numbers of a joint of the model in each recording."""
        name = next(n for n, match in self.joints.items() if match.model == model)
        return self.series.columns(self.series.names.index(name))


@dataclass(frozen=True)
class Command:
    """What drove joints."""

    jointed: Jointed
    kind: Kind
    lags: dict[str, Lag]
    """By joint of the model: how its measured position (speed, acceleration) follows."""

    @property
    def linear(self) -> bool:
        """Whether what is asked for lies on the line between two stamps, as between points of a trajectory."""
        return self.jointed.series.held.type.endswith("/JointTrajectory")


@dataclass(frozen=True)
class Placed:
    """A pose or sensor that is a body or site of the model."""

    series: Series
    at: str
    how: str


@dataclass(frozen=True)
class Found:
    """What is what."""

    measured: tuple[Jointed, ...]
    commands: tuple[Command, ...]
    others: tuple[Jointed, ...]
    """Velocities and efforts beside the measured positions."""
    placed: tuple[Placed, ...]
    notes: tuple[str, ...]
    """What could not be matched, and why."""


def find(recordings: Recordings, robot: Robot) -> Found:
    """Match everything; nothing found is an empty answer."""
    models = [joint.name for joint in robot.joints]
    jointed = [
        Jointed(series, matched(series.names, models))
        for series in recordings.series
        if series.held.quantity.startswith("joint") and series.held.named
    ]
    positions = [one for one in jointed if one.joints and one.series.held.quantity == "joint_position"]
    measured = _measured(positions)
    notes = [_unmatched(one) for one in jointed if len(one.joints) < len(one.series.names) and one in measured]
    topics = {one.series.held.topic for one in measured}
    others = [o for o in jointed if o.joints and o.series.held.topic in topics and o not in positions]
    others = [o for o in others if not o.series.asked]
    lists = [s for s in recordings.series if not s.held.named and s.held.quantity == "joint_position"]
    offered = [*_offered(jointed, measured, notes), *_listed(lists, measured, notes)]
    commands = _covering(offered)
    left = [c for c in offered if c not in commands]
    if not commands:
        commands = list(_torques(others, measured))
        notes += [
            f"{c.jointed.series.held.topic}: no command was found; its efforts drive the joints" for c in commands
        ]
    notes += [f"{c.jointed.series.held.topic}: not used: another command is of the same joints" for c in left]
    placed, unplaced = _placed(recordings, robot)
    return Found(tuple(measured), tuple(commands), tuple(others), tuple(placed), (*notes, *unplaced))


def _measured(positions: Sequence[Jointed]) -> list[Jointed]:
    """Series of positions that no other one follows; of several with the same joints one."""
    leads = dict.fromkeys(range(len(positions)), 0)
    for a, b in permutations(range(len(positions)), 2):
        shared = [m for m in positions[a].models if m in positions[b].models]
        if shared and _leads(positions[a], positions[b], shared):
            leads[a] += 1
    ranked = sorted(
        (i for i in leads if not positions[i].series.asked and not leads[i]),
        key=lambda i: (positions[i].series.hinted, -len(positions[i].joints), positions[i].series.period_s),
    )
    out: list[Jointed] = []
    for i in ranked:
        known = {m for one in out for m in one.models}
        new = {name: match for name, match in positions[i].joints.items() if match.model not in known}
        if new and not (out and positions[i].series.hinted):
            out.append(replace(positions[i], joints=new) if len(new) < len(positions[i].joints) else positions[i])
    return out


def _leads(a: Jointed, b: Jointed, shared: Sequence[str]) -> bool:
    """Whether b follows a in most joints that move, by more than half a message."""
    lags = [_lag(a.columns(m), b.columns(m)) for m in shared]
    moving = [one.seconds for one in lags if one.correlation > FOLLOWS]
    return bool(moving) and float(np.median(moving)) > 0.5 * max(a.series.period_s, b.series.period_s)


def _lag(commands: Sequence[Column], answers: Sequence[Column], held: bool = True) -> Lag:
    """The median over some recordings."""
    every = [lag(c, a, held) for c, a in zip(commands[:_FEW], answers[:_FEW], strict=True)]
    moving = [one for one in every if one.correlation > 0] or every
    return Lag(*(float(np.median([getattr(one, part) for one in moving])) for part in ("seconds", "correlation")))


def _offered(jointed: Sequence[Jointed], measured: Sequence[Jointed], notes: list[str]) -> Iterator[Command]:
    """Series with names that could be commands of measured joints."""
    of = {m: one for one in measured for m in one.models}
    for one in jointed:
        held = one.series.held
        kind: Kind = held.quantity.removeprefix("joint_")  # type: ignore[assignment]
        known = {name: match for name, match in one.joints.items() if match.model in of}
        own = any(held.topic == m.series.held.topic and held.part == m.series.held.part for m in measured)
        requested = one.series.asked or one.series.hinted
        if not known or own or (kind != "position" and not requested):
            continue
        command = _timed(replace(one, joints=known), kind, of)
        lags = [answer for answer in command.lags.values() if answer.correlation > FOLLOWS]
        late = float(np.median([answer.seconds for answer in lags])) if lags else 0.0
        half = 0.5 * one.series.period_s
        if kind == "effort" or (lags and late > -half and (requested or late > half)) or (not lags and requested):
            yield command
        else:
            best = max((a.correlation for a in command.lags.values()), default=0.0)
            why = f"positions follow it by {1e3 * late:.0f} ms" if lags else f"correlation {best:.2f} at most"
            notes.append(f"{held.topic} ({held.quantity}): no command: {why}")


def _torques(others: Sequence[Jointed], measured: Sequence[Jointed]) -> Iterator[Command]:
    """Measured efforts that are not one value all along."""
    of = {m: one for one in measured for m in one.models}
    for one in others:
        every = [column.value for m in one.models for column in one.columns(m)]
        if one.series.held.quantity == "joint_effort" and any(len(v) and np.ptp(v) > 0 for v in every):
            yield _timed(one, "effort", of)


def _timed(one: Jointed, kind: Kind, of: dict[str, Jointed]) -> Command:
    """With the lags of what came of it."""
    linear = one.series.held.type.endswith("/JointTrajectory")
    lags = {m: _lag(one.columns(m), _answers(of[m], m, kind), not linear) for m in one.models}
    return Command(one, kind, lags)


def _answers(measured: Jointed, model: str, kind: Kind) -> list[Column]:
    """What a command of this kind shows in: positions, speeds, or their changes."""
    out = measured.columns(model)[:_FEW]
    for _ in range({"position": 0, "velocity": 1, "effort": 2}[kind]):
        out = [Column(column.stamp_ns, rates(column)) for column in out]
    return out


def _listed(lists: Sequence[Series], measured: Sequence[Jointed], notes: list[str]) -> Iterator[Command]:
    """Messages of numbers without names: which is which is seen in how the joints follow."""
    of = {m: one for one in measured for m in one.models}
    for series in lists:
        effort = bool(_EFFORT & {*tokens(series.held.topic)})
        kinds: tuple[Kind, ...] = ("effort",) if effort else ("position", "velocity")
        commands = [c for c in (_assigned(series, of, kind) for kind in kinds) if c is not None]
        if commands:
            best = max(commands, key=lambda c: min(a.correlation for a in c.lags.values()))
            yield best
        else:
            notes.append(
                f"{series.held.topic}: {len(series.names)} numbers without names, that no joints follow one by one"
            )


def _assigned(series: Series, of: dict[str, Jointed], kind: Kind) -> Command | None:
    """Numbers and joints in pairs; None where a number is left, or follows nothing.

    Of efforts those of all joints in their order: what a torque does is seen in no one joint.
    """
    models = list(of)
    if len(series.names) > len(models):
        return None
    if kind == "effort":
        if len(series.names) != len(models):
            return None
        chosen = dict(zip(series.names, models, strict=True))
        how = "by its place: as many numbers as joints"
    else:
        every = [[_lag(series.columns(i), _answers(of[m], m, kind)) for m in models] for i in range(len(series.names))]
        score = np.array([[one.correlation for one in row] for row in every])
        rows, columns = linear_sum_assignment(-score)
        if score[rows, columns].min() < FOLLOWS:
            return None
        chosen = {series.names[r]: models[c] for r, c in zip(rows, columns, strict=True)}
        how = "by motion"
    joints = {name: Match(model, how) for name, model in chosen.items()}
    return _timed(Jointed(series, joints), kind, of)


def _covering(offered: Sequence[Command]) -> list[Command]:
    """For each joint one command: most joints first, then what is followed best, then what comes most often."""
    order: dict[Kind, int] = {"position": 0, "velocity": 1, "effort": 2}
    ranked = sorted(
        offered,
        key=lambda c: (
            -len(c.lags),
            order[c.kind],
            -round(float(np.median([a.correlation for a in c.lags.values()])), 1),
            c.jointed.series.period_s,
        ),
    )
    out: list[Command] = []
    for command in ranked:
        if not {m for one in out for m in one.lags} & {*command.lags}:
            out.append(command)
    return out


def _unmatched(one: Jointed) -> str:
    names = [name for name in one.series.names if name not in one.joints]
    return f"{one.series.held.topic}: {', '.join(names)}: no joint of the model is called so"


def _placed(recordings: Recordings, robot: Robot) -> tuple[list[Placed], list[str]]:
    """Poses of bodies, and sensors at sites, by their frames or else by their topics."""
    placed: list[Placed] = []
    notes: list[str] = []
    poses = {(s.held.topic, s.names) for s in recordings.series if s.held.quantity == "pose"}
    for series in recordings.series:
        held = series.held
        if held.quantity.startswith("joint") or (held.quantity == "position" and (held.topic, series.names) in poses):
            continue
        elements = robot.bodies if held.quantity in ("pose", "position") else robot.sites
        words = held.names[:1] if held.named else tuple(reversed(held.topic.strip("/").split("/")))
        found = next((m for m in (matched([word], elements).get(word) for word in words) if m is not None), None)
        if found is not None and found.model not in {p.at for p in placed if p.series.held.quantity == held.quantity}:
            placed.append(Placed(series, found.model, found.how))
        else:
            kind = "body" if elements is robot.bodies else "site"
            notes.append(f"{held.topic} ({held.quantity} of {held.names[0]}): no {kind} of the model is called so")
    return placed, notes
