"""The arm that holds the pusher: planar two-link kinematics, and how it looks from above."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from compass_ros.tracking.camera import TableView
from compass_ros.tracking.scene_config import ArmConfig
from compass_ros.types import Floats

_SHIFT = 4
_SHADOW = 0.72
_SHADOW_SHRINK = 4
_SHADOW_OFFSET = np.array([0.25, -0.22])
"""Where a shadow falls, in units of the height of what casts it."""
_DARK, _SHELL = (52, 50, 48), (206, 205, 202)


@dataclass(frozen=True)
class ArmPose:
    """Joints and where the links are."""

    joints: Floats
    """(2,) shoulder angle from the table's x axis, elbow angle from the upper arm [rad]."""
    points: Floats
    """(3, 2) shoulder, elbow and hand in the frame `table` [m]."""


def arm_pose(arm: ArmConfig, hand: Floats) -> ArmPose:
    """Joints that bring the hand over (2,) [m], elbow to the left; stretched towards it when it is out of reach."""
    base, (upper, fore) = np.asarray(arm.base_m), arm.links_m
    offset = np.asarray(hand, dtype=np.float64) - base
    reach = float(np.clip(np.linalg.norm(offset), abs(upper - fore) + 1e-6, upper + fore - 1e-6))
    direction = float(np.arctan2(offset[1], offset[0]))
    inner = float(np.arccos(np.clip((upper**2 + reach**2 - fore**2) / (2 * upper * reach), -1, 1)))
    bend = float(np.arccos(np.clip((upper**2 + fore**2 - reach**2) / (2 * upper * fore), -1, 1)))
    joints = np.array([direction + inner, bend - np.pi])
    elbow = base + upper * np.array([np.cos(joints[0]), np.sin(joints[0])])
    wrist = elbow + fore * np.array([np.cos(joints.sum()), np.sin(joints.sum())])
    return ArmPose(joints, np.stack([base, elbow, wrist]))


def draw_arm(image: NDArray[np.uint8], view: TableView, arm: ArmConfig, pose: ArmPose) -> None:
    """Draw the arm and its shadow over a BGR image, in place."""
    _draw_shadow(image, view, arm, pose)
    base, elbow, hand = pose.points
    height = arm.height_m
    for a, b, radius, lift in ((base, elbow, 0.030, 1.25), (elbow, hand, 0.024, 1.0)):
        # a tube: lighter towards the light, drawn as ever narrower strips
        for share, tone in ((1.0, 0.62), (0.86, 0.80), (0.62, 0.93), (0.34, 1.0)):
            strip = _capsule(a, b, radius * share) + (1 - share) * radius * np.array([-0.35, 0.35])
            _fill(image, view, strip, height * lift, tuple(tone * c for c in _SHELL))
    for centre, radius, lift in ((base, 0.042, 1.3), (elbow, 0.034, 1.3), (hand, 0.022, 1.02)):
        _fill(image, view, _capsule(centre, centre, radius), height * lift, tuple(0.6 * c for c in _DARK))
        _fill(image, view, _capsule(centre, centre, radius * 0.86), height * lift, _DARK)
        ring = _capsule(centre, centre, radius * 0.45) + np.array([-0.1, 0.1]) * radius
        _fill(image, view, ring, height * lift, tuple(1.5 * c for c in _DARK))


def _capsule(a: Floats, b: Floats, radius: float) -> Floats:
    """(32, 2) outline of all points within `radius` of the segment a-b."""
    along = np.arctan2(b[1] - a[1], b[0] - a[0])
    half = along + np.pi / 2 + np.linspace(0, np.pi, 16)
    tail = a + radius * np.stack([np.cos(half), np.sin(half)], axis=-1)
    tip = b + radius * np.stack([np.cos(half + np.pi), np.sin(half + np.pi)], axis=-1)
    return np.vstack([tail, tip])


def _project(view: TableView, outline: Floats, height: float) -> Floats:
    points = np.column_stack([outline, np.full(len(outline), height)])
    return view.pixel_from_table(points)


def _fill(image: NDArray[np.uint8], view: TableView, outline: Floats, height: float, colour: tuple[float, ...]) -> None:
    pixel = np.rint(_project(view, outline, height) * (1 << _SHIFT)).astype(np.int32)
    cv2.fillPoly(image, [pixel], colour, cv2.LINE_AA, _SHIFT)


def _draw_shadow(image: NDArray[np.uint8], view: TableView, arm: ArmConfig, pose: ArmPose) -> None:
    height, width = image.shape[:2]
    # 255 is full light; drawn small and enlarged, which also softens it
    small = np.full((height // _SHADOW_SHRINK, width // _SHADOW_SHRINK), 255, np.uint8)
    fall = _SHADOW_OFFSET * arm.height_m
    base, elbow, hand = pose.points + fall
    for a, b, radius in ((base, elbow, 0.030), (elbow, hand, 0.024)):
        pixel = (_project(view, _capsule(a, b, radius), 0.0) + 0.5) / _SHADOW_SHRINK - 0.5
        points = np.rint(pixel * (1 << _SHIFT)).astype(np.int32)
        cv2.fillPoly(small, [points], (255 * _SHADOW,), cv2.LINE_AA, _SHIFT)
    soft = cv2.blur(small, (3, 3))
    rows, columns = (np.flatnonzero((soft < 255).any(axis=axis)) for axis in (1, 0))
    if rows.size == 0:
        return
    top, bottom, left, right = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
    scale = _SHADOW_SHRINK
    region = image[top * scale : bottom * scale, left * scale : right * scale]
    shade = cv2.resize(soft[top:bottom, left:right], region.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    cv2.multiply(region, cv2.cvtColor(shade, cv2.COLOR_GRAY2BGR), region, 1 / 255)
