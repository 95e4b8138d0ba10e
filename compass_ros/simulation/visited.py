"""How a scene moves in recorded episodes, and what moves it there: from which the sizes of laws follow."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import mujoco
import numpy as np

from compass_ros.simulation.balance import Balance
from compass_ros.simulation.extents import (
    BodySize,
    PairSize,
    Path,
    SignalSize,
    body_size,
    camera_size,
    pair_size,
    paths,
    signal_size,
    standing,
)
from compass_ros.simulation.simulator import Simulator
from compass_ros.simulation.site_kinds import JOINTS, SiteKind
from compass_ros.simulation.sites import Site
from compass_ros.simulation.sizes import DriveSize, JointSize, actuators_most, command_unit, joint_sizes
from compass_ros.simulation.touching import touching
from compass_ros.types import Floats

BALANCED = 4
"""Episodes, of all, in which it is asked what numbers of the scene do: a budget."""


class Visited:
    """(E, A) inputs up to (E, F) times [s], at (P,) values. They are played when that is first asked for, and once."""

    def __init__(self, simulator: Simulator, values: Floats, inputs: Floats, time_s: Floats) -> None:
        self._simulator, self._values = simulator, values
        self._asked = np.tile(values, (len(inputs), 1)), inputs, time_s

    def joint_sizes(self) -> dict[str, JointSize]:
        """Of each tracked joint."""
        simulator = self._simulator
        joints = {name: site for name, site in simulator.moving.items() if site.kind in JOINTS}
        if not joints:
            return {}
        noise, signals = simulator.cell.spec.noise_m, simulator.cell.signals
        noises = {name: s.noise or noise for s in signals if s.jointed and s.places for name in s.at}
        states, driven = self._states
        return joint_sizes(simulator.written(self._values), joints, states, driven, noises)

    def paths_in_space(self, names: Sequence[str]) -> tuple[dict[str, BodySize], dict[str, Path]]:
        """Of bodies; what stands as what never moves."""
        simulator, states = self._simulator, self._states[0]
        model = simulator.written(self._values)
        found, seconds = paths(model, names, states), states.shape[1] * simulator.time_step
        sites = {name: simulator.places.body(name) for name in names}
        noise = simulator.cell.spec.noise_m
        turning = {name for s in simulator.cell.signals if s.quantity == "pose" for name in s.at}
        return {
            name: body_size(model, site, found[name], seconds, noise, name in turning) if site else standing(model)
            for name, site in sites.items()
        }, found

    def balance(self) -> Balance:
        """What numbers of the scene do in some of the episodes."""
        states, (controls, parts) = self._states
        some = slice(None, None, max(len(states) // BALANCED, 1))
        own = None if controls is None else controls[some]
        return Balance(self._simulator.written(self._values), states[some], (own, parts))

    def pair_sizes(self, pairs: Sequence[Site]) -> list[PairSize]:
        """Of pairs of geoms or bodies."""
        model = self._simulator.physics.model
        bodies = [tuple(_body_of(model, pair.kind, name) for name in pair.names) for pair in pairs]
        sizes, found = self.paths_in_space(tuple(dict.fromkeys(name for two in bodies for name in two)))
        return [
            pair_size(pair.kind, (sizes[one], found[one]), (sizes[other], found[other]))
            for pair, (one, other) in zip(pairs, bodies, strict=True)
        ]

    def touching(self) -> tuple[tuple[str, str], ...]:
        """The pairs of named geoms that touch, the longest first, of bodies that have names too."""
        simulator = self._simulator
        if not simulator.places.touching:
            return ()
        return touching(simulator.written(self._values), self._states[0])

    def signal_size(self, site: Site) -> SignalSize:
        """Of what is measured, as the simulator has it."""
        return signal_size(site, self._observed)

    def camera_size(self) -> SignalSize:
        """Of all that a camera sees, as the simulator has it."""
        simulator = self._simulator
        bodies = [s for s in simulator.places.signals if s.kind == "camera" and len(s.columns) > 1]
        return camera_size(bodies, self._observed, simulator.cell.spec.noise_m)

    @cached_property
    def _drives(self) -> Floats:
        """(2, nu) the largest force and speed of each actuator."""
        return actuators_most(self._simulator.written(self._values), *self._states)

    def drive_size(self, drives: Sequence[Site]) -> DriveSize:
        """What drives of one kind are told, and how hard and fast their actuators are there."""
        controls, steps = self._commands
        unit = command_unit(self._simulator.physics.model, drives[0])
        told = [np.linalg.norm(controls[:, :, list(d.actuators)], axis=2).max() for d in drives if controls is not None]
        own = [i for d in drives for i in d.actuators]
        force, speed = (float(most) or 1.0 for most in self._drives[:, own].max(axis=1))
        return DriveSize(drives[0].kind, float(max(told)), unit, force, steps * self._simulator.time_step, speed)

    @cached_property
    def _states(self) -> tuple[Floats, tuple[Floats | None, int]]:
        """(E, T, s) states, and (E, T, n) what drove MuJoCo with the bits that say what its rows are."""
        simulator, (values, inputs, _) = self._simulator, self._asked
        own, start, controls, steps = simulator.begun(values, inputs, simulator.physics.duration(*self._asked))
        states = simulator.play(own, start, controls, steps)[0]
        return states, (controls, simulator.physics.drives.parts)

    @cached_property
    def _observed(self) -> Floats:
        """(E, F, C)"""
        return self._simulator.observe(*self._asked)

    @cached_property
    def _commands(self) -> tuple[Floats | None, int]:
        """(E, T, n) what drives are told before any law changes it, and T."""
        plain = self._simulator.with_effects(())
        values, inputs, _ = self._asked
        _, _, controls, steps = plain.begun(values, inputs, plain.physics.duration(*self._asked))
        return controls, steps


def _body_of(model: mujoco.MjModel, kind: SiteKind, name: str) -> str:
    """The body that moves a geom or a body of that name, which may be welded to it."""
    body = int(model.geom(name).bodyid[0]) if kind == "geom_pair" else model.body(name).id
    return str(model.body(int(model.body_weldid[body])).name)
