"""Effects with what they act on: in a simulator of ours, in YAML, or on any MuJoCo model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import yaml

from compass_ros.cells.dynamics import Sliding
from compass_ros.config import read_yaml
from compass_ros.errors import ConfigError
from compass_ros.simulation.effects.effect import Context, Effect
from compass_ros.simulation.native.program import Programs
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


@dataclass(frozen=True)
class FittedEffect:
    """An effect with its values, as exported."""

    attached: Attached
    values: tuple[float, ...]
    std: tuple[float, ...]


def write_effects(effects: Sequence[FittedEffect], sliding: Mapping[str, Sliding], path: Path) -> None:
    """Write fitted effects as YAML: name, objects, values with units, and the table contact that friction effects need."""
    content = {
        "effects": [
            {
                "name": e.attached.effect.name,
                "objects": list(e.attached.objects),
                "values": {
                    q.name: {"value": value, "std": std, "unit": q.unit}
                    for q, value, std in zip(e.attached.effect.quantities, e.values, e.std, strict=True)
                },
            }
            for e in effects
        ],
        "sliding": {
            name: {"friction": float(s.friction[0]), "creep": float(s.creep[0]), "load": float(s.load[0])}
            for name, s in sliding.items()
        },
    }
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")


def read_effects(path: Path) -> Mapping[str, object]:
    """What `write_effects` wrote. Raises ConfigError with one line."""
    content = read_yaml(path)
    if not isinstance(content.get("effects"), list):
        raise ConfigError(f"{path}: expected a list under `effects`")
    return content


class attach:  # noqa: N801 - reads as a verb: `with attach(model, data, effects): ...`
    """Attach exported effects to a MuJoCo model: forces from now on, changes of the model at once.

    `effects` is what `read_effects` gives. Use it as a context, or keep the object as long as the model is stepped and
    call `detach()`. Effects of the command or of the sensor act outside the model and are refused with ConfigError.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, effects: Mapping[str, object]) -> None:
        from compass_ros.simulation.effects import effect  # the registry imports this module

        table = effects.get("sliding") or {}
        assert isinstance(table, dict)
        sliding = {
            name: Sliding(name, *(np.array([float(row[key])]) for key in ("friction", "creep", "load")))
            for name, row in table.items()
        }
        from compass_ros.simulation.native.program import Kind, Term

        terms = [
            Term(Kind.TABLE_FRICTION, s.body, np.stack([s.friction, s.creep, s.load], axis=1)) for s in sliding.values()
        ]
        entries = effects["effects"]
        assert isinstance(entries, list)
        for entry in entries:
            kind = effect(str(entry["name"]))
            numbers = np.array([float(entry["values"][q.name]["value"]) for q in kind.quantities])
            context = Context(tuple(entry["objects"]), sliding, (), (), float(model.opt.timestep))
            if kind.model is not None:
                kind.model(model, numbers, context)
            elif kind.forces is not None:
                terms.extend(kind.forces(numbers[None], context))
            else:
                raise ConfigError(f"effect '{kind.name}' acts on the {kind.channel}, not on the model; apply it there")
        self._programs = Programs([model], terms)
        self._programs.__enter__()
        mujoco.mj_forward(model, data)

    def detach(self) -> None:
        """Stop the forces. Changes of the model stay."""
        self._programs.__exit__()

    def __enter__(self) -> attach:
        return self

    def __exit__(self, *_: object) -> None:
        self.detach()
