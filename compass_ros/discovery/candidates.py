"""Which effects are asked about in a cell, and on what: those that can act on what it has, by kinds of sites."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.discovery.sites_asked import Pairs, choices, on_signals
from compass_ros.discovery.unlisted import unlisted
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached, Effect, Quantity
from compass_ros.simulation.rotors import actuated
from compass_ros.simulation.site_kinds import DRIVES, JOINTS, PLANAR, SIGNALS, SiteKind
from compass_ros.simulation.sites import names_of
from compass_ros.simulation.sizes import JointSize, alike
from compass_ros.simulation.visited import Visited
from compass_ros.types import Bools, Floats

ALIKE: tuple[tuple[SiteKind, ...], ...] = (PLANAR, *((kind,) for kind in JOINTS))
"""What moves in the same way: one number of an effect means the same for all of them."""


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
    def begins(self) -> Floats:
        """(q,) up to where each quantity does nothing."""
        return np.array([q.begins for q in self.quantities])

    @property
    def alone(self) -> bool:
        """Whether it is on one site, or on pairs of one geom with others; or on all of the cell that it can act on."""
        named = [set(names) for names in self.attached.named]
        together = self.attached.effect.paired and bool(set.intersection(*named))
        return not self.beside and (len(named) == 1 or together)

    @property
    def by_force(self) -> bool:
        """Whether it pushes what moves along a path, so that impulse responses tell what it does."""
        return self.attached.effect.along_path and self.attached.effect.on != ("body",)


def candidates(simulator: Simulator, values: Floats, inputs: Floats, time_s: Floats) -> tuple[Candidate, ...]:
    """All laws that can act in this cell, with the sizes that they can have there.

    On all movers of a kind together and on each alone, on each wall, on the drives of a kind and on each alone, on the
    pairs that touch and those of tracked bodies, on all signals of a kind and on each. (P,) values, (E, A) inputs and
    (E, F) times [s] say how joints move and what drives are told.
    """
    visited = Visited(simulator, values, inputs, time_s)
    joints, between = visited.joint_sizes(), Pairs(simulator, visited)
    out: list[Attached] = []
    for effect in EFFECTS.values():
        if effect.moves:
            out.extend(_on_movers(effect, simulator, joints))
            out.extend(_in_space(effect, simulator, visited))
            out.extend(_on_links(effect, simulator, visited) if effect.on_links else ())
        elif effect.on_walls:
            out.extend(Attached(effect, (wall,)) for wall in simulator.places.walls)
        elif any(kind in DRIVES for kind in effect.on):
            out.extend(_on_drives(effect, simulator, visited))
        elif effect.paired:
            out.extend(between.on_pairs(effect))
            if "contacts" in effect.on and simulator.accepts(effect, ()):
                out.append(Attached(effect.on_kinds(("contacts",)), ()))
        elif any(kind in SIGNALS for kind in effect.on):
            out.extend(on_signals(effect, simulator, visited))
        elif simulator.accepts(effect, ()):
            out.append(Attached(effect, ()))
    out.extend(unlisted(simulator, values, visited))
    return tuple(Candidate(attached) for attached in out)


def _on_movers(effect: Effect, simulator: Simulator, joints: Mapping[str, JointSize]) -> Iterator[Attached]:
    """All movers of a kind together, and each alone; no joint that nothing drives, where the law acts by that force.

    Nothing between joint and rotor, where recorded forces are applied to the joint: they would pass the rotor by.
    """
    places = simulator.places
    able = [site for site in simulator.moving.values() if effect.takes(places.model, site)]
    able = [site for site in able if not effect.loaded or joints[site.name].drive > 0]
    if effect.rotor:
        able = [site for site in able if joints[site.name].drive == 0 or actuated(places.model, site.name)]
    for kinds in ALIKE:
        alike_ones = [site for site in able if site.kind in kinds]
        for sites in choices(effect, alike_ones):
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


def _on_links(effect: Effect, simulator: Simulator, visited: Visited) -> Iterator[Attached]:
    """Each last link of the arms whose joints are tracked, or all of their links, and what is fixed to these, together.

    What may hang on the last link is measured by the mean of all: a flange is light.
    """
    places, joints = simulator.places, [name for name, site in simulator.moving.items() if site.kind in JOINTS]
    links, last = ([site for site in sites if effect.takes(places.model, site)] for sites in places.links(joints))
    if effect.on_links == "all" and links:
        yield Attached(effect.on_kinds(("body",)), names_of(links))
        return
    mean = float(np.mean([places.model.body(site.name).mass for site in links])) if links else 0.0
    for site, size in zip(last, visited.paths_in_space(names_of(last))[0].values() if last else (), strict=True):
        yield Attached(effect.at(replace(size, mass=max(size.mass, mean))), site.names)


def _on_drives(effect: Effect, simulator: Simulator, visited: Visited) -> Iterator[Attached]:
    """All drives of a kind together, and each alone; without names all of the cell where they are of one kind."""
    every = [drive for drive in simulator.places.drives if drive.kind in effect.on]
    able = [drive for drive in every if effect.takes(simulator.places.model, drive)]
    for kind in dict.fromkeys(drive.kind for drive in able):
        for drives in choices(effect, [drive for drive in able if drive.kind == kind]):
            objects = () if drives == every and not effect.by_name else names_of(drives)
            if effect.on_drive is None or kind == "tool_drive":
                sized: Effect = effect
            elif (size := visited.drive_size(drives)).command > 0:
                sized = effect.at(size)
            else:
                continue  # what was never told anything cannot show it
            if all(objects) or not objects:
                yield Attached(sized, objects)
