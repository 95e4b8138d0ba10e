"""Fine measurement: the centre of a disc from its rim.

The image of a circle is not a circle, and the centre of that image is not the image of the centre. So nothing is
measured in the image: it is sampled along radii drawn on the plane of the disc's top face, the step from the object's
colour to its surroundings is found on each, and a circle of known radius is fitted to the steps there.

Seen obliquely, the outline of a flat cylinder is partly the rim of its bottom, which the model holds. A moving disc is
blurred along its velocity; the middle of the blurred step is where the rim was at mid-exposure, so the fitted centre is
the position at mid-exposure. Radii on which another thing hides the rim, or on which a like-coloured thing touches, are
left out. One radial offset common to all radii is fitted too: it takes up a radius stated slightly wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from compass_ros.tracking.camera import TableView
from compass_ros.tracking.config import ObjectConfig
from compass_ros.types import Bools, Floats

_RADII = 48
"""Radii around a disc."""
_REACH = np.linspace(0.66, 1.32, 25)
"""Where each radius is sampled, in units of the disc's radius."""
_INNER = (_REACH > 0.68) & (_REACH < 0.87)
_OUTER = (_REACH > 1.12) & (_REACH < 1.26)
_LEAST_CONTRAST = 25.0
"""Grey levels between an object's colour and its surroundings, shading apart, under which no step is looked for."""
_OFFSET_STD_M = 0.0003
"""Prior of the common radial offset."""
_STEP_NOISE_M = 0.00025
"""Least standard deviation of one step's place: what the pixel grid leaves."""
_Colours = NDArray[np.float32]
_ANGLE = np.arange(_RADII) * (2 * np.pi / _RADII)
_NORMAL = np.stack([np.cos(_ANGLE), np.sin(_ANGLE)], axis=-1)
_ROW = np.column_stack([_NORMAL, np.ones(_RADII)])


@dataclass(frozen=True)
class RimFit:
    """Centres of discs in the frame `table` at mid-exposure."""

    xy: Floats
    """(S, 2) [m]."""
    covariance: Floats
    """(S, 2, 2) [m^2]."""
    arc: Floats
    """(S,) share of the rim that supports the fit."""


def fit_rims(
    image: NDArray[np.uint8], view: TableView, seeds: Floats, looks: Sequence[ObjectConfig], rounds: int = 3
) -> RimFit:
    """Measure the disc near each seed (S, 2) [m] in a BGR image (H, W, 3); `looks`: one for each seed.

    A seed may be off by a third of the radius. A fit with a small `arc` or a large covariance is not to be trusted.
    """
    centre = np.asarray(seeds, dtype=np.float64)
    radius, height = _sizes(looks)
    weight = np.zeros((len(centre), _RADII))
    normal = np.tile(np.eye(3), (len(centre), 1, 1))
    spread = np.full(len(centre), np.inf)
    for _ in range(rounds):
        step, usable = _steps(image, view, centre, looks)
        residual = step - _silhouette(view, centre, radius, height)
        shift, weight, normal, spread = _fit_circle(residual, usable)
        centre = centre + np.clip(shift, -0.5 * radius[:, None], 0.5 * radius[:, None])
        if np.all(np.abs(shift) < 0.03 * radius[:, None]):
            break
    covariance = np.linalg.inv(normal)[:, :2, :2] * np.maximum(spread, _STEP_NOISE_M)[:, None, None] ** 2
    return RimFit(centre, covariance, (weight > 0.1).mean(axis=1))


def _sizes(looks: Sequence[ObjectConfig]) -> tuple[Floats, Floats]:
    return np.array([look.radius_m for look in looks]), np.array([look.height_m for look in looks])


def _steps(
    image: NDArray[np.uint8],
    view: TableView,
    centre: Floats,
    looks: Sequence[ObjectConfig],
) -> tuple[Floats, Bools]:
    """(S, M) distance from the centre of each radius's colour step [m], and whether it can be one."""
    radius, height = _sizes(looks)
    reach = radius[:, None, None, None] * _REACH[:, None]
    xy = centre[:, None, None] + reach * _NORMAL[:, None]
    points = np.concatenate([xy, np.broadcast_to(height[:, None, None, None], (*xy.shape[:3], 1))], axis=-1)
    pixels = view.pixel_from_table(points).astype(np.float32).reshape(len(centre) * _RADII, -1, 2)
    sampled = cv2.remap(image, pixels[..., 0], pixels[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    colour = sampled.astype(np.float32).reshape(len(centre), _RADII, _REACH.size, 3)
    inside, outside = colour[:, :, _INNER].mean(axis=2), colour[:, :, _OUTER].mean(axis=2)

    unit = outside / np.maximum(np.linalg.norm(outside, axis=-1, keepdims=True), 1.0)
    contrast = inside - (inside * unit).sum(axis=-1, keepdims=True) * unit
    strength = np.linalg.norm(contrast, axis=-1)
    contrast /= np.maximum(strength, 1.0)[..., None]
    mine = np.stack([_has_colour(inside[i], look) & ~_has_colour(outside[i], look) for i, look in enumerate(looks)])
    usable = mine & (strength > _LEAST_CONTRAST)
    level = _level(colour, inside, outside, unit, contrast)
    below = (level[:, :, 1:] < 0.5) & (level[:, :, :-1] >= 0.5)
    first = below.argmax(axis=2)
    high = np.take_along_axis(level, first[..., None], axis=2)[..., 0]
    low = np.take_along_axis(level, first[..., None] + 1, axis=2)[..., 0]
    spacing = _REACH[1] - _REACH[0]
    step = radius[:, None] * (_REACH[first] + spacing * (high - 0.5) / np.maximum(high - low, 1e-6))

    return step, below.any(axis=2) & usable


def _level(colour: _Colours, inside: _Colours, outside: _Colours, unit: _Colours, contrast: _Colours) -> _Colours:
    """(S, M, N) share of each sample that the object covers: 1 inside, 0 outside, whatever shadow lies across.

    A sample is light * (a * object + (1 - a) * surroundings). The ratio of its components along `contrast` and along
    `unit` (the colour of the surroundings, at right angles to it) is free of the light and gives a.
    """
    bright = np.maximum((inside * unit).sum(axis=-1), 1.0)
    relative = (np.maximum((outside * unit).sum(axis=-1), 1.0) / bright)[..., None]
    vivid = (inside * contrast).sum(axis=-1) / bright
    ratio = np.einsum("smnc,smc->smn", colour, contrast) / np.maximum(np.einsum("smnc,smc->smn", colour, unit), 1.0)
    return np.asarray(ratio * relative / np.maximum(vivid[..., None] + ratio * (relative - 1), 1e-3))


def _has_colour(colour: NDArray[np.float32], look: ObjectConfig) -> Bools:
    """(M, 3) BGR, 0 to 255 -> (M,) whether it is the object's colour."""
    hsv = cv2.cvtColor(np.ascontiguousarray(colour[None] / 255), cv2.COLOR_BGR2HSV)[0]
    off = np.abs((hsv[:, 0] - look.hue_deg + 180) % 360 - 180)
    return np.asarray(
        (off <= look.hue_tolerance_deg) & (hsv[:, 1] >= look.min_saturation) & (hsv[:, 2] >= look.min_value)
    )


def _silhouette(view: TableView, centre: Floats, radius: Floats, height: Floats) -> Floats:
    """(S, M) distance from the centre to the outline of the cylinder on each radius, on the plane of its top face."""
    eye = view.position
    lift = height / eye[2]
    towards = (eye[:2] - centre) * lift[:, None]
    along = towards @ _NORMAL.T
    across2 = (towards**2).sum(axis=1)[:, None] - along**2
    bottom = along + np.sqrt(np.maximum((radius * (1 - lift))[:, None] ** 2 - across2, 0))
    return np.maximum(radius[:, None], bottom)


def _fit_circle(residual: Floats, usable: Bools) -> tuple[Floats, Floats, Floats, Floats]:
    """Robust fit of residual = normal . shift + offset: shift (S, 2), weights (S, M), normal matrices (S, 3, 3) and
    the residuals' standard deviation (S,)."""
    prior = np.diag([1e-6, 1e-6, (_STEP_NOISE_M / _OFFSET_STD_M) ** 2])
    weight = usable.astype(np.float64)
    left = residual
    solution = np.zeros((len(residual), 3))
    normal = np.tile(prior, (len(residual), 1, 1))
    # Tukey's weights, from forgiving to strict, so that a bad seed costs nothing
    for scale in (np.inf, 0.004, 0.002, 0.001, 0.0008):
        weight = usable * np.clip(1 - (left / scale) ** 2, 0, None) ** 2
        normal = np.einsum("sm,mi,mj->sij", weight, _ROW, _ROW) + prior
        solution = np.linalg.solve(normal, np.einsum("sm,mi,sm->si", weight, _ROW, residual)[..., None])[..., 0]
        left = residual - solution @ _ROW.T
    total = np.maximum(weight.sum(axis=1), 1e-9)
    return solution[:, :2], weight, normal, np.sqrt((weight * left**2).sum(axis=1) / total)
