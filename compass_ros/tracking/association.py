"""Which measurement is which object.

Colour separates objects that look different; those that look alike are told apart by where each was predicted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from compass_ros.tracking.config import ObjectConfig, TrackerConfig
from compass_ros.tracking.motion import Motion
from compass_ros.types import Floats

_FORBIDDEN = 1e6


@dataclass(frozen=True)
class Detection:
    """A measured disc, not yet named."""

    look: ObjectConfig
    xy: Floats
    """(2,) centre in the frame `table` at mid-exposure [m]."""
    covariance: Floats
    """(2, 2) [m^2]."""
    arc: float
    """Share of the rim that was seen."""


def assign(
    detections: Sequence[Detection], predicted: Mapping[str, Motion], config: TrackerConfig
) -> dict[str, Detection]:
    """Name -> detection, each used once, so that the sum of distances to the predictions is least.

    `predicted`: motions at the image's time, of the objects that are tracked. An object that looks like no other takes
    a detection of its colour wherever it is; one of several alike only within the gate. Alike objects seen for the
    first time are named in the order of x.
    """
    names = list(config.objects)
    if not detections:
        return {}
    looks = list(config.objects.values())
    cost = np.full((len(names), len(detections)), _FORBIDDEN)
    for row, name in enumerate(names):
        unique = looks.count(looks[row]) == 1
        for column, detection in enumerate(detections):
            if detection.look != looks[row]:
                continue
            motion = predicted.get(name)
            if motion is None:
                # dearer than any tracked object's claim; the row breaks the tie in the order of x
                cost[row, column] = 1e3 + row * float(detection.xy[0]) * -1e-3 - detection.arc
                continue
            distance = float(np.linalg.norm(detection.xy - motion.mean[:2]))
            gate = config.gate_m + 3 * float(np.sqrt(np.trace(motion.covariance[:2, :2])))
            if unique or distance < gate:
                cost[row, column] = distance - 0.02 * detection.arc
    rows, columns = linear_sum_assignment(cost)
    return {names[r]: detections[c] for r, c in zip(rows, columns, strict=True) if cost[r, c] < _FORBIDDEN}
