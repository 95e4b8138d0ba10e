"""The truth of a world in the quantities of the library's effects.

Laws here have other formulas on purpose. The library's formulas stand here once more, as its documentation gives them,
to say which of their numbers come nearest to a law: first by the accelerations along the true paths, then by the
trajectories (`imitation`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares

from compass_ros.concealed.law import PUCKS, Ingredient, Moment
from compass_ros.concealed.table import Played, Table
from compass_ros.types import Floats

_SLOW = 0.02  # m/s; slower pucks say nothing about a force
_MAX_POINTS, _FEW_POINTS = 4000, 1000

Formula = Callable[[Floats, Moment], Floats]
"""Quantities, state -> (S, 2, 2) newtons."""


@dataclass(frozen=True)
class Form:
    """One effect of the library: names of its quantities, where a fit starts, formula."""

    names: tuple[str, ...]
    start: Callable[[Ingredient], list[float]]
    formula: Formula
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Ranges of quantities that the formula needs."""


def _mass(at: Moment) -> Floats:
    return np.asarray(at.mass[None, :, None])


def _arm(q: Floats, at: Moment) -> tuple[Floats, Floats]:
    arm = at.position - q[1:3]
    return arm, np.asarray(np.linalg.norm(arm, axis=2, keepdims=True))


def _across(v: Floats) -> Floats:
    return np.stack([-v[..., 1], v[..., 0]], axis=-1)


def _peaked(q: Floats, at: Moment) -> Floats:
    arm, r = _arm(q, at)
    return np.asarray(_mass(at) * q[0] * arm / q[3] * (1 + q[4] * ((r / q[3]) ** 2 - 1) / 2) ** (-1 / q[4]))


def _attraction(q: Floats, at: Moment) -> Floats:
    arm, r = _arm(q, at)
    return np.asarray(-_mass(at) * q[0] * 1.5 * 3**0.5 * q[3] ** 2 * arm / (r**2 + q[3] ** 2) ** 1.5)


def _crosswind(q: Floats, at: Moment) -> Floats:
    size = float(np.hypot(q[0], q[1])) + 1e-12
    relative = q[2] * q[:2] / size - at.velocity
    return np.asarray(_mass(at) * size * np.linalg.norm(relative, axis=2, keepdims=True) * relative / q[2] ** 2)


def _patch(q: Floats, at: Moment) -> Floats:
    _, r = _arm(q, at)
    return at.against(q[0] / (1 + np.exp(np.minimum(10 * (r[:, :, 0] / q[3] - 1), 50.0))) * at.load)


def _anisotropic(q: Floats, at: Moment) -> Floats:
    tensor = np.array([[q[0], q[1]], [q[1], -q[0]]])
    pace = np.sqrt(at.speed**2 + at.creep**2)
    return np.asarray(-(at.load / pace)[:, :, None] * (at.velocity @ tensor))


def _pulsating(q: Floats, at: Moment) -> Floats:
    turn = 2 * np.pi * q[2] * at.time
    return at.against((q[0] * np.cos(turn) + q[1] * np.sin(turn)) * at.load)


def _centre(i: Ingredient, radius: str, factor: float = 1.0) -> list[float]:
    hand = i.shape.get("hand", 1.0)
    return [0.03 * i.size * hand, i.shape["centre_x"], i.shape["centre_y"], factor * i.shape[radius]]


_FIELD = ("strength", "centre_x", "centre_y")
_PEAKED = (*_FIELD, "radius", "tail")
_TAIL = {"tail": (1e-4, 1.2)}
FORMS: Mapping[str, Form] = {
    "table_tilt": Form(
        ("tilt_x", "tilt_y"),
        lambda i: [1e-3 * i.size * i.shape["x"], 1e-3 * i.size * i.shape["y"]],
        lambda q, at: np.broadcast_to(_mass(at) * 9.81 * q, at.velocity.shape),
    ),
    "crosswind": Form(
        ("acceleration_x", "acceleration_y", "speed"),
        lambda i: [0.01 * i.size * i.shape["x"], 0.01 * i.size * i.shape["y"], i.shape["air_speed"]],
        _crosswind,
    ),
    "fan_field": Form(_PEAKED, lambda i: [*_centre(i, "radius"), 0.5], _peaked, _TAIL),
    "swirl": Form(_PEAKED, lambda i: [*_centre(i, "radius"), 0.5], lambda q, at: _across(_peaked(q, at)), _TAIL),
    "point_attraction": Form((*_FIELD, "core"), lambda i: _centre(i, "depth"), _attraction),
    "viscous_drag": Form(("rate",), lambda i: [0.02 * i.size], lambda q, at: -_mass(at) * q[0] * at.velocity),
    "quadratic_drag": Form(
        ("coefficient",),
        lambda i: [0.1 * i.size],
        lambda q, at: -_mass(at) * q[0] * at.speed[:, :, None] * at.velocity,
    ),
    "magnus": Form(
        ("rate",), lambda i: [0.02 * i.size * i.shape["hand"]], lambda q, at: _mass(at) * q[0] * _across(at.velocity)
    ),
    "friction_patch": Form(
        ("extra", "centre_x", "centre_y", "radius"),
        lambda i: [0.01 * i.size, i.shape["centre_x"], i.shape["centre_y"], i.shape["radius"]],
        _patch,
    ),
    "friction_gradient": Form(
        ("along_x", "along_y"),
        lambda i: [0.02 * i.size * i.shape["x"], 0.02 * i.size * i.shape["y"]],
        lambda q, at: at.against(at.position @ q * at.load),
    ),
    "anisotropic_friction": Form(
        ("along_x", "diagonal"),
        lambda i: [0.002 * i.size * np.cos(2 * i.shape["axis"]), 0.002 * i.size * np.sin(2 * i.shape["axis"])],
        _anisotropic,
    ),
    "stribeck_friction": Form(
        ("extra", "speed"),
        lambda i: [0.01 * i.size, i.shape["speed"]],
        lambda q, at: at.against(q[0] * np.exp(-((at.speed / q[1]) ** 2)) * at.load),
    ),
    "pulsating_lift": Form(
        ("cosine", "sine", "frequency"),
        lambda i: [
            0.005 * i.size * np.cos(i.shape["phase"]),
            0.005 * i.size * np.sin(i.shape["phase"]),
            i.shape["frequency"],
        ],
        _pulsating,
    ),
}


def in_library_terms(ingredient: Ingredient, played: Played) -> dict[str, float]:
    """Quantities of the library's effect of the same name where they are arithmetic; empty elsewhere."""
    law = ingredient.law
    if law.library is not None:
        return dict(law.library(ingredient.size, ingredient.shape))
    if law.name == "stroke_jitter":
        return {"deviation": 0.005 * ingredient.size * float(np.std(list(ingredient.shape.values())))}
    if law.name == "rate_dependent_restitution":
        return {"slope": _slope(ingredient, played)}
    return {}


def along(
    law: Ingredient, begin: Ingredient, form: Form, table: Table, played: Played, coarse: bool = False
) -> tuple[Floats, float]:
    """Numbers with which a formula comes nearest to a law's force along the true paths, and the share that is left.

    Each puck's friction is free beside it. `begin`: where the search starts, in the numbers of the formula's own law.
    """
    assert law.law.force is not None
    moments = on_paths(table, played, _FEW_POINTS if coarse else _MAX_POINTS)
    mask = np.array([name in law.objects for name in PUCKS], dtype=float)[None, :, None]
    moving = [at.speed > _SLOW for at in moments]
    truth = [mask * law.law.force(law.size, law.shape, at) for at in moments]
    frictions = [at.against(np.broadcast_to(at.load, at.speed.shape)) for at in moments]
    start = np.array(form.start(begin))
    unit = np.sqrt(np.mean(np.concatenate([t[m] for t, m in zip(truth, moving, strict=True)]) ** 2)) + 1e-15

    def residual(x: Floats) -> Floats:
        parts = []
        for at, wanted, keep, friction in zip(moments, truth, moving, frictions, strict=True):
            model = mask * form.formula(x[:-2], at) + 0.01 * x[-2:, None] * friction
            parts.append((model - wanted)[keep].ravel())
        return np.asarray(np.concatenate(parts) / unit)

    scale = np.concatenate([np.maximum(np.abs(start), 0.02 * np.abs(start).max()), [1.0, 1.0]])
    free = (-np.inf, np.inf)
    low, high = np.array([*(form.bounds.get(name, free) for name in form.names), free, free]).T
    found = least_squares(residual, np.concatenate([start, [0.0, 0.0]]), bounds=(low, high), x_scale=scale, max_nfev=60)
    return found.x[:-2], float(np.mean(found.fun**2))


def on_paths(table: Table, played: Played, points: int) -> list[Moment]:
    """States along the true paths, evenly in time; about so many `points` of shots and pucks together."""
    steps, shots = played.position.shape[:2]
    stride = max(1, steps * shots * 2 // points)
    return [
        table.moment(step * played.time_step, played.position[step], played.velocity[step])
        for step in range(0, steps, stride)
    ]


def _slope(ingredient: Ingredient, played: Played) -> float:
    """The damping of all impacts as a line over their speed; over a contact the mean speed is 0.849 of the first.

    0.849 = (4 / 3) / (pi / 2): the ratio of the integrals of cos^3 and cos^2 over half a swing, weighted by the loss.
    """
    assert ingredient.law.damping is not None
    speeds = np.array([impact.approach for impact in played.impacts])
    factors = np.array([ingredient.law.damping(ingredient.size, ingredient.shape, v) for v in speeds])
    rise, at_rest = np.polyfit(speeds, factors, 1, w=speeds)
    return float(rise / at_rest / 0.849)
