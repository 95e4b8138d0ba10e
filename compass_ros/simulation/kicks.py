"""Responses of a whole recording to unit kicks: a change of velocity of one degree of freedom at one moment."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np

from compass_ros.cells.inertia import mass_matrix
from compass_ros.simulation.simulator import CHUNK, Simulator
from compass_ros.simulation.transitions import Chart, chained, changes
from compass_ros.types import Floats

_TINY = 1e-5
"""Size of the change of an observation that its derivative is taken from, as a share of the range of the raw row."""


@dataclass(frozen=True, eq=False)
class Kicks:
    """E episodes, K moments, V degrees of freedom, F frames, C observed columns."""

    moments_s: Floats
    """(K,) since the command."""
    states: Floats
    """(E, K, s) full states at these moments."""
    controls: Floats | None
    """(E, K, n) what drives MuJoCo there."""
    response: Floats
    """(E, F, C, K, V) change of what is observed per unit change of velocity."""


def kicks(simulator: Simulator, values: Floats, inputs: Floats, time_s: Floats, count: int) -> Kicks:
    """For (P,) values, (E, A) inputs and (E, F) times [s], at so many moments, in the middle of equal stretches."""
    episodes = len(inputs)
    tiled = np.tile(values, (episodes, 1))
    duration = simulator.physics.duration(tiled, inputs, time_s)
    tiled, start, controls, steps = simulator.begun(tiled, inputs, duration)
    states, sensors = simulator.play(tiled, start, controls, steps)
    states = np.concatenate([start[:, None], states], axis=1)
    middles = (np.arange(count) + 0.5) * steps / count  # of equal stretches: the sum of kicks is an integral's
    moments = np.append(np.unique(middles.astype(int)), steps)
    chart = Chart.of(simulator.physics.model)
    sizes = changes(chart, states, moments, simulator.time_step)
    raw = _Raw(simulator, states.shape[2] - 1)
    base = raw.rows(states[:, :-1], states[:, 1:], sensors)
    stretches = [
        _stretch(simulator, chart, raw, tiled, controls, (states, base), sizes, slice(first, last))
        for first, last in pairwise(moments)
    ]
    response = []
    for e in range(episodes):
        of_episode = ((rows[e], after[e]) for rows, after in stretches)
        rows = [moved for moved, _ in chained(of_episode, len(stretches), chart.nv, chart.size)]
        begin = np.zeros((moments[0] + (not raw.sensed), *rows[0].shape[1:]))
        moved = np.concatenate([begin, *rows])
        still = base[e] if raw.sensed else np.concatenate([raw.of(states[e, :1]), base[e]])
        response.append(_observed(simulator, values, inputs[e], time_s[e], still, moved))
    shape = (*time_s.shape, response[0].shape[-2], len(stretches), chart.nv)
    return Kicks(
        moments[:-1] * simulator.time_step,
        states[:, moments[:-1]],
        None if controls is None else controls[:, np.minimum(moments[:-1], controls.shape[1] - 1)],
        np.stack(response).reshape(shape),
    )


class _Raw:
    """The raw rows that are observed: of states after a step, or of states and sensors before it."""

    def __init__(self, simulator: Simulator, size: int) -> None:
        self.columns = simulator.physics.dynamics.columns()
        self.sensed = bool(simulator.physics.model.nsensordata)
        self._size = size

    def of(self, states: Floats) -> Floats:
        """(..., C) of (..., s) states, where there are no sensors."""
        return np.asarray(states[..., 1 + self.columns])

    def rows(self, before: Floats, after: Floats, sensors: Floats) -> Floats:
        """(..., L, C) of states before and after each of L steps, and what sensors say of those before."""
        if not self.sensed:
            return self.of(after)
        return np.asarray(np.concatenate([before, sensors], axis=-1)[..., 1 + self.columns])


def _stretch(
    simulator: Simulator,
    chart: Chart,
    raw: _Raw,
    values: Floats,
    controls: Floats | None,
    known: tuple[Floats, Floats],
    sizes: Floats,
    stretch: slice,
) -> tuple[Floats, Floats]:
    """(E, L, C, n) changes of raw rows and (E, n, n) of the state at the end, by each tangent number at the start."""
    states, base = known
    episodes, length = len(states), int(stretch.stop - stretch.start)
    begin = states[:, stretch.start]
    starts = np.stack([chart.moved(begin, i, float(sizes[i])) for i in range(chart.size)])
    flat = starts.reshape(-1, begin.shape[1])
    of = np.tile(np.arange(episodes), chart.size)
    rows, ends = [], []
    for i in range(0, len(flat), CHUNK):
        part = slice(i, i + CHUNK)
        driven = None if controls is None else np.ascontiguousarray(controls[of[part], stretch])
        after, sensors = simulator.play(values[of[part]], flat[part], driven, length)
        before = np.concatenate([flat[part][:, None], after[:, :-1]], axis=1)
        rows.append(raw.rows(before, after, sensors) - base[of[part], stretch])
        ends.append(chart.apart(states[of[part], stretch.stop], after[:, -1]))
    moved = np.concatenate(rows).reshape(chart.size, episodes, length, -1) / sizes[:, None, None, None]
    ended = np.concatenate(ends).reshape(chart.size, episodes, chart.size) / sizes[:, None, None]
    return moved.transpose(1, 2, 3, 0), ended.transpose(1, 2, 0)


def _observed(
    simulator: Simulator, values: Floats, inputs: Floats, time_s: Floats, still: Floats, moved: Floats
) -> Floats:
    """(F, C, H) changes of what is observed, from (T, C) raw rows and their (T, C, H) changes."""
    count = moved.shape[2]
    largest = np.max(np.abs(moved), axis=(0, 1))
    scale = _TINY * max(float(np.ptp(still)), 1e-6) / np.maximum(largest, 1e-12)
    out = []
    for i in range(0, count, CHUNK):
        part = slice(i, min(i + CHUNK, count))
        rows = np.concatenate([still[None], still + np.moveaxis(moved[:, :, part] * scale[part], 2, 0)])
        tiled, asked = np.tile(values, (len(rows), 1)), np.tile(inputs, (len(rows), 1))
        seen = simulator.physics.sensed(tiled, asked, np.tile(time_s, (len(rows), 1)), rows)
        out.append((seen[1:] - seen[:1]) / scale[part, None, None])
    return np.moveaxis(np.concatenate(out), 0, 2)


def inertias(simulator: Simulator, values: Floats, states: Floats) -> Floats:
    """(E, K, V, V) mass matrices at (E, K, s) states."""
    model = simulator.written(values)
    data, out = mujoco.MjData(model), np.zeros((*states.shape[:2], model.nv, model.nv))
    for e, k in np.ndindex(*states.shape[:2]):
        mujoco.mj_setState(model, data, states[e, k], mujoco.mjtState.mjSTATE_FULLPHYSICS)
        mujoco.mj_fwdPosition(model, data)
        out[e, k] = mass_matrix(model, data)
    return out
