"""Physics that no library names: what a verdict should call unknown."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from compass_ros.concealed.law import Law, Moment, Places, Shape, sign, spot
from compass_ros.types import Floats

_G = 9.81  # m/s^2


def _wave(rng: Generator, places: Places, other: float) -> dict[str, float]:
    angle = rng.uniform(0, 2 * np.pi)
    return {
        "x": float(np.cos(angle)),
        "y": float(np.sin(angle)),
        "frequency": float(rng.uniform(0.7, 2.5)),
        "phase": float(rng.uniform(0, 2 * np.pi)),
    }


def _oscillating(size: float, shape: Shape, at: Moment) -> Floats:
    """The same push everywhere, to and fro in time: a table that sways."""
    push = 0.03 * size * np.cos(2 * np.pi * shape["frequency"] * at.time - shape["phase"])
    return np.broadcast_to(push * at.mass[:, None] * np.array([shape["x"], shape["y"]]), at.position.shape)


def _rotating(size: float, shape: Shape, at: Moment) -> Floats:
    """The same push everywhere, in a direction that turns."""
    turn = 2 * np.pi * shape["frequency"] * at.time - shape["phase"]
    return np.broadcast_to(0.03 * size * at.mass[:, None] * np.array([np.cos(turn), np.sin(turn)]), at.position.shape)


def _line(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"x0": float(np.quantile(places.points[:, 0], rng.uniform(0.35, 0.65))), "hand": sign(rng)}


def _jump(size: float, shape: Shape, at: Moment) -> Floats:
    """Another surface beyond a line across the table."""
    beyond = shape["hand"] * (at.position[:, :, 0] - shape["x0"]) > 0
    return at.against(0.01 * size * beyond * at.load)


def _gusts(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"wavelength": float(rng.uniform(0.25, 0.5)), "frequency": float(rng.uniform(0.6, 1.5))}


def _gusty_drag(size: float, shape: Shape, at: Moment) -> Floats:
    """Drag in bands that wander along the table."""
    turn = 2 * np.pi * (at.position[:, :, 0] / shape["wavelength"] - shape["frequency"] * at.time)
    return np.asarray(-(at.mass * 0.05 * size * (1 + np.cos(turn)))[:, :, None] * at.velocity)


def _plateau(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"speed": float(rng.uniform(0.1, 0.2))}


def _saturating(size: float, shape: Shape, at: Moment) -> Floats:
    """Drag that rises with the speed and then falls again, as on a film that breaks."""
    ratio = at.speed / shape["speed"]
    return np.asarray(-(at.mass * 0.1 * size * np.exp(1 - ratio))[:, :, None] * at.velocity)


def _eye(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return spot(rng, places) | {"radius": float(rng.uniform(0.08, 0.15)), "hand": sign(rng)}


def _eye_vortex(size: float, shape: Shape, at: Moment) -> Floats:
    """A vortex whose inner part turns the other way."""
    arm = at.position - np.array([shape["centre_x"], shape["centre_y"]])
    ratio = np.linalg.norm(arm, axis=2) / shape["radius"]
    turn = 0.06 * size * shape["hand"] * np.cos(np.pi * np.minimum(ratio, 1.5)) * np.exp(-(ratio**2) / 2)
    around = np.stack([-arm[:, :, 1], arm[:, :, 0]], axis=2) / shape["radius"]
    return np.asarray((at.mass * turn)[:, :, None] * around)


def _charge(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"power": float(rng.uniform(2.0, 3.0))}


def _repulsion(size: float, shape: Shape, at: Moment) -> Floats:
    """Pucks that repel each other from afar, as when both are charged."""
    arm = at.position[:, 0] - at.position[:, 1]
    distance = np.maximum(np.linalg.norm(arm, axis=1, keepdims=True), 0.05)
    push = 2e-4 * size * (0.1 / distance) ** shape["power"] * arm / distance
    return np.stack([push, -push], axis=1)


def _crater_shape(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return spot(rng, places) | {"radius": float(rng.uniform(0.07, 0.12)), "hand": sign(rng)}


def _crater(size: float, shape: Shape, at: Moment) -> Floats:
    """A bump in the shape of a ring: the height is a Gaussian of the distance from a circle."""
    arm = at.position - np.array([shape["centre_x"], shape["centre_y"]])
    distance = np.maximum(np.linalg.norm(arm, axis=2), 1e-6)
    width = 0.3 * shape["radius"]
    ratio = (distance - shape["radius"]) / width
    slope = 1e-3 * size * shape["hand"] * ratio * np.exp(0.5 * (1 - ratio**2))  # at most `size` milliradians
    return np.asarray((at.mass * _G * slope / distance)[:, :, None] * arm)


LAWS = (
    Law("oscillating_field", "dynamics", ("free",), draw=_wave, force=_oscillating),
    Law("rotating_push", "dynamics", ("free",), draw=_wave, force=_rotating),
    Law("friction_jump", "dynamics", ("free",), draw=_line, force=_jump),
    Law("gusty_drag", "dynamics", ("free",), draw=_gusts, force=_gusty_drag),
    Law("saturating_drag", "dynamics", ("free",), draw=_plateau, force=_saturating),
    Law("eye_vortex", "dynamics", ("free",), draw=_eye, force=_eye_vortex),
    Law("puck_repulsion", "dynamics", ("free", "object_contact", "all"), draw=_charge, force=_repulsion),
    Law("ring_bump", "dynamics", ("free",), draw=_crater_shape, force=_crater),
)
