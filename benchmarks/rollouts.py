"""Rollouts per second of the air-hockey cell, beside bare `mujoco.rollout` on the same model.

    python benchmarks/rollouts.py [--rollouts 256] [--threads 0]

The contestants run in turn, several rounds; the best round of each counts. `mujoco.rollout`: one model, no table
friction, no effect, nothing done with the states; with MuJoCo's profiler, as `import mujoco` leaves it, and without.
Ours: parameters written into a model each, controls made, friction, observation; never with the profiler.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.rollout import Rollout

from compass_ros.cells import load
from compass_ros.cells.registry import dynamics_of
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.types import Floats


@dataclass(frozen=True)
class Cost:
    """Seconds a rollout by the clock (wall) and of the processor (cpu), best of the rounds."""

    profiled_wall: float
    profiled_cpu: float
    bare_wall: float
    bare_cpu: float
    plain_wall: float
    plain_cpu: float
    field_wall: float
    field_cpu: float


def compare(rollouts: int, threads: int, rounds: int, duration: float = 2.5) -> Cost:
    """Time bare rollouts, ours, and ours with one force field on both pucks."""
    cell = load("air_hockey")
    plain = Simulator(cell, threads=threads)
    field = plain.with_effects([Attached(EFFECTS["fan_field"], ("puck1", "puck2"))])
    low, high = np.array([(a.low, a.high) for a in cell.action]).T
    shots = np.random.default_rng(0).uniform(low, high, (rollouts, len(low)))
    values = np.tile(cell.defaults, (rollouts, 1))
    with_field = np.hstack([values, np.tile([0.3, 0.2, 0.0, 0.12, 0.5], (rollouts, 1))])
    runs: tuple[Callable[[], object], ...] = (
        bare_run(plain, rollouts, values, shots, duration, profiler=True),
        bare_run(plain, rollouts, values, shots, duration, profiler=False),
        lambda: plain.motion(values, shots, duration),
        lambda: field.motion(with_field, shots, duration),
    )
    best = np.full((len(runs), 2), np.inf)
    for _ in range(rounds):
        for i, run in enumerate(runs):
            wall, cpu = time.perf_counter(), time.process_time()
            run()
            spent = time.perf_counter() - wall, time.process_time() - cpu
            best[i] = np.minimum(best[i], np.array(spent) / rollouts)
    return Cost(*best.ravel().tolist())


def bare_run(
    like: Simulator, rollouts: int, values: Floats, shots: Floats, duration: float, profiler: bool
) -> Callable[[], object]:
    """The same starts and controls on the scene as it is, by `mujoco.rollout` alone."""
    dynamics = dynamics_of(like.cell)
    model = dynamics.model
    steps = int(np.ceil(duration / like.time_step))
    start = np.zeros((rollouts, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS.value)))
    start[:, 1 : 1 + model.nq] = dynamics.start(values, shots)[0]
    controls = np.ascontiguousarray(dynamics.controls(values, shots, steps))
    data = [mujoco.MjData(model) for _ in range(like.threads)]
    pool = Rollout(nthread=like.threads)

    def run() -> object:
        if profiler:
            mujoco.MjData(model)  # the first one switches it on, and so does each after it was switched off
        else:
            mujoco.set_mjcb_time(None)
        return pool.rollout(model, data, start, controls, nstep=steps)

    return run


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rollouts", type=int, default=256)
    parser.add_argument("--threads", type=int, default=0, help="0: all cores")
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    cost = compare(given.rollouts, given.threads, given.rounds)
    threads = given.threads or len(os.sched_getaffinity(0))
    print(f"{given.rollouts} rollouts of 2.5 s at 1 ms, {threads} threads, best of {given.rounds}")
    print(f"{'':28}{'rollouts/s':>12}{'share':>8}{'ms of one core':>16}")
    for name, wall, cpu, of in (
        ("mujoco.rollout, profiler on", cost.profiled_wall, cost.profiled_cpu, cost.bare_wall),
        ("mujoco.rollout", cost.bare_wall, cost.bare_cpu, cost.bare_wall),
        ("Simulator", cost.plain_wall, cost.plain_cpu, cost.bare_wall),
        ("Simulator, fan_field", cost.field_wall, cost.field_cpu, cost.plain_wall),
    ):
        print(f"{name:28}{1 / wall:12.0f}{of / wall:8.2f}{1e3 * cpu:16.2f}")
    print("share: of mujoco.rollout; with the field, of Simulator")


if __name__ == "__main__":
    main()
