"""What an effect is: a piece of physics that a simulator may lack, with hooks at the places where it can act."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import mujoco
import numpy as np

from compass_ros.cells.dynamics import Sliding
from compass_ros.errors import ConfigError
from compass_ros.simulation.extents import BodySize, PairSize, SignalSize, Size
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import JOINTS, MOVING, PAIRS, SiteKind
from compass_ros.simulation.sites import Places, Site
from compass_ros.simulation.sizes import DriveSize, JointSize
from compass_ros.types import Channel, Floats

Sample = Callable[[Floats], Floats]
"""(B, F) times [s] -> (B, F, C) observed columns; what a perfect sensor would say at those times."""
_CREEP = 1e-3
"""Speed at which the friction of a body that lies on something is faded in, where the cell does not say [m/s]."""


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
    later: bool = False
    """Whether files were written before the law had it; it is zero in them."""
    formerly: tuple[str, str, float] | None = None
    """Its name, unit and what one of that unit is now, in files that say it in another way."""
    chance: bool = False
    """Whether it is another number in each episode, by chance around zero, and this its standard deviation: a rollout
    is given its own as an input beside the cell's (`Simulator.inputs`)."""
    begins: float = 0.0
    """Up to where an amplitude does nothing in what was seen: of a limit, where it is the largest that was reached."""
    grid: int = 0
    """Places, evenly from low to high, that a search for a shape has to look at, where only near ones are alike; 0: a
    few are enough; 1: where it begins, for what no first order shows."""


@dataclass(frozen=True)
class Context:
    """What the cell knows of itself, for hooks. Columns: of an observation."""

    sites: tuple[Site, ...]
    """What the effect acts on; drives one at a time."""
    sliding: Mapping[str, Sliding]
    places: tuple[tuple[int, ...], ...]
    """Columns of where each body that a camera sees is [m]: x and y, or x, y and z."""
    turns: tuple[tuple[int, ...], ...]
    """Columns of how each of them is turned: a quaternion with the scalar first, or none."""
    time_step: float
    before: Floats | None = None
    """(B, n) what a drive of n components was told before the first command; None: zeros."""


@dataclass(frozen=True)
class Effect:
    """A named effect. Numbers come as (B, q) in the order of `quantities`; B rollouts, F frames, T steps, C columns."""

    name: str
    channel: Channel
    quantities: tuple[Quantity, ...]
    sentence: str
    """What the simulator lacks, as in 'the simulator lacks ...'."""
    on: tuple[SiteKind, ...]
    """The kinds of site on which it can act."""
    forces: Callable[[Floats, Context], tuple[Term, ...]] | None = None
    model: Callable[[mujoco.MjModel, Floats, Context], None] | None = None
    """Changes one model, given (q,) numbers; what it changes must be among RESTORED."""
    controls: Callable[[Floats, Floats, Context], Floats] | None = None
    """(B, T, n) commands of one drive -> the same as it follows them."""
    sensing: Callable[[Sample, Floats, Context], Sample] | None = None
    ahead: Callable[[Floats, float], float] | None = None
    """(B, q) numbers, last time asked for [s] -> how far beyond it the sensor looks [s]; None: not at all."""
    superposes: bool = True
    """Whether small amplitudes add up; False: each direction of the amplitudes is a case of its own."""
    on_joint: Callable[[JointSize], tuple[Quantity, ...]] | None = None
    """Its quantities on a joint, from how that moves and what moves it; None: it acts on no joint."""
    on_drive: Callable[[DriveSize], tuple[Quantity, ...]] | None = None
    """Its quantities on a drive that moves no tool along x and y, from what that is told; None: `quantities`."""
    on_body: Callable[[BodySize], tuple[Quantity, ...]] | None = None
    """Its quantities on a body in space, from how that moves; None: `quantities`."""
    on_pair: Callable[[PairSize], tuple[Quantity, ...]] | None = None
    """Its quantities between two geoms or bodies; None: it acts on no pair."""
    on_signal: Callable[[SignalSize], tuple[Quantity, ...]] | None = None
    """Its quantities on one signal, from what that shows; None: `quantities`."""
    on_links: Literal["", "each last", "all"] = ""
    """On the links of an arm, which nothing tracks: whether it is looked for on each last one, or on all of them
    together; empty: on neither."""
    loaded: bool = False
    """Whether it acts by the force that drives a joint, which its path does not say."""
    rotor: bool = False
    """Whether it acts between a joint and its motor, which the scene is then compiled with (`cells/rotors.py`)."""
    spring: str = ""
    """The quantity that makes its dry friction a spring before it slides; a scene is compiled with anchors for it."""
    apart: bool = False
    """Whether it is another law on each of its sites, so that it is never the same one on several."""
    by_name: bool = False
    """Whether it acts on what is named alone, and means nothing for all of a kind."""
    of_message: bool = False
    """Whether it acts on all numbers of a message alike."""
    tuned_as: str = ""
    """Field of a parameter of a cell that says the same of a number that is measured; empty: there is none."""
    unable: Callable[[mujoco.MjModel, Site], str] | None = None
    """Why it cannot act on a site of the right kind, where its kind does not say all; empty: it can. None: it can."""

    @property
    def moves(self) -> bool:
        """Whether it acts on bodies or joints by name."""
        return any(kind in MOVING for kind in self.on)

    @property
    def scattered(self) -> bool:
        """Whether its numbers are other ones in each episode, by chance; then all of them are."""
        return any(q.chance for q in self.quantities)

    @property
    def anchored(self) -> bool:
        """Whether it needs anchors: a body that lies on something has no such quantity."""
        return any(q.name == self.spring for q in self.quantities)

    @property
    def along_path(self) -> bool:
        """Whether it is a force that follows from the path of what it acts on."""
        return self.forces is not None and self.moves and not self.loaded and not self.rotor

    @property
    def paired(self) -> bool:
        """Whether it acts between two geoms or bodies."""
        return any(kind in PAIRS for kind in self.on)

    @property
    def on_walls(self) -> bool:
        """Whether it acts on one fixed geom."""
        return "wall" in self.on

    def takes(self, model: mujoco.MjModel, site: Site) -> bool:
        """Whether it can act on a site."""
        return site.kind in self.on and not (self.unable is not None and self.unable(model, site))

    def on_kinds(self, kinds: tuple[SiteKind, ...]) -> Effect:
        """The same on some of its kinds of site alone."""
        return replace(self, on=kinds)

    def at(self, size: Size) -> Effect:
        """The same with the quantities that it has on a site of that size, and on its kind alone."""
        return replace(self, on=(size.kind,), quantities=self._sized(size) or self.quantities)

    def _sized(self, size: Size) -> tuple[Quantity, ...]:
        """Empty: they do not depend on the size."""
        match size:
            case JointSize():
                return self.on_joint(size) if self.on_joint else ()
            case DriveSize():
                return self.on_drive(size) if self.on_drive else ()
            case BodySize():
                return self.on_body(size) if self.on_body else ()
            case PairSize():
                return self.on_pair(size) if self.on_pair else ()
            case SignalSize():
                return self.on_signal(size) if self.on_signal else ()


RESTORED = (
    "actuator_biasprm",
    "actuator_forcelimited",
    "actuator_forcerange",
    "actuator_gainprm",
    "actuator_trnid",
    "body_inertia",
    "body_ipos",
    "body_iquat",
    "body_mass",
    "body_pos",
    "body_sameframe",
    "dof_armature",
    "dof_damping",
    "dof_frictionloss",
    "geom_friction",
    "geom_pos",
    "geom_quat",
    "geom_sameframe",
    "geom_solref",
    "jnt_range",
    "jnt_stiffness",
    "pair_solref",
    "sensor_objid",
    "tendon_actfrcrange",
    "tendon_damping",
    "tendon_frictionloss",
    "tendon_lengthspring",
    "tendon_limited",
    "tendon_range",
    "tendon_solref_lim",
    "tendon_stiffness",
    "tendon_stiffnesspoly",
)
"""Arrays of a model that effects may change, beside the friction cone in its options."""


def restore(model: mujoco.MjModel, scene: mujoco.MjModel) -> None:
    """Undo in `model` what effects have changed since it was a copy of `scene`."""
    model.opt.cone = scene.opt.cone
    for name in RESTORED:
        getattr(model, name)[:] = getattr(scene, name)


def table_friction(sliding: Sliding, places: Places) -> Term:
    """The friction of a body with its table. Raises ConfigError where the scene has no such body that moves."""
    site = places.body(sliding.body)
    if site is None:
        raise ConfigError(f"the scene has no moving body '{sliding.body}' that could slide on a table")
    return Term(Kind.TABLE_FRICTION, site, np.stack([sliding.friction, sliding.creep, sliding.load], axis=1))


def told_before(controls: Floats, context: Context) -> Floats:
    """(B, n) what a drive was told before the first of its (B, T, n) commands."""
    return np.zeros_like(controls[:, 0]) if context.before is None else context.before.copy()


def on_contacts(kind: Kind, context: Context, numbers: Floats) -> tuple[Term, ...]:
    """A term for all contacts, or for those of each pair of geoms that the law is on."""
    return tuple(Term(kind, site if site.kind == "geom_pair" else None, numbers) for site in context.sites)


def friction(
    kind: Kind, context: Context, before: Floats, after: Floats | None = None, softness: Floats | None = None
) -> tuple[Term, ...]:
    """Terms of a friction on each site: numbers before and after the creep speed and the share of the weight.

    Of a body on a table both are the cell's. A body that the cell says nothing of lies with all its weight, and its
    friction is faded in at 1 mm/s. Of a joint the first number is a force; fields.c holds a joint with it against all
    other forces, the frictions of all joints together. Of a body in space sliding.h takes neither: its contacts are
    MuJoCo's. `softness`: (B, 1) of a joint [s], or no column: it is hard.
    """
    hard = np.zeros((len(before), 1))
    terms = []
    for site in context.sites:
        known = context.sliding.get(site.name) if site.kind == "table" else None
        if known:
            fading = known.creep[:, None]
        elif site.kind in JOINTS:
            fading = softness if softness is not None and softness.size else hard
        else:
            fading = np.full_like(hard, _CREEP)
        load = known.load[:, None] if known else np.ones((len(before), 1))
        terms.append(Term(kind, site, np.hstack([before, fading, load, *([] if after is None else [after])])))
    return tuple(terms)
