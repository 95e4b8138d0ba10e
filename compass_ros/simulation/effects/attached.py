"""An effect together with what it acts on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.errors import ConfigError
from compass_ros.simulation.effects.effect import Effect
from compass_ros.simulation.site_kinds import in_words
from compass_ros.simulation.sites import Places, Site
from compass_ros.types import Bools, Floats, Parameter


@dataclass(frozen=True)
class Attached:
    """An effect on certain objects: joints, bodies, one fixed geom, or actuators, by name.

    Without objects it acts on all contacts, all drives or all signals of the kinds that it knows.
    """

    effect: Effect
    objects: tuple[str, ...]

    def parameters(self) -> tuple[Parameter, ...]:
        """The quantities as parameters `objects@effect@quantity`."""
        prefix = f"{'+'.join(self.objects) or 'cell'}@{self.effect.name}"
        return tuple(
            Parameter(f"{prefix}@{q.name}", q.start, q.low, q.high, q.unit, q.scale) for q in self.effect.quantities
        )

    @property
    def named(self) -> tuple[tuple[str, ...], ...]:
        """The objects by site: one each, two of a pair; one empty site where it acts on all of a kind."""
        size = 2 if self.effect.paired else 1
        return tuple(self.objects[i : i + size] for i in range(0, len(self.objects), size)) or ((),)

    @property
    def distinct(self) -> tuple[str, ...]:
        """The objects, each once: a geom may stand in several pairs."""
        return tuple(dict.fromkeys(self.objects))

    @property
    def amplitudes(self) -> Bools:
        """(q,) which quantities are amplitudes."""
        return np.array([q.amplitude for q in self.effect.quantities])

    @property
    def drawn(self) -> int:
        """How many numbers of its own each episode has of it, by chance."""
        return len(self.effect.quantities) if self.effect.scattered else 0

    def expected(self, values: Sequence[float]) -> Floats:
        """(q,) its numbers where nothing is known of a rollout: zero where they differ by chance."""
        return np.zeros(len(values)) if self.effect.scattered else np.array(values)

    def present(self, numbers: Floats) -> bool:
        """Whether any rollout of (B, q) numbers has an amplitude that is not zero."""
        return bool(numbers[:, self.amplitudes].any())

    def objection(self, places: Places) -> str:
        """Why it cannot act in a scene, in one line; empty where it can."""
        kind, sites = self.effect, places.sites(self.objects, self.effect.on)
        if miscounted := self._miscounted():
            return f"effect '{kind.name}' acts {miscounted}, found {list(self.objects) or 'none'}"
        if missing := places.missing(self.objects, kind.on):
            return f"effect '{kind.name}': {missing}"
        if kind.paired and 2 * len(sites) < len(self.objects):
            return f"effect '{kind.name}' cannot act between {list(self.objects)}: neither moves against the other"
        for site in sites:
            if kind.unable is not None and (why := kind.unable(places.model, site)):
                return f"effect '{kind.name}' cannot act on '{'+'.join(site.names)}': {why}"
        return ""

    def _miscounted(self) -> str:
        """On how many objects it acts, where these are too few or too many."""
        kind, count = self.effect, len(self.objects)
        if (kind.moves or kind.by_name) and not count:
            return "on at least one object"
        if kind.paired and (count % 2 or (not count and "contacts" not in kind.on)):
            return f"between {in_words(kind.on)}"
        return "on one wall" if kind.on_walls and count != 1 else ""

    def sites(self, places: Places) -> tuple[Site, ...]:
        """What the objects are in a scene. Raises ConfigError where the effect cannot act on one of them there."""
        if objection := self.objection(places):
            raise ConfigError(objection)
        return places.sites(self.objects, self.effect.on)
