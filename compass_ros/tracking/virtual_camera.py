"""Images as the camera over the table takes them, from where the things really are.

A disc is drawn by area: for every pixel near it, the distance of the pixel's ray to the rim, on the plane of the rim,
over the size of the pixel there, gives the share of the pixel that it covers. So perspective, lens and sub-pixel
position are exact, and the truth is known to a small fraction of a pixel. Motion blur is the mean over moments of the
exposure. An image's time is the middle of its exposure.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from compass_ros.tracking.arm import arm_pose, draw_arm
from compass_ros.tracking.scene import Scene, build_scene
from compass_ros.tracking.scene_config import CameraConfig, DiscConfig, SceneConfig
from compass_ros.types import Floats

_Image = NDArray[np.float32]
_NOISE_MARGIN = 64


@dataclass(frozen=True)
class VirtualCamera:
    """A scene ready to be filmed."""

    config: SceneConfig
    scene: Scene
    noise: NDArray[np.int16]
    """(H + margin, W + margin, 3) sensor noise; each image takes another window of it."""


def make_camera(config: SceneConfig, seed: int = 0, table_shift_m: tuple[float, float] = (0.0, 0.0)) -> VirtualCamera:
    """Draw the background and the noise once. `table_shift_m`: see `build_scene`."""
    shape = (config.camera.height + _NOISE_MARGIN, config.camera.width + _NOISE_MARGIN, 3)
    noise = np.random.default_rng(seed).normal(0, config.camera.noise, shape)
    return VirtualCamera(config, build_scene(config, table_shift_m), np.rint(noise).astype(np.int16))


def exposure_times(camera: CameraConfig, mid_s: Floats) -> Floats:
    """(F,) times of images [s] -> (F, sub_frames) moments that each image averages, symmetric about its time."""
    share = (np.arange(camera.sub_frames) + 0.5) / camera.sub_frames - 0.5
    return np.asarray(mid_s[:, None] + camera.exposure_s * share)


def draw(camera: VirtualCamera, poses: Mapping[str, Floats]) -> NDArray[np.uint8]:
    """What falls on the sensor: a BGR image (H, W, 3) without noise.

    `poses`: name of a disc -> (sub_frames, 3) x, y [m], yaw [rad] in the frame `table` at the moments of the exposure.
    """
    config, scene = camera.config, camera.scene
    image = scene.background.copy()
    for name, disc in config.discs.items():
        if name in poses:
            _draw_disc(image, scene, disc, poses[name])
    if config.arm is not None and config.arm.holds in poses:
        hand = poses[config.arm.holds][:, :2].mean(axis=0)
        draw_arm(image, scene.view, config.arm, arm_pose(config.arm, hand))
    return image


def expose(camera: VirtualCamera, drawn: NDArray[np.uint8], image_number: int) -> NDArray[np.uint8]:
    """The image that the sensor reads: with noise, which the number picks."""
    if camera.config.camera.noise == 0:
        return drawn
    # two strides without a common divisor walk through all windows before one comes again
    row, column = image_number * 29 % _NOISE_MARGIN, image_number * 37 % (_NOISE_MARGIN - 1)
    window = camera.noise[row : row + drawn.shape[0], column : column + drawn.shape[1]]
    return np.asarray(cv2.add(drawn, window, dtype=cv2.CV_8U), dtype=np.uint8)


def render(camera: VirtualCamera, poses: Mapping[str, Floats], image_number: int) -> NDArray[np.uint8]:
    """One image: `draw`, then `expose`. The same poses and number give the same image."""
    return expose(camera, draw(camera, poses), image_number)


def _draw_disc(image: NDArray[np.uint8], scene: Scene, disc: DiscConfig, pose: Floats) -> None:
    """Draw a flat cylinder with its shadow, and its handle if it has one, in place."""
    mean = pose[:, :2].mean(axis=0)
    window = _window(scene, disc, mean, float(np.ptp(pose[:, :2], axis=0).max()))
    rows, columns = window
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return
    near = _Near(scene, window)
    picture = image[window].astype(np.float32)
    colour = np.array(disc.colour[::-1], dtype=np.float32)
    light = scene.light[window]

    shadow = near.cover(mean + np.array([0.004, -0.004]), disc.radius_m, 0.0, softness_m=0.006)
    picture *= 1 - disc.shadow * shadow[..., None]
    top = np.zeros(near.shape, np.float32)
    hull, rim, dot = top.copy(), top.copy(), top.copy()
    for x, y, yaw in pose:
        centre = np.array([x, y])
        face = near.cover(centre, disc.radius_m, disc.height_m)
        top += face
        hull += np.maximum.reduce([face, *(near.cover(centre, disc.radius_m, disc.height_m * z) for z in (0.0, 0.5))])
        rim += near.cover(centre, 0.70 * disc.radius_m, disc.height_m)
        spot = centre + 0.42 * disc.radius_m * np.array([np.cos(yaw), np.sin(yaw)])
        dot += near.cover(spot, 0.14 * disc.radius_m, disc.height_m)
    top, hull, rim, dot = (part / len(pose) for part in (top, hull, rim, dot))
    # the parts are nested, so mixing their mean covers is the mean of the mixed pictures
    paint = (hull - top)[..., None] * (0.70 * colour) + (top - rim)[..., None] * colour
    paint += (rim - dot)[..., None] * (1.16 * colour) + dot[..., None] * np.float32(235.0)
    picture = picture * (1 - hull[..., None]) + np.minimum(paint, 255) * light
    if disc.handle_m > 0:
        levels = np.linspace(disc.height_m, disc.handle_m, 12)
        handle = np.maximum.reduce([near.cover(mean, 0.008, float(z)) for z in levels])
        picture = picture * (1 - handle[..., None]) + handle[..., None] * (np.float32(70.0) * light)
    image[window] = np.rint(picture).clip(0, 255).astype(np.uint8)


def _window(scene: Scene, disc: DiscConfig, centre: Floats, travel: float) -> tuple[slice, slice]:
    """Rows and columns that the disc can touch."""
    reach = 1.35 * disc.radius_m + travel
    box = centre + reach * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    points = np.vstack([np.column_stack([box, np.full(4, z)]) for z in (0.0, max(disc.height_m, disc.handle_m))])
    pixels = scene.view.pixel_from_table(points)
    height, width = scene.light.shape[:2]
    low = np.maximum(np.floor(pixels.min(axis=0)), 0).astype(int)
    high = np.minimum(np.ceil(pixels.max(axis=0)) + 1, [width, height]).astype(int)
    return slice(low[1], high[1]), slice(low[0], high[0])


class _Near:
    """The rays of the pixels of a window."""

    def __init__(self, scene: Scene, window: tuple[slice, slice]) -> None:
        self._x = scene.slope[..., 0][window]
        self._y = scene.slope[..., 1][window]
        self._pixel = scene.pixel_slope[window]
        self._eye = scene.view.position
        self.shape = self._x.shape

    def cover(self, centre: Floats, radius: float, height: float, softness_m: float = 0.0) -> _Image:
        """(h, w) share of each pixel that a disc at `height` covers [m]; `softness_m`: width of a soft edge."""
        depth = np.float32(self._eye[2] - height)
        x = self._x * depth + np.float32(self._eye[0] - centre[0])
        y = self._y * depth + np.float32(self._eye[1] - centre[1])
        width = np.maximum(self._pixel * depth, np.float32(softness_m))
        share = (np.float32(radius) - np.sqrt(x * x + y * y)) / width + np.float32(0.5)
        return np.asarray(np.clip(share, 0, 1), dtype=np.float32)
