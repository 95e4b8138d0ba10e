"""Where a discrepancy sits, and on what it depends: a joint or body, a part of the plane or of a range, or a signal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compass_ros.discovery.discrepancy import Free, spread
from compass_ros.discovery.evidence import evidences, log_sum
from compass_ros.discovery.kernels import Shared, shared
from compass_ros.discovery.maps import in_plane
from compass_ros.discovery.response import Response
from compass_ros.discovery.settings import FREE
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
    other, best = sorted((shared(response, "velocity"), shared(response, "place")), key=lambda one: one.log)
    n, moved = _one_or_all(response, [_pushes(response, n) for n in range(len(response.sites))])
    sensors = _sensors(response)
    s, read = _one_or_all(response, list(sensors.values()))
    if read > max(moved, best.log):
        return Where(list(sensors)[s] if s is not None and len(sensors) > 1 else "all", "all", "sensing")
    name = response.sites[n].name if n is not None and len(response.sites) > 1 else "all"
    depends_on = _depends_on(best, other, free)
    pushes = free.pushes if depends_on == "time" else best.pushes
    return Where(
        name,
        "free",
        "dynamics",
        region(response, pushes) if depends_on != "velocity" else None,
        interval=interval(response, pushes, n, depends_on),
        depends_on=depends_on,
    )


def _pushes(response: Response, n: int) -> Floats:
    """(S,) 1 for the forces on one site."""
    return np.pad((response.site_of == n).astype(float), (0, len(response.unit) - len(response.site_of)))


def _sensors(response: Response) -> dict[str, Floats]:
    """(S,) 1 for the errors of each encoder, by `signal.joint`, and of each other signal."""
    out: dict[str, Floats] = {}
    for signal in response.simulator.cell.signals:
        if not signal.fitted:
            continue
        named = zip(signal.numbers, range(signal.first, signal.first + signal.size), strict=True)
        each = {f"{signal.name}.{n}": slice(i, i + 1) for n, i in named} if signal.jointed and signal.size > 1 else {}
        for name, columns in (each or {signal.name: signal.columns}).items():
            out[name] = np.zeros(len(response.unit))
            out[name][len(response.site_of) :][columns] = 1.0
    return out


def _one_or_all(response: Response, each: Sequence[Floats]) -> tuple[int | None, float]:
    """Which of some (S,) parts has the highest evidence for a discrepancy of its own, None: all together; and that."""
    logs = []
    for on in (np.sum(each, axis=0), *each):
        found = evidences(response.tangent, [spread(response, s * on * response.unit) for s in FREE])
        logs.append(log_sum(np.array([f.log for f in found])) - float(np.log(len(FREE))))
    best = int(np.argmax(logs))
    return best - 1 if best else None, logs[best]


def _depends_on(best: Shared, other: Shared, free: Free) -> DependsOn | None:
    """Place or velocity where a function of it has clearly more evidence than of the other, or than one of time."""
    if free.in_time > best.log + CLEARLY:
        return "time"
    if best.log < max(other.log, free.in_time) + CLEARLY:
        return None
    return "place" if best.kernel == "place" else "velocity"


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


def interval(response: Response, pushes: Floats, n: int | None, depends_on: DependsOn | None) -> Interval | None:
    """The shortest range of an angle, or of a speed, that holds most of the pushes on one site; None: no such range."""
    if n is None or depends_on not in ("place", "velocity"):
        return None
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
