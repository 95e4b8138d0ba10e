"""Which effects are asked about in a cell, and on what they could act."""

from __future__ import annotations

from dataclasses import dataclass

from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached

ACTUATED = frozenset({"actuation_delay", "first_order_lag", "velocity_saturation", "dead_band", "heading_bias"})
PLANAR_ONLY = frozenset({"heading_bias", "camera_rotation", "lens_distortion", "rolling_shutter"})
NOT_FITTED = frozenset({"stroke_jitter"})
"""Random from episode to episode: judged by the scatter of the launches, see launches.py."""


@dataclass(frozen=True)
class Candidate:
    """An effect on certain objects."""

    attached: Attached

    @property
    def name(self) -> str:
        return self.attached.effect.name

    @property
    def by_force(self) -> bool:
        """Whether it pushes bodies along their way, so that impulse responses tell what it does."""
        return self.attached.effect.forces is not None and self.attached.effect.on == "objects"


def candidates(simulator: Simulator) -> tuple[Candidate, ...]:
    """All effects that can act in this cell: on all its movers together, on each alone, on each wall."""
    movers = simulator.movers()
    out: list[Candidate] = []
    for name, effect in EFFECTS.items():
        if name in NOT_FITTED or (effect.channel == "actuation" and not simulator.actuated):
            continue
        if effect.on == "cell":
            sets: list[tuple[str, ...]] = [()]
        elif effect.on == "walls":
            sets = [(wall,) for wall in simulator.walls()]
        else:
            sets = [movers] if len(movers) < 2 else [movers, *((m,) for m in movers)]
        out.extend(Candidate(Attached(effect, objects)) for objects in sets if simulator.accepts(effect, objects))
    return tuple(out)
