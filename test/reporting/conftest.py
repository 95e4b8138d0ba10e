"""A made-up calibration of an air-hockey cell: 64 parameters, 12 episodes, a planted push from the table's centre.

The motion is a small planar toy (friction, walls, one collision), enough for curves that look and err like real ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from compass_ros.reporting import Candidate, ReportExtras, Scene, Shape
from compass_ros.types import (
    Budget,
    EffectFinding,
    EffectParameter,
    Evidence,
    ExplainedLaw,
    Explanation,
    Floats,
    Gap,
    Graph,
    HeldOut,
    Iteration,
    Mismatch,
    ParameterRow,
    Region,
    Replay,
    ReplayedTrack,
    Result,
    SignalGap,
    Verdict,
    Where,
)

FACTORS = ("puck1", "puck2")
OBJECTS = (
    "puck1",
    "puck2",
    "pusher",
    "front_wall",
    "back_wall",
    "left_wall",
    "right_wall",
    "obstacle",
    "goal",
    "table",
)
KINDS = (
    ("dyna@damping", "1/s", -10.0, -20.0, -1.0),
    ("dyna@friction_sliding", "1", 0.05, 0.005, 0.2),
    ("dyna@friction_torsional", "m", 0.005, 0.0, 0.05),
    ("dyna@friction_rolling", "m", 1e-4, 0.0, 1e-3),
    ("dyna@mass", "kg", 0.02, 0.005, 0.08),
    ("geom@size", "m", 0.0255, 0.024, 0.027),
)
FOUND = {
    "pusher@actuation@vel_discount": (0.8463, 0.0031, 0.85),
    "pusher@dyna@damping": (-6.4, 0.9, -6.0),
    "puck1@dyna@damping": (-6.11, 0.24, -6.0),
    "puck1@dyna@friction_sliding": (0.0402, 0.0006, 0.04),
    "puck2@dyna@damping": (-5.8, 0.31, -6.0),
    "puck2@dyna@friction_sliding": (0.0304, 0.0009, 0.03),
    "right_wall@dyna@damping": (-6.2, 0.42, -6.0),
    "front_wall@dyna@damping": (-8.9, 3.1, -6.0),
    "env@camera@bias_x": (0.03004, 0.00012, 0.03),
    "env@camera@bias_y": (-0.01993, 0.00011, -0.02),
}
DOUBTFUL = ("front_wall@dyna@damping", "pusher@dyna@damping")
SENTENCE = (
    "On free slides of both pucks, within 12 cm of (0.02, -0.01), the simulator lacks an outward push; "
    "fan_field, 0.21 +- 0.01 m/s2; held-out error 19.6 -> 1.0 mm, floor 1.0 mm."
)


def parameter_rows() -> tuple[ParameterRow, ...]:
    """64 rows in the paper's spelling; the ten of FOUND are active."""
    known: list[tuple[str, str, float, float, float]] = [
        ("pusher@actuation@vel_discount", "1", 0.75, 0.5, 1.0),
        ("env@camera@bias_x", "m", 0.0, -0.05, 0.05),
        ("env@camera@bias_y", "m", 0.0, -0.05, 0.05),
        ("env@camera@rotation", "rad", 0.0, -0.1, 0.1),
    ]
    known += [(f"{o}@{kind}", unit, default, low, high) for o in OBJECTS for kind, unit, default, low, high in KINDS]
    rows = []
    for name, unit, default, low, high in known[:64]:
        value, std, _ = FOUND.get(name, (default, float("nan"), default))
        rows.append(ParameterRow(name, unit, default, value, std, (low, high), name in FOUND, name not in DOUBTFUL))
    return tuple(rows)


@dataclass(frozen=True)
class World:
    friction: tuple[float, float]
    discount: float
    restitution: float
    bias: tuple[float, float]
    fan: float


REAL = World((0.04, 0.03), 0.85, 0.9, (0.03, -0.02), 0.21)
NOMINAL = World((0.05, 0.05), 0.75, 0.8, (0.0, 0.0), 0.0)
CALIBRATED = World((0.0372, 0.0287), 0.847, 0.897, (0.0300, -0.0199), 0.0)
WITH_EFFECTS = World((0.04002, 0.03002), 0.84997, 0.9, (0.0300, -0.0199), 0.2096)


def shot(world: World, angle: float, speed: float, steps: int = 150, dt: float = 1 / 60) -> Floats:
    """(steps, 2 pucks, x and y) measured positions at 60 Hz [m]."""
    x = np.array([[-0.15, 0.0], [-0.075, -0.075]])
    v = np.array([[np.cos(angle), np.sin(angle)], [0.0, 0.0]]) * speed * world.discount * 2.6
    limit, seen, substeps = np.array([0.4245, 0.1995]), [], 4
    for _ in range(steps):
        seen.append(x + world.bias)
        for _ in range(substeps):
            h = dt / substeps
            speeds = np.linalg.norm(v, axis=1, keepdims=True)
            v = v * np.maximum(0.0, 1 - np.array(world.friction)[:, None] * 9.81 * h / np.maximum(speeds, 1e-9))
            away = x - [0.02, -0.01]
            moving = speeds > 1e-3
            v = (
                v
                + h * world.fan * 0.5 * away / 0.12 * np.exp(-np.sum(away**2, axis=1, keepdims=True) / 0.0288) * moving
            )
            x = x + h * v
            hit = np.abs(x) > limit
            v = np.where(hit, -world.restitution * np.sign(x) * np.abs(v), v)
            x = np.clip(x, -limit, limit)
            gap = x[1] - x[0]
            distance = float(np.linalg.norm(gap))
            closing = float((v[0] - v[1]) @ gap) / distance
            if distance < 0.051 and closing > 0:
                v = v + (1 + world.restitution) / 2 * closing * np.array([-gap, gap]) / distance
    return np.array(seen)


def replays(effects: bool, rng: np.random.Generator) -> tuple[Replay, ...]:
    """12 shots; every fourth is held out."""
    real = REAL if effects else replace(REAL, fan=0.0)
    calibrated = CALIBRATED if effects else replace(WITH_EFFECTS, fan=0.0)
    out = []
    for i in range(12):
        angle, speed = rng.uniform(-0.62, -0.30), rng.uniform(0.3, 0.5)
        time = np.arange(150) / 60 + 0.2
        seen = shot(real, angle, speed) + rng.normal(0.0, 1e-3 / np.sqrt(2), (150, 2, 2))
        paths = {name: shot(world, angle, speed) for name, world in
                 (("nominal", NOMINAL), ("calibrated", calibrated), ("effects", WITH_EFFECTS))}  # fmt: skip
        visible = rng.random(150) > 0.03
        tracks = tuple(
            ReplayedTrack(
                FACTORS[k], time[visible], seen[visible, k], paths["nominal"][visible, k],
                paths["calibrated"][visible, k], paths["effects"][visible, k] if effects else None,
            )
            for k in range(2)
        )  # fmt: skip
        out.append(Replay(f"episode_{i + 1:04d}", i % 4 == 3, tracks))
    return tuple(out)


def _gap(shots: tuple[Replay, ...], model: str) -> Gap:
    pairs = [(t.real, getattr(t, model), t.object) for replay in shots for t in replay.tracks]
    errors = {f: [np.linalg.norm(m - r, axis=1) for r, m, name in pairs if name == f] for f in FACTORS}
    every = np.concatenate([e for part in errors.values() for e in part])
    d = {factor: float(np.mean([e.sum() / 3 for e in part])) for factor, part in errors.items()}
    rms = {factor: float(np.sqrt(np.mean(np.concatenate(part) ** 2))) for factor, part in errors.items()}
    signals = {factor: SignalGap(one, "m", 0.00101) for factor, one in rms.items()}
    turning = {f"{factor}_spin": one / 0.0255 for factor, one in rms.items()}
    signals["spins"] = SignalGap(float(np.sqrt(np.mean(np.square([*turning.values()])))), "rad", 0.04, turning)
    return Gap(d, float(np.sqrt(np.mean(every**2))), signals)


def _trace(
    rows: tuple[ParameterRow, ...], psi: Floats, difference: Floats, rng: np.random.Generator
) -> tuple[Iteration, ...]:
    start, end = np.array([r.default for r in rows]), np.array([r.value for r in rows])
    shares = 1 - np.exp(-np.arange(10) / 2.2)
    return tuple(
        Iteration(
            start + (end - start) * share * (1 + rng.normal(0, 0.02, end.size)),
            difference * (0.08 + 0.92 * np.exp(-i / 1.8)) * (1 + rng.normal(0, 0.03, 2)),
            1 - (1 - psi) * (1 - np.exp(-(i + 1) / 2)),
            640 * (i + 1),
        )
        for i, share in enumerate(shares)
    )


def effect(name: str, equivalents: tuple[str, ...] = ()) -> EffectFinding:
    parameters = {
        "strength": EffectParameter(0.208, 0.011, "m/s^2"),
        "centre_x": EffectParameter(0.021, 0.004, "m"),
        "centre_y": EffectParameter(-0.009, 0.003, "m"),
        "radius": EffectParameter(0.118, 0.006, "m"),
    }
    return EffectFinding(name, parameters, Evidence(0.95, 312.4, 0.0004), equivalents)


def explanation(name: str, probability: float, log_evidence: float, after: float, site: str = "puck1") -> Explanation:
    """One law on one site; the held-out error falls from 19.6 mm."""
    laws = (ExplainedLaw(name, (site,), effect(name).parameters),)
    return Explanation(laws, probability, log_evidence, HeldOut(0.0196, after, 0.00101, "m"))


UNKNOWN = Explanation((ExplainedLaw("unknown", (), {}),), 0.002, 7_917.9)
NOTHING = Explanation((), 1e-130, 7_611.0, HeldOut(0.0196, 0.0196, 0.00101, "m"))
EXPLANATIONS: dict[Verdict, tuple[Explanation, ...]] = {
    "none": (replace(NOTHING, probability=0.98), replace(UNKNOWN, probability=0.02, log_evidence=7_607.0)),
    "named": (
        replace(explanation("fan_field", 0.994, 7_923.4, 0.00102), corrections=explanation("swirl", 0, 0, 0).laws),
        explanation("point_attraction", 0.0031, 7_917.7, 0.0064),
        UNKNOWN, explanation("fan_field", 9e-4, 7_916.4, 0.0031, "puck2"),
        explanation("swirl", 1e-60, 7_781.2, 0.0151), NOTHING,
    ),
    "ambiguous": (
        explanation("actuation_delay", 0.62, 7_923.4, 0.00102, "drive_x"),
        explanation("camera_latency", 0.379, 7_922.9, 0.00105, "camera"), UNKNOWN, NOTHING,
    ),
    "unknown": (replace(UNKNOWN, probability=0.97), explanation("swirl", 0.03, 7_899.6, 0.0151), NOTHING),
}  # fmt: skip
FAN_HERE = Where(
    "all", "free", "dynamics", Region((0.02, -0.01), 0.12), (0.3, 1.9), site_kind="body", site="puck1+puck2"
)
UNDETECTABLE = ("off_centre_mass", "magnus", "rolling_shutter", "stribeck_friction", "local_wall", "clock_drift")
MISMATCHES: dict[Verdict, Mismatch] = {
    "none": Mismatch("none", None, (), UNDETECTABLE, "", "Nothing is missing: held-out error 1.0 mm, floor 1.0 mm."),
    "named": Mismatch("named", FAN_HERE, (effect("fan_field"),), UNDETECTABLE, "", SENTENCE),
    "ambiguous": Mismatch(
        "ambiguous", Where("all", "free", "actuation"), (effect("actuation_delay", ("camera_latency",)),),
        UNDETECTABLE[:3],
        "Film the pusher in one shot from (-0.22, 0.07) m at 0.05 rad, 0.45 m/s: a delay moves it, a latency does not.",
        "All comes 21 +- 2 ms late: actuation_delay or camera_latency; held-out error 19.6 -> 1.0 mm, floor 1.0 mm.",
    ),
    "unknown": Mismatch(
        "unknown", Where("puck1", "free", "dynamics", Region((0.2, 0.05), 0.08)), (), UNDETECTABLE[:2],
        "Five slow shots (0.3 m/s) across (0.20, 0.05) m from different sides.",
        "Something pushes puck1 near (0.20, 0.05), and no known effect explains it; error 19.6 mm, floor 1.0 mm.",
    ),
    "fit_failed": Mismatch("fit_failed", None, (), (), "Start again with another seed, or with more rollouts.",
                           "The fit stopped at 20 mm, far above the floor of 1.0 mm, and two starts disagree."),
    "data_bad": Mismatch("data_bad", None, (), (), "Record 12 shots at 60 Hz.",
                         "The tracks come at 15 Hz; at least 25 Hz are needed."),
    "not_evaluated": Mismatch("not_evaluated", None, (), (), "",
                              "Missing physics was not looked for: held-out error 183 -> 19.6 mm, floor 1.0 mm."),
}  # fmt: skip


@cache
def synthetic_result(verdict: Verdict = "named") -> Result:
    """A whole result for one verdict; the same bits every time."""
    rng = np.random.default_rng(7)
    rows, fitted = parameter_rows(), verdict in ("named", "ambiguous")
    names = tuple(row.name for row in rows)
    psi = np.clip(rng.beta(0.6, 9.0, (64, 2)), 0.0, 0.45)
    for i, row in enumerate(rows):
        if row.active:
            psi[i] = rng.uniform(0.72, 0.99, 2)
            psi[i, 1 if row.name.startswith("puck1@dyna@damping") else 0] *= 1.0 if "puck2" not in row.name else 0.1
    shots = replays(verdict != "none", rng)
    if not fitted:
        shots = tuple(replace(s, tracks=tuple(replace(t, with_effects=None) for t in s.tracks)) for s in shots)
    parts = {"fit": tuple(s for s in shots if not s.held_out), "held_out": tuple(s for s in shots if s.held_out)}
    models = ("nominal", "calibrated", "with_effects") if fitted else ("nominal", "calibrated")
    gap = {m: {part: _gap(some, m) for part, some in parts.items()} for m in models}
    mismatch = replace(MISMATCHES[verdict], explanations=EXPLANATIONS.get(verdict, ()), false_alarm=0.01)
    return Result(
        cell="air_hockey",
        method="compass",
        seed=7,
        versions={"compass_ros": "0.1.0", "mujoco": "3.9.0", "numpy": "1.26.4", "torch": "2.9.0", "python": "3.11.7"},
        budget=Budget(21_440, 53_600.0, 187.4),
        fit=tuple(s.episode for s in parts["fit"]),
        held_out=tuple(s.episode for s in parts["held_out"]),
        gap=gap,  # type: ignore[arg-type]  # the keys are the literals
        noise_floor_m=0.00101,
        parameters=rows,
        graph=Graph(names, FACTORS, psi, 0.5),
        mismatch=mismatch,
        trace=_trace(rows, psi, np.array([4.1, 2.7]), rng),
        replays=shots,
        cancelled=False,
        warnings=("episode_0009: 4 frames without puck2",) if verdict == "named" else (),
    )


def synthetic_extras() -> ReportExtras:
    """A scene, candidates and the truth."""
    shapes = (
        Shape("rectangle", "table", (0.0, 0.0), (0.9, 0.45)),
        Shape("circle", "goal", (0.43, 0.0), (0.3, 0.3)),
        Shape("rectangle", "obstacle", (0.1, 0.0), (0.025, 0.18)),
    )
    candidates = (
        Candidate("fan_field", "dynamics", 312.4, 0.95, True),
        Candidate("point_attraction", "dynamics", 241.0, 0.71, False, "71 of evidence less"),
        Candidate("swirl", "dynamics", 88.2, 0.22, False),
        Candidate("friction_patch", "dynamics", 61.7, 0.19, False),
        Candidate("table_tilt", "dynamics", 12.5, 0.04, False),
        Candidate("lens_distortion", "sensing", 3.1, 0.01, False),
        Candidate("camera_scale", "sensing", -1.4, -0.01, False, "no gain"),
    )
    return ReportExtras(
        command="compass calibrate --cell air_hockey --seed 7 --out runs/today bags/episode_00*",
        scene=Scene(shapes, {"puck1": 0.0255, "puck2": 0.0255}),
        candidates=candidates,
        truth={name: truth for name, (_, _, truth) in FOUND.items()},
    )


@pytest.fixture(scope="session")
def make_result() -> Callable[[Verdict], Result]:
    """Builds a whole result for one verdict."""
    return synthetic_result


@pytest.fixture(scope="session")
def result() -> Result:
    """A result with one named effect."""
    return synthetic_result("named")


@pytest.fixture(scope="session")
def extras() -> ReportExtras:
    return synthetic_extras()
