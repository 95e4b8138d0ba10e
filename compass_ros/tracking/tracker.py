"""One image -> where the objects are. `step` is the tracker; everything it remembers goes in and comes out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from compass_ros.errors import TrackingError
from compass_ros.tracking.association import Detection, assign
from compass_ros.tracking.blobs import find_blobs, hue_image
from compass_ros.tracking.camera import CameraModel, TableView
from compass_ros.tracking.config import ObjectConfig, TrackerConfig
from compass_ros.tracking.fiducials import TableFix, recheck, update_fix
from compass_ros.tracking.motion import Motion, correct, first_motion, predict
from compass_ros.tracking.rim import fit_rims
from compass_ros.types import Floats

_FULL_SEARCHES = 5
"""Images in which all markers are looked for; afterwards one marker at a time."""
_RECHECK_EVERY = 8
_HIDDEN_STD_M = 0.001
"""Standard deviation that a rim hidden as a whole would have; in proportion to the hidden share."""
_PARTIAL_ARC = 0.7
_PARTIAL_GATE = 9.2
"""Squared distance in standard deviations that 99 % of the measurements in the plane keep."""
_SAME_M = 0.006
"""Measurements of like-coloured discs nearer to each other than this are one."""
_RESTART_NS = 1_000_000_000
"""A clock that goes back by more has been restarted (a bag that is played again); by less, an image came late."""


@dataclass(frozen=True)
class Sighting:
    """One object in one image."""

    object: str
    stamp_ns: int
    """The image's stamp: the middle of its exposure in the sensor's clock."""
    xy: Floats
    """(2,) centre in the frame `table` [m]: measured when `seen`, else predicted."""
    covariance: Floats
    """(2, 2) [m^2]; grows while the object is not seen, and is never under `bridged_std_m`^2 then."""
    velocity: Floats
    """(2,) filtered [m/s]."""
    seen: bool
    arc: float
    """Share of the rim that was seen."""

    @property
    def std(self) -> float:
        """One standard deviation of a coordinate [m]."""
        return float(np.sqrt(np.trace(self.covariance) / 2))


@dataclass(frozen=True)
class Frame:
    """What one image says."""

    stamp_ns: int
    sightings: tuple[Sighting, ...]
    problem: str
    """One line when the image could not be used; empty when all is well."""


@dataclass(frozen=True)
class TrackerState:
    """What the tracker remembers from image to image."""

    fix: TableFix = field(default_factory=TableFix)
    motions: Mapping[str, Motion] = field(default_factory=dict)
    stamp_ns: int | None = None
    images: int = 0


def use_one_core() -> None:
    """Keep OpenCV and linear algebra to the calling thread: on images and matrices this small their threads cost more
    than they bring, and on a busy machine they wait for each other."""
    cv2.setNumThreads(1)
    threadpool_limits(1)


def step(
    state: TrackerState, image: NDArray[np.uint8], stamp_ns: int, camera: CameraModel, config: TrackerConfig
) -> tuple[TrackerState, Frame]:
    """Track the objects through one more BGR image (H, W, 3).

    Returns the next state and the sightings in the order of `config.objects`. No fiducials in view, or an image older
    than the last, is a `problem` of the frame. Raises TrackingError if the image does not fit the camera.
    """
    if image.shape != (camera.height, camera.width, 3):
        raise TrackingError(
            f"image is {image.shape[1]}x{image.shape[0]} with shape {image.shape}, "
            f"camera_info says {camera.width}x{camera.height} with 3 channels"
        )
    if state.stamp_ns is not None and stamp_ns <= state.stamp_ns:
        if state.stamp_ns - stamp_ns < _RESTART_NS:
            return state, Frame(stamp_ns, (), f"image out of order: stamp {stamp_ns} ns after {state.stamp_ns} ns")
        state = replace(state, motions={})
    fix, last_ns = _look_for_table(state, image, camera, config), state.stamp_ns
    state = replace(state, fix=fix, stamp_ns=stamp_ns, images=state.images + 1)
    if fix.view is None:
        return state, Frame(stamp_ns, (), fix.problem)
    predicted = {name: predict(m, stamp_ns, config.acceleration_std) for name, m in state.motions.items()}
    found = assign(_detect(image, fix.view, predicted, last_ns, config), predicted, config)
    motions, sightings = {}, []
    for name in config.objects:
        sighting = _sight(name, stamp_ns, found.get(name), predicted.get(name), last_ns, config)
        if sighting is not None:
            motions[name], seen = sighting
            sightings.append(seen)
    return replace(state, motions=motions), Frame(stamp_ns, tuple(sightings), "")


def _look_for_table(
    state: TrackerState, image: NDArray[np.uint8], camera: CameraModel, config: TrackerConfig
) -> TableFix:
    fix, markers = state.fix, config.fiducials
    searching = fix.view is None or fix.view.camera != camera or state.images < _FULL_SEARCHES
    if not searching and state.images % _RECHECK_EVERY:
        return fix
    gray = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    if searching:
        return update_fix(fix, gray, camera, markers)
    known = sorted(fix.corners)
    return recheck(fix, gray, known[state.images // _RECHECK_EVERY % len(known)], camera, markers)


def _detect(
    image: NDArray[np.uint8],
    view: TableView,
    predicted: Mapping[str, Motion],
    last_ns: int | None,
    config: TrackerConfig,
) -> list[Detection]:
    """Discs in the image: sought where a spot of their colour is, and near it where they were predicted.

    `last_ns`: stamp of the image before.
    """
    hsv = hue_image(image)
    seeds: list[Floats] = []
    looks: list[ObjectConfig] = []
    # objects that look alike are one search
    for look in dict.fromkeys(config.objects.values()):
        known = [predicted[name] for name, other in config.objects.items() if other == look and name in predicted]
        # after a miss the prediction is not trusted to be near
        expected = [motion.mean[:2] for motion in known if motion.seen_ns == last_ns]
        blobs = find_blobs(hsv, view, look, np.array(expected).reshape(-1, 2))
        guesses = [b.xy for b in blobs if np.all(np.abs(b.xy) < [config.x_limit_m, config.y_limit_m])]
        if guesses and len(known) > 1:
            # discs that look alike and touch make one spot
            guesses += [motion.mean[:2] for motion in known]
        seeds += guesses
        looks += [look] * len(guesses)
    if not seeds:
        return []
    fit = fit_rims(image, view, np.array(seeds), looks)
    systematic = np.eye(2) * config.systematic_std_m**2
    detections: list[Detection] = []
    # the best supported first: a second measurement of the same disc is dropped
    for i in np.argsort(-fit.arc):
        # the edge of what hides a disc can pass for its rim: the less is seen, the less is sure
        covariance = fit.covariance[i] + systematic + np.eye(2) * (_HIDDEN_STD_M * (1 - fit.arc[i])) ** 2
        sure = fit.arc[i] >= config.min_arc and np.sqrt(np.linalg.eigvalsh(covariance)[-1]) <= config.max_std_m
        again = any(d.look == looks[i] and np.linalg.norm(d.xy - fit.xy[i]) < _SAME_M for d in detections)
        if sure and not again:
            detections.append(Detection(looks[i], fit.xy[i], covariance, float(fit.arc[i])))
    return detections


def _mistaken(found: Detection, predicted: Motion | None, last_ns: int | None) -> bool:
    """Whether a disc that is hidden in part was measured at the edge of what hides it: not where it was predicted from
    the image before. A second such measurement is believed."""
    if found.arc >= _PARTIAL_ARC or predicted is None or predicted.seen_ns != last_ns:
        return False
    off = found.xy - predicted.mean[:2]
    return bool(off @ np.linalg.solve(predicted.covariance[:2, :2] + found.covariance, off) > _PARTIAL_GATE)


def _sight(
    name: str,
    stamp_ns: int,
    found: Detection | None,
    predicted: Motion | None,
    last_ns: int | None,
    config: TrackerConfig,
) -> tuple[Motion, Sighting] | None:
    """The object's next motion and what is said of it; None when it is not known where it is."""
    if found is not None and not _mistaken(found, predicted, last_ns):
        if predicted is None or np.linalg.norm(found.xy - predicted.mean[:2]) > config.gate_m:
            motion = first_motion(stamp_ns, found.xy, found.covariance)
        else:
            motion = correct(predicted, found.xy, found.covariance)
        return motion, Sighting(name, stamp_ns, found.xy, found.covariance, motion.mean[2:], True, found.arc)
    if predicted is None or stamp_ns - predicted.seen_ns > config.bridge_s * 1e9:
        return None
    covariance = predicted.covariance[:2, :2] + np.eye(2) * config.bridged_std_m**2
    return predicted, Sighting(name, stamp_ns, predicted.mean[:2], covariance, predicted.mean[2:], False, 0.0)
