"""An effect together with what it acts on."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from compass_ros.errors import ConfigError, nearest
from compass_ros.simulation.effects.effect import Effect
from compass_ros.types import Bools, Floats, Parameter


@dataclass(frozen=True)
class Attached:
    """An effect on certain objects (bodies, joints, or one fixed geom for effects on walls)."""

    effect: Effect
    objects: tuple[str, ...]

    def parameters(self) -> tuple[Parameter, ...]:
        """The quantities as parameters `objects@effect@quantity`."""
        prefix = f"{'+'.join(self.objects) or 'cell'}@{self.effect.name}"
        return tuple(
            Parameter(f"{prefix}@{q.name}", q.start, q.low, q.high, q.unit, q.scale) for q in self.effect.quantities
        )

    @property
    def amplitudes(self) -> Bools:
        """(q,) which quantities are amplitudes."""
        return np.array([q.amplitude for q in self.effect.quantities])

    def present(self, numbers: Floats) -> bool:
        """Whether any rollout of (B, q) numbers has an amplitude that is not zero."""
        return bool(numbers[:, self.amplitudes].any())

    def check(self, model: mujoco.MjModel) -> None:
        """Raise ConfigError where a model lacks what the effect acts on."""
        kind = self.effect
        count = {"objects": "at least one object", "walls": "one wall", "cell": "no object"}[kind.on]
        right = {"objects": len(self.objects) > 0, "walls": len(self.objects) == 1, "cell": not self.objects}[kind.on]
        if not right:
            raise ConfigError(f"effect '{kind.name}' acts on {count}, found {list(self.objects)}")
        bodies, joints = _names(model, "body", model.nbody), _names(model, "joint", model.njnt)
        known = _names(model, "geom", model.ngeom) if kind.on == "walls" else bodies + joints
        for name in self.objects:
            if name not in known:
                raise ConfigError(f"effect '{kind.name}': the scene has no '{name}'{nearest(name, known)}")


def _names(model: mujoco.MjModel, kind: str, count: int) -> list[str]:
    return [getattr(model, kind)(i).name for i in range(count)]
