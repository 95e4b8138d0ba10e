"""Forces of a law over speed, angle, place or direction, by `evaluate`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from compass_ros.reporting.palette import LIGHT
from compass_ros.simulation.effects import Effect
from compass_ros.simulation.effects.effect import Context
from compass_ros.simulation.native.program import evaluate
from compass_ros.simulation.sites import Site
from compass_ros.simulation.sizes import unit_joint
from compass_ros.types import Floats
from scripts.law_pictures.axes import GRAVITY, SLIDING, WITH, WITHOUT, Draw, both, labelled


def torque(numbers: Sequence[float], over: str = "speed", reach: float = 3.0) -> Draw:
    """On a hinge, over its speed or its angle."""

    def draw(axes: Axes, law: Effect) -> None:
        along = np.linspace(-reach, reach, 401)
        states = np.zeros((1, along.size, 6))
        states[0, :, 0 if over == "angle" else 2], states[..., 4] = along, 1.0
        context = Context((Site("hinge", ("joint",)),), {}, (), (), 1e-3)
        on_hinge = law.at(unit_joint("hinge"))
        assert on_hinge.forces is not None
        (term,) = on_hinge.forces(np.array([numbers]), context)
        both(axes, along, 0 * along, evaluate(term, states, GRAVITY)[0, :, 0])
        labelled(axes, "speed [rad/s]" if over == "speed" else "angle [rad]", "torque [N m]")

    return draw


def on_table(law: Effect, numbers: Sequence[float], states: Floats) -> Floats:
    """(F, 2) forces on a puck of 1 kg in (F, 6) states."""
    context = Context((Site("table", ("puck",)),), {"puck": SLIDING}, (), (), 1e-3)
    assert law.forces is not None
    (term,) = law.forces(np.array([numbers]), context)
    return np.asarray(evaluate(term, states[None], GRAVITY)[0])


def field(numbers: Sequence[float]) -> Draw:
    """Arrows where a puck is pushed."""

    def draw(axes: Axes, law: Effect) -> None:
        x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.4, 0.4, 13), np.linspace(-0.2, 0.2, 7)))
        states = np.column_stack([x, y, 0 * x, 0 * x, 1 + 0 * x, 0 * x])
        axes.quiver(x, y, *on_table(law, numbers, states).T, color=LIGHT["with_effects"], width=0.007, pivot="mid")
        axes.set_aspect("equal")
        labelled(axes, "x [m]", "y [m]")

    return draw


def friction_along(numbers: Sequence[float]) -> Draw:
    """Deceleration of a puck that slides along x."""

    def draw(axes: Axes, law: Effect) -> None:
        x = np.linspace(-0.4, 0.4, 201)
        own = np.full_like(x, 0.05 * GRAVITY)
        states = np.column_stack([x, 0 * x, 0.5 + 0 * x, 0 * x, 1 + 0 * x, 0 * x])
        both(axes, x, own, own - on_table(law, numbers, states)[:, 0])
        axes.set_ylim(bottom=0)
        labelled(axes, "x [m]", "slows by [m/s²]")

    return draw


def by_direction(numbers: Sequence[float]) -> Draw:
    """Deceleration in each direction of motion."""

    def draw(axes: Axes, law: Effect) -> None:
        turn = np.linspace(0, 2 * np.pi, 181)
        unit = np.column_stack([np.cos(turn), np.sin(turn)])
        states = np.column_stack([0 * unit, 0.5 * unit, 1 + 0 * turn, 0 * turn])
        own = 0.05 * GRAVITY
        slows = own - np.sum(on_table(law, numbers, states) * unit, axis=1)
        axes.plot(*(own * unit).T, **WITHOUT)
        axes.plot(*(slows[:, None] * unit).T, **WITH)
        axes.set_aspect("equal")
        labelled(axes, "slows along x", "along y [m/s²]")

    return draw
