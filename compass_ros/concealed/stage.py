"""A cell with a secret: what is drawn for a demonstration, and each of its shots as a camera would see it.

The laws are those of the sealed worlds. What acts inside a camera is left out, since the images are really drawn, and
so is what differs from shot to shot. The clock is the simulator's own: what differs from it is what is concealed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.registry import dynamics_of
from compass_ros.concealed.absorption import Absorber
from compass_ros.concealed.law import Ingredient
from compass_ros.concealed.laws import KNOWN, known
from compass_ros.concealed.recording import RATE
from compass_ros.concealed.strength import Judge
from compass_ros.concealed.table import Table
from compass_ros.concealed.world import described, places_of, strong_enough, wrong_parameters
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.types import Floats

POOL = tuple(law.name for law in KNOWN.values() if law.channel != "sensing" and law.name != "stroke_jitter")
"""What a cell may conceal from its camera."""
NOTHING = 0.15
"""Share of the seeds that conceal wrong parameters alone."""
WEAKEST, STRONGEST = 3e-3, 8e-3
"""What the best parameters leave of the effect, rms [m]; drawn uniform in the logarithm."""
_SHARE = "pusher@actuation@vel_discount"
"""What the arm makes of a commanded speed."""
_STREAMS = ("kind", "parameters", "law")


@dataclass(frozen=True)
class Secret:
    """What is wrong with a cell, and what was never in its simulator."""

    values: Floats
    """(P,) true parameters."""
    ingredients: tuple[Ingredient, ...] = ()


class Stage:
    """Plays single shots of a cell that has a secret."""

    def __init__(self, cell: Cell, secret: Secret) -> None:
        """Raises ConfigError where the cell cannot have this secret."""
        if secret.ingredients:
            _has_physics(cell)
        self.cell, self.secret = cell, secret
        self._simulator = Simulator(cell, threads=1)
        self.time_step = self._simulator.time_step

    def bodies(self, action: Floats, time_s: Floats) -> Mapping[str, Floats]:
        """(F, 3) x, y [m], yaw [rad] of each moving body after an (A,) action, at (F,) times since it [s]."""
        if not self.secret.ingredients:
            return self._simulator.bodies(self.secret.values, action, time_s)
        table = Table(self.cell, self.secret.values, action[None], self.time_step)
        state = table.play(self.secret.ingredients).state[:, 0]
        clock = self.time_step * np.arange(len(state))
        at = np.stack([np.interp(time_s, clock, column) for column in state.T], axis=1)
        poses = dynamics_of(self.cell).poses(self.secret.values[None], at[None])
        return {name: pose[0] for name, pose in poses.items()}

    def told(self, action: Floats, time_s: Floats) -> Floats:
        """(F, nu) speeds that the arm's controller is told for an (A,) action, at (F,) times since it [s]; before it 0.

        As commanded: what share of them the arm reaches, and how late, is its secret.
        """
        values = np.where([p.name == _SHARE for p in self.cell.parameters], 1.0, self.secret.values)
        steps = round(self.cell.duration / self.time_step)
        controls = dynamics_of(self.cell).controls(values[None], action[None], steps)[0]
        at = np.floor(time_s / self.time_step + 1e-9).astype(int)
        return np.asarray(np.where(at[:, None] >= 0, controls[np.clip(at, 0, steps - 1)], 0.0))


def draw(cell: Cell, inputs: Floats, seed: int, values: Floats | None = None, effect: str = "") -> Mapping[str, object]:
    """The answer (plain data for JSON) of a cell that is to play (S, A) shots.

    `values`: (P,) true parameters, else drawn; `effect`: a name of POOL, `none`, or empty: drawn. The same arguments
    give the same answer. Raises ConfigError for an unknown effect, or a cell that has no concealed physics.
    """
    streams = {name: np.random.default_rng([seed, i]) for i, name in enumerate(_STREAMS)}
    values = wrong_parameters(cell, streams["parameters"]) if values is None else values
    nothing = bool(streams["kind"].random() < NOTHING) if not effect else effect == "none"
    if not nothing:
        _has_physics(cell)
    name = effect or str(streams["kind"].choice(POOL))
    effects = [] if nothing else [_effect(cell, values, inputs, name, streams["law"])]
    return {
        "schema": "compass/answer/1",
        "cell": cell.name,
        "cell_hash": cell.hash,
        "seed": seed,
        "kind": "one" if effects else "none",
        "effects": effects,
        "parameters": {p.name: float(v) for p, v in zip(cell.parameters, values, strict=True)},
        "noise_floor_m": {},
    }


def _effect(cell: Cell, values: Floats, inputs: Floats, name: str, rng: np.random.Generator) -> dict[str, object]:
    """One law at a size that these shots show, as answers describe it."""
    if name not in POOL:
        raise ConfigError(f"--effect {known(name)}: a demonstration may conceal none, {', '.join(POOL)}")
    times = np.arange(round(cell.duration * RATE)) / RATE
    table = Table(cell, values, inputs, Simulator(cell, threads=1).time_step)
    absorber = Absorber(cell, values, inputs, times)
    judge = Judge(table, absorber, np.tile(times, (len(inputs), 1)), table.play())
    target = float(np.exp(rng.uniform(np.log(WEAKEST), np.log(STRONGEST))))
    found = strong_enough(KNOWN[name], True, places_of(judge.base), judge, target, (), rng)
    return described(found, judge, table.play([found.ingredient]))


def _has_physics(cell: Cell) -> None:
    if cell.spec.dynamics != "air_hockey":
        raise ConfigError(f"{cell.name}: laws exist for the dynamics air_hockey, not {cell.spec.dynamics}")


def read_secret(path: Path, cell: Cell) -> Secret:
    """The secret in an answer's file. Raises ConfigError where it is not one of this cell."""
    try:
        answer = json.loads(path.read_text(encoding="utf-8"))
        values = [float(answer["parameters"][p.name]) for p in cell.parameters]
        ingredients = [
            Ingredient(KNOWN[e["name"]], tuple(e["objects"]), dict(e["shape"]), float(e["size"]))
            for e in answer["effects"]
        ]
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{path}: not the answer of a cell like '{cell.name}': {error!r}") from error
    return Secret(np.array(values), tuple(ingredients))
