"""The sentence of a verdict says how much, with units, and where."""

from __future__ import annotations

import numpy as np

from compass_ros.discovery.words import place, value_of, values_of, where_of
from compass_ros.simulation.effects import EFFECTS, Attached, effect
from compass_ros.simulation.extents import unit_body
from compass_ros.simulation.sizes import unit_joint
from compass_ros.types import EffectFinding, EffectParameter, Evidence


def test_every_amplitude_is_said_and_shapes_that_are_known_but_for_a_region() -> None:
    numbers = {"tilt_x": EffectParameter(3.1e-3, 5e-5, "rad"), "tilt_y": EffectParameter(-4e-3, 5e-5, "rad")}
    tilt = EffectFinding("table_tilt", numbers, Evidence(0.9, 100.0, 0.001), ())
    said = "table_tilt, tilt_x 0.0031 +- 5e-05 rad, tilt_y -0.004 +- 5e-05 rad"
    assert value_of(tilt, Attached(EFFECTS["table_tilt"], ("puck1",)), told=False) == said
    assert value_of(tilt, Attached(EFFECTS["table_tilt"], ("puck1",)), told=True) == said.replace(",", " of puck1,", 1)

    swirl = EFFECTS["swirl"]
    found = {q.name: EffectParameter(0.25, 0.01, q.unit) for q in swirl.quantities}
    finding = EffectFinding("swirl", found, Evidence(0.9, 100.0, 0.001), ())
    words = value_of(finding, Attached(swirl, ("puck1",)), told=False)
    assert words == "swirl, strength 0.25 +- 0.01 m/s^2, tail 0.25 +- 0.01"

    cogging = Attached(EFFECTS["cogging"], ("j",))
    given = {f"{wave}{n}": (0.0, 1e-5) for wave in ("cosine", "sine") for n in ("", "_2", "_3")}
    given["cosine"] = (0.0064, 2e-5)
    for std, sure in ((0.02, True), (20.0, False)):
        known = given | {"periods": (42.0, std)}
        found = {q.name: EffectParameter(*known[q.name], q.unit) for q in cogging.effect.quantities}
        words = value_of(EffectFinding("cogging", found, Evidence(0.9, 100.0, 0.001), ()), cogging, told=False)
        assert words.startswith("cogging, cosine 0.0064 +- 2e-05")
        assert ("periods 42 +- 0.02" in words) is sure


def test_of_numbers_that_each_episode_has_it_says_that_they_spread() -> None:
    magnus = Attached(effect("magnus").at(unit_body(turns=False)), ("ball",))
    numbers = {q.name: EffectParameter(0.02, 0.003, q.unit) for q in magnus.effect.quantities}
    words = value_of(EffectFinding("magnus", numbers, Evidence(0.9, 100.0, 0.001), ()), magnus, told=False)
    assert words.startswith("magnus, rate_x 0.02 +- 0.003 1/s, rate_y")
    assert words.endswith("(standard deviations over episodes, each of which has its own)")


def test_what_is_not_told_from_zero_stands_last() -> None:
    numbers = {"mass": EffectParameter(0.0, 0.5, "kg")}
    numbers |= {f"moment_{axis}": EffectParameter(-4e-3, 1e-5, "kg m") for axis in "xyz"}
    load = EffectFinding("payload", numbers, Evidence(0.9, 100.0, 0.001), ())
    moments = ", ".join(f"moment_{axis} -0.004 +- 1e-05 kg m" for axis in "xyz")
    said = value_of(load, Attached(EFFECTS["payload"], ("tool",)), told=False)
    assert said == f"payload, {moments} (not told from 0: mass 0 +- 0.5 kg)"
    wide = {name: EffectParameter(one.value, 1.0, one.unit) for name, one in numbers.items()}
    open_ = EffectFinding("payload", wide, Evidence(0.9, 100.0, 0.001), ())
    assert value_of(open_, Attached(EFFECTS["payload"], ("tool",)), told=False).endswith("with other numbers)")


def test_a_field_on_one_of_two_pucks_has_a_place() -> None:
    fan = Attached(EFFECTS["fan_field"], ("puck1",))
    given = {"strength": 0.2, "centre_x": 0.02, "centre_y": -0.01, "radius": 0.12}
    numbers = [given.get(q.name, q.start) for q in fan.effect.quantities]
    where = where_of([fan], np.array(numbers), ("puck1", "puck2"))
    assert place(where) == "On free slides of puck1, within 12 cm of (0.02, -0.01)"
    both = where_of([Attached(fan.effect, ("puck1", "puck2"))], np.array(numbers), ("puck1", "puck2"))
    assert place(both).startswith("On free slides, within")


def test_several_sites_are_listed() -> None:
    latency = Attached(EFFECTS["latency"], ("joints.a", "joints.b", "joints.c"))
    numbers = np.array([q.start for q in latency.effect.quantities])
    assert place(where_of([latency], numbers, ("a", "b", "c")), flat=False) == "In joints.a, joints.b and joints.c"
    load = Attached(EFFECTS["payload"], ("tool",))
    numbers = np.array([q.start for q in load.effect.quantities])
    assert place(where_of([load], numbers, ("a", "b", "c")), flat=False) == "In the motion of tool"


def test_a_law_on_many_sites_is_said_by_how_far_it_reaches() -> None:
    law = effect("viscous_drag").at(unit_joint("hinge"))
    (quantity,) = law.quantities

    def found(value: float) -> EffectFinding:
        parameters = {quantity.name: EffectParameter(value, 0.01, quantity.unit)}
        return EffectFinding(law.name, parameters, Evidence(0.9, 100.0, 0.001), ())

    laws, findings = [Attached(law, (name,)) for name in "abc"], [found(v) for v in (0.3, -0.1, 0.2)]
    unit = quantity.unit
    assert values_of(findings, laws) == f"viscous_drag, {quantity.name} -0.1 to 0.3 {unit} on 3 sites"
    first = f"viscous_drag of a, {quantity.name} 0.3 +- 0.01 {unit}"
    assert values_of(findings[:2], laws[:2]) == f"{first}; viscous_drag of b, {quantity.name} -0.1 +- 0.01 {unit}"
    assert values_of(findings[:1], laws[:1]) == first.replace(" of a", "")
