"""Degrees for radians, millimetres for metres: units in which the recordings are not those of this scene.

First the scene is asked. A joint with a range is outside of it as it is and inside once it is converted; a joint
without one is more than a turn away from its zero; a body has moved by a hundred times the size of the scene and more.
Then the simulator is asked, with nothing tuned, for the first part of the recordings. Let D be the recorded
displacement and S the simulated one: |S - D|^2 / |D|^2, which parameters that are a little wrong make a little larger
than zero. Where the scene is sure (outside before and inside afterwards), that must only not speak against it. Where
it is not (some joints make many turns, some bodies fall far), it must be TEN times less once it is converted. A system
without a scale of its own (a linear one) moves alike in any unit; a wheel that spins down in degrees is not seen, and
is calibrated as well as one in radians.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.limits import Limits
from compass_ros.checks.finding import Finding
from compass_ros.errors import DataError
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import recordings
from compass_ros.types import QUANTITY_SIZE, Bools, Episode, Floats, Track

FACTORS: Mapping[str, tuple[str, float]] = {
    "angle": ("degrees, not radians", np.pi / 180),
    "length": ("millimetres, not metres", 1e-3),
}
MOST = 0.5
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
    cell: Cell, episodes: Mapping[str, Episode], limits: Mapping[str, Limits], size: float
) -> tuple[Finding, ...]:
    """Objects whose numbers are in other units than the scene's. `size` [m]: the extent of the scene."""
    names = list(episodes)
    chosen = [episodes[names[i]] for i in np.unique(np.linspace(0, len(names) - 1, EPISODES).astype(int))]
    found = []
    for kind, (unit, factor) in FACTORS.items():
        own = {o.name: limits[o.name] for o in cell.objects if limits[o.name].kind == kind}
        doubts = {name: _doubt(chosen, name, one, size) for name, one in own.items()}
        strange = [name for name, doubt in doubts.items() if doubt != "none"]
        for group in dict.fromkeys((tuple(strange), *((name,) for name in strange))):
            sure = all(doubts[name] == "sure" for name in group)
            if group and _in_other_units(Simulator(cell, threads=1), chosen, group, factor, sure):
                looks = f"the numbers look like {unit}"
                found += [Finding("units", "bad", name, dict.fromkeys(names, ()), looks) for name in group]
                break
    return tuple(found)


def _doubt(episodes: Sequence[Episode], name: str, limits: Limits, size: float) -> Literal["none", "some", "sure"]:
    """How sure the scene is that these units are wrong and the others are right."""
    factor = FACTORS[limits.kind][1]
    numbers = np.concatenate([e.track(name).value[:, :3] for e in episodes])
    if np.isfinite(limits.high):
        return "sure" if _outside(numbers, limits, factor) else "none"
    if limits.kind == "angle":
        return "some" if np.abs(numbers).max() > 2 * np.pi else "none"
    moved = float(np.ptp(numbers, axis=0).max())
    return "none" if moved < SIZES * size else "sure" if moved * factor < SIZES * size else "some"


def _outside(numbers: Floats, limits: Limits, factor: float) -> bool:
    """Whether most numbers are outside the joint's range and all of them inside it once converted."""
    margin = 0.1 * (limits.high - limits.low)

    def inside(values: Floats) -> Bools:
        return np.asarray((values >= limits.low - margin) & (values <= limits.high + margin))

    return bool(np.mean(inside(numbers)) < MOST and inside(numbers * factor).all())


def _in_other_units(
    simulator: Simulator, episodes: Sequence[Episode], group: Sequence[str], factor: float, sure: bool
) -> bool:
    """Whether the simulator does better with these objects converted; where the scene is sure: not much worse."""
    as_it_is, converted = (_left(simulator, episodes, group, by) for by in (1.0, factor))
    return converted < (AGAINST if sure else 1 / TEN) * as_it_is


def _left(simulator: Simulator, episodes: Sequence[Episode], group: Sequence[str], factor: float) -> float:
    """|S - D|^2 / |D|^2 over the first part of the episodes, these objects converted; inf where that is no motion."""
    cell = simulator.cell
    try:
        data = recordings(cell, [_converted(e, group, factor) for e in episodes])
    except DataError:
        return float("inf")
    until = data.time_s <= SHARE * cell.duration
    columns = _columns(cell, group)
    predicted = simulator.observe(
        np.tile(simulator.defaults, (len(episodes), 1)), simulator.inputs(data.inputs), data.time_s
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


def _converted(episode: Episode, group: Sequence[str], factor: float) -> Episode:
    def of(track: Track) -> Track:
        value = track.value.copy()
        value[:, :3] *= factor
        return replace(track, value=value) if track.object in group else track

    return replace(episode, tracks=tuple(map(of, episode.tracks)))


def _columns(cell: Cell, group: Sequence[str]) -> list[int]:
    """Of an observation: positions and angles of these objects."""
    out, column = [], 0
    for o in cell.objects:
        size = QUANTITY_SIZE[o.quantity]
        out += list(range(column, column + min(size, 3))) if o.name in group else []
        column += size
    return out
