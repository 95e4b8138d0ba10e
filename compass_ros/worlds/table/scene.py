"""Twelve shots of the cell `air_hockey`, filmed from above at 60 Hz."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.random import Generator

from compass_ros.types import Episode, Floats, Ints, Track
from compass_ros.worlds import draw, optics, sensors, soft
from compass_ros.worlds.table.discs import PUCKS, STEP_S, Extra, Force, Physics, Ratio, Rig, play
from compass_ros.worlds.table.laws import DRAW, KNOWN, OUTSIDE, Drawn
from compass_ros.worlds.world import Asked, Missing, Task, World, answer

SHOTS = 12
RATE_HZ = 60.0
DURATION_S = 2.5
BEFORE_S = 0.25
PLACE_M = 1e-3
LOST = 0.02
COMMAND = ("x", "y", "angle", "velocity")
LOW = np.array([-0.3, -0.12, -0.25, 0.25])
HIGH = np.array([-0.2, 0.12, 0.25, 0.7])
"""Of a command [m, m, rad, m/s], within the arm's reach."""
_SPARE_S = 0.06
_STREAMS = ("kind", "values", "laws", "shots", "noise", "strokes")


def conceal(task: Task, asked: Asked) -> World:
    """Draw and play a world of the table."""
    rng = draw.streams(asked.seed, task.name, _STREAMS)
    kind, names = draw.laws(asked, KNOWN, OUTSIDE, rng["kind"])
    values = draw.true_values(task.parameters, rng["values"])
    found = {name: DRAW[name](rng["laws"]) for name in names}
    commands = rng["shots"].uniform(LOW, HIGH, (SHOTS, 4)) if asked.commands is None else asked.commands
    strokes = rng["strokes"].normal(size=len(commands))
    time_s = np.arange(-int(BEFORE_S * RATE_HZ), int(DURATION_S * RATE_HZ)) / RATE_HZ
    paths: dict[tuple[str, ...], Floats] = {}

    def played(laws: Mapping[str, Drawn]) -> Floats:
        moving = tuple(name for name, law in laws.items() if law.optics is None)
        if moving not in paths:
            paths[moving] = shot(values, commands, strokes, laws)
        return paths[moving]

    def see(laws: Mapping[str, Drawn]) -> Floats:
        when = optics.taken(faults(laws), time_s)
        return np.concatenate(seen(values, played(laws), laws, when))

    alone, total = sensors.strengths(found, see, PLACE_M)
    laws = [Missing(n, d.classes, d.sites, d.quantities, d.source, alone[n]) for n, d in found.items()]
    shown = sensors.stamps(optics.shown(faults(found), time_s))
    episodes = []
    for n, places in enumerate(seen(values, played(found), found, time_s)):
        action = {name: float(value) for name, value in zip(COMMAND, commands[n], strict=True)}
        tracks = filmed(places, shown, rng["noise"])
        episodes.append(Episode(f"shot_{n:02d}", task.name, task.hash, action, sensors.START_NS, tracks))
    noise = {"place_m": PLACE_M, "lost": LOST, "rate_hz": RATE_HZ}
    said = answer(task, "table", asked, kind, laws, values, total, noise)
    return World(task.name, tuple(episodes), said)


def shot(values: Mapping[str, float], commands: Floats, strokes: Floats, laws: Mapping[str, Drawn]) -> Floats:
    """(T + 1, S, 18) states of all shots; `strokes` (S,) are what jitters, in standard deviations."""
    done = commands.copy()
    done[:, 2] += sum(law.heading_rad for law in laws.values())
    shots = np.linspace(0, 1, len(commands))
    physical = replace(
        physics(laws),
        strokes=1 + sum(law.jitter for law in laws.values()) * strokes,
        carried=1 - sum(law.tiring for law in laws.values()) * shots,
    )
    return play(Rig(values), done, DURATION_S + _SPARE_S, physical)


def physics(laws: Mapping[str, Drawn]) -> Physics:
    """What the laws add to the table."""
    forces: dict[str, tuple[Force, ...]] = {}
    ratios: dict[str, tuple[Ratio, ...]] = {}
    extras: dict[str, tuple[Extra, ...]] = {}
    grips: dict[str, float] = {}
    for law in laws.values():
        for site in law.sites:
            if law.force is not None:
                forces[site] = (*forces.get(site, ()), law.force)
            if law.ratio is not None:
                ratios[site] = (*ratios.get(site, ()), law.ratio)
            if law.extra is not None:
                extras[site] = (*extras.get(site, ()), law.extra)
            if law.grip:
                grips[site] = grips.get(site, 0.0) + law.grip
    drives = [law.drive for law in laws.values() if law.drive is not None]
    if len(drives) == 2:
        return Physics(forces, ratios, extras, grips, lambda told: drives[1](drives[0](told)))
    return Physics(forces, ratios, extras, grips, drives[0] if drives else None)


def faults(laws: Mapping[str, Drawn]) -> tuple[optics.Optics, ...]:
    return tuple(law.optics for law in laws.values() if law.optics is not None)


def seen(values: Mapping[str, float], paths: Floats, laws: Mapping[str, Drawn], time_s: Floats) -> list[Floats]:
    """(F, 4) x, y of both pucks in each shot, without noise."""
    bias = np.array([values["env@camera@bias_x"], values["env@camera@bias_y"]])

    def of(path: Floats, puck: int) -> Floats:
        def place(when: Floats) -> Floats:
            flat = soft.at(path[:, 2 * puck : 2 * puck + 2], STEP_S, when)
            return np.concatenate([flat, np.zeros((len(when), 1))], axis=1)

        return np.asarray(optics.through(faults(laws), place, time_s)[:, :2] + bias)

    return [np.concatenate([of(paths[:, s], k) for k in range(2)], axis=1) for s in range(paths.shape[1])]


def filmed(places: Floats, shown: Ints, rng: Generator) -> tuple[Track, ...]:
    """Tracks of both pucks with noise; each is lost in frames of its own."""
    out = []
    for k, name in enumerate(PUCKS):
        keep = sensors.kept(len(places), LOST, rng)
        place = sensors.noisy(places[:, 2 * k : 2 * k + 2], PLACE_M, rng)
        out.append(Track(name, "xy", shown[keep], place[keep]))
    return tuple(out)
