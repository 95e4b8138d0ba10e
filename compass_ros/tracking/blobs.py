"""Coarse search: spots of an object's colour in the whole image, at half its size."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from compass_ros.tracking.camera import TableView
from compass_ros.tracking.config import ObjectConfig
from compass_ros.types import Floats

_SHRINK = 2
_LEAST_SHARE = 0.12
"""A spot that shows less of an object's disc is not looked at."""
_WHOLE_SHARE = 0.85
"""From this share on, the spot's centroid is near enough to the object's centre."""
_NEAR = 0.3
"""An expected place is believed when the centroid of the whole spot is within this share of the radius."""
_NOWHERE: Floats = np.zeros((0, 2))
_MOST_SHARE = 6.0
"""Objects of one colour that touch make one spot; a larger one is something else."""


@dataclass(frozen=True)
class Blob:
    """A spot of an object's colour."""

    xy: Floats
    """(2,) guess of the object's centre in the frame `table` [m], within a few mm for one that is seen whole."""
    share: float
    """Its area over that of the object's disc."""


def hue_image(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """BGR image (H, W, 3) -> HSV with the hue in OpenCV's half degrees, at half the size."""
    height, width = image.shape[:2]
    small = cv2.resize(image, (width // _SHRINK, height // _SHRINK), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.cvtColor(small, cv2.COLOR_BGR2HSV), dtype=np.uint8)


def colour_mask(hsv: NDArray[np.uint8], look: ObjectConfig) -> NDArray[np.uint8]:
    """Where an HSV image has the object's colour: 255, else 0."""
    low, high = look.hue_deg - look.hue_tolerance_deg, look.hue_deg + look.hue_tolerance_deg
    least = (255 * look.min_saturation, 255 * look.min_value)
    # the circle of hues is cut at red; an interval across the cut is two
    spans = [(max(low, 0), min(high, 360)), *([(low + 360, 360.0)] if low < 0 else [])]
    spans += [(0.0, high - 360)] if high > 360 else []
    masks = [cv2.inRange(hsv, np.array([a / 2, *least]), np.array([b / 2, 255, 255])) for a, b in spans]
    return np.asarray(masks[0] if len(masks) == 1 else cv2.bitwise_or(*masks), dtype=np.uint8)


def find_blobs(
    hsv: NDArray[np.uint8], view: TableView, look: ObjectConfig, expected: Floats = _NOWHERE
) -> tuple[Blob, ...]:
    """Spots that can be the object or a part of it, the largest first.

    `expected` (K, 2): where such objects should be [m]; a spot there takes that place for its guess, which is better
    than what it shows itself.
    """
    mask = colour_mask(hsv, look)
    left, top, wide, high = cv2.boundingRect(mask)
    if not wide:
        return ()
    # to count spots costs by the pixel, coloured or not
    mask = mask[top : top + high, left : left + wide]
    _, labels, stats, centroids = cv2.connectedComponentsWithStats(mask, connectivity=4)
    # the centre of a half-size pixel (0, 0) lies between the first four pixels
    pixels = (centroids[1:] + np.array([left, top])) * _SHRINK + 0.5 * (_SHRINK - 1)
    scale = _SHRINK * view.metres_per_pixel
    shares = stats[1:, cv2.CC_STAT_AREA] * scale**2 / (np.pi * look.radius_m**2)
    fitting = np.flatnonzero((shares > _LEAST_SHARE) & (shares < _MOST_SHARE))
    if fitting.size == 0:
        return ()
    centres = view.table_from_pixel(pixels[fitting], look.height_m)
    blobs = []
    for index, centre in zip(fitting, centres, strict=True):
        whole = shares[index] >= _WHOLE_SHARE
        away = np.linalg.norm(expected - centre, axis=1)
        guess = centre
        if away.size and away.min() < (_NEAR if whole else 1.0) * look.radius_m:
            guess = expected[away.argmin()]
        elif not whole:
            x, y, width, height = stats[index + 1, :4]
            spot = np.asarray(labels[y : y + height, x : x + width] == index + 1, dtype=np.uint8)
            guess = _vote(spot, (left + x, top + y), centre, view, look)
        blobs.append(Blob(guess, float(shares[index])))
    return tuple(sorted(blobs, key=lambda blob: -blob.share))


def _vote(
    spot: NDArray[np.uint8], corner: tuple[int, int], centroid: Floats, view: TableView, look: ObjectConfig
) -> Floats:
    """Centre of a disc of known radius of which a part is hidden: the one whose circle runs along most of the spot's
    outline and that leaves none of the spot outside."""
    outlines, _ = cv2.findContours(spot, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    outline = np.concatenate(outlines)[:, 0].astype(np.float64) + np.asarray(corner)
    edge = view.table_from_pixel(outline * _SHRINK + 0.5 * (_SHRINK - 1), look.height_m)
    steps = np.linspace(-1, 1, 13) * look.radius_m
    centres = centroid + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    distance = np.linalg.norm(centres[:, None] - edge[None], axis=-1)
    # outline pixels lie about half a small pixel inside of the rim
    slack = _SHRINK * view.metres_per_pixel
    inside = distance < look.radius_m + 0.5 * slack
    on_rim = inside & (distance > look.radius_m - 1.5 * slack)
    score = on_rim.sum(axis=1) - 4.0 * (~inside).sum(axis=1)
    return np.asarray(centres[score >= score.max() - 0.5].mean(axis=0))
