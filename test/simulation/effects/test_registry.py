"""All effects alike: absent at zero to the last bit, sane numbers, and documentation that names every one of them."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from compass_ros.errors import ConfigError
from compass_ros.reporting.markdown import between
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Effect, effect
from compass_ros.types import Floats
from scripts.effects_table import BEGIN, END, PAGE, formula, table
from test.simulation.table import DESCRIBED, WIDE, attached, cell, simulator, values

UNITS = {"1", "m", "s", "rad", "Hz", "rad/s", "m/s", "m/s^2", "1/m", "1/s", "s/m", "1/m^2", "N m/rad"}
UNITS |= {"s^2", "N", "N m", "N/m", "kg", "kg m", "kg m^2", "rad/N m", "1/N^2 m^2"}
NAMES = {
    "dynamics": "table_tilt viscous_drag quadratic_drag crosswind fan_field swirl point_attraction friction_patch "
    "friction_gradient anisotropic_friction stribeck_friction coulomb_friction magnus pulsating_lift spring "
    "asymmetric_friction load_dependent_friction cogging joint_elasticity backlash gravity_tilt payload wind buoyancy "
    "pair_attraction tether parameter",
    "contact": "rate_dependent_restitution tangential_impulse local_wall off_centre_mass friction_cone "
    "adhesion rolling_resistance",
    "actuation": "actuation_delay first_order_lag velocity_saturation dead_band heading_bias stroke_jitter "
    "torque_saturation rate_limit gain_error hysteresis",
    "sensing": "camera_latency camera_scale camera_rotation lens_distortion rolling_shutter tracking_lag clock_drift "
    "latency scale offset rotation eccentricity",
}
TWICE = {"dead_band", "joint_elasticity", "stribeck_friction", "torque_saturation"}
"""Laws with two hooks: a dead band by the kind of drive; of a gear and of a joint's friction the scene has springs,
of a drive its limit."""
SHOTS = np.vstack([DESCRIBED, WIDE[:1]])


def seen(kind: Effect, numbers: Floats) -> Floats:
    """(N, S, F, C) what the camera sees of both shots for (N, q) numbers."""
    changed = Simulator(cell(), [attached(kind)], threads=1)
    given = np.hstack([values(count=len(numbers)), numbers])
    times = np.linspace(0, 1.5, 40)
    tiled = np.repeat(given, len(SHOTS), axis=0), np.tile(SHOTS, (len(given), 1)), np.tile(times, (2 * len(given), 1))
    return changed.observe(*tiled).reshape(len(numbers), len(SHOTS), len(times), -1)


@pytest.fixture(scope="module")
def plain() -> Floats:
    return simulator().observe(values(count=2), SHOTS, np.tile(np.linspace(0, 1.5, 40), (2, 1)))


ON_THE_TABLE = [name for name, kind in EFFECTS.items() if simulator().accepts(kind, attached(kind).objects)]


@pytest.mark.parametrize("name", ON_THE_TABLE)
def test_an_effect_is_absent_at_zero_and_acts_within_its_bounds(name: str, plain: Floats) -> None:
    """Zero amplitudes: the same bits, also beside a rollout that has the effect. Bounds: finite, and not the same."""
    kind = EFFECTS[name]
    low, high, start = np.array([(q.low, q.high, q.start) for q in kind.quantities]).T
    amplitude = np.array([q.amplitude for q in kind.quantities])
    zero = np.where(amplitude, 0.0, start)
    batch = np.stack([zero, np.where(amplitude, 0.5 * high, start), high, np.where(amplitude, low, start)])
    found = seen(kind, batch)
    assert (found[0] == plain).all()
    assert (seen(kind, zero[None])[0] == plain).all()
    assert np.isfinite(found).all()
    if name != "friction_cone":  # contacts of the table have no friction of their own
        assert np.abs(found[1] - plain).max() > 1e-4


@pytest.mark.parametrize("channel", NAMES)
def test_the_names_that_others_build_on_are_there(channel: str) -> None:
    assert [name for name, e in EFFECTS.items() if e.channel == channel] == NAMES[channel].split()
    assert all(EFFECTS[name].name == name for name in EFFECTS)


def test_an_unknown_effect_gets_the_nearest_name() -> None:
    with pytest.raises(ConfigError, match=r"unknown effect 'magnuss'.*did you mean 'magnus'"):
        effect("magnuss")


@pytest.mark.parametrize("name", EFFECTS)
def test_quantities_are_sane(name: str) -> None:
    kind = EFFECTS[name]
    hooks = (kind.forces, kind.model, kind.controls, kind.sensing)
    assert sum(hook is not None for hook in hooks) == (2 if name in TWICE else 1)
    assert any(q.amplitude for q in kind.quantities)
    for q in kind.quantities:
        assert q.unit in UNITS
        assert q.low <= q.start <= q.high
        assert q.low < q.high
        assert 0 < q.scale <= q.high - q.low
        assert not q.amplitude or (q.start == 0 and q.low <= 0 <= q.high)


@pytest.mark.parametrize("name", EFFECTS)
def test_the_formula_names_every_quantity_and_the_text_its_source(name: str) -> None:
    text = sys.modules[f"compass_ros.simulation.effects.{name}"].__doc__
    assert text is not None
    assert "Source:" in text
    for q in EFFECTS[name].quantities:
        stem = "centre" if q.name.startswith("centre_") else q.name
        assert stem in formula(name), f"{name}: {stem}"


def test_the_documented_table_is_that_of_the_registry() -> None:
    """`python scripts/effects_table.py` writes it anew."""
    assert between(PAGE.read_text(encoding="utf-8"), BEGIN, END) == table()
