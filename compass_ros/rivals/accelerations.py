"""Accelerations in free flight, of the recorded and of the simulated tracks.

A parabola through the frames of a window gives place, velocity and acceleration at its middle (Savitzky and Golay 1964,
second order), for both tracks alike. A window that touches a contact of the simulated track, or that no parabola
describes, is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.rivals.calibrated import Calibrated, Shots
from compass_ros.types import Bools, Floats, Ints

JUMP = 0.02
"""Change of the simulated velocity from frame to frame that is a contact [m/s]; friction makes 0.005 at most."""
MARGIN = 2
"""Frames on each side of a contact that are left out: the real one is a little earlier or later."""
SLOW = 0.03
"""Slower bodies say nothing: friction may hold them [m/s]."""
LEAST_FRAMES = 5
BENT = 2.5
"""Residual of the parabola in noise units above which the window holds a contact that the simulator does not have."""


@dataclass(frozen=True)
class Samples:
    """n windows."""

    mover: Ints
    """(n,) index of the body."""
    state: Floats
    """(n, 4) x, y [m], vx, vy [m/s]."""
    time: Floats
    """(n,) since the command [s]."""
    acceleration: Floats
    """(n, 2) [m/s^2]."""

    def of(self, chosen: Bools) -> Samples:
        return Samples(self.mover[chosen], self.state[chosen], self.time[chosen], self.acceleration[chosen])


def accelerations(model: Calibrated, shots: Shots, window_s: float) -> tuple[Samples, Samples]:
    """All windows of a length, four to a length of window: as recorded, and as simulated."""
    rows: list[tuple[int, float, Floats]] = []
    places = shots.places
    sigma = float(np.median(model.noise.sigma))
    for e, time in enumerate(shots.data.time_s):
        frame = float(np.median(np.diff(time)))
        half = max(round(0.5 * window_s / frame), LEAST_FRAMES // 2)
        for n in range(len(model.movers)):
            path = shots.paths[e, :, n]
            free = in_flight(path, time)
            for i in range(half, len(time) - half, max(half // 2, 1)):
                own = slice(i - half, i + half + 1)
                if free[own].all():
                    found = _parabola(time[own], time[i], places[e, own, n], path[own, :2], sigma)
                    if found is not None:
                        rows.append((n, float(time[i]), found))
    mover = np.array([row[0] for row in rows], dtype=np.int64)
    times = np.array([row[1] for row in rows], dtype=np.float64)
    fitted = np.array([row[2] for row in rows], dtype=np.float64).reshape(len(rows), 3, 2, 2)
    states, accelerated = fitted[:, :2].swapaxes(1, 2).reshape(-1, 2, 4), 2 * fitted[:, 2]
    recorded, simulated = (Samples(mover, states[:, side], times, accelerated[:, side]) for side in (0, 1))
    return recorded, simulated


def in_flight(path: Floats, time: Floats) -> Bools:
    """(F,) frames in which a simulated body slides freely; (F, 4) path, (F,) times, padding repeats the last one."""
    jumps = np.linalg.norm(np.diff(path[:, 2:], axis=0), axis=1) > JUMP
    touched = np.convolve(np.concatenate([[False], jumps]) | np.concatenate([jumps, [False]]),
                          np.ones(2 * MARGIN + 1), mode="same") > 0  # fmt: skip
    advancing = np.concatenate([[True], np.diff(time) > 0])
    return np.asarray(~touched & advancing & (time >= 0) & (np.linalg.norm(path[:, 2:], axis=1) > SLOW))


def _parabola(time: Floats, middle: float, measured: Floats, simulated: Floats, sigma: float) -> Floats | None:
    """(3, 2, 2) power, (measured, simulated), (x, y): the parabolas; None where the window is of no use."""
    seen = ~np.isnan(measured[:, 0])
    if seen.sum() < LEAST_FRAMES:
        return None
    design = np.vander(time[seen] - middle, 3, increasing=True)
    both = np.hstack([measured[seen], simulated[seen]])
    fitted, *_ = np.linalg.lstsq(design, both, rcond=None)
    bent = float(np.sqrt(np.mean((design @ fitted - both)[:, :2] ** 2)))
    if bent > BENT * sigma or np.linalg.norm(fitted[1, :2]) < SLOW:
        return None
    return np.asarray(fitted.reshape(3, 2, 2))
