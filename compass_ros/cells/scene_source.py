"""A scene's document as MuJoCo reads it; without the drawings whose files are not there.

What moves is decided by masses, joints and drives. A model whose meshes were not handed on (a URDF without its package)
is therefore still a robot: geoms of meshes that are missing are left out, whoever loads it says so, and nothing touches
them. Where a mass was to come from such a mesh, MuJoCo itself says that the body has none.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco

from compass_ros.cells.scene_files import SceneFiles, scene_files
from compass_ros.errors import ConfigError


@dataclass(frozen=True)
class SceneSource:
    """A scene to be compiled, and what was left out of it."""

    spec: mujoco.MjSpec
    """Of the caller's own."""
    missing: tuple[str, ...]
    """Files of meshes, as the document names them."""

    @property
    def remark(self) -> str:
        """One sentence on what was left out; empty: nothing."""
        if not self.missing:
            return ""
        listed = ", ".join(self.missing[:3]) + ", ..." * (len(self.missing) > 3)
        return f"{len(self.missing)} mesh files are not there ({listed}): their geoms are left out and touch nothing"


def scene_source(path: Path) -> SceneSource:
    """The document of a scene, MJCF or URDF. Raises ConfigError with MuJoCo's own words in one line."""
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise ConfigError(f"{path}: {' '.join(str(error).split())}") from error
    files = scene_files(path)
    return SceneSource(spec, tuple(mesh.file for mesh in list(spec.meshes) if _left_out(spec, mesh, files)))


def missing_meshes(path: Path) -> str:
    """`SceneSource.remark` of a scene. Raises ConfigError."""
    return scene_source(path).remark


def _left_out(spec: mujoco.MjSpec, mesh: mujoco.MjsMesh, files: SceneFiles) -> bool:
    """Whether a mesh's file is nowhere; then it and its geoms are deleted."""
    if not mesh.file or files.find(mesh.file, spec.meshdir) is not None:
        return False
    name = mesh.name or Path(mesh.file).stem  # as MuJoCo calls it
    for geom in [geom for geom in spec.geoms if geom.meshname == name]:
        spec.delete(geom)
    spec.delete(mesh)
    return True
