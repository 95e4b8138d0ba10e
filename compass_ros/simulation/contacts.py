"""What may touch what in a scene, and where that has friction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np

from compass_ros.types import Bools, Ints

if TYPE_CHECKING:
    from compass_ros.simulation.sites import Site

_WITH_FRICTION = 3
"""Dimensions of a contact that has friction: MuJoCo's condim."""


def slides_on_what_stands(model: mujoco.MjModel, site: Site) -> str:
    """Why a body in space cannot slide on anything that stands, with friction; empty: it can, or is another site."""
    if site.kind != "body":
        return ""
    weld = model.body_weldid[model.geom_bodyid]
    own, stands = weld == model.body_weldid[model.body(site.name).id], weld == 0
    one, other = model.pair_geom1, model.pair_geom2
    paired = (own[one] & stands[other]) | (own[other] & stands[one])
    one, other = np.flatnonzero(own)[:, None], np.flatnonzero(stands)
    rubs = np.maximum(model.geom_condim[one], model.geom_condim[other]) >= _WITH_FRICTION
    if np.any(paired & (model.pair_dim >= _WITH_FRICTION)) or np.any(masks_meet(model, one, other) & rubs):
        return ""
    return "it touches nothing that stands with friction"


def masks_meet(model: mujoco.MjModel, one: Ints, other: Ints) -> Bools:
    """Whether the contact masks of geoms let them touch."""
    types, answers = model.geom_contype, model.geom_conaffinity
    return np.asarray(((types[one] & answers[other]) | (types[other] & answers[one])) != 0)
