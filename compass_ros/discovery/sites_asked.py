"""On which pairs and signals of a cell laws are asked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

from compass_ros.cells import Cell
from compass_ros.cells.signals import Signal
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, Effect
from compass_ros.simulation.extents import PairSize, alike_pairs
from compass_ros.simulation.site_kinds import PAIRS, SiteKind
from compass_ros.simulation.sites import Places, Site, names_of
from compass_ros.simulation.visited import Visited

PAIRS_ASKED = 12
"""Pairs of a kind on which laws are asked, those that touch longest or come nearest: a budget."""


class Pairs:
    """Pairs of geoms that touch, and of tracked bodies, in what was visited; looked for when first asked for."""

    def __init__(self, simulator: Simulator, visited: Visited) -> None:
        self._simulator, self._visited = simulator, visited
        self._of: dict[SiteKind, list[tuple[list[Site], PairSize]]] = {}

    def on_pairs(self, effect: Effect) -> Iterator[Attached]:
        """Each pair alone, those together that differ by which of several alike bodies is in them; where only one
        touches, a law of all contacts is that one's."""
        for kind in (kind for kind in effect.on if kind in PAIRS):
            if kind not in self._of:
                self._of[kind] = list(self._found(kind))
            found = self._of[kind]
            for sites, size in found if len(found) > 1 or "contacts" not in effect.on else ():
                if all(effect.takes(self._simulator.places.model, site) for site in sites):
                    yield Attached(effect.at(size), names_of(sites))

    def _found(self, kind: SiteKind) -> list[tuple[list[Site], PairSize]]:
        names = self._visited.touching() if kind == "geom_pair" else combinations(self._bodies(), 2)
        places = self._simulator.places
        sites = [site for one, other in names if (site := places.pair(kind, one, other)) is not None]
        if kind == "geom_pair":
            together = list(self._alike(sites).values())[:PAIRS_ASKED]
            return [(pairs, alike_pairs(self._visited.pair_sizes(pairs))) for pairs in together]
        sized = zip(([site] for site in sites), self._visited.pair_sizes(sites), strict=True)
        return sorted((one for one in sized if one[1].nearest > 0), key=lambda one: one[1].nearest)[:PAIRS_ASKED]

    def _alike(self, pairs: Sequence[Site]) -> dict[object, list[Site]]:
        """Pairs of one geom with geoms of one shape on tracked bodies: what the one is made of, they meet alike."""
        model, tracked = self._simulator.places.model, self._bodies()
        out: dict[object, list[Site]] = {}
        for pair in pairs:
            shapes = {
                name: (int(model.geom(name).type[0]), tuple(model.geom(name).size))
                for name in pair.names
                if model.body(int(model.body_weldid[model.geom(name).bodyid[0]])).name in tracked
            }
            others = [name for name in pair.names if name not in shapes]
            key = (others[0], *shapes.values()) if len(shapes) == 1 else pair.names
            out.setdefault(key, []).append(pair)
        return out

    def _bodies(self) -> list[str]:
        """Those that are tracked as bodies."""
        signals = self._simulator.cell.signals
        return list(dict.fromkeys(n for s in signals if s.places and s.fitted and not s.jointed for n in s.at))


def on_signals(effect: Effect, simulator: Simulator, visited: Visited) -> Iterator[Attached]:
    """All signals of its kinds together, unless it acts on what is named, and each sensor alone.

    A sensor is a number that is measured, or one message where the law acts on all of it, or cannot act on less. All
    that a camera sees is one.
    """
    places = simulator.places
    if simulator.accepts(effect, ()):
        of_camera = effect.on == ("camera",) and effect.on_signal is not None
        yield Attached(effect.at(visited.camera_size()) if of_camera else effect, ())
    sensors = list(_sensors(effect, simulator.cell, places))
    for sites in sensors if effect.by_name or len(sensors) > 1 else ():
        sized = effect.at(visited.signal_size(sites[0]))
        if all(q.high > q.low for q in sized.quantities):  # what never moves cannot show it
            yield Attached(sized, tuple(site.name for site in sites))


def _sensors(effect: Effect, cell: Cell, places: Places) -> Iterator[list[Site]]:
    """What the law acts on alone."""
    tuned = {(p.of, p.field) for p in cell.spec.parameters}
    cameras: list[Site] = []
    for signal in (signal for signal in cell.signals if signal.fitted):
        own = [s for s in places.signals if effect.takes(places.model, s) and set(s.columns) <= _columns(signal)]
        if own and own[0].kind == "camera":
            cameras += [site for site in own if site.name == signal.name]
            continue
        whole, numbers = [s for s in own if s.name == signal.name], [s for s in own if len(s.columns) == 1]
        for site in whole if effect.of_message else numbers or whole:
            if (signal.name, f"{effect.tuned_as}[{site.columns[0] - signal.first}]") not in tuned:
                yield [site]
    if cameras:
        yield cameras


def _columns(signal: Signal) -> set[int]:
    return set(range(signal.first, signal.first + signal.size))


def choices(effect: Effect, sites: list[Site]) -> list[list[Site]]:
    """All of some sites of a kind, unless the law acts on what is named, and each one where they are several."""
    alone = [[site] for site in sites]
    return [sites, *alone] if len(sites) > 1 and not effect.by_name else alone
