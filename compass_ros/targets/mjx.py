"""Laws as a Python file for MJX, MuJoCo in JAX: forces as pure functions of a model and its data.

The file is `mjx_laws.py` beside this one with the laws' numbers in it. It needs jax and mujoco-mjx, nothing of ours.
"""

from __future__ import annotations

import copy
import pprint
from collections.abc import Iterator, Mapping
from pathlib import Path

import mujoco
import numpy as np

from compass_ros.cells.rotors import rotors
from compass_ros.simulation.effects import Exported, FittedEffect
from compass_ros.simulation.effects.attach import context_in
from compass_ros.simulation.effects.effect import RESTORED, table_friction
from compass_ros.simulation.native.program import SLIDING, Kind, Term
from compass_ros.simulation.site_kinds import JOINTS, PLANAR
from compass_ros.simulation.sites import Places
from compass_ros.targets.said import Said
from compass_ros.types import Floats

SOURCE = Path(__file__).with_name("mjx_laws.py")
_NO_TERMS = "TERMS: tuple[Term, ...] = ()"
_UNCHANGED = "CHANGED: dict[str, Any] = {}"
_DRY = (Kind.COULOMB, Kind.STRIBECK, Kind.ASYMMETRIC, Kind.LOAD_FRICTION)
_NO_PLACE = "MJX offers no place between its contacts and their solver"
_REPLACES = "it replaces a drive's own force, which MJX computes after the applied ones"
_UNSAID: Mapping[Kind, str] = {
    Kind.RATE_RESTITUTION: _NO_PLACE,
    Kind.TANGENTIAL: _NO_PLACE,
    Kind.ROLLING: _NO_PLACE,
    Kind.ADHESION: _NO_PLACE,
    Kind.TORQUE_SPEED: _REPLACES,
    Kind.SERVO_DEAD_BAND: _REPLACES,
}


def write_mjx(scene: Path, exported: Exported, out: Path) -> tuple[Said, ...]:
    """Write the laws of a written scene, by the names that it has; what became of each."""
    model = mujoco.MjModel.from_xml_path(str(scene))
    places = Places(model, frozenset(exported.sliding))
    terms = [table_friction(sliding, places) for sliding in exported.sliding.values()]
    said = [Said("friction of the table", (name,), "exact") for name in exported.sliding]
    changed = copy.copy(model)
    for fitted in exported.effects:
        own, what = _of(fitted, places, exported, changed)
        terms += own
        said.append(what)
    text = SOURCE.read_text(encoding="utf-8")
    said_terms = "".join(f"    {line},\n" for line in map(as_code, terms))
    text = text.replace(_NO_TERMS, f"TERMS: tuple[Term, ...] = (\n{said_terms})" if terms else _NO_TERMS)
    differences = {name: value.tolist() for name, value in _differences(model, changed)}
    if differences:
        text = text.replace(_UNCHANGED, f"CHANGED: dict[str, Any] = {pprint.pformat(differences, width=120)}")
    out.write_text(text, encoding="utf-8")
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4 and terms:
        said.append(Said("forces", (), "alike", "held during a step of Runge and Kutta"))
    return tuple(said)


def _of(fitted: FittedEffect, places: Places, exported: Exported, changed: mujoco.MjModel) -> tuple[list[Term], Said]:
    """Terms of one law, or its change of the model; and what became of it."""
    law, on = fitted.attached.effect, fitted.attached.objects
    outside = "acts on commands" if law.controls is not None else "acts on what a sensor says"
    if law.forces is None and law.model is None:
        return [], Said(law.name, on, "left out", f"{outside}, outside of the model")
    motor = law.rotor or (rotors(changed) and law.model is not None)
    if law.scattered or motor:
        why = "a motor's joint of its own, not tried in MJX" if motor else "other numbers in each episode, by chance"
        return [], Said(law.name, on, "left out", why)
    context = context_in(places, exported, fitted)
    terms = list(law.forces(np.array([fitted.values]), context)) if law.forces is not None else []
    if law.model is not None and not terms:
        law.model(changed, np.array(fitted.values), context)
        return [], Said(law.name, on, "exact", "by `prepare`")
    unsaid = [why for term in terms if (why := _unsaid(term))]
    if unsaid or not terms:
        return [], Said(law.name, on, "left out", (unsaid or [f"{outside}, outside of the model"])[0])
    if any(term.kind in _DRY and term.site is not None and term.site.kind in JOINTS for term in terms):
        creeps = "whole from the speed that it stops in a step; what it holds creeps"
        springs = ", where it should be a spring" if law.spring and any(fitted.values[2:]) else ""
        return terms, Said(law.name, on, "alike", creeps + springs)
    return terms, Said(law.name, on, "exact")


def _unsaid(term: Term) -> str:
    """Why MJX cannot have a term; empty: it can."""
    of_contacts = term.kind in SLIDING and term.site is not None and term.site.kind == "body"
    return _NO_PLACE if of_contacts else _UNSAID.get(term.kind, "")


def placed(term: Term) -> tuple[str, str, tuple[str, ...]]:
    """Kind, placement and names of a term, as `mjx_laws.Term` has them."""
    if term.site is None:
        raise ValueError(f"{term.kind.name}: a law of contacts is no force for MJX")
    kind = term.site.kind
    on = "joint" if kind in JOINTS else "pair" if kind == "body_pair" else "planar" if kind in PLANAR else "body"
    return term.kind.name.lower(), on, term.site.names


def as_code(term: Term) -> str:
    """A term with the numbers of the first rollout, as Python."""
    kind, on, names = placed(term)
    numbers = ", ".join(repr(float(number)) for number in term.numbers[0])
    return f"Term({kind!r}, {on!r}, {names!r}, ({numbers},))".replace("'", '"')


def _differences(before: mujoco.MjModel, after: mujoco.MjModel) -> Iterator[tuple[str, Floats]]:
    """Arrays of a model that laws have changed, and the friction cone."""
    for name in RESTORED:
        one, other = getattr(before, name), getattr(after, name)
        if not np.array_equal(one, other):
            yield name, np.array(other)
    if before.opt.cone != after.opt.cone:
        yield "cone", np.array(after.opt.cone)
