"""Cells drawn at random, each recorded with other parameters than it states: how a stranger's robot looks to the suite.

One to eight joints of any kind in a tree, up to eight drives of any kind, tracked joints and bodies, passive or driven;
the recordings are the scene's own, simulated with parameters away from their defaults, and noise.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml

from compass_ros.cells import Cell, load
from compass_ros.cells.auto import at_defaults
from compass_ros.cells.registry import dynamics_of
from compass_ros.episodes import write_episode
from compass_ros.simulation import Simulator
from compass_ros.types import Episode, Floats, Track

NOISE = 1e-3
"""Of every tracked number [m, rad]."""
_START_NS = 1_700_000_000_000_000_000
_QUANTITIES = ("xy", "xyz", "pose")
_FELT = ("@dyna@joint_damping", "@dyna@mass", "@dyna@stiffness", "@dyna@frictionloss", "gravity_z", "@actuation@")
"""Of most cells only such parameters are tuned; of the others any, which often nothing depends on."""


@dataclass(frozen=True)
class Size:
    """The most of what is drawn."""

    joints: int = 8
    drives: int = 8
    episodes: int = 8
    steps: int = 16
    """Control steps of 50 ms."""
    rate_hz: int = 100


FULL, SMALL = Size(), Size(joints=3, drives=3, episodes=4, steps=8, rate_hz=30)


@dataclass
class _Scene:
    """A tree of bodies as it grows."""

    rng: np.random.Generator
    parent: list[int] = field(default_factory=list)
    """Of each body; -1: the world."""
    kind: list[str] = field(default_factory=list)
    """Of its joint."""

    def __len__(self) -> int:
        return len(self.kind)

    def joints(self, *kinds: str) -> list[str]:
        return [f"joint{i}" for i, kind in enumerate(self.kind) if kind in kinds]

    def any_of(self, names: list[str]) -> str:
        return names[self.rng.integers(len(names))]

    def uniform(self, low: float, high: float) -> float:
        return float(np.round(self.rng.uniform(low, high), 4))


def _grown(rng: np.random.Generator, most: int) -> _Scene:
    """One body or more with a joint each; only what hangs on the world can be free."""
    scene = _Scene(rng)
    for i in range(int(rng.integers(1, most + 1))):
        parent = int(rng.integers(-1, i))
        kind = str(rng.choice(["hinge", "slide", "ball", "free"], p=[0.5, 0.2, 0.15, 0.15]))
        scene.parent.append(-1 if kind == "free" else parent)
        scene.kind.append(kind)
    return scene


def _body(scene: _Scene, i: int) -> str:
    """The XML of a body with everything that hangs on it."""
    kind, u = scene.kind[i], scene.uniform
    axis = scene.any_of(["1 0 0", "0 1 0", "0 0 1", "0.6 0.8 0"])
    spring = f'stiffness="{u(0.1, 3)}"' if scene.rng.random() < 0.3 else ""
    limit = 'range="-1.5 1.5"' if kind in ("hinge", "slide") and scene.rng.random() < 0.2 else ""
    loss = f'frictionloss="{u(0.001, 0.02)}"' if scene.rng.random() < 0.2 else ""
    damping = f'damping="{u(0.001, 0.1)}"'
    more = "" if kind == "free" else f"{damping} {spring} {limit} {loss}"
    joint = f'<joint name="joint{i}" type="{kind}" axis="{axis}" {more}/>'
    forms = (
        f'type="sphere" size="{u(0.02, 0.06)}"',
        f'type="box" size="0.03 {u(0.02, 0.05)} {u(0.05, 0.1)}"',
        f'type="capsule" size="0.02" fromto="0 0 0 {u(-0.1, 0.1)} 0 -0.15"',
    )
    form = scene.any_of([*forms])
    place = f"{u(-0.5, 0.5)} {u(-0.5, 0.5)} {u(0.6, 1.2)}" if scene.parent[i] < 0 else f"{u(-0.05, 0.05)} 0 -0.15"
    inside = "".join(_body(scene, j) for j in range(len(scene)) if scene.parent[j] == i)
    geom = f'<geom name="geom{i}" {form} mass="{u(0.05, 0.5)}"/>'
    return f'<body name="body{i}" pos="{place}">{joint}{geom}<site name="site{i}" pos="0 0 -0.05"/>{inside}</body>'


def _drive(scene: _Scene, i: int) -> tuple[str, str]:
    """The XML of a drive, and of the tendon that it needs."""
    u, name = scene.uniform, f'name="drive{i}"'
    joint, single = scene.any_of(scene.joints("hinge", "slide", "ball", "free")), scene.joints("hinge", "slide")
    tendon = (
        f'<spatial name="cable{i}"><site site="anchor"/><site site="site{scene.rng.integers(len(scene))}"/></spatial>'
    )
    every = [
        (f'<motor {name} joint="{joint}" gear="{u(0.1, 1)} {u(0, 0.3)} 0"/>', ""),
        (f'<adhesion {name} body="body0" ctrlrange="0 1" gain="{u(0.5, 3)}"/>', ""),
        (f'<motor {name} tendon="cable{i}" gear="{u(-1, 1)}"/>', tendon),
        (f'<muscle {name} tendon="cable{i}" lengthrange="0.1 2" force="{u(0.5, 5)}"/>', tendon),
        (f'<general {name} site="site0" gear="{u(0, 0.5)} 0 {u(0, 0.5)} 0 {u(0, 0.1)} 0"/>', ""),
    ]
    if single:
        on = f'{name} joint="{scene.any_of(single)}"'
        every += [
            (f'<position {on} kp="{u(0.5, 10)}" kv="{u(0.01, 0.5)}"/>', ""),
            (f'<position {on} kp="{u(0.5, 10)}" dampratio="1" timeconst="0.05"/>', ""),
            (f'<velocity {on} kv="{u(0.1, 1)}"/>', ""),
            (f'<intvelocity {on} kp="{u(0.5, 10)}" actrange="-2 2"/>', ""),
            (f'<damper {on} kv="{u(0.1, 1)}" ctrlrange="0 1"/>', ""),
            (f'<cylinder {on} timeconst="0.1" area="{u(0.1, 1)}" bias="0 {u(-1, 0)} 0"/>', ""),
            (f'<general {on} gainprm="{u(0.01, 0.05)}" biastype="affine" biasprm="0 {u(-5, -1)} -0.1"/>', ""),
            (f'<dcmotor {on} motorconst="{u(0.05, 0.5)}" resistance="{u(1, 3)}"/>', ""),
            (f'<position {on} kp="{u(0.5, 10)}" delay="0.03" nsample="12"/>', ""),
        ]
    return every[scene.rng.integers(len(every))]


def _document(scene: _Scene, drives: int) -> str:
    rng = scene.rng
    made = [_drive(scene, i) for i in range(drives)]
    bodies = "".join(_body(scene, i) for i in range(len(scene)) if scene.parent[i] < 0)
    floor = '<geom name="floor" type="plane" size="3 3 0.1"/>' if rng.random() < 0.4 else ""
    apart = "" if floor else '<default><geom contype="0" conaffinity="0"/></default>'
    key = '<keyframe><key name="home" ctrl="{}"/></keyframe>'.format(" ".join(["0.2"] * drives)) if drives else ""
    return (
        f'<mujoco model="random"><compiler autolimits="true"/>{apart}'
        f'<option timestep="{scene.any_of(["0.002", "0.004"])}" integrator="implicitfast"/>'
        f'<worldbody><site name="anchor" pos="0 0 1.5"/>{floor}{bodies}</worldbody>'
        f"<tendon>{''.join(tendon for _, tendon in made)}</tendon>"
        f"<actuator>{''.join(drive for drive, _ in made)}</actuator>{key if rng.random() < 0.3 else ''}</mujoco>"
    )


def _tracked(scene: _Scene) -> list[dict[str, str]]:
    """Some of the joints with one number, and some of the bodies; at least one of all."""
    joints = [{"name": name, "quantity": "joint"} for name in scene.joints("hinge", "slide")]
    bodies = [{"name": f"body{i}", "quantity": scene.any_of([*_QUANTITIES])} for i in range(len(scene))]
    chosen = [o for o in joints if scene.rng.random() < 0.7] + [o for o in bodies if scene.rng.random() < 0.25]
    return chosen or [scene.rng.choice([*joints, *bodies])]  # type: ignore[arg-type]


def _starts(scene: _Scene, tracked: list[dict[str, str]]) -> list[dict[str, object]]:
    """Of what can begin where it was seen."""
    free = {f"body{i}" for i, kind in enumerate(scene.kind) if kind == "free"}
    able = [o for o in tracked if o["quantity"] == "joint" or o["name"] in free]
    noise = {"position": 2 * NOISE, "velocity": 0.05}
    return [{"object": o["name"], "frames": 6, **({"noise": noise} if scene.rng.random() < 0.7 else {})} for o in able]


def _actions(scene: _Scene, drives: int) -> list[dict[str, object]]:
    """Commands to most drives, for a time, and first positions or rates of some joints."""
    out: list[dict[str, object]] = []
    for i in range(drives):
        if scene.rng.random() < 0.8:
            until = {"until_s": scene.uniform(0.1, 0.5)} if scene.rng.random() < 0.5 else {}
            out.append(
                {
                    "name": f"command{i}",
                    "field": "ctrl",
                    "of": f"drive{i}",
                    "unit": "1",
                    "low": -1.0,
                    "high": 1.0,
                    **until,
                }
            )
    for joint in scene.joints("hinge", "slide"):
        what = scene.any_of(["qpos", "qvel", ""])
        if what:
            out.append({"name": f"{what}_{joint}", "field": what, "of": joint, "unit": "rad", "low": -0.5, "high": 0.5})
    return out


def drawn(folder: Path, seed: int, size: Size = FULL) -> Cell:
    """The cell of a seed, written as scene.xml and cell.yaml."""
    rng = np.random.default_rng(seed)
    scene = _grown(rng, size.joints)
    drives = int(rng.integers(0, size.drives + 1)) if rng.random() < 0.7 else 0
    (folder / "scene.xml").write_text(_document(scene, drives))
    tracked = _tracked(scene)
    passive = rng.random() < 0.4
    content: dict[str, object] = {
        "name": f"random{seed}", "dynamics": "mjcf", "model": "scene.xml", "noise_m": NOISE,
        "control_dt_s": 0.05, "horizon": int(rng.integers(6, size.steps + 1)), "objects": tracked,
        "factors": [o["name"] for o in tracked],
        "start": _starts(scene, tracked) if passive or rng.random() < 0.2 else [],
        "action": [] if passive else _actions(scene, drives),
    }  # fmt: skip
    everything = len(scene) <= 2 and rng.random() < 0.2
    every = _written(folder, content | {"auto": True})
    if everything:
        return every
    felt = [p for p in every.spec.parameters if any(word in p.name for word in _FELT)]
    known = felt if felt and rng.random() < 0.7 else every.spec.parameters
    chosen = [known[i] for i in sorted(rng.permutation(len(known))[: int(rng.integers(1, 7))])]
    fields = ("name", "field", "of", "unit", "default", "bounds", "half_width")
    return _written(folder, content | {"parameters": [{field: getattr(p, field) for field in fields} for p in chosen]})


def _written(folder: Path, content: dict[str, object]) -> Cell:
    plain = json.loads(json.dumps(content))  # what stands twice would become an alias
    (folder / "cell.yaml").write_text(yaml.safe_dump(plain, sort_keys=False))
    return load(folder / "cell.yaml")


def recorded(cell: Cell, seed: int, folder: Path, size: Size = FULL) -> list[Path]:
    """Bags of the cell: mostly as many episodes as a search for missing physics needs, with noise and lost frames."""
    rng = np.random.default_rng([seed, 1])
    few = rng.random() < 0.1
    episodes = int(rng.integers(1, 4) if few else rng.integers(4, size.episodes + 1))
    rate = min(int(rng.choice([30, 60, 100])), size.rate_hz)
    low, high, width = (np.array([getattr(p, what) for p in cell.parameters]) for what in ("low", "high", "half_width"))
    truth = np.clip(cell.defaults + width * rng.normal(size=len(width)), low, high)
    inputs = np.stack([_inputs(cell, rng) for _ in range(episodes)])
    time = np.arange(0, cell.duration, 1 / rate)
    seen = Simulator(cell, threads=1).observe(np.tile(truth, (episodes, 1)), inputs, np.tile(time, (episodes, 1)))
    return [write_episode(_episode(cell, i, inputs[i], time, seen[i], rng), folder) for i in range(episodes)]


def _inputs(cell: Cell, rng: np.random.Generator) -> Floats:
    """(A,) a command within the action's range; first states beside those of the drawing."""
    command = [rng.uniform(a.low, a.high) for a in cell.action]
    model = at_defaults(cell, dynamics_of(cell))
    for start in cell.starts:
        signal = cell.signal(start.object)
        if signal.jointed:
            command += [*rng.uniform(-0.8, 0.8, 1), *rng.uniform(-1, 1, 1)]
            continue
        size = 2 if signal.quantity == "xy" else 3
        command += (model.body(signal.at[0]).pos[:size] + rng.uniform(-0.1, 0.1, size)).tolist()
        if signal.quantity == "pose":
            turn = rng.normal(size=4)
            command += [
                *(turn / np.linalg.norm(turn)),
                *rng.uniform(-0.5, 0.5, 3),
                *rng.uniform(-2, 2, 3),
                0.0,
                0.0,
                0.0,
            ]
        else:
            command += rng.uniform(-0.5, 0.5, size).tolist()
    return np.array(command)


def _episode(cell: Cell, number: int, inputs: Floats, time: Floats, seen: Floats, rng: np.random.Generator) -> Episode:
    tracks = []
    for signal in cell.signals:
        value = seen[:, signal.columns] + rng.normal(0, NOISE, (len(time), signal.size))
        if signal.quantity == "pose":
            value[:, 3:] /= np.linalg.norm(value[:, 3:], axis=1, keepdims=True)
        there = (rng.random(len(time)) < 0.95) | (np.arange(len(time)) < 10)
        stamps = _START_NS + 10**11 * number + np.round(time[there] * 1e9).astype(np.int64)
        tracks.append(Track(signal.name, signal.quantity, stamps, value[there]))
    action = dict(zip([a.name for a in cell.action], inputs[: len(cell.action)].tolist(), strict=True))
    return Episode(f"episode{number}", cell.name, cell.hash, action, _START_NS + 10**11 * number, tuple(tracks))
