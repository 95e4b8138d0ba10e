"""Where a scene begins: its keyframe `start`, else `home`, else as it is drawn."""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.types import Floats

NAMES = ("start", "home")
"""Keyframes that are looked for, the first that exists counts; `home` is what models of robots call theirs."""
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS.value


def begun(model: mujoco.MjModel) -> mujoco.MjData:
    """The scene as an episode begins, at time 0: qpos, qvel, act, ctrl and mocap poses of the keyframe."""
    data = mujoco.MjData(model)
    keys = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, name) for name in NAMES]
    for key in [key for key in keys if key >= 0][:1]:
        mujoco.mj_resetDataKeyframe(model, data, key)
    data.time = 0.0
    return data


def first_state(data: mujoco.MjData, model: mujoco.MjModel) -> Floats:
    """(s,) all that a rollout starts from: time, qpos, qvel, act, and what delayed drives remember."""
    state = np.zeros(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def place_mocap(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Move the model's mocap bodies to where they are in `data`: rollouts begin with them where the model does."""
    for body in np.flatnonzero(model.body_mocapid >= 0):
        model.body_pos[body] = data.mocap_pos[model.body_mocapid[body]]
        model.body_quat[body] = data.mocap_quat[model.body_mocapid[body]]
