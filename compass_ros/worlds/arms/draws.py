"""Laws of joints at random: sites and sizes. Ranges are from each law's source, scaled to the arm at hand.

Nothing is asked of the suite's simulator, and nothing is drawn again because it is faint.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.chain import mass_matrix
from compass_ros.worlds.arms.law import Law
from compass_ros.worlds.arms.laws.bodies import LooseBase, Payload, TiltedBase
from compass_ros.worlds.arms.laws.bristles import Dahl, LuGre
from compass_ros.worlds.arms.laws.curves import SKEWS, LoadFriction, PlaceFriction, SkewFriction, StribeckCurve
from compass_ros.worlds.arms.laws.encoders import MagnetOffCentre, SlowClock
from compass_ros.worlds.arms.laws.fields import BalanceSpring, Cogging, DressPack, EddyBrake
from compass_ros.worlds.arms.laws.gears import FlexibleGear, Play, TransmissionError
from compass_ros.worlds.arms.laws.servos import (
    CommandPlay,
    ComplianceMargin,
    LineLatency,
    ProfileSpeed,
    SaggingDrive,
    Smoothing,
)
from compass_ros.worlds.arms.laws.thermal import WarmingUp
from compass_ros.worlds.draw import log_uniform, sites


@dataclass(frozen=True)
class Use:
    """An arm and how it is used; what sizes go by."""

    arm: Arm
    torque: Floats
    """(J,) of gravity on it, about [N m]."""
    carried: Floats
    """(J,) that its gears carry, about [N m]: of an arm without drives, what rotors need and rub."""
    peak: Floats
    """(J,) largest torque of its drives [N m]."""
    speed: Floats
    """(J,) rms [rad/s]."""
    fastest: Floats
    """(J,) [rad/s]"""
    noise: float
    """Of an encoder [rad]."""
    tool: Floats
    """(3,) where the last link holds things, in its frame [m]."""
    load: tuple[float, float]
    """Lightest and heaviest payload [kg]."""
    share: float = 1.0
    """Factor on sizes of torques and tilts: what swings by itself shows small ones, stiff servos only large ones."""

    def sizes(self, rng: Generator, low: float, high: float, count: int | None = None) -> Floats:
        """Uniform in the logarithm between shares of these."""
        return self.share * log_uniform(rng, low, high, count)

    def inertia(self, joints: list[int]) -> Floats:
        """(S,) of rotor and link against each other at angle zero [kg m^2]."""
        rotor = self.arm.armature[self.arm.hinge]
        link = np.diag(mass_matrix(np.zeros(len(self.arm.mass)), self.arm.armature, *self.arm.chain)) - rotor
        return np.asarray((rotor * link / (rotor + link))[joints])


Draw = Callable[[Use, Generator], Law]


def _at(use: Use, rng: Generator) -> tuple[tuple[int, ...], list[int], int]:
    at = sites(rng, range(len(use.arm.joints)))
    return at, list(at), len(at)


def lugre(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    coulomb = use.arm.dry[own]
    bristle = log_uniform(rng, 3e-4, 2e-3, n)
    micro = np.sqrt(coulomb / bristle * use.arm.armature[own]) * rng.uniform(0.3, 1, n)
    static = coulomb * (1 + use.sizes(rng, 0.1, 1, n))
    return LuGre(at, coulomb, static, log_uniform(rng, 0.02, 0.15, n), bristle, micro)


def dahl(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    return Dahl(at, use.arm.dry[own] * use.sizes(rng, 0.5, 4, n), log_uniform(rng, 0.02, 0.08, n))


def stribeck(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    return StribeckCurve(at, use.arm.dry[own] * use.sizes(rng, 0.15, 1.2, n), log_uniform(rng, 0.02, 0.2, n))


def load(use: Use, rng: Generator) -> Law:
    at, _, n = _at(use, rng)
    share = log_uniform(rng, 0.02, 0.15, n)
    return LoadFriction(at, share, share * rng.uniform(0, 1.5, n))


def skew(use: Use, rng: Generator) -> Law:
    at, _, n = _at(use, rng)
    return SkewFriction(at, rng.choice(np.abs(SKEWS), n) * rng.choice([-1, 1], n))


def place(use: Use, rng: Generator) -> Law:
    at, _, n = _at(use, rng)
    return PlaceFriction(at, rng.uniform(0.3, 0.9, n), rng.uniform(-np.pi, np.pi, n))


def warming(use: Use, rng: Generator) -> Law:
    at, _, n = _at(use, rng)
    return WarmingUp(at, use.sizes(rng, 0.3, 2, n), float(log_uniform(rng, 300, 1500)))


def cogging(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    harmonics = np.column_stack([np.ones(n), rng.uniform(0.2, 0.6, n), rng.uniform(0, 0.3, n)])
    teeth = rng.integers(4, 25, n).astype(float)
    return Cogging(
        at, use.arm.dry[own] * use.sizes(rng, 0.2, 2, n), teeth, harmonics, rng.uniform(-np.pi, np.pi, (n, 3))
    )


def balance(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    base = rng.uniform(0.06, 0.15, n)
    link = base * rng.uniform(0.5, 0.8, n)
    rate = use.torque[own] * use.sizes(rng, 0.03, 0.3, n) / (0.6 * base * link)
    return BalanceSpring(at, rate, base, link, 0.5 * base, rng.uniform(-np.pi, np.pi, n))


def dress(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    linear = use.torque[own] * use.sizes(rng, 0.02, 0.3, n)
    return DressPack(at, linear, linear * rng.uniform(0.3, 2, n), rng.uniform(-0.5, 0.5, n))


def eddy(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    return EddyBrake(at, use.arm.dry[own] * use.sizes(rng, 0.5, 4, n), use.speed[own] * rng.uniform(0.3, 1, n))


def flexible(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    twist = use.noise * log_uniform(rng, 2, 25, n)
    stiffness = use.carried[own] / twist
    damping = 2 * rng.uniform(0.03, 0.1, n) * np.sqrt(stiffness * use.inertia(own))
    bristle = twist * rng.uniform(0.2, 0.6, n)
    second = np.column_stack([rng.uniform(1.3, 1.6, n), rng.uniform(1.6, 1.8, n)])
    ends = np.outer(use.carried[own], [0.4, 1.2])
    return FlexibleGear(at, stiffness, second, ends, damping, stiffness * bristle * rng.uniform(0.1, 0.4, n), bristle)


def play(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    gap = use.noise * log_uniform(rng, 3, 30, n)
    stiffness = 5 * use.carried[own] / gap
    return Play(at, gap, stiffness, 2 * rng.uniform(0.05, 0.2, n) * np.sqrt(stiffness * use.inertia(own)))


def transmission(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    first = use.noise * log_uniform(rng, 1.5, 10, n)
    stiffness = 4 * use.carried[own] / use.noise
    damping = 2 * rng.uniform(0.05, 0.2, n) * np.sqrt(stiffness * use.inertia(own))
    size = np.column_stack([first, first * rng.uniform(0.1, 0.4, n)])
    waves = 2.0 * rng.choice([30, 50, 80, 100], n)
    return TransmissionError(at, size, waves, rng.uniform(-np.pi, np.pi, (n, 2)), stiffness, damping)


def payload(use: Use, rng: Generator) -> Law:
    turn, aside = rng.uniform(-np.pi, np.pi), rng.uniform(0.02, 0.06)
    at = use.tool + aside * np.array([np.cos(turn), np.sin(turn), 0.0])
    return Payload((), float(log_uniform(rng, *use.load)), at, 0.02)


def tilted(use: Use, rng: Generator) -> Law:
    turn = rng.uniform(-np.pi, np.pi)
    return TiltedBase((), use.sizes(rng, 0.004, 0.04) * np.array([np.cos(turn), np.sin(turn)]))


def loose(use: Use, rng: Generator) -> Law:
    swing = np.cumsum(use.arm.origin, axis=0)  # lengths of the links, not places: an upper bound is enough for a scale
    total = float(np.sum(use.arm.mass * np.maximum(np.sum(swing**2, axis=1), 0.01)))
    foot = total * rng.uniform(0.1, 0.5)
    stiffness = (total + foot) * (2 * np.pi * log_uniform(rng, 1.5, 8, 2)) ** 2 / use.share
    return LooseBase((), stiffness, 2 * rng.uniform(0.03, 0.1) * np.sqrt(stiffness * (total + foot)), foot)


def sagging(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    stall = use.peak[own] * rng.uniform(0.6, 1.1, n)
    return SaggingDrive(at, stall, use.fastest[own] * rng.uniform(2, 5, n), float(rng.uniform(0.05, 0.3)))


def margin(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    error = use.carried[own] / use.arm.stiffness[own]  # as large as it is in use: a smaller margin is never entered
    return ComplianceMargin(at, error * log_uniform(rng, 0.1, 1.5, n))


def command_play(use: Use, rng: Generator) -> Law:
    at, _, n = _at(use, rng)
    return CommandPlay(at, use.noise * log_uniform(rng, 3, 30, n))


def latency(use: Use, rng: Generator) -> Law:
    return LineLatency((), float(log_uniform(rng, 0.004, 0.04)))


def profile(use: Use, rng: Generator) -> Law:
    at, own, n = _at(use, rng)
    return ProfileSpeed(at, use.fastest[own] * rng.uniform(0.4, 0.95, n))


def smoothing(use: Use, rng: Generator) -> Law:
    at, _, n = _at(use, rng)
    return Smoothing(at, log_uniform(rng, 0.006, 0.05, n))


def magnet(use: Use, rng: Generator) -> Law:
    at, _, n = _at(use, rng)
    first = use.noise * log_uniform(rng, 1.5, 25, n)
    return MagnetOffCentre(
        at, np.column_stack([first, first * rng.uniform(0.1, 0.4, n)]), rng.uniform(-np.pi, np.pi, (n, 2))
    )


def clock(use: Use, rng: Generator) -> Law:
    return SlowClock((), float(log_uniform(rng, 5e-4, 1e-2)))


Named = Mapping[str, Draw]
FRICTION: Named = {"lugre_friction": lugre, "stribeck_curve": stribeck, "skew_friction": skew}
FIELDS: Named = {"cogging_harmonics": cogging, "balance_spring": balance, "dress_pack": dress}
GEARS: Named = {"flexible_gear": flexible, "gear_play": play}
BODIES: Named = {"payload_ball": payload, "tilted_base": tilted}
SERVOS: Named = {"sagging_drive": sagging, "compliance_margin": margin, "command_play": command_play,
                 "profile_speed": profile}  # fmt: skip
LATE: Named = {"line_latency": latency, "smoothing": smoothing}
SENSING: Named = {"magnet_off_centre": magnet}
CLOCK: Named = {"slow_clock": clock}
LOAD: Named = {"load_friction": load}
STRANGE: Named = {"dahl_harness": dahl, "warming_up": warming, "place_friction": place, "loose_base": loose}
BRAKE: Named = {"eddy_brake": eddy}
GEAR_ERROR: Named = {"transmission_error": transmission}
