"""Joint-space inertia of a model in a state, as all supported versions of MuJoCo have it: rows of a lower triangle."""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.types import Floats


def mass_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> Floats:
    """(nv, nv) symmetric, after mj_forward or mj_step1. `mj_fullM` took other arguments before MuJoCo 3.11."""
    whole = np.zeros((model.nv, model.nv))
    for row, (first, count) in enumerate(zip(model.M_rowadr, model.M_rownnz, strict=True)):
        held = slice(first, first + count)
        whole[row, model.M_colind[held]] = whole[model.M_colind[held], row] = data.M[held]
    return whole


def mass_diagonal(model: mujoco.MjModel, data: mujoco.MjData) -> Floats:
    """(nv,): the diagonal is the last of each row."""
    return np.array(data.M[model.M_rowadr + model.M_rownnz - 1])
