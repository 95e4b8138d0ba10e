"""Twelve drops of the cell `bouncing_ball`, filmed at 100 Hz from the side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.random import Generator

from compass_ros.types import Episode, Floats, Track
from compass_ros.worlds import draw, optics, sensors, soft
from compass_ros.worlds.bounce.ball import STEP_S, Extra, Physics, Rig, play
from compass_ros.worlds.bounce.laws import DRAW, KNOWN, OUTSIDE, Drawn
from compass_ros.worlds.world import Asked, Missing, Task, World, answer

DROPS = 12
RATE_HZ = 100.0
DURATION_S = 1.08
BEFORE_S = 0.2
"""Of still frames before the ball is let go."""
PLACE_M = 1e-3
LOST = 0.02
LOWEST_M, HIGHEST_M = 0.2, 0.4
_SPARE_S = 0.06
"""Beyond the last frame, for stamps and exposures that are off."""
_STREAMS = ("kind", "values", "laws", "drops", "noise")


def conceal(task: Task, asked: Asked) -> World:
    """Draw and play a world of the ball between its plates."""
    rng = draw.streams(asked.seed, task.name, _STREAMS)
    kind, names = draw.laws(asked, KNOWN, OUTSIDE, rng["kind"])
    values = draw.true_values(task.parameters, rng["values"])
    found = {name: DRAW[name](rng["laws"]) for name in names}
    heights = rng["drops"].uniform(LOWEST_M, HIGHEST_M, DROPS)
    time_s = np.arange(-int(BEFORE_S * RATE_HZ), int(DURATION_S * RATE_HZ)) / RATE_HZ

    paths: dict[tuple[str, ...], Floats] = {}

    def played_once(laws: Mapping[str, Drawn]) -> Floats:
        moving = tuple(name for name, law in laws.items() if law.optics is None)
        if moving not in paths:
            paths[moving] = played(values, heights, laws)
        return paths[moving]

    def see(laws: Mapping[str, Drawn]) -> Floats:
        when = optics.taken(faults(laws), time_s)
        return np.concatenate(seen(values, played_once(laws), laws, when))

    alone, total = sensors.strengths(found, see, PLACE_M)
    laws = [Missing(n, d.classes, d.sites, d.quantities, d.source, alone[n]) for n, d in found.items()]
    episodes = recorded(task, values, heights, played_once(found), found, time_s, rng["noise"])
    noise = {"place_m": PLACE_M, "lost": LOST, "rate_hz": RATE_HZ}
    said = answer(task, "bounce", asked, kind, laws, values, total, noise)
    return World(task.name, tuple(episodes), said)


def played(values: Mapping[str, float], heights: Floats, laws: Mapping[str, Drawn]) -> Floats:
    """(T + 1, S, 7) states of the ball in S drops."""
    rig = Rig(values)
    spin = sum((law.quantities.get("spin_rads", 0.0) for law in laws.values()), 0.0)
    cooling = 1 - sum(law.heats for law in laws.values()) * np.linspace(0, 1, len(heights))
    spins = np.full(len(heights), float(spin))
    duration = DURATION_S + _SPARE_S
    if np.ptp(cooling) == 0:
        return play(rig, heights, spins, duration, physics(rig, laws))
    one_by_one = [
        play(Rig(_warmed(values, float(k))), h[None], s[None], duration, physics(rig, laws))
        for h, s, k in zip(heights, spins, cooling, strict=True)
    ]
    return np.concatenate(one_by_one, axis=1)


def _warmed(values: Mapping[str, float], share: float) -> dict[str, float]:
    """The ball's own stiffness and damping at a higher temperature."""
    return dict(values) | {f"ball@dyna@{k}": values[f"ball@dyna@{k}"] * share for k in ("stiffness", "damping")}


def physics(rig: Rig, laws: Mapping[str, Drawn]) -> Physics:
    """What the laws add to the rig."""
    extras: dict[str, tuple[Extra, ...]] = {}
    grips = {}
    for law in laws.values():
        for site in law.sites:
            if law.extra is not None:
                extras[site] = (*extras.get(site, ()), law.extra(rig))
            if law.grip is not None:
                grips[site] = law.grip
    pushes = tuple(law.push(rig) for law in laws.values() if law.push is not None)
    loose = next((law.loose for law in laws.values() if law.loose is not None), None)
    return Physics(extras, grips, pushes, loose=loose)


def faults(laws: Mapping[str, Drawn]) -> tuple[optics.Optics, ...]:
    return tuple(law.optics for law in laws.values() if law.optics is not None)


def seen(values: Mapping[str, float], paths: Floats, laws: Mapping[str, Drawn], time_s: Floats) -> list[Floats]:
    """(F, 3) of each drop, without noise."""
    bias = np.array([values["env@camera@bias_x"], 0.0, values["env@camera@bias_z"]])

    def of(path: Floats) -> Floats:
        def place(when: Floats) -> Floats:
            x, z = np.asarray(soft.at(path[:, :2], STEP_S, when)).T
            return np.stack([x, np.zeros_like(x), z], axis=1)

        return np.asarray(optics.through(faults(laws), place, time_s) + bias)

    return [of(paths[:, s]) for s in range(paths.shape[1])]


def recorded(
    task: Task,
    values: Mapping[str, float],
    heights: Floats,
    paths: Floats,
    laws: Mapping[str, Drawn],
    time_s: Floats,
    rng: Generator,
) -> Sequence[Episode]:
    out = []
    shown = sensors.stamps(optics.shown(faults(laws), time_s))
    for n, place in enumerate(seen(values, paths, laws, time_s)):
        keep = sensors.kept(len(time_s), LOST, rng)
        track = Track("ball", "xyz", shown[keep], sensors.noisy(place, PLACE_M, rng)[keep])
        action = {"height": float(heights[n])}
        out.append(Episode(f"drop_{n:02d}", task.name, task.hash, action, sensors.START_NS, (track,)))
    return out
