"""Physics that a simulator may lack, each effect a file of this folder; EFFECTS knows them by name."""

from compass_ros.simulation.effects.attach import Attachment, attach
from compass_ros.simulation.effects.attached import Attached
from compass_ros.simulation.effects.effect import Effect, Quantity
from compass_ros.simulation.effects.exported import (
    Exported,
    FittedEffect,
    as_entry,
    from_entry,
    read_effects,
    write_effects,
)
from compass_ros.simulation.effects.registry import EFFECTS, effect

__all__ = [
    "EFFECTS",
    "Attached",
    "Attachment",
    "Effect",
    "Exported",
    "FittedEffect",
    "Quantity",
    "as_entry",
    "attach",
    "effect",
    "from_entry",
    "read_effects",
    "write_effects",
]
