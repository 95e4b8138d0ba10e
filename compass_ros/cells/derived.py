"""What follows from a field and is not computed by `mj_setConst`: bounds of geoms, margins of bodies, unit axes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import mujoco
import numpy as np

from compass_ros.errors import ConfigError
from compass_ros.types import Floats, Ints

Follow = Callable[[mujoco.MjModel], None]
"""Brings a model in step with the fields that have been written into it."""
_GEOM = mujoco.mjtGeom
_GEOM_FIELDS = ("geom_size", "geom_pos", "geom_quat", "geom_turn")


def followers(scene: mujoco.MjModel, written: Mapping[str, Ints], where: str) -> list[Follow]:
    """What has to follow the written places of each array, for the scene at its defaults. Raises ConfigError."""
    geoms, axes, margins = (written.get(name, np.zeros(0, int)) for name in ("geom_size", "jnt_axis", "geom_margin"))
    follow = [bounding(scene, int(geom), where) for geom in np.unique(geoms // 3)]
    follow += [partial(_unit_axis, joint, scene.jnt_axis[joint].copy()) for joint in np.unique(axes // 3)]
    return follow + [partial(_margin, body) for body in np.unique(scene.geom_bodyid[margins])]


def clear_shortcuts(model: mujoco.MjModel, used: set[str]) -> None:
    """Clear the flags by which MuJoCo skips frames that are the identity, and boxes drawn at the defaults."""
    if used & {"geom_pos", "geom_quat", "geom_turn"}:
        model.geom_sameframe[:] = 0
    if used & {"site_pos", "site_quat"}:
        model.site_sameframe[:] = 0
    if used & {"body_ipos", "body_iquat", "inertia_turn", "inertia_log_cholesky"}:
        model.body_sameframe[:] = 0
    if used & set(_GEOM_FIELDS):
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE


def _unit_axis(joint: int, nominal: Floats, model: mujoco.MjModel) -> None:
    """A tuned axis is a direction: MuJoCo takes its length for a gear."""
    axis = model.jnt_axis[joint]
    if (axis != nominal).any():
        model.jnt_axis[joint] = axis / np.linalg.norm(axis)


def _margin(body: int, model: mujoco.MjModel) -> None:
    own = slice(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body])
    model.body_margin[body] = model.geom_margin[own].max()


def bounding(scene: mujoco.MjModel, geom: int, where: str) -> Follow:
    """What keeps a geom's bounding radius and box in step with its size. Raises ConfigError for meshes."""
    kind, nominal = int(scene.geom_type[geom]), scene.geom_size[geom].copy()
    box, radius = scene.geom_aabb[geom].copy(), float(scene.geom_rbound[geom])
    half = _HALF_SIZES.get(kind)
    if half is None:
        name = scene.geom(geom).name
        raise ConfigError(f"{where}: geom_size: geom '{name}' is a mesh or a height field, without a size")

    def write(model: mujoco.MjModel) -> None:
        if kind == _GEOM.mjGEOM_PLANE:
            return
        size = model.geom_size[geom]
        as_drawn = bool((size == nominal).all())
        model.geom_aabb[geom, 3:] = box[3:] if as_drawn else half(size)
        model.geom_rbound[geom] = radius if as_drawn else _radius(kind, size)

    return write


_HALF_SIZES: dict[int, Callable[[Floats], Floats]] = {
    int(_GEOM.mjGEOM_PLANE): lambda s: s,
    int(_GEOM.mjGEOM_SPHERE): lambda s: np.full(3, s[0]),
    int(_GEOM.mjGEOM_CAPSULE): lambda s: np.array([s[0], s[0], s[0] + s[1]]),
    int(_GEOM.mjGEOM_CYLINDER): lambda s: np.array([s[0], s[0], s[1]]),
    int(_GEOM.mjGEOM_ELLIPSOID): lambda s: s,
    int(_GEOM.mjGEOM_BOX): lambda s: s,
}


def _radius(kind: int, size: Floats) -> float:
    if kind == _GEOM.mjGEOM_SPHERE:
        return float(size[0])
    if kind == _GEOM.mjGEOM_CAPSULE:
        return float(size[0] + size[1])
    if kind == _GEOM.mjGEOM_CYLINDER:
        return float(np.hypot(size[0], size[1]))
    return float(size.max() if kind == _GEOM.mjGEOM_ELLIPSOID else np.linalg.norm(size))


def set_const(model: mujoco.MjModel, data: mujoco.MjData | None = None) -> None:
    """What MuJoCo derives from a model's numbers, with welds and other equalities as they were compiled or written.

    Since MuJoCo 4.0 `mj_setConst` measures them anew where the bodies are by then, a mocap body at its keyframe too.
    """
    equalities = model.eq_data.copy()
    mujoco.mj_setConst(model, mujoco.MjData(model) if data is None else data)
    model.eq_data[:] = equalities
