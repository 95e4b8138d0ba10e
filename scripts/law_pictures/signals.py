"""What drives make of commands and sensors of motions, by the hooks of the law."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes

from compass_ros.reporting.palette import LIGHT
from compass_ros.simulation.effects import Effect
from compass_ros.simulation.effects.effect import Context
from compass_ros.simulation.sites import Site
from compass_ros.types import Floats
from scripts.law_pictures.axes import WITH, WITHOUT, Draw, both, labelled


def command(numbers: Sequence[float], told: Callable[[Floats], Floats], unit: str = "command") -> Draw:
    """What a drive makes of what it is told."""

    def draw(axes: Axes, law: Effect) -> None:
        time = np.arange(0, 2, 0.01)
        given = told(time)[None, :, None]
        assert law.controls is not None
        followed = law.controls(given, np.array([numbers]), Context((), {}, (), (), 0.01))
        both(axes, time, given[0, :, 0], followed[0, :, 0])
        labelled(axes, "time [s]", unit)

    return draw


def heading(axes: Axes, law: Effect) -> None:
    """A push in the plane, as told and as done."""
    assert law.controls is not None
    told = np.tile([0.5, 0.1], (1, 2, 1))
    done = law.controls(told, np.array([[0.2]]), Context((), {}, (), (), 0.01))
    for one, style in ((told, WITHOUT), (done, WITH)):
        axes.plot([0, one[0, 0, 0]], [0, one[0, 0, 1]], **style)
    axes.set_aspect("equal", adjustable="datalim")
    labelled(axes, "vx [m/s]", "vy [m/s]")


def jitter(axes: Axes, law: Effect) -> None:
    """The same push in eight episodes."""
    assert law.controls is not None
    episodes = np.arange(1, 9)
    spread = np.random.default_rng(1).normal(0, 0.08, episodes.size)
    done = law.controls(np.full((episodes.size, 1, 1), 0.5), spread[:, None], Context((), {}, (), (), 0.01))
    axes.plot(episodes, 0.5 + 0 * episodes, **WITHOUT)
    axes.plot(episodes, done[:, 0, 0], "o", color=LIGHT["with_effects"], ms=3.5)
    labelled(axes, "episode", "speed [m/s]")


def swing(time: Floats) -> Floats:
    return np.asarray(np.sin(2 * np.pi * time / 1.1))


def steps(time: Floats) -> Floats:
    return np.where((time > 0.3) & (time < 1.2), 1.0, 0.0)


def sensed(
    law: Effect, numbers: Sequence[float], true: Callable[[Floats], Floats], time: Floats, sites: tuple[Site, ...] = ()
) -> Floats:
    """(F, C) what a sensor with the law says of a true motion, (B, F) times -> (B, F, C)."""
    assert law.sensing is not None
    columns = true(time[None]).shape[2]
    context = Context(sites, {}, (tuple(range(columns)),), ((),), 1e-3)
    rest = [0.0] * (len(law.quantities) - len(numbers))
    return np.asarray(law.sensing(true, np.array([[*numbers, *rest]]), context)(time[None])[0])


def signal(numbers: Sequence[float], amplitude: float = 1.0) -> Draw:
    """A joint that swings, as it is and as it is measured."""

    def draw(axes: Axes, law: Effect) -> None:
        time = np.linspace(0, 3, 301)

        def true(at: Floats) -> Floats:
            return amplitude * swing(at)[..., None]

        both(axes, time, true(time[None])[0, :, 0], sensed(law, numbers, true, time)[:, 0])
        labelled(axes, "time [s]", "angle [rad]")

    return draw


def standing(points: Floats) -> Callable[[Floats], Floats]:
    """(F, C) points that are the same at all times."""
    return lambda _: points[None]


def over_a_turn(axes: Axes, law: Effect) -> None:
    """Error of an encoder over the angle."""
    angle = np.linspace(0, 4 * np.pi, 201)
    seen = sensed(law, [0.01, 0.02], lambda at: at[..., None], angle)[:, 0]
    both(axes, angle, 0 * angle, 1e3 * (seen - angle))
    labelled(axes, "angle [rad]", "error [mrad]")


def camera(numbers: Sequence[float], sites: tuple[Site, ...] = (), three: bool = False) -> Draw:
    """A grid of points, as it is and as it is seen."""

    def draw(axes: Axes, law: Effect) -> None:
        across, up = np.linspace(-0.4, 0.4, 9), np.linspace(-0.2, 0.2, 5)
        lines = [np.column_stack([np.full(11, x), np.linspace(-0.2, 0.2, 11)]) for x in across]
        lines += [np.column_stack([np.linspace(-0.4, 0.4, 11), np.full(11, y)]) for y in up]
        for line in lines:
            points = np.column_stack([line, np.zeros(11)]) if three else line
            seen = sensed(law, numbers, standing(points), np.zeros(11), sites)
            axes.plot(*line.T, **{**WITHOUT, "lw": 0.6})
            axes.plot(seen[:, 0], seen[:, 1], **{**WITH, "lw": 0.9})
        axes.set_aspect("equal")
        labelled(axes, "x [m]", "y [m]")

    return draw


def moving(numbers: Sequence[float]) -> Draw:
    """A puck that circles, as it is and as it is seen at each moment."""

    def draw(axes: Axes, law: Effect) -> None:
        time = np.linspace(0, 1, 201)

        def true(at: Floats) -> Floats:
            return np.stack([0.3 * np.cos(2 * np.pi * at), 0.15 * np.sin(2 * np.pi * at)], axis=2)

        here, seen = true(time[None])[0], sensed(law, numbers, true, time)
        both(axes, time, 0 * time, 1e3 * np.hypot(*(seen - here).T))
        labelled(axes, "time [s]", "error [mm]")

    return draw
