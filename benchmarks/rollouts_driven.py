"""Rollouts per second of a driven cell with recorded joint targets, beside `mujoco.rollout` with the same controls.

    python benchmarks/rollouts_driven.py [--cell kinova3] [--rollouts 256] [--threads 0]

The contestants run in turn, several rounds; the best round of each counts. `mujoco.rollout`: one model, the controls
made beforehand, nothing done with the states. Ours: parameters written into a model each, recorded targets made into
controls (late by the delay of each rollout), the signals observed at the recorded stamps. A Jacobian: one parameter is
another in each rollout, as in a fit; any values: all are, so that no two rollouts share a delay. Laws: the same with
three of them on each joint.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable

import mujoco
import numpy as np
from mujoco.rollout import Rollout

from compass_ros.bench.driven import Routine, record
from compass_ros.cells import load
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.visited import Visited
from compass_ros.simulation.windows import windows

LAWS = "stribeck_friction", "cogging", "quadratic_drag"
"""On each joint, of a friction that holds, a force by place and one by speed."""


def runs(cell_name: str, rollouts: int, threads: int) -> dict[str, Callable[[], object]]:
    """By name, what is timed: windows of two recordings, each many times, with parameters of its own."""
    cell = load(cell_name)
    data = recordings(cell, windows(cell, record(cell, cell.defaults, 2, Routine(), 0)))
    simulator = Simulator(cell, threads=threads).driven(data.drives)
    which = np.arange(rollouts) % len(data.names)
    inputs, time_s = simulator.inputs(data.inputs)[which], data.time_s[which]
    wide = 0.05 * np.array([p.half_width for p in cell.parameters])
    rows = cell.defaults + wide * np.eye(len(wide))[np.arange(rollouts) // len(data.names) % len(wide)]
    draws = cell.defaults + wide * np.random.default_rng(0).uniform(0, 1, (rollouts, len(wide)))
    physics = simulator.physics
    steps = int(np.ceil(float(time_s.max()) / simulator.time_step))
    start = physics.start(rows, inputs)
    controls = physics.controls(rows, inputs, steps)
    data_of = [mujoco.MjData(physics.model) for _ in range(simulator.threads)]
    pool = Rollout(nthread=simulator.threads)

    def bare() -> object:
        mujoco.set_mjcb_time(None)
        parts = physics.drives.parts
        return pool.rollout(physics.model, data_of, start, controls, control_spec=parts, nstep=steps)

    sizes = Visited(simulator, cell.defaults, inputs, time_s).joint_sizes()
    laws = [Attached(EFFECTS[name].at(sizes[joint]), (joint,)) for joint in simulator.moving for name in LAWS]
    lawful = simulator.with_effects(laws)
    numbers = [q.scale if q.amplitude else q.start for law in laws for q in law.effect.quantities]
    with_laws = np.concatenate([rows, np.tile(numbers, (rollouts, 1))], axis=1)
    return {
        "mujoco.rollout": bare,
        "Simulator, a Jacobian, laws": lambda: lawful.observe(with_laws, inputs, time_s),
        "Simulator, a Jacobian": lambda: simulator.observe(rows, inputs, time_s),
        "Simulator, any values": lambda: simulator.observe(draws, inputs, time_s),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cell", default="kinova3")
    parser.add_argument("--rollouts", type=int, default=256)
    parser.add_argument("--threads", type=int, default=0, help="0: all cores")
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    best: dict[str, list[float]] = {}
    asked = runs(given.cell, given.rollouts, given.threads)
    for _ in range(given.rounds):
        for name, run in asked.items():
            wall, cpu = time.perf_counter(), time.process_time()
            run()
            spent = [time.perf_counter() - wall, time.process_time() - cpu]
            best[name] = np.minimum(best.get(name, [np.inf, np.inf]), spent).tolist()
    threads = given.threads or len(os.sched_getaffinity(0))
    print(f"{given.cell}: {given.rollouts} rollouts of a window, {threads} threads, best of {given.rounds}")
    print(f"{'':28}{'rollouts/s':>12}{'share':>8}{'ms of one core':>16}{'share':>8}")
    wall0, cpu0 = best["mujoco.rollout"]
    for name, (wall, cpu) in best.items():
        rate, one = given.rollouts / wall, 1e3 * cpu / given.rollouts
        print(f"{name:28}{rate:12.0f}{wall0 / wall:8.2f}{one:16.2f}{cpu0 / cpu:8.2f}")


if __name__ == "__main__":
    main()
