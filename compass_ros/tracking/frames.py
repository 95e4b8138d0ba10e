"""Where the camera hangs among the frames of a robot: below the table, by the root of the tree that it belongs to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats


@dataclass(frozen=True)
class Place:
    """Where a frame is in another one: its points become `rotation @ point + translation` there."""

    rotation: Floats
    """(3, 3)."""
    translation: Floats
    """(3,) [m]."""

    def __matmul__(self, inner: Place) -> Place:
        """Where a frame is that is at `inner` in the frame that is here."""
        return Place(self.rotation @ inner.rotation, self.rotation @ inner.translation + self.translation)

    @property
    def inverse(self) -> Place:
        """Where the other frame is in this one."""
        return Place(self.rotation.T, -self.rotation.T @ self.translation)

    def near(self, other: Place, distance_m: float, angle_rad: float) -> bool:
        """Whether two places are the same but for so much."""
        turned = np.linalg.norm(self.rotation - other.rotation) / np.sqrt(2)  # of a small angle: the angle
        return bool(np.linalg.norm(self.translation - other.translation) <= distance_m and turned <= angle_rad)


Tree = Mapping[str, tuple[str, Place]]
"""Frame -> its parent, and its place in the parent."""


@dataclass(frozen=True)
class Hanging:
    """An edge that connects two trees of frames."""

    child: str
    place: Place
    """Of the child in the table."""


def hang(camera: str, place: Place, table: str, tree: Tree) -> Hanging | None:
    """The edge below `table` that puts the frame `camera` at its `place` in the table; None where there is one.

    A frame has one parent. So where a driver has hung the camera's frame below others, their root is what is hung.
    """
    root, in_root = _root(camera, tree)
    if root == table or root == _root(table, tree)[0]:
        return None
    return Hanging(root, place @ in_root.inverse)


def _root(frame: str, tree: Tree) -> tuple[str, Place]:
    """The root above a frame, and the frame's place in it. Frames in a ring have none: the last one counts."""
    place, seen = Place(np.eye(3), np.zeros(3)), {frame}
    while frame in tree and tree[frame][0] not in seen:
        parent, own = tree[frame]
        frame, place = parent, own @ place
        seen.add(frame)
    return frame, place
