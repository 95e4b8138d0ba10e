"""What a scene is asked for and what it hands back: recordings, and the answer as plain data for JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal, Protocol

from compass_ros.types import Episode, Floats, Parameter

Kind = Literal["none", "one", "two", "outside"]
UNKNOWN = "unknown"
"""The class of what lies outside of the suite's vocabulary."""


@dataclass(frozen=True)
class Task:
    """What a scene may know of its cell: the drawing as a text file, and the priors of the tunable numbers."""

    name: str
    hash: str
    model: Path
    parameters: tuple[Parameter, ...]

    def values(self, true: Mapping[str, float]) -> dict[str, float]:
        """All of them, as in the drawing but for these."""
        return {p.name: p.default for p in self.parameters} | dict(true)


@dataclass(frozen=True)
class Asked:
    """What may be asked of a world; everything else follows from the seed."""

    seed: int
    kind: Kind | None = None
    """None: drawn."""
    names: tuple[str, ...] = ()
    """Laws by the scene's own names, at most two; they decide the kind."""
    commands: Floats | None = None
    """What the world is told, in the place of what is drawn for it: (S, 4) shots of a table, (E, n, J) positions [rad]
    at 100 Hz for the joints of a driven arm. All else stays as it is."""


@dataclass(frozen=True)
class Missing:
    """A piece of physics that this world has and its cell lacks."""

    name: str
    """The scene's own."""
    classes: tuple[str, ...]
    """Names of the suite's vocabulary that a perfect observer may give; or UNKNOWN alone."""
    sites: tuple[str, ...]
    """Joints, bodies, geoms, actuators, inputs or signals of the cell, by its names."""
    quantities: Mapping[str, float | Sequence[float]]
    """With units in their names; of several sites a list in the order of the sites."""
    source: str
    """Author, year, where."""
    strength: float = 0.0
    """rms of what it changes in the tracked signals, over the noise of each; the other laws of the world stay."""


@dataclass(frozen=True)
class World:
    """Recordings of one cell, and what is true of them."""

    cell: str
    episodes: tuple[Episode, ...]
    answer: Mapping[str, object]


class Scene(Protocol):
    """Draws and plays a world. The same task and wishes give the same bits. Raises ConfigError for unknown laws."""

    def __call__(self, task: Task, asked: Asked) -> World: ...


def answer(
    task: Task,
    scene: str,
    asked: Asked,
    kind: Kind,
    laws: Sequence[Missing],
    parameters: Mapping[str, float],
    strength: float,
    noise: Mapping[str, object],
) -> dict[str, object]:
    """The answer of a world: what `compass conceal` seals.

    Args:
        task: The cell.
        scene: The scene's own name.
        asked: Where the seed comes from.
        kind: How much is missing.
        laws: All that is missing.
        parameters: True values of the cell's parameters, by name.
        strength: rms difference of the tracked signals with and without all laws, over the noise.
        noise: What the sensors do, with units in the names.
    """
    return {
        "schema": "compass/answer/2",
        "cell": task.name,
        "cell_hash": task.hash,
        "scene": scene,
        "seed": asked.seed,
        "kind": kind,
        "laws": [_law(law) for law in laws],
        "parameters": {name: float(value) for name, value in parameters.items()},
        "strength": float(strength),
        "noise": dict(noise),
    }


def _law(law: Missing) -> dict[str, object]:
    """With `class` for `classes`, as plain lists."""
    said = asdict(law)
    classes = said.pop("classes")
    return {"name": said.pop("name"), "class": list(classes), **said, "sites": list(law.sites)}
