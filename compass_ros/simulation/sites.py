"""Where physics can act in a scene: its joints, bodies, walls, contacts, drives and signals, each of one kind.

A law says on which kinds it acts, and so what it is asked about follows from what a cell has: no law is tried on a site
to see whether it fails.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np

from compass_ros.cells.auto_rules import candidates
from compass_ros.cells.candidate import Candidate
from compass_ros.errors import nearest
from compass_ros.simulation.contacts import masks_meet
from compass_ros.simulation.site_kinds import PAIRS, PLANAR, SiteKind, in_words

NUMBERS = frozenset({"dof_armature", "dof_damping", "dof_frictionloss", "jnt_stiffness", "body_mass", "body_ipos",
                     "body_moment", "body_pos", "servo_gain", "geom_friction"})  # fmt: skip
"""Fields that a scene may have wrong: what a joint resists with, a link's mass, centre, inertia and place, a servo's
gain, the friction of a geom. A share of a motor's torque is what `gain_error` says."""

_SLIDE, _HINGE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)
ONE_DOF = (_HINGE, _SLIDE)
OF_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))


def driven_joint(model: mujoco.MjModel, actuator: str) -> str:
    """Name of the joint that an actuator acts on; empty where it is none, but a tendon or a site."""
    index = model.actuator(actuator).id
    if int(model.actuator_trntype[index]) not in OF_JOINT:
        return ""
    return str(model.joint(int(model.actuator_trnid[index, 0])).name)


@dataclass(frozen=True)
class Site:
    """One place where physics can act."""

    kind: SiteKind
    names: tuple[str, ...] = ()
    """Of a joint, body, geom or signal, of a pair, or of a drive's actuators; empty for all contacts or signals."""
    actuators: tuple[int, ...] = ()
    """Of a drive: indices of its controls, in the order of the command's components."""
    columns: tuple[int, ...] = ()
    """Of what is measured: columns of an observation."""
    quantity: str = ""
    """Of one signal: what it measures."""
    units: tuple[str, ...] = ()
    """Of one signal: of each of its columns."""
    number: Candidate | None = None
    """Of a number of the scene: its field, what the scene says it is, and how far off that may be."""

    @property
    def name(self) -> str:
        """Of a joint, body or geom."""
        return self.names[0]


@dataclass(frozen=True, eq=False)
class Places:
    """The sites of a scene."""

    model: mujoco.MjModel
    sliding: frozenset[str] = frozenset()
    """Bodies whose friction on a table is the cell's, no part of the scene."""
    signals: tuple[Site, ...] = ()
    """What is measured of it: each signal, and each number of those that have several."""
    commanded: frozenset[int] | None = None
    """Actuators that are told what to do; one that follows a measured path is no drive. None: all."""

    def sites(self, objects: Sequence[str], kinds: Collection[SiteKind]) -> tuple[Site, ...]:
        """Those of these kinds that the names stand for; without names all drives, all contacts or all signals."""
        if not objects:
            whole = [*self.drives, *([Site("contacts")] if self.touching else []), *self._measured]
            return tuple(site for site in whole if site.kind in kinds)
        if paired := [kind for kind in PAIRS if kind in kinds]:
            pairs = zip(objects[::2], objects[1::2], strict=False)
            return tuple(site for one, other in pairs if (site := self.pair(paired[0], one, other)) is not None)
        found = [self.of(name, kinds) for name in objects]
        return self._joined(objects, kinds) or tuple(site for site in found if site is not None)

    def missing(self, objects: Sequence[str], kinds: Collection[SiteKind]) -> str:
        """Which of the names stands for no site of these kinds, and what there is, in one line; empty: none."""
        found, wanted = names_of(self.sites(objects, kinds)), in_words(kinds)
        if any(kind in PAIRS for kind in kinds):
            found, wanted = tuple(self._names(kinds)), "geom" if "geom_pair" in kinds else "body"
        if not objects:
            return "" if self.sites((), kinds) else f"the scene has no {wanted}"
        unknown = next((name for name in objects if name not in found), None)
        if unknown is None:
            return ""
        known = self._names(kinds)
        return f"the scene has no {wanted} '{unknown}'; it has {known or 'none'}{nearest(unknown, known)}"

    def joint(self, name: str) -> Site | None:
        """A hinge or slide of that name."""
        found = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_JOINT, name)
        kinds: dict[int, SiteKind] = {_HINGE: "hinge", _SLIDE: "slide"}
        kind = kinds.get(int(self.model.jnt_type[found])) if found >= 0 else None
        return Site(kind, (name,)) if kind else None

    def body(self, name: str) -> Site | None:
        """A moving body of that name."""
        found = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, name)
        if found < 0 or not self.model.body_weldid[found]:
            return None
        if not slides_in_plane(self.model, found):
            return Site("body", (name,))
        pressed = self.model.opt.gravity[2] < 0
        return Site(("table" if name in self.sliding else "lying") if pressed else "planar", (name,))

    def links(self, joints: Collection[str]) -> tuple[tuple[Site, ...], tuple[Site, ...]]:
        """Bodies that these joints move, what is fixed to them too, and of them the last ones, beyond which no other of
        these joints is; those that have a mass and a name."""
        model = self.model
        own = {int(model.joint(name).bodyid[0]) for name in joints}
        above = {body: carriers(model, body) for body in range(1, model.nbody)}
        found = {body: site for body in above if above[body] & own and model.body_mass[body] > 0
                 and (site := self.body(str(model.body(body).name))) and site.kind == "body"}  # fmt: skip
        last = [body for body in found if body in own and not any(body in above[b] - {b} for b in own)]
        return tuple(found.values()), tuple(found[body] for body in last)

    def wall(self, name: str) -> Site | None:
        """A fixed geom of that name that stands in a contact pair."""
        return Site("wall", (name,)) if name in self.walls else None

    def signal(self, name: str) -> Site | None:
        """What is measured under that name."""
        return next((site for site in self.signals if site.name == name), None)

    def pair(self, kind: SiteKind, one: str, other: str) -> Site | None:
        """Two geoms of different bodies or two bodies, of which one moves."""
        model, of_geoms = self.model, kind == "geom_pair"
        what = mujoco.mjtObj.mjOBJ_GEOM if of_geoms else mujoco.mjtObj.mjOBJ_BODY
        found = [mujoco.mj_name2id(model, what, name) for name in (one, other)]
        if min(found) < 0:
            return None
        welded = model.body_weldid[model.geom_bodyid[found] if of_geoms else found]
        return Site(kind, (one, other)) if welded[0] != welded[1] else None

    def of(self, name: str, kinds: Collection[SiteKind]) -> Site | None:
        """What of one of these kinds has the name; a joint before a body called the same."""
        found = (self.joint(name), self.body(name), self.wall(name), self.signal(name), self.numbers.get(name))
        return next((site for site in found if site is not None and site.kind in kinds), None)

    def _joined(self, names: Sequence[str], kinds: Collection[SiteKind]) -> tuple[Site, ...]:
        """The drives of these kinds whose actuators are exactly these; none where the names are no such drives."""
        wanted = [d for d in self.drives if d.kind in kinds and set(d.names) <= set(names)]
        return tuple(wanted) if sorted(names_of(wanted)) == sorted(names) else ()

    def _names(self, kinds: Collection[SiteKind]) -> list[str]:
        """Of all sites of some kinds."""
        model = self.model
        joints = [self.joint(model.joint(i).name) for i in range(model.njnt)]
        bodies = [self.body(model.body(i).name) for i in range(1, model.nbody)]
        numbers = self.numbers.values() if "field" in kinds else ()
        found = [*joints, *bodies, *map(self.wall, self.walls), *self.drives, *self.signals, *numbers]
        named = list(names_of(site for site in found if site is not None and site.kind in kinds))
        named += [model.geom(i).name for i in range(model.ngeom) if "geom_pair" in kinds]
        return named + [model.body(i).name for i in range(model.nbody) if "body_pair" in kinds]

    @cached_property
    def numbers(self) -> dict[str, Site]:
        """Numbers of the scene that say what moves and what moves it, by their names `object@type@field`."""
        known = (c for c in candidates(self.model) if c.field.partition("[")[0] in NUMBERS)
        return {one.name: Site("field", (one.name,), number=one) for one in known if "+" not in one.name}

    @cached_property
    def _measured(self) -> tuple[Site, ...]:
        """All that is measured, by kind."""
        kinds = dict.fromkeys(site.kind for site in self.signals)
        own = {kind: {c for site in self.signals if site.kind == kind for c in site.columns} for kind in kinds}
        return tuple(Site(kind, columns=tuple(sorted(columns))) for kind, columns in own.items())

    @cached_property
    def walls(self) -> tuple[str, ...]:
        """Fixed geoms that stand in a contact pair, by name."""
        model = self.model
        pairs = [(model.pair_geom1[i], model.pair_geom2[i]) for i in range(model.npair)]
        fixed = {int(g) for pair in pairs for g in pair if model.body_weldid[model.geom_bodyid[g]] == 0}
        return tuple(model.geom(g).name for g in sorted(fixed) if model.geom(g).name)

    @cached_property
    def ends(self) -> tuple[str, ...]:
        """Bodies with joints that carry no other such body: the last link of an arm, each finger, a free body."""
        model = self.model
        jointed = [body for body in range(1, model.nbody) if model.body_jntnum[body]]
        carrying = {int(model.body_weldid[model.body_parentid[body]]) for body in jointed}
        return tuple(model.body(body).name for body in jointed if body not in carrying and model.body(body).name)

    @cached_property
    def drives(self) -> tuple[Site, ...]:
        """Actuators by what they are told; those that move one tool together."""
        told = range(self.model.nu) if self.commanded is None else sorted(self.commanded)
        single = [Site(drive_kind(self.model, i), (self.model.actuator(i).name,), (i,)) for i in told]
        tools = [tool for body in range(1, self.model.nbody) if (tool := self._tool(body, single))]
        taken = {i for tool in tools for i in tool.actuators}
        alone = [d for d in single if d.actuators[0] not in taken]
        return tuple(sorted([*tools, *alone], key=lambda d: min(d.actuators)))

    def _tool(self, body: int, single: Sequence[Site]) -> Site | None:
        """The velocity drives of a body's slides along x and y of the world, and z where it has one."""
        model, first = self.model, int(self.model.body_jntadr[body])
        slides = [j for j in range(first, first + int(model.body_jntnum[body])) if model.jnt_type[j] == _SLIDE]
        on = {int(model.actuator_trnid[d.actuators[0], 0]): d for d in single
              if d.kind == "velocity_drive" and model.actuator_trntype[d.actuators[0]] in OF_JOINT}  # fmt: skip
        upright = model.body_parentid[body] == 0 and np.array_equal(model.body_quat[body], [1, 0, 0, 0])
        along = len(slides) in (2, 3) and np.array_equal(model.jnt_axis[slides], np.eye(3)[: len(slides)])
        if not (upright and along and all(j in on for j in slides)):
            return None
        drives = [on[j] for j in slides]
        return Site("tool_drive", tuple(d.names[0] for d in drives), tuple(d.actuators[0] for d in drives))

    @cached_property
    def touching(self) -> bool:
        """Whether two geoms of the scene could ever touch, by its pairs and its contact masks."""
        model = self.model
        if model.npair:
            return True
        one, other = np.triu_indices(model.ngeom, 1)
        weld = model.body_weldid[model.geom_bodyid]
        parent = model.body_weldid[model.body_parentid[weld]]
        family = ((parent[one] == weld[other]) & (weld[other] > 0)) | ((parent[other] == weld[one]) & (weld[one] > 0))
        return bool(np.any(masks_meet(model, one, other) & (weld[one] != weld[other]) & ~family))


def slides_in_plane(model: mujoco.MjModel, body: int) -> bool:
    """Whether a body of the world has slides along x and y, perhaps a hinge about z after them, and nothing else."""
    count, own = int(model.body_jntnum[body]), slice(model.body_jntadr[body], None)
    return bool(
        count in (2, 3)
        and model.body_parentid[body] == 0
        and model.jnt_type[own][:count].tolist() == [_SLIDE, _SLIDE, _HINGE][:count]
        and np.array_equal(model.jnt_axis[own][:count], np.eye(3)[:count])
        and np.array_equal(model.body_quat[body], [1, 0, 0, 0])
        and not model.jnt_pos[own][:count].any()
    )


def drive_kind(model: mujoco.MjModel, actuator: int) -> SiteKind:
    """What an actuator is told: a position, a speed, a force; or something else (muscles, gains that vary)."""
    fixed = model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_FIXED
    affine = model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_AFFINE
    plain = model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_NONE
    dynamics = mujoco.mjtDyn(int(model.actuator_dyntype[actuator]))
    integrated = dynamics == mujoco.mjtDyn.mjDYN_INTEGRATOR
    followed = dynamics in (mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT)
    stiffness, damping = -model.actuator_biasprm[actuator, 1:3]
    if fixed and affine and stiffness > 0 and (integrated or followed):
        return "velocity_drive" if integrated else "position_drive"
    if fixed and affine and stiffness == 0 and damping > 0 and followed:
        return "velocity_drive"
    by_force = plain or (affine and stiffness == 0 and damping == 0)
    return "effort_drive" if fixed and by_force and followed else "other_drive"


def carriers(model: mujoco.MjModel, body: int) -> set[int]:
    """A body and all those that carry it."""
    found = set()
    while body:
        found.add(body)
        body = int(model.body_parentid[body])
    return found


def names_of(sites: Iterable[Site]) -> tuple[str, ...]:
    """All names of some sites, in their order."""
    return tuple(name for site in sites for name in site.names)


def any_slides(moving: Mapping[str, Site]) -> bool:
    """Whether something that is tracked slides in a plane."""
    return any(site.kind in PLANAR for site in moving.values())
