"""Which effects are asked about in a cell, and on what: those that can act on what it has, by kinds of sites."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from compass_ros.discovery.unlisted import unlisted
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached, Effect, Quantity
from compass_ros.simulation.sites import DRIVES, JOINTS, PLANAR, Site, SiteKind, names_of
from compass_ros.simulation.sizes import JointSize, alike
from compass_ros.simulation.visited import Visited
from compass_ros.types import Bools, Floats

ALIKE: tuple[tuple[SiteKind, ...], ...] = (PLANAR, *((kind,) for kind in JOINTS))
"""What moves in the same way: one number of an effect means the same for all of them."""

BY_NAME_ALONE = frozenset({"load_dependent_friction", "cogging", "joint_elasticity", "backlash", "torque_saturation"})
"""Laws that first order, as it is here, cannot rank: a load and a motor's angle are no part of a path, a period is
not found from four starts, and a limit does nothing before it is the largest force. They can be attached by name."""


@dataclass(frozen=True)
class Candidate:
    """An effect on certain objects."""

    attached: Attached
    beside: tuple[Attached, ...] = ()
    """The same law on further sites, with a size on each."""

    @property
    def name(self) -> str:
        return self.attached.effect.name

    @property
    def parts(self) -> tuple[Attached, ...]:
        return (self.attached, *self.beside)

    @property
    def objects(self) -> tuple[str, ...]:
        return tuple(name for part in self.parts for name in part.objects)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        return tuple(q for part in self.parts for q in part.effect.quantities)

    @property
    def amplitudes(self) -> Bools:
        """(q,) which of the quantities are amplitudes."""
        return np.array([q.amplitude for q in self.quantities])

    @property
    def by_force(self) -> bool:
        """Whether it pushes what moves along a path, so that impulse responses tell what it does."""
        effect = self.attached.effect
        return effect.forces is not None and effect.moves and effect.on != ("body",)


def candidates(simulator: Simulator, values: Floats, inputs: Floats, time_s: Floats) -> tuple[Candidate, ...]:
    """All laws that can act in this cell, with the sizes that they can have there.

    On all movers of a kind together and on each alone, on each wall, on the drives of a kind and on each alone. (P,)
    values, (E, A) inputs and (E, F) times [s] say how joints move and what drives are told.
    """
    visited = Visited(simulator, values, inputs, time_s)
    joints = visited.joint_sizes()
    out: list[Attached] = []
    for effect in EFFECTS.values():
        if effect.name in BY_NAME_ALONE:
            continue
        if effect.moves:
            out.extend(_on_movers(effect, simulator, joints))
            out.extend(_in_space(effect, simulator, visited))
        elif effect.on_walls:
            out.extend(Attached(effect, (wall,)) for wall in simulator.places.walls)
        elif any(kind in DRIVES for kind in effect.on):
            out.extend(_on_drives(effect, simulator, visited))
        elif simulator.accepts(effect, ()):
            out.append(Attached(effect, ()))
    out.extend(unlisted(simulator, values, visited))
    return tuple(Candidate(attached) for attached in out)


def _on_movers(effect: Effect, simulator: Simulator, joints: Mapping[str, JointSize]) -> Iterator[Attached]:
    """All movers of a kind together, and each alone."""
    places = simulator.places
    able = [site for site in simulator.moving.values() if effect.takes(places.model, site)]
    for kinds in ALIKE:
        for sites in together_and_alone([site for site in able if site.kind in kinds]):
            names = names_of(sites)
            if sites[0].kind in JOINTS:
                yield Attached(effect.at(alike([joints[name] for name in names])), names)
                continue
            own = tuple(dict.fromkeys(site.kind for site in sites))
            mistaken = any(places.of(site.name, effect.on) != site for site in sites)  # for a joint of the same name
            yield Attached(effect.on_kinds(own) if mistaken else effect, names)


def _in_space(effect: Effect, simulator: Simulator, visited: Visited) -> Iterator[Attached]:
    """Each body that moves in space by itself."""
    able = [site for site in simulator.in_space.values() if effect.takes(simulator.places.model, site)]
    sizes = visited.paths_in_space(names_of(able))[0] if able and effect.on_body else {}
    for site in able:
        sized = effect.at(sizes[site.name]) if effect.on_body else effect.on_kinds(("body",))
        yield Attached(sized, site.names)


def _on_drives(effect: Effect, simulator: Simulator, visited: Visited) -> Iterator[Attached]:
    """All drives of a kind together, and each alone; without names all of the cell where they are of one kind."""
    able = [drive for drive in simulator.places.drives if drive.kind in effect.on]
    for kind in dict.fromkeys(drive.kind for drive in able):
        for drives in together_and_alone([drive for drive in able if drive.kind == kind]):
            objects = () if drives == able else names_of(drives)
            if effect.on_drive is None or kind == "tool_drive":
                sized: Effect = effect
            elif (size := visited.drive_size(drives)).command > 0:
                sized = effect.at(size)
            else:
                continue  # what was never told anything cannot show it
            if all(objects) or not objects:
                yield Attached(sized, objects)


def together_and_alone(sites: list[Site]) -> list[list[Site]]:
    """All of some sites, and each one where they are several."""
    return [sites, *([site] for site in sites)] if len(sites) > 1 else [[site] for site in sites]
