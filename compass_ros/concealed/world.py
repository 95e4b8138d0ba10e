"""A whole concealed world: what is drawn, how it is played, what the answer says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.random import Generator

from compass_ros.cells import Cell
from compass_ros.concealed.absorption import Absorber, rms
from compass_ros.concealed.imitation import Imitation, best_imitation, ideal
from compass_ros.concealed.law import PUCKS, WALLS, Ingredient, Law, Places
from compass_ros.concealed.laws import KNOWN, LAWS, OUTSIDE, known
from compass_ros.concealed.library import in_library_terms
from compass_ros.concealed.recording import NOISES, episodes, frame_times, seen
from compass_ros.concealed.shots import choose_shots
from compass_ros.concealed.strength import Judge, Strength, sized
from compass_ros.concealed.table import TIME_STEP, Played, Table
from compass_ros.concealed.twins import twins
from compass_ros.errors import ConfigError
from compass_ros.types import Episode, Floats

Kind = Literal["none", "one", "two", "outside"]
ODDS: Mapping[Kind, float] = {"none": 0.20, "one": 0.55, "two": 0.10, "outside": 0.15}
SHOTS = 12
COARSE_STEP = 0.001
"""For the search of twins, where only changes count."""
WEAKEST, STRONGEST = 1.5e-3, 8e-3
"""Bounds of the rms that is drawn [m]."""
_ALONE = 0.9
"""Share of an effect from which on one puck describes where it is."""
_UNLIKE = 0.9
"""Two effects of one world have a smaller cosine after the best parameters."""
_TRIES = 12
_MOVING = 0.05  # m/s
_STREAMS = ("kind", "parameters", "shots", "laws", "frames", "noise")


@dataclass(frozen=True)
class Wishes:
    """What may be asked of a world; everything else follows from the seed."""

    seed: int
    noise: str = "white"
    rms_m: float | None = None
    """None: drawn for each effect, uniform in the logarithm from WEAKEST to STRONGEST."""
    forms: Literal["other", "like"] = "other"
    """Formulas unlike the library's, or like them."""
    kind: Kind | None = None
    """None: drawn with ODDS."""
    names: tuple[str, ...] = ()
    """Laws that are asked for by name; they decide the kind."""


@dataclass(frozen=True)
class World:
    """Recordings, and the answer as plain data for JSON."""

    episodes: tuple[Episode, ...]
    answer: Mapping[str, object]


def conceal(cell: Cell, wishes: Wishes) -> World:
    """Draw and play a world. The same cell and wishes give the same bits.

    Raises ConfigError for a cell that has no concealed physics, an unknown noise or an unknown law.
    """
    if cell.spec.dynamics != "air_hockey":
        raise ConfigError(f"{cell.name}: concealed worlds exist for the dynamics air_hockey, not {cell.spec.dynamics}")
    if wishes.noise not in NOISES:
        raise ConfigError(f"unknown noise '{wishes.noise}'; known: {', '.join(NOISES)}")
    streams = {name: np.random.default_rng([wishes.seed, i]) for i, name in enumerate(_STREAMS)}
    kind = _kind(wishes, streams["kind"])
    values = wrong_parameters(cell, streams["parameters"])
    inputs = choose_shots(cell, values, SHOTS, streams["shots"])
    time_s = frame_times(cell.duration, SHOTS, streams["frames"])
    judges = _judges(cell, values, inputs, NOISES[wishes.noise].repeated)
    found = _effects(kind, wishes, judges[0], streams["laws"])
    ingredients = [s.ingredient for s in found]
    played = judges[0].table.play(ingredients) if found else judges[0].base
    bias = np.array([values[cell.index(f"env@camera@bias_{axis}")] for axis in "xy"])
    positions = seen(played, ingredients, time_s, bias)
    recorded, floor = episodes(cell, inputs, time_s, positions, NOISES[wishes.noise], streams["noise"])
    answer = {
        "schema": "compass/answer/1",
        "cell": cell.name,
        "cell_hash": cell.hash,
        "seed": wishes.seed,
        "noise": wishes.noise,
        "forms": wishes.forms,
        "time_step_s": TIME_STEP,
        "kind": kind,
        "effects": [described(s, judges[1], played) for s in found],
        "parameters": {p.name: float(v) for p, v in zip(cell.parameters, values, strict=True)},
        "noise_floor_m": floor,
        "numerics_rms_m": _numerics(judges[0], bias),
    }
    return World(tuple(recorded), answer)


def _numerics(judge: Judge, bias: Floats) -> float:
    """What the finer clock alone leaves after the best parameters [m]; estimated along tangents."""
    return rms(judge.absorber.left(judge.base.sample()(judge.time_s) + np.tile(bias, 2) - judge.absorber.plain))


def _kind(wishes: Wishes, rng: Generator) -> Kind:
    drawn: Kind = list(ODDS)[int(rng.choice(len(ODDS), p=list(ODDS.values())))]
    if not wishes.names:
        return wishes.kind or drawn
    if len(wishes.names) > 2:
        raise ConfigError(f"a world holds two effects at most, asked for {', '.join(wishes.names)}")
    if any(known(name) in OUTSIDE for name in wishes.names):
        return "outside"
    return "two" if len(wishes.names) == 2 else "one"


def wrong_parameters(cell: Cell, rng: Generator) -> Floats:
    """(P,) all of them, uniform within the half-width around the default and within the bounds."""
    low, high = (np.array([getattr(p, side) for p in cell.parameters]) for side in ("low", "high"))
    half = np.array([p.half_width for p in cell.parameters])
    return np.asarray(np.clip(cell.defaults + rng.uniform(-1, 1, len(half)) * half, low, high))


def _judges(cell: Cell, values: Floats, inputs: Floats, repeated: float) -> tuple[Judge, Judge]:
    """The world without laws, on its own clock and on a coarser one."""
    times = np.arange(round(cell.duration * 60)) / 60
    absorber = Absorber(cell, values, inputs, times)
    tiled = np.tile(times, (len(inputs), 1))
    tables = [Table(cell, values, inputs, step) for step in (TIME_STEP, COARSE_STEP)]
    fine, coarse = (Judge(table, absorber, tiled, table.play(), repeated) for table in tables)
    return fine, coarse


def _effects(kind: Kind, wishes: Wishes, judge: Judge, rng: Generator) -> list[Strength]:
    """Sized ingredients; a shape that cannot be made strong enough is drawn again."""
    pool = OUTSIDE if kind == "outside" else KNOWN
    count = {"none": 0, "one": 1, "two": 2, "outside": 1}[kind]
    names = wishes.names or tuple(rng.choice(list(pool), count, replace=False).tolist())
    places = places_of(judge.base)
    found: list[Strength] = []
    for name in names:
        target = wishes.rms_m or float(np.exp(rng.uniform(np.log(WEAKEST), np.log(STRONGEST))))
        found.append(strong_enough(LAWS[name], wishes.forms == "other", places, judge, target, found, rng))
    return found


def strong_enough(
    law: Law, other_forms: bool, places: Places, judge: Judge, target: float, others: Sequence[Strength], rng: Generator
) -> Strength:
    """Draw shapes of a law until one can be sized to `target` [m] and is unlike the others."""
    best: Strength | None = None
    for _ in range(_TRIES):
        shape = law.draw(rng, places, float(other_forms))
        tried = sized(Ingredient(law, _objects(law, places, rng), shape), judge, target)
        unlike = all(_cosine(tried.left, other.left) < _UNLIKE for other in others)
        if unlike and (best is None or abs(tried.rms_m - target) < abs(best.rms_m - target)):
            best = tried
        if best is not None and abs(best.rms_m / target - 1) < 0.15:
            break
    if best is None:
        raise ConfigError(f"{law.name} cannot be told from the other effect of this world; choose another seed")
    return best


def _cosine(a: Floats, b: Floats) -> float:
    return float(abs(np.sum(a * b)) / (np.linalg.norm(a) * np.linalg.norm(b) + 1e-30))


def _objects(law: Law, places: Places, rng: Generator) -> tuple[str, ...]:
    if law.on == "wall":
        often = [wall for wall in WALLS if places.touched.get(wall, 0) >= 3] or list(WALLS)
        return (str(rng.choice(often)),)
    if law.on == "puck":
        choices = (PUCKS, PUCKS[:1], PUCKS[1:])
        return choices[int(rng.choice(3, p=(0.5, 0.25, 0.25)))]
    return PUCKS


def places_of(played: Played) -> Places:
    """Where laws can be seen in shots that were played without any."""
    moving = np.linalg.norm(played.velocity, axis=3) > _MOVING
    return Places(played.position[moving], played.touched(), played.position.shape[1])


def described(strength: Strength, coarse: Judge, played: Played) -> dict[str, object]:
    """What the answer says of an effect. `coarse`: the world without laws on the coarser clock."""
    i = strength.ingredient
    share = np.sum(strength.left.reshape(-1, 2, 2) ** 2, axis=(0, 2))
    share = share / share.sum()
    alike = {puck for puck, part in zip(PUCKS, share, strict=True) if part > _ALONE}
    alike |= {"all"} if i.objects == PUCKS else set(i.objects)
    alike |= {"all"} if i.law.on == "wall" else set()
    twin = twins(strength, coarse)
    centre = [i.shape["centre_x"], i.shape["centre_y"]] if "centre_x" in i.shape else None
    outside = i.law.name in OUTSIDE
    numbers: Mapping[str, float] = {}
    if outside:
        near: Imitation | None = best_imitation(strength, coarse, places_of(coarse.base), played)
    else:
        near = ideal(strength, coarse, played)
        numbers = near.numbers if near else in_library_terms(i, played)
    return {
        "name": i.law.name,
        "outside": outside,
        "channel": i.law.channel,
        "phase": i.law.phases[0],
        "phases_right": sorted({*i.law.phases, *(phase for name in twin for phase in KNOWN[name].phases)}),
        "channels_right": sorted({i.law.channel, *(KNOWN[name].channel for name in twin)}),
        "objects": list(i.objects),
        "objects_right": sorted(alike),
        "centre_m": centre,
        "size": i.size,
        "shape": dict(i.shape),
        "library": dict(numbers),
        "nearest": {"name": near.name, "left_m": near.left_m} if near else None,
        "rms_before_m": rms(strength.change),
        "rms_m": strength.rms_m,
        "share_of_objects": {puck: float(part) for puck, part in zip(PUCKS, share, strict=True)},
        "twins": twin,
    }
