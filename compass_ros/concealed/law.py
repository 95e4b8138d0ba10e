"""What a concealed world may hold: a law of physics with a shape that is drawn and a size that is scaled."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import mujoco
from numpy.random import Generator

from compass_ros.types import Channel, Floats, Phase

PUCKS = ("puck1", "puck2")
WALLS = ("front_wall", "back_wall", "left_wall", "right_wall", "obstacle")

Shape = Mapping[str, float]
"""The numbers of a law but for its size, SI units."""
Sample = Callable[[Floats], Floats]
"""(S, F) times since the command [s] -> (S, F, 4) x, y of puck 1 and puck 2 [m]."""


@dataclass(frozen=True)
class Moment:
    """All shots of a world at one moment. S shots, 2 pucks, frame `table`."""

    time: float
    """[s] since the command."""
    position: Floats
    """(S, 2, 2) [m]."""
    velocity: Floats
    """(S, 2, 2) [m/s]."""
    speed: Floats
    """(S, 2) [m/s]."""
    mass: Floats
    """(2,) [kg]."""
    load: Floats
    """(2,) what the table carries of the weight [N]."""
    creep: Floats
    """(2,) speed under which dry friction fades [m/s]."""

    def against(self, force: Floats) -> Floats:
        """(S, 2, 2) a dry friction of (S, 2) newtons against the motion, faded at the creep speed."""
        return -(force / (self.speed**2 + self.creep**2) ** 0.5)[:, :, None] * self.velocity


@dataclass(frozen=True)
class Places:
    """Where the pucks go in the shots of a world, so that what is drawn lies where it can be seen."""

    points: Floats
    """(N, 2) positions of moving pucks [m]."""
    touched: Mapping[str, int]
    """How many shots touch a wall, by name."""
    shots: int


@dataclass(frozen=True)
class Law:
    """One piece of physics. Hooks take the size first: at 0 nothing happens, 1 is a modest amount."""

    name: str
    channel: Channel
    phases: tuple[Phase, ...]
    """When it acts; the first is its own, the others describe it rightly too."""
    draw: Callable[[Generator, Places, float], dict[str, float]]
    """A shape; the last argument scales how far it departs from the library's formula (0: not at all)."""
    on: Literal["table", "puck", "wall"] = "table"
    """Both pucks alike; both or one of them; one wall."""
    force: Callable[[float, Shape, Moment], Floats] | None = None
    """(S, 2, 2) newtons on the pucks."""
    scene: Callable[[float, Shape, tuple[str, ...], mujoco.MjModel], None] | None = None
    """Changes the scene of one shot; the objects are those that it acts on."""
    damping: Callable[[float, Shape, float], float] | None = None
    """Factor on a contact's damping, from the speed of approach [m/s] at the first touch."""
    rim: Callable[[float, Shape], float] | None = None
    """Coefficient of Coulomb friction between rims."""
    command: Callable[[float, Shape, Floats, float], Floats] | None = None
    """(S, T, 2) commanded velocities, time step [s] -> velocities that the servo is told."""
    camera: Callable[[float, Shape, Sample], Sample] | None = None
    library: Callable[[float, Shape], Mapping[str, float]] | None = None
    """The same in the library's quantities, where that is plain arithmetic."""
    first: float = 1.0
    """Size at which a search for the right one begins."""
    most: float = 1e3
    """Size beyond which it is no longer physical."""


@dataclass(frozen=True)
class Ingredient:
    """A law with its numbers, as part of a world."""

    law: Law
    objects: tuple[str, ...] = PUCKS
    shape: Shape = field(default_factory=dict)
    size: float = 1.0


def nothing(rng: Generator, places: Places, other: float) -> dict[str, float]:
    """The shape of a law that has none."""
    return {}


def spot(rng: Generator, places: Places) -> dict[str, float]:
    """A centre within some centimetres of where pucks move, and off the bar."""
    point = places.points[rng.integers(len(places.points))] + rng.uniform(-0.03, 0.03, 2)
    return {"centre_x": float(point[0].clip(-0.38, 0.38)), "centre_y": float(point[1].clip(-0.17, 0.17))}


def sign(rng: Generator) -> float:
    """One or minus one."""
    return float(rng.choice((-1.0, 1.0)))
