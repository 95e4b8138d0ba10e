"""Where a discrepancy sits, and on what it depends: a joint or body, a part of the plane or of a range, or a signal."""

from __future__ import annotations

import numpy as np

from compass_ros.discovery.discrepancy import ALL, Free, Part
from compass_ros.discovery.maps import in_plane
from compass_ros.discovery.response import Response
from compass_ros.simulation.site_kinds import JOINTS
from compass_ros.types import DependsOn, Floats, Interval, Region, Where

HELD, WIDE = 0.9, 0.6
"""Share of a discrepancy's square that a range holds to be told as its place; share of all moments that it may hold at
most, beyond which it is no place. They choose words and no verdict."""
CLEARLY = 3.0
"""Difference of log evidence from which one thing is said and not the other: odds of 20 (Kass and Raftery 1995,
'strong')."""


def whereabouts(response: Response, free: Free) -> Where:
    """Site, channel, place and kind of a free discrepancy."""
    by_place, by_speed = ([part for part in free.state if part.of == kernel] for kernel in ("place", "velocity"))
    other, best = sorted((max(of, key=lambda part: part.log) for of in (by_place, by_speed)), key=lambda part: part.log)
    on_one = max(free.forces, key=lambda part: part.log)
    of_one = max(free.signals, key=lambda part: part.log, default=None)
    if of_one and of_one.log > max(on_one.log, best.log):
        return Where(of_one.name, "all", "sensing")
    depends_on = _depends_on(best, other, on_one)
    pushes = free.pushes if depends_on == "time" else best.pushes
    return Where(
        on_one.name,
        "free",
        "dynamics",
        region(response, pushes) if depends_on != "velocity" else None,
        interval=interval(response, pushes, on_one.name, depends_on),
        depends_on=depends_on,
    )


def _depends_on(best: Part, other: Part, in_time: Part) -> DependsOn | None:
    """Place or velocity where a function of it has clearly more evidence than of the other, or than one of time."""
    if in_time.log > best.log + CLEARLY:
        return "time"
    if best.log < max(other.log, in_time.log) + CLEARLY:
        return None
    return "place" if best.of == "place" else "velocity"


def region(response: Response, pushes: Floats) -> Region | None:
    """A disc in the plane that holds most of (E, K, S) pushes, where it is clearly smaller than where things were."""
    place, size = in_plane(response, pushes)
    strength = size**2
    if not strength.sum() > 0:
        return None
    centre = (strength[:, None] * place).sum(axis=0) / strength.sum()
    far = np.hypot(*(place - centre).T)
    order = np.argsort(far)
    inside = np.searchsorted(np.cumsum(strength[order]), HELD * strength.sum())
    radius = float(far[order][min(inside, len(far) - 1)])
    wide = float(np.mean(far <= radius))
    return Region((float(centre[0]), float(centre[1])), radius) if wide < WIDE else None


def interval(response: Response, pushes: Floats, name: str, depends_on: DependsOn | None) -> Interval | None:
    """The shortest range of an angle, or of a speed, that holds most of the pushes on one site; None: no such range."""
    names = [site.name for site in response.sites]
    if (name == ALL and len(names) > 1) or depends_on not in ("place", "velocity"):
        return None
    n = names.index(name) if len(names) > 1 else 0
    joint = response.sites[n].kind in JOINTS
    place, rate = (one.reshape(-1, one.shape[2]) for one in response.along(n))
    unit = response.simulator.unit if joint else "m"
    if depends_on == "place" and not joint:
        return None
    at = place[:, 0] if depends_on == "place" else np.linalg.norm(rate, axis=1)
    strength = np.sum(pushes[:, :, np.flatnonzero(response.site_of == n)] ** 2, axis=2).ravel()
    order = np.argsort(at)
    held = np.concatenate([[0.0], np.cumsum(strength[order]) / max(strength.sum(), 1e-300)])
    last = np.searchsorted(held, held[:-1] + HELD - 1e-9)
    able = np.flatnonzero(last <= len(at))
    first = int(able[np.argmin(at[order][last[able] - 1] - at[order][able])])
    if last[first] - first > WIDE * len(at):
        return None
    low, high = float(at[order][first]), float(at[order][last[first] - 1])
    if depends_on == "velocity":
        return Interval("speed", low, high, f"{unit}/s")
    return Interval("angle" if unit == "rad" else "position", low, high, unit)
