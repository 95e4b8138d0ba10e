"""Random planar shots for rehearsing the tracker without a physics simulator, and the images of a shot.

Pucks slide, slow down, and bounce off the walls, off each other and off a pusher that swings to and fro.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from compass_ros.tracking.scene_config import SceneConfig
from compass_ros.tracking.virtual_camera import VirtualCamera, exposure_times, render
from compass_ros.types import Floats, Ints

_STEP_S = 0.0005
_DECELERATION = 0.25
_RESTITUTION = 0.9


@dataclass(frozen=True)
class Shot:
    """Where everything was."""

    time_s: Floats
    """(F,) increasing."""
    poses: Mapping[str, Floats]
    """Name -> (F, 3) x, y [m], yaw [rad] in the frame `table`."""

    def at(self, time_s: Floats) -> dict[str, Floats]:
        """Poses at other times (any shape ...) -> (..., 3); held before the first and after the last."""
        return {
            name: np.stack([np.interp(time_s, self.time_s, pose[:, k]) for k in range(3)], axis=-1)
            for name, pose in self.poses.items()
        }


@dataclass(frozen=True)
class Image:
    """One image of a shot with the truth behind it."""

    stamp_ns: int
    """Middle of the exposure, time 0 of the shot at 0."""
    bgr: NDArray[np.uint8]
    """(H, W, 3)."""
    truth: Mapping[str, Floats]
    """Name -> (3,) pose at mid-exposure."""


def random_shot(scene: SceneConfig, duration_s: float, seed: int, top_speed: float = 1.2) -> Shot:
    """A shot of the discs of a scene; the one that the arm holds swings, the others slide freely."""
    rng = np.random.default_rng(seed)
    names = list(scene.discs)
    radius = np.array([scene.discs[name].radius_m for name in names])
    driven = np.array([scene.arm is not None and scene.arm.holds == name for name in names])
    half = np.asarray(scene.table_m) / 2 - radius[:, None]
    xy = _apart(rng, half, radius, driven)
    angle = rng.uniform(-np.pi, np.pi, len(names))
    velocity = rng.uniform(0.3, top_speed, (len(names), 1)) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    home, phase, rate = xy.copy(), rng.uniform(0, 2 * np.pi), rng.uniform(1.0, 2.5)
    swing = np.array([0.05, 0.06])
    yaw, spin = rng.uniform(-np.pi, np.pi, len(names)), rng.normal(0, 2.0, len(names))
    time = np.arange(0, duration_s + _STEP_S, _STEP_S)
    record = np.empty((time.size, len(names), 3))
    for i, t in enumerate(time):
        place = home + swing * np.array([np.sin(rate * t + phase), np.sin(1.3 * rate * t)])
        velocity[driven] = ((place - xy) / _STEP_S)[driven] if i else 0.0
        xy = np.where(driven[:, None], place, xy + velocity * _STEP_S)
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        slower = np.maximum(1 - _DECELERATION * _STEP_S / np.maximum(speed, 1e-9), 0)
        velocity = np.where(driven[:, None], velocity, velocity * slower)
        hit = (np.abs(xy) > half) & (velocity * xy > 0)
        velocity = np.where(hit, -_RESTITUTION * velocity, velocity)
        velocity = _collide(xy, velocity, radius, driven)
        yaw = yaw + spin * _STEP_S
        record[i] = np.column_stack([xy, yaw])
    return Shot(time, {name: record[:, k] for k, name in enumerate(names)})


def film(camera: VirtualCamera, shot: Shot, duration_s: float, first_number: int = 0) -> Iterator[Image]:
    """Images of a shot at the camera's rate from time 0 on. `first_number`: see `render`."""
    rate = camera.config.camera.rate_hz
    stamps: Ints = np.array([round(i * 1e9 / rate) for i in range(int(duration_s * rate))])
    mids = stamps * 1e-9
    moments = shot.at(exposure_times(camera.config.camera, mids))
    truth = shot.at(mids)
    for i, stamp in enumerate(stamps):
        picture = render(camera, {name: pose[i] for name, pose in moments.items()}, first_number + i)
        yield Image(int(stamp), picture, {name: pose[i] for name, pose in truth.items()})


def _apart(rng: np.random.Generator, half: Floats, radius: Floats, driven: NDArray[np.bool_]) -> Floats:
    """(D, 2) places inside of the walls where no disc touches another; driven ones on the left."""
    least = radius[:, None] + radius[None, :] + 0.004 - 10.0 * np.eye(len(radius))
    while True:
        xy = rng.uniform(-half, half)
        xy[driven] = np.array([-0.2, 0.06]) + rng.uniform(-0.02, 0.02, (int(driven.sum()), 2))
        if np.all(np.linalg.norm(xy[:, None] - xy[None], axis=-1) > least):
            return xy


def _collide(xy: Floats, velocity: Floats, radius: Floats, driven: NDArray[np.bool_]) -> Floats:
    """Velocities after the impacts of discs of equal mass; a driven one does not yield."""
    velocity = velocity.copy()
    for i in range(len(xy)):
        for j in range(i + 1, len(xy)):
            offset = xy[j] - xy[i]
            distance = float(np.hypot(*offset))
            if distance >= radius[i] + radius[j] or (driven[i] and driven[j]):
                continue
            normal = offset / distance
            closing = float((velocity[i] - velocity[j]) @ normal)
            if closing > 0:
                yields = np.array([0.0 if driven[i] else 1.0, 0.0 if driven[j] else 1.0])
                impulse = (1 + _RESTITUTION) * closing * normal / yields.sum()
                velocity[i] -= yields[0] * impulse
                velocity[j] += yields[1] * impulse
    return velocity
