"""Which of the models of a race are fitted to all episodes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

from compass_ros.discovery.fits import Begun
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.neighbours import probable
from compass_ros.discovery.odds import Prior
from compass_ros.simulation.effects import Attached, effect
from test.discovery.planted import PUCKS

LAWS = "wind", "viscous_drag", "quadratic_drag", "fan_field", "swirl", "anisotropic_friction", "gravity_tilt"
PRIOR = Prior(dict.fromkeys(LAWS, 1))


def begun(name: str, left: float, log_evidence: float) -> Begun:
    """A fit that leaves half a sum of squares, and the log evidence of its model."""
    point = SimpleNamespace(cost=left)
    model = SimpleNamespace(fit=SimpleNamespace(point=point), log_evidence=log_evidence)
    return Begun((Attached(effect(name), PUCKS),), cast("Hypothesis", model))


def chosen(*models: Begun) -> list[str]:
    return [one.laws[0].effect.name for one in probable(models, PRIOR)]


def test_the_evidence_decides_and_not_what_a_fit_leaves() -> None:
    """Of falling whiffle balls a wind leaves 1,644 and a drag 2,093, and the drag's evidence is higher by 170."""
    wind, drag = begun("wind", 1644.0, -371.0), begun("viscous_drag", 2093.0, -200.0)
    others = [begun(name, 1700.0, -500.0) for name in ("fan_field", "swirl")]
    assert chosen(wind, *others, drag) == ["viscous_drag", "wind"]
    alike = [begun("quadratic_drag", 5000.0, -204.0)]
    assert chosen(wind, *alike, drag) == ["viscous_drag", "quadratic_drag"]


def test_of_two_fits_of_one_law_the_more_probable_one_is_taken() -> None:
    """Friction by direction under a bar, on three episodes: raced it leaves 926.5, from the parent 927.5, where its log
    evidence is 17 more. By the first of them it would be given up for a tilt; on all episodes it is 22 above that."""
    raced, from_parent = begun("anisotropic_friction", 926.5, -943.6), begun("anisotropic_friction", 927.5, -926.9)
    tilt, wind = begun("gravity_tilt", 891.6, -921.7), begun("wind", 909.8, -930.3)
    assert probable([raced, wind, from_parent, tilt], PRIOR)[:2] == [tilt, from_parent]
