"""Degrees for radians, millimetres for metres: units in which the recordings are not those of this scene.

First the scene is asked. A joint with a range is outside of it as it is, in most of one recording at least, and inside
once it is converted, in all of them; a joint without one is more than a turn away from its zero; a body has moved by a
hundred times the size of the scene and more. Then the simulator is asked, with nothing tuned, for the first part of the
recordings, with the joints' commands in the one unit and in the other. Let D be the recorded displacement and S the
simulated one: |S - D|^2 / |D|^2, which parameters that are a little wrong make a little larger than zero. Where the
scene is sure (outside before and inside afterwards), that must only not speak against it. Where it is not (some joints
make many turns, some bodies fall far), it must be TEN times less once it is converted. A system without a scale of its
own (a linear one) moves alike in any unit; a wheel that spins down in degrees is not seen, and is calibrated as well as
one in radians.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.limits import Limits
from compass_ros.checks.finding import Finding
from compass_ros.checks.signals import Part
from compass_ros.errors import DataError
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.sites import driven_joint
from compass_ros.simulation.windows import windows
from compass_ros.types import Bools, Episode, Floats, Track

FACTORS: Mapping[str, tuple[str, float]] = {
    "angle": ("degrees, not radians", np.pi / 180),
    "length": ("millimetres, not metres", 1e-3),
}
MOST = 0.5
"""Of a recording's numbers: a joint that rests at zero is inside its range in any unit, a glitch is soon over."""
SIZES = 100.0
"""Sizes of the scene by which hardly anything moves: in millimetres that is a tenth of its size."""
TEN = 10.0
AGAINST = 2.0
"""By how much worse the simulator may do once it is told other units."""
EPISODES = 6
"""So many are simulated."""
SHARE = 0.3
"""Of an episode: what is wrong with the parameters shows later."""


def units(
    cell: Cell, episodes: Mapping[str, Episode], parts: Mapping[str, Sequence[Part]], size: float
) -> list[Finding]:
    """Parts whose numbers are in other units than the scene's.

    Args:
        parts: By the name of their signal.
        size: Extent of the scene [m].
    """
    names = list(episodes)
    chosen = [episodes[names[i]] for i in np.unique(np.linspace(0, len(names) - 1, EPISODES).astype(int))]
    found: list[Finding] = []
    for kind, (unit, factor) in FACTORS.items():
        own = [(signal, p) for signal, of in parts.items() for p in of if p.limits.kind == kind and not p.turns]
        doubts = {one: _doubt(chosen, *one, size) for one in own}
        strange = [one for one, doubt in doubts.items() if doubt != "none"]
        together = _all(Simulator(cell, threads=1), chosen, strange, doubts, factor) if strange else []
        looks = f"the numbers look like {unit}"
        found += [Finding("units", "bad", part.name, dict.fromkeys(names, ()), looks) for _, part in together]
    return found


def _all(
    simulator: Simulator,
    episodes: Sequence[Episode],
    strange: Sequence[tuple[str, Part]],
    doubts: Mapping[tuple[str, Part], str],
    factor: float,
) -> list[tuple[str, Part]]:
    """Of the strange parts those in other units: all of them, or else each that is so by itself."""

    def so(group: Sequence[tuple[str, Part]]) -> bool:
        return _in_other_units(simulator, episodes, group, factor, all(doubts[one] == "sure" for one in group))

    if so(strange):
        return list(strange)
    return [one for one in strange if len(strange) > 1 and so([one])]


def _doubt(episodes: Sequence[Episode], signal: str, part: Part, size: float) -> Literal["none", "some", "sure"]:
    """How sure the scene is that these units are wrong and the others are right."""
    limits, factor = part.limits, FACTORS[part.limits.kind][1]
    each = [e.track(signal).value[:, part.columns] for e in episodes]
    each = [numbers[~np.isnan(numbers).any(axis=1)] for numbers in each]
    numbers = np.concatenate(each)
    if not len(numbers):
        return "none"
    if np.isfinite(limits.high):
        return "sure" if _outside([own for own in each if len(own)], limits, factor) else "none"
    if limits.kind == "angle":
        return "some" if np.abs(numbers).max() > 2 * np.pi else "none"
    moved = float(np.ptp(numbers, axis=0).max())
    return "none" if moved < SIZES * size else "sure" if moved * factor < SIZES * size else "some"


def _outside(each: Sequence[Floats], limits: Limits, factor: float) -> bool:
    """Whether most numbers of a recording are outside the joint's range, and all of all inside it once converted."""
    margin = 0.1 * (limits.high - limits.low)

    def inside(values: Floats) -> Bools:
        return np.asarray((values >= limits.low - margin) & (values <= limits.high + margin))

    return any(np.mean(inside(own)) < MOST for own in each) and all(inside(own * factor).all() for own in each)


def _in_other_units(
    simulator: Simulator, episodes: Sequence[Episode], group: Sequence[tuple[str, Part]], factor: float, sure: bool
) -> bool:
    """Whether the simulator does better with these objects converted; where the scene is sure: not much worse."""
    told = _told(simulator, group)
    converted = [[_converted(e, group, told, factor, by) for e in episodes] for by in (1.0, factor)[: 1 + bool(told)]]
    least = min(_left(simulator, those, group) for those in converted)
    return least < (AGAINST if sure else 1 / TEN) * _left(simulator, episodes, group)


def _told(simulator: Simulator, group: Sequence[tuple[str, Part]]) -> dict[str, list[int]]:
    """Of each input that says where these joints should be, or how fast, their columns."""
    cell, model = simulator.cell, simulator.physics.model
    joints = {cell.signal(name).at[part.first] for name, part in group if cell.signal(name).jointed}
    out = {}
    for spec in cell.spec.inputs:
        if spec.to == "ctrl" and spec.quantity in ("joint_position", "joint_velocity"):
            out[spec.name] = [i for i, name in enumerate(spec.targets) if driven_joint(model, name) in joints]
    return {name: columns for name, columns in out.items() if columns}


def _left(simulator: Simulator, episodes: Sequence[Episode], group: Sequence[tuple[str, Part]]) -> float:
    """|S - D|^2 / |D|^2 of these objects over the first part of the episodes; inf where that is no motion."""
    cell = simulator.cell
    try:
        data = recordings(cell, windows(cell, episodes)[:EPISODES])
    except DataError:
        return float("inf")
    until = data.time_s <= SHARE * cell.duration
    columns = [cell.signal(name).first + i for name, part in group for i in range(part.first, part.first + part.size)]
    simulator = simulator.driven(data.drives)
    predicted = simulator.observe(
        np.tile(simulator.defaults, (len(data.names), 1)), simulator.inputs(data.inputs), data.time_s
    )
    seen = until[:, :, None] & (data.time_s >= 0)[:, :, None] & ~np.isnan(data.measured)
    recorded, simulated = (
        _moved(np.where(seen, values, np.nan)[:, :, columns]) for values in (data.measured, predicted)
    )
    size = float(np.nansum(recorded**2))
    missed = float(np.nansum((simulated - recorded) ** 2)) if np.isfinite(predicted).all() else float("inf")
    return missed / size if size > 0 else float("inf")


def _moved(values: Floats) -> Floats:
    """(E, F, c) displacement from the first frame that was seen."""
    first = np.argmax(~np.isnan(values), axis=1)
    return np.asarray(values - np.take_along_axis(values, first[:, None], axis=1))


def _converted(
    episode: Episode,
    group: Sequence[tuple[str, Part]],
    told: Mapping[str, Sequence[int]],
    factor: float,
    commands: float,
) -> Episode:
    """With the numbers of these parts, and of the commands to them, by these factors."""

    def of(track: Track) -> Track:
        value = track.value.copy()
        for name, part in group:
            if name == track.object:
                value[:, part.columns] *= factor
        return replace(track, value=value)

    def input_of(track: Track) -> Track:
        value = track.value.copy()
        value[:, list(told.get(track.object, ()))] *= commands
        return replace(track, value=value)

    return replace(episode, tracks=tuple(map(of, episode.tracks)), inputs=tuple(map(input_of, episode.inputs)))
