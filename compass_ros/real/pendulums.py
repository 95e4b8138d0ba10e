"""Free pendulums: which friction the authors' viscous one leaves out, judged on swings that no fit has seen.

Swings are cut into short pieces with free first states, so that friction is learnt where it acts and an error does not
add up over seconds. Judged are whole swings: from the first state that the authors state (their own way to compare),
from angle and rate of the first 20 ms of angles, and with the first state left free.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from compass_ros.cells import Cell, load
from compass_ros.real.fitting import Fitted, Unknown, fit, gain, residual_at, thinned, with_free_start
from compass_ros.real.imports import episodes
from compass_ros.real.table import Study, Table, several, with_error
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, Quantity, effect
from compass_ros.types import Episode, Floats

EVERY = 10
"""Of the frames at 1 kHz, each tenth is compared."""
MRAD = 1e3
CLEAR = 5.0
"""Log evidence by which a law must win to be preferred: the joint errors of pieces of one swing are not modelled."""

STRIBECK = replace(
    effect("stribeck_friction"),
    quantities=(
        Quantity("extra", "N m", 0.0, 0.01, 1e-4),
        Quantity("speed", "rad/s", 0.1, 20.0, 2.0, amplitude=False, start=4.0),
    ),
)
"""The effect with the range that a joint needs."""
Say = Callable[[str], None]


@dataclass(frozen=True)
class Law:
    """A hypothesis about friction: what is added to the authors' model, and what of it a fit moves."""

    name: str
    effects: tuple[Attached, ...]
    unknowns: tuple[Unknown, ...]
    fixed: Mapping[str, float]


def dry(joint: str, start: float) -> tuple[Attached, Unknown]:
    attached = Attached(effect("coulomb_friction"), (joint,))
    return attached, Unknown(attached.parameters()[0].name, start, start)


def drag(link: str, start: float) -> tuple[Attached, Unknown]:
    attached = Attached(effect("quadratic_drag"), (link,))
    return attached, Unknown(attached.parameters()[0].name, start, start)


def law(
    name: str, base: Sequence[Unknown], added: Sequence[tuple[Attached, Unknown]], fixed: Mapping[str, float]
) -> Law:
    return Law(name, tuple(a for a, _ in added), (*base, *(u for _, u in added)), fixed)


def single_laws() -> tuple[Law, ...]:
    """From viscous friction alone to dry friction with drag of the air."""
    base = (Unknown("link1@dyna@inertia", 0.000118, 0.00002), Unknown("joint1@sensing@offset", 0.001, 0.003))
    viscous = Unknown("joint1@dyna@damping", 0.00019, 0.0002)
    friction, air = dry("joint1", 0.0004), drag("link1", 0.03)
    slow = Attached(STRIBECK, ("joint1",))
    extra, speed = (p.name for p in slow.parameters())
    none = {"joint1@dyna@damping": 0.0}
    return (
        law("viscous", (*base, viscous), (), {}),
        law("viscous and dry", (*base, viscous), (friction,), {}),
        law("viscous and drag of the air", (*base, viscous), (air,), {}),
        law("dry and drag of the air", base, (friction, air), none),
        law("viscous, dry and drag of the air", (*base, viscous), (friction, air), {}),
        law(
            "dry, higher when slow (Stribeck), and drag of the air",
            (*base, Unknown(speed, 5.0, 3.0)),
            (friction, air, (slow, Unknown(extra, 0.0002, 0.0003))),
            none,
        ),
    )


def double_laws() -> tuple[Law, ...]:
    """The same for two links."""
    widths = {"link1@dyna@inertia": 0.0001, "link2@dyna@inertia": 0.0001, "link1@dyna@centre": 0.003}
    widths |= {"link2@dyna@centre": 0.003, "link1@dyna@length": 0.001}
    cell = load("pendulum_double")
    base = [Unknown(name, cell.parameters[cell.index(name)].default, width) for name, width in widths.items()]
    base += [Unknown(f"joint{i}@sensing@offset", 0.0, 0.003) for i in (1, 2)]
    viscous = [Unknown("joint1@dyna@damping", 0.0002, 0.0002), Unknown("joint2@dyna@damping", 0.00003, 0.00003)]
    friction = [dry("joint1", 0.0004), dry("joint2", 0.0002)]
    air = [drag("link1", 0.02), drag("link2", 0.02)]
    none = {"joint1@dyna@damping": 0.0, "joint2@dyna@damping": 0.0}
    return (
        law("viscous", (*base, *viscous), (), {}),
        law("viscous and dry", (*base, *viscous), friction, {}),
        law("dry and drag of the air", base, (*friction, *air), none),
    )


def single(out: Path, data: Path | None, say: Say, swings: int = 4) -> Study:
    """The single pendulum: 4 swings of 9.2 s to fit, 2 to judge."""
    return study("pendulum_single", single_laws(), 1.0, out, data, say, swings)


def double(out: Path, data: Path | None, say: Say, swings: int = 26) -> Study:
    """The double pendulum: 26 swings of 2.7 s to fit, 4 to judge."""
    return study("pendulum_double", double_laws(), 1.333, out, data, say, swings)


def study(name: str, laws: Sequence[Law], piece_s: float, out: Path, data: Path | None, say: Say, swings: int) -> Study:
    """Fit every law on pieces of the swings named `fit_*` (the first `swings`), judge on those named `validation_*`."""
    cell = load(name)
    recorded = episodes(cell, name, out, data)
    to_fit = [e for e in recorded if e.name.startswith("fit")][:swings]
    cut = [piece for episode in to_fit for piece in pieces(cell, episode, piece_s)]
    unseen = [e for e in recorded if e.name.startswith("validation")]
    authors = Simulator(cell)
    rows: list[tuple[str, ...]] = [
        ("authors' parameters", "", "", *judged(authors, authors.defaults, cell, unseen), "")
    ]
    found: list[Fitted] = []
    for one in laws:
        say(f"{name}: {one.name}")
        fitted = fit(Simulator(cell, one.effects), cut, one.unknowns, True, one.fixed)
        found.append(fitted)
        rows.append(_row(one, fitted, found[0], cell, unseen))
    evidence = [gain(f, found[0]) for f in found]  # of the fitted pieces alone: validation does not choose
    best = int(np.argmax(evidence))
    rivals = [
        one.name for one, e in zip(laws, evidence, strict=True) if evidence[best] - e < CLEAR and one is not laws[best]
    ]
    columns: tuple[str, ...] = ("friction", f"fitted pieces of {piece_s:g} s", "log evidence over viscous")
    columns += ("validation, first state as stated", "from the first 20 ms", "first state free", "coefficients")
    title = f"{name}: rms on the validation swings [mrad]"
    sentence = f"The swings prefer {laws[best].name}: {_coefficients(laws[best], found[best])}."
    told = f"Not told apart from it by the fitted pieces: {', '.join(rivals) or 'nothing else that was tried'}."
    return Study(name, (sentence, told), (Table(title, columns, tuple(rows)),))


def pieces(cell: Cell, episode: Episode, seconds: float) -> list[Episode]:
    """An episode cut into pieces that begin with angle and rate of their own first frames; a last rest is dropped."""
    stamps = episode.tracks[0].stamp_ns
    frames = round(seconds * 1e9 / float(stamps[1] - stamps[0]))
    out = []
    for first in range(0, len(stamps) - frames + 1, frames):
        own = slice(first, first + frames)
        tracks = tuple(replace(t, stamp_ns=t.stamp_ns[own], value=t.value[own], std=None) for t in episode.tracks)
        name = f"{episode.name}_{first // frames}"
        out.append(at_first_frames(cell, replace(episode, name=name, start_ns=int(stamps[first]), tracks=tracks)))
    return [thinned(piece, EVERY) for piece in out]


def at_first_frames(cell: Cell, episode: Episode) -> Episode:
    """The same, beginning with what its first frames say instead of what was stated."""
    inputs = cell.inputs(replace(episode, initial_state={}))
    states = {o.name: (float(inputs[2 * i]), float(inputs[2 * i + 1])) for i, o in enumerate(cell.objects)}
    return replace(episode, initial_state=states)


def judged(simulator: Simulator, values: Floats, cell: Cell, unseen: Sequence[Episode]) -> tuple[str, str, str]:
    """The three judgements of whole swings [mrad]."""
    stated = [thinned(episode, EVERY) for episode in unseen]
    seen = [thinned(at_first_frames(cell, episode), EVERY) for episode in unseen]
    free = [with_free_start(simulator, values, [episode]).residual for episode in seen]
    first, second, third = (
        several([MRAD * _absolute(r) for r in residuals])
        for residuals in (residual_at(simulator, values, stated), residual_at(simulator, values, seen), free)
    )
    return first, second, third


def _absolute(residual: Floats) -> float:
    """Root mean square over absolute angles, as the authors count: a joint's error moves the links after it too."""
    return float(np.sqrt(np.nanmean(np.cumsum(residual, axis=-1) ** 2)))


def _row(one: Law, fitted: Fitted, first: Fitted, cell: Cell, unseen: Sequence[Episode]) -> tuple[str, ...]:
    rms = f"{MRAD * float(np.sqrt(np.mean(fitted.rms**2))):.2f}"
    evidence = f"{gain(fitted, first):.0f}"
    judgement = judged(fitted.simulator, fitted.values, cell, unseen)
    return (one.name, rms, evidence, *judgement, _coefficients(one, fitted))


def _coefficients(one: Law, fitted: Fitted) -> str:
    of_friction = [u.name for u in one.unknowns if "@dyna@damping" in u.name or u.name.count("@dyna@") == 0]
    named = [n for n in of_friction if "offset" not in n]
    units = {p.name: p.unit for p in fitted.simulator.parameters}
    return "; ".join(f"{n} {with_error(fitted.value(n), fitted.std[n])} {_unit(n, units[n])}" for n in named)


def _unit(name: str, unit: str) -> str:
    """Dry friction on a joint is a torque."""
    return "N m" if name.startswith("joint") and "coulomb" in name else unit
