"""Which effects are asked about in a cell, and on what they could act."""

from __future__ import annotations

from dataclasses import dataclass

from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached


@dataclass(frozen=True)
class Candidate:
    """An effect on certain objects."""

    attached: Attached
    twins: tuple[Attached, ...] = ()
    """What the recordings can hardly tell from it, where that is known."""

    @property
    def name(self) -> str:
        return self.attached.effect.name

    @property
    def by_force(self) -> bool:
        """Whether it pushes bodies along their way, so that impulse responses tell what it does."""
        return self.attached.effect.forces is not None and self.attached.effect.on == "objects"


def candidates(simulator: Simulator) -> tuple[Candidate, ...]:
    """All laws that can act in this cell: on all its movers together, on each alone, on each wall."""
    movers = simulator.movers()
    out: list[Candidate] = []
    for effect in EFFECTS.values():
        if effect.scattered or (effect.channel == "actuation" and not simulator.actuated):
            continue
        if effect.on == "cell":
            sets: list[tuple[str, ...]] = [()]
        elif effect.on == "walls":
            sets = [(wall,) for wall in simulator.walls()]
        else:
            sets = [movers] if len(movers) < 2 else [movers, *((m,) for m in movers)]
        out.extend(Candidate(Attached(effect, objects)) for objects in sets if simulator.accepts(effect, objects))
    return tuple(out)


def scattered(simulator: Simulator) -> tuple[Candidate, ...]:
    """Effects that differ from episode to episode by chance."""
    return tuple(Candidate(Attached(e, ())) for e in EFFECTS.values() if e.scattered and simulator.actuated)
