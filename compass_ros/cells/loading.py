"""From a name or a path to a cell that can be simulated."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from compass_ros.cells.auto import with_auto
from compass_ros.cells.cell import Cell
from compass_ros.cells.drives import Drives
from compass_ros.cells.physical import check_physical
from compass_ros.cells.registry import dynamics_of
from compass_ros.cells.scene_files import scene_files
from compass_ros.cells.spec import validated_spec
from compass_ros.config import Parameters, read_yaml
from compass_ros.errors import ConfigError, nearest, shown

_builtin = Path(__file__).parents[1] / "config" / "cells"


def load(name_or_path: str | Path, parameters: Parameters = "cell") -> Cell:
    """A cell by its name in config/cells or by the path of its YAML, with its own parameters or all of its scene's.

    Either way it is the same cell with the same hash: `auto` adds parameters at values that the scene has already.

    Raises ConfigError with one line: no such cell, not as expected, or with a scene or parameters that its dynamics
    cannot use.
    """
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        known = sorted(p.stem for p in cells_folder().glob("*.yaml"))
        if str(name_or_path) not in known:
            raise ConfigError(
                f"unknown cell '{name_or_path}'; known: {', '.join(known)}{nearest(str(name_or_path), known)}"
            )
        path = cells_folder() / f"{name_or_path}.yaml"
    content, bases = _whole(path)
    spec = validated_spec(content, str(path))
    check_physical(spec.parameters, str(path))
    model = path.parent / spec.model
    if not model.is_file():
        raise ConfigError(f"{path}: model: no file {model}")
    cell = Cell(spec, path, _hash([path, *bases], model))
    Drives(cell, dynamics_of(cell).model)
    return with_auto(cell) if spec.auto or parameters == "auto" else cell


def _whole(path: Path, above: tuple[Path, ...] = ()) -> tuple[dict[str, object], list[Path]]:
    """A YAML's content, with what it has not itself from the YAML that it extends; the YAMLs below it.

    Raises ConfigError.
    """
    content = dict(read_yaml(path))
    given = content.pop("extends", None)
    if given is None:
        return content, []
    if not isinstance(given, str):
        raise ConfigError(f"{path}: extends: expected the path of a cell's YAML, found {shown(given)}")
    base = path.parent / given
    if base in above:
        raise ConfigError(f"{path}: extends: {given} extends this one itself")
    below, bases = _whole(base, (*above, path))
    if "model" in below:
        below["model"] = str((base.parent / str(below["model"])).absolute())
    return below | content, [base, *bases]


def _hash(yamls: Sequence[Path], model: Path) -> str:
    """Of the YAML and those that it extends, of the scene, and of all files that the scene is made of."""
    contents = [*yamls, model, *scene_files(model).further]
    return hashlib.sha256(b"".join(file.read_bytes() for file in contents)).hexdigest()[:16]


def cells_folder() -> Path:
    """Folder of the cells that come with the suite: installed inside the package, or at the root of a checkout."""
    return _builtin if _builtin.is_dir() else Path(__file__).parents[2] / "config" / "cells"
