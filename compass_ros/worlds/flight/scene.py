"""Twelve throws of one football in a hall, filmed with markers on it: place and orientation at 120 Hz."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from compass_ros.types import Episode, Floats, Track
from compass_ros.worlds import draw, optics, sensors
from compass_ros.worlds.flight import pushes
from compass_ros.worlds.flight.ball import Ball, Flight, Throw, continuous, fly
from compass_ros.worlds.flight.laws import DRAW, Drawn
from compass_ros.worlds.world import Asked, Kind, Missing, Task, World, answer

THROWS = 12
RATE_HZ = 120.0
DURATION_S = 1.2
MASS_KG, RADIUS_M = 0.43, 0.11
"""Law 2 of football: 0.41 to 0.45 kg, 0.68 to 0.70 m around."""
PLACE_M, ANGLE_RAD = 3e-3, 0.02
"""Noise of one frame."""
LOST = 0.02
SLOWEST_MS, FASTEST_MS = 3.0, 26.0
"""Of the fastest throw of a world: by hand to a free kick (Carre et al. 2002, Sports Eng. 5, 183)."""
SENSING = ("clock_drift", "camera_scale", "camera_rotation", "lens")
SINGLES: Mapping[str, Sequence[str]] = {
    "ball_flight": ("drag", "drag", "buoyancy", *SENSING),
    "ball_flight_air": ("magnus", "magnus", "wind", "wind", "crisis", *SENSING),
}
PAIRS: Mapping[str, Sequence[tuple[str, str]]] = {
    "ball_flight": (("drag", "magnus"), ("drag", "wind"), ("drag", "magnus"), ("drag", "lens")),
    "ball_flight_air": (("magnus", "wind"), ("magnus", "lens"), ("wind", "camera_rotation"), ("crisis", "magnus")),
}
"""By cell. Without drag no ball is lifted or blown away."""
OUTSIDE = ("knuckle", "gusts", "plume", "camera_shake")
WITH_DRAG = ("knuckle", "gusts", "plume")
_STREAMS = ("kind", "values", "laws", "throws", "noise")


def conceal(task: Task, asked: Asked) -> World:
    """Draw and play a world of a ball in flight."""
    rng = draw.streams(asked.seed, task.name, _STREAMS)
    kind, names = chosen(task.name, asked, rng["kind"])
    values = draw.true_values(task.parameters, rng["values"])
    ball = ball_of(values)
    found = {name: DRAW[name](rng["laws"]) for name in names}
    fastest = float(draw.log_uniform(rng["throws"], SLOWEST_MS, FASTEST_MS))
    throws = [thrown(rng["throws"], fastest) for _ in range(THROWS)]
    flights = [played(ball, throw, found) for throw in throws]
    time_s = [frames(flight) for flight in flights]

    def see(laws: Mapping[str, Drawn]) -> Floats:
        flown = [played(ball, throw, laws) for throw in throws]
        return np.concatenate([places(flight, laws, t) for flight, t in zip(flown, time_s, strict=True)])

    alone, total = sensors.strengths(found, see, PLACE_M)
    laws = [missing(name, law, alone[name]) for name, law in found.items()]
    episodes = recorded(task, flights, found, rng["noise"])
    noise = {"place_m": PLACE_M, "angle_rad": ANGLE_RAD, "lost": LOST, "rate_hz": RATE_HZ}
    said = answer(task, "flight", asked, kind, laws, values, total, noise)
    return World(task.name, tuple(episodes), said)


def chosen(cell: str, asked: Asked, rng: Generator) -> tuple[Kind, tuple[str, ...]]:
    """How much is missing, and what."""
    kind, names = draw.laws(asked, [n for n in DRAW if n not in OUTSIDE], OUTSIDE, rng)
    if asked.names:
        return kind, names
    if kind == "one":
        return kind, (str(rng.choice(SINGLES[cell])),)
    if kind == "two":
        return kind, PAIRS[cell][int(rng.integers(len(PAIRS[cell])))]
    bare = cell == "ball_flight" and set(names) & set(WITH_DRAG)
    return kind, ("drag", *names) if bare else names


def ball_of(values: Mapping[str, float]) -> Ball:
    centre = np.array([values.get(f"ball@dyna@centre_{axis}", 0.0) for axis in "xyz"])
    known = 2 * values.get("ball@dyna@drag", 0.0)  # MuJoCo's coefficient is of rho A v^2
    return Ball(MASS_KG, RADIUS_M, values["env@dyna@gravity"], centre, known)


def thrown(rng: Generator, fastest_ms: float) -> Throw:
    """Half of `fastest_ms` and more, 5 to 50 degrees up, any spin to 40 rad/s."""
    speed, up = fastest_ms * rng.uniform(0.5, 1), np.radians(rng.uniform(5, 50))
    side = np.radians(rng.uniform(-15, 15))
    along = np.array([np.cos(up) * np.cos(side), np.cos(up) * np.sin(side), np.sin(up)])
    axis = rng.normal(size=3)
    spin = rng.uniform(2, 40) * axis / np.linalg.norm(axis)
    place = np.array([0.0, 0.0, 1.2]) + rng.normal(size=3) * 0.1
    return Throw(place, speed * along, spin, Rotation.random(random_state=int(rng.integers(2**31))))


def played(ball: Ball, throw: Throw, laws: Mapping[str, Drawn]) -> Flight:
    winds = [law.wind for law in laws.values() if law.wind is not None]

    def air(time: float, place: Floats) -> Floats:
        return sum((wind(time, place) for wind in winds), np.zeros(3))

    blowing = air if winds else pushes.still
    acting = tuple(law.push(ball, throw, blowing) for law in laws.values() if law.push is not None)
    known = (pushes.drag(ball, pushes.constant(ball.known_drag), blowing),) if ball.known_drag else ()
    return fly(ball, throw, DURATION_S + 0.05, (*known, *acting))


def faults(laws: Mapping[str, Drawn]) -> tuple[optics.Optics, ...]:
    return tuple(law.optics for law in laws.values() if law.optics is not None)


def frames(flight: Flight) -> Floats:
    """(F,) moments of the frames until the ball is a radius above the ground, or the end."""
    time_s = np.arange(int(DURATION_S * RATE_HZ)) / RATE_HZ
    low = np.flatnonzero(flight.centre(time_s)[2] < RADIUS_M)
    return time_s[: low[0]] if len(low) else time_s


def places(flight: Flight, laws: Mapping[str, Drawn], shown_s: Floats) -> Floats:
    """(F, 3) what is seen in frames whose stamps show (F,) moments."""
    true_s = np.clip(optics.taken(faults(laws), shown_s), 0.0, DURATION_S)
    return optics.through(faults(laws), flight.pose, true_s)[:, :3]


def recorded(task: Task, flights: Sequence[Flight], laws: Mapping[str, Drawn], rng: Generator) -> list[Episode]:
    out = []
    for n, flight in enumerate(flights):
        time_s = frames(flight)
        time_s = time_s[sensors.kept(len(time_s), LOST, rng)]
        seen = optics.through(faults(laws), flight.pose, time_s)
        place = sensors.noisy(seen[:, :3], PLACE_M, rng)
        wrong = Rotation.from_rotvec(rng.normal(size=(len(time_s), 3)) * ANGLE_RAD)
        turned = wrong * Rotation.from_quat(np.roll(seen[:, 3:], -1, axis=1))
        value = np.concatenate([place, continuous(np.roll(turned.as_quat(), 1, axis=1))], axis=1)
        stamp = sensors.stamps(optics.shown(faults(laws), time_s))
        track = Track("ball", "pose", stamp, value)
        out.append(Episode(f"throw_{n:02d}", task.name, task.hash, {}, int(stamp[0]), (track,)))
    return out


def missing(name: str, law: Drawn, size: float) -> Missing:
    site = "env" if law.wind is not None else "ball"
    return Missing(name, law.classes, (site,), law.quantities, law.source, size)
