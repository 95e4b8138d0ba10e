"""Dry friction that depends on place, direction, speed or time, on top of the table's ordinary one."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from compass_ros.concealed.law import Law, Moment, Places, Shape, spot
from compass_ros.types import Floats


def _blob(rng: Generator, places: Places, other: float) -> dict[str, float]:
    lobes = {f"lobe_{k}": other * float(rng.uniform(-0.12, 0.12) / k) for k in (2, 3)}
    turns = {f"turn_{k}": float(rng.uniform(0, 2 * np.pi)) for k in (2, 3)}
    edge = 0.1 + other * float(rng.uniform(-0.04, 0.06))
    return spot(rng, places) | {"radius": float(rng.uniform(0.05, 0.13)), "edge": edge} | lobes | turns


def _patch(size: float, shape: Shape, at: Moment) -> Floats:
    """A stain of irregular outline with a soft edge."""
    arm = at.position - np.array([shape["centre_x"], shape["centre_y"]])
    angle = np.arctan2(arm[:, :, 1], arm[:, :, 0])
    outline = 1 + sum(shape[f"lobe_{k}"] * np.cos(k * angle - shape[f"turn_{k}"]) for k in (2, 3))
    ratio = np.linalg.norm(arm, axis=2) / (shape["radius"] * outline)
    inside = 1 / (1 + np.exp(np.minimum((ratio - 1) / shape["edge"], 50.0)))
    return at.against(0.01 * size * inside * at.load)


PATCH = Law("friction_patch", "dynamics", ("free",), draw=_blob, force=_patch)


def _direction(rng: Generator, places: Places, other: float) -> dict[str, float]:
    angle = rng.uniform(0, 2 * np.pi)
    return {"x": float(np.cos(angle)), "y": float(np.sin(angle)), "curve": other * float(rng.uniform(-0.4, 0.4))}


def _gradient(size: float, shape: Shape, at: Moment) -> Floats:
    """Friction that grows along a line, slightly faster than in proportion; never less than none at all."""
    along = at.position @ np.array([shape["x"], shape["y"]])
    return at.against(0.02 * size * (along + shape["curve"] * along**2) * at.load)


GRADIENT = Law("friction_gradient", "dynamics", ("free",), draw=_direction, force=_gradient, most=15.0)


def _grain(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"axis": float(rng.uniform(0, np.pi)), "fourth": other * float(rng.uniform(-0.2, 0.2))}


def _anisotropic(size: float, shape: Shape, at: Moment) -> Floats:
    """Brushed grain: friction depends on the angle of the motion to it, with the sideways pull of a tensor."""
    pace = np.sqrt(at.speed**2 + at.creep**2)
    heading = np.arctan2(at.velocity[:, :, 1], at.velocity[:, :, 0]) - shape["axis"]
    unit = at.velocity / pace[:, :, None]
    across = np.stack([-unit[:, :, 1], unit[:, :, 0]], axis=2)
    along_part = np.cos(2 * heading) + shape["fourth"] * np.cos(4 * heading)
    force = 0.002 * size * at.load
    return np.asarray(-(force * along_part)[:, :, None] * unit + (force * np.sin(2 * heading))[:, :, None] * across)


ANISOTROPIC = Law("anisotropic_friction", "dynamics", ("free",), draw=_grain, force=_anisotropic, most=15.0)


def _stick(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"speed": float(rng.uniform(0.05, 0.15)), "power": 2.0 - other}


def _stribeck(size: float, shape: Shape, at: Moment) -> Floats:
    """More friction when slow: Tustin's exponential exp(-(v / speed)^power), power 1."""
    slow = np.exp(-((at.speed / shape["speed"]) ** shape["power"]))
    return at.against(0.01 * size * slow * at.load)


STRIBECK = Law("stribeck_friction", "dynamics", ("free",), draw=_stick, on="puck", force=_stribeck)


def _pulse(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {
        "frequency": float(rng.uniform(0.6, 2.5)),
        "phase": float(rng.uniform(0, 2 * np.pi)),
        "second": other * float(rng.uniform(-0.2, 0.2)),
    }


def _pulsating(size: float, shape: Shape, at: Moment) -> Floats:
    """A fan that hunts, not quite as a sine."""
    turn = 2 * np.pi * shape["frequency"] * at.time - shape["phase"]
    wave = np.cos(turn) + shape["second"] * np.cos(2 * turn)
    return at.against(np.broadcast_to(0.005 * size * wave * at.load, at.speed.shape))


PULSATING = Law("pulsating_lift", "dynamics", ("free",), draw=_pulse, force=_pulsating, most=10.0)

LAWS = (PATCH, GRADIENT, ANISOTROPIC, STRIBECK, PULSATING)
