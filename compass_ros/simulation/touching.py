"""Which geoms touch in recorded episodes."""

from __future__ import annotations

from collections import Counter

import mujoco
import numpy as np

from compass_ros.types import Floats

MOMENTS = 200
"""Of an episode that are looked at: a contact of MuJoCo's default time constant of 20 ms lasts longer than a hundredth
of the 2 s that shots take."""


def touching(model: mujoco.MjModel, states: Floats) -> tuple[tuple[str, str], ...]:
    """The pairs of geoms that touch in (E, T, s) full states, the longest first: named ones, on bodies with name and
    mass."""
    data, count = mujoco.MjData(model), Counter[tuple[int, int]]()
    for state in states[:, :: max(states.shape[1] // MOMENTS, 1)].reshape(-1, states.shape[2]):
        mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        mujoco.mj_fwdPosition(model, data)
        count.update({(int(a), int(b)) for a, b in np.sort(data.contact.geom[data.contact.efc_address >= 0])})
    named = [pair for pair, _ in count.most_common() if all(_named(model, geom) for geom in pair)]
    return tuple((model.geom(a).name, model.geom(b).name) for a, b in named)


def _named(model: mujoco.MjModel, geom: int) -> bool:
    body = int(model.body_weldid[model.geom_bodyid[geom]])
    return bool(model.geom(geom).name and model.body(body).name and (model.body_mass[body] or not body))
