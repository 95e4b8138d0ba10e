"""What an effect is: a piece of physics that a simulator may lack, with hooks at the places where it can act."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import mujoco

from compass_ros.cells.dynamics import Sliding
from compass_ros.errors import ConfigError
from compass_ros.simulation.native.program import Term
from compass_ros.types import Channel, Floats

Sample = Callable[[Floats], Floats]
"""(B, F) times [s] -> (B, F, C) observed columns; what a perfect sensor would say at those times."""


@dataclass(frozen=True)
class Quantity:
    """One number of an effect. At zero of all amplitudes the effect is absent."""

    name: str
    unit: str
    low: float
    high: float
    scale: float
    """A modest size: the step of searches and the width of the prior."""
    amplitude: bool = True
    """False for shapes (a centre, a radius, a frequency), which mean nothing while the amplitudes are zero."""
    start: float = 0.0
    """Where a search begins; for shapes."""
    most: float = math.inf
    """From here on an effect is no longer what its name says (a patch as wide as the table), and is not named; for
    shapes."""


@dataclass(frozen=True)
class Context:
    """What the cell knows of itself, for hooks. Columns: of an observation; pairs (x, y) in the plane."""

    objects: tuple[str, ...]
    """Bodies or joints that the effect acts on."""
    sliding: Mapping[str, Sliding]
    planes: tuple[tuple[int, int], ...]
    positions: tuple[int, ...]
    """Columns that are positions (or joint positions), in metres or radians."""
    time_step: float


@dataclass(frozen=True)
class Effect:
    """A named effect. Numbers come as (B, q) in the order of `quantities`; B rollouts, F frames, T steps, C columns."""

    name: str
    channel: Channel
    quantities: tuple[Quantity, ...]
    sentence: str
    """What the simulator lacks, as in 'the simulator lacks ...'."""
    forces: Callable[[Floats, Context], tuple[Term, ...]] | None = None
    model: Callable[[mujoco.MjModel, Floats, Context], None] | None = None
    """Changes one model, given (q,) numbers; what it changes must be among RESTORED."""
    controls: Callable[[Floats, Floats, Context], Floats] | None = None
    """(B, T, nu) velocity commands -> the same as the arm follows them."""
    sensing: Callable[[Sample, Floats, Context], Sample] | None = None
    ahead: Callable[[Floats, float], float] | None = None
    """(B, q) numbers, last time asked for [s] -> how far beyond it the sensor looks [s]; None: not at all."""
    superposes: bool = True
    """Whether small amplitudes add up; False: each direction of the amplitudes is a case of its own."""
    on: Literal["objects", "walls", "cell"] = "objects"
    """What it acts on: `objects` (all that are tracked, or some), `walls` (one fixed geom of the scene), `cell`."""
    scattered: bool = False
    """Whether its number is another one in each episode, by chance around zero: a rollout may be given its own as an
    input beside the cell's (`Simulator.inputs`), and what a fit finds is the standard deviation."""
    limit: str = ""
    """Name of the simpler effect that it comes to at an end of its shapes' ranges; empty: none."""


RESTORED = (
    "geom_pos",
    "geom_quat",
    "geom_sameframe",
    "geom_solref",
    "body_inertia",
    "body_ipos",
    "body_sameframe",
    "pair_solref",
)
"""Arrays of a model that effects may change, beside the friction cone in its options."""


def restore(model: mujoco.MjModel, scene: mujoco.MjModel) -> None:
    """Undo in `model` what effects have changed since it was a copy of `scene`."""
    model.opt.cone = scene.opt.cone
    for name in RESTORED:
        getattr(model, name)[:] = getattr(scene, name)


def creep_and_load(context: Context, name: str) -> tuple[Floats, Floats]:
    """The two columns that friction on the table needs: creep speed [m/s] and share of the weight on the table.

    Raises ConfigError where the object does not lie on the table.
    """
    if name not in context.sliding:
        raise ConfigError(f"friction on the table cannot act on '{name}'; on the table lie {sorted(context.sliding)}")
    sliding = context.sliding[name]
    return sliding.creep[:, None], sliding.load[:, None]
