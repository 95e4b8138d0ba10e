"""How far the library's law lies from a concealed one: what it leaves, fitted directly on the true site.

python scripts/forms.py --cell two_joint_arm_driven --seed 730201 gear_play cogging_harmonics ...   # lines of JSON
python scripts/forms.py --table                                                                      # of docs/worlds.md

No search: the answer of each world is open. A law is fitted from the first-order solution and by a race of its own, on
the site of the answer, as `discovery` would if it had guessed right.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from time import process_time
from typing import Any, cast

import numpy as np

from compass_ros import selection
from compass_ros.calibration.refine import Refined, refine
from compass_ros.cells import Cell, load
from compass_ros.config import CalibrationConfig
from compass_ros.discovery.candidates import candidates
from compass_ros.discovery.first_order import FirstOrder, Ranked
from compass_ros.discovery.fits import finished, from_parent, whole
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.neighbours import STEPS, modest, rank
from compass_ros.discovery.race import race
from compass_ros.estimation import estimate_parameters
from compass_ros.posing import Posed, noise_of
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.windows import usable, windows
from compass_ros.types import Episode, silent
from compass_ros.worlds.scenes import scene_of
from compass_ros.worlds.world import Asked, Task

FILE = Path("proof/forms.jsonl")
CHOICES = 2
"""Choices of sites of a law that are fitted, those nearest to the answer's."""
Row = Mapping[str, object]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("law", nargs="*", help="names of the scene's own")
    parser.add_argument("--cell")
    parser.add_argument("--seed", type=int, default=0, help="of the first law's world; one more for each that follows")
    parser.add_argument("--file", type=Path, default=FILE)
    parser.add_argument("--table", action="store_true")
    given = parser.parse_args()
    if given.table:
        print(table([json.loads(line) for line in given.file.read_text(encoding="utf-8").splitlines()]))
        return
    for i, law in enumerate(given.law):
        for row in compared(load(given.cell), law, given.seed + i):
            with given.file.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            print(json.dumps(row), flush=True)


def compared(cell: Cell, law: str, seed: int) -> Iterator[Row]:
    """A row for each law of the class of a concealed one, on its sites; one without a name where none is asked."""
    scene = scene_of(cell.name)
    assert scene is not None
    world = scene(Task(cell.name, cell.hash, cell.model_path, cell.parameters), Asked(seed, names=(law,)))
    (truth,) = cast("list[Mapping[str, Any]]", world.answer["laws"])
    began = process_time()
    plain, simulator = calibrated(cell, world.episodes)
    likelihood = plain.likelihood
    asked = candidates(simulator, plain.response.values, likelihood.inputs, likelihood.time_s)
    first = [r for r in rank(FirstOrder(plain.response), asked) if r.candidate.name in truth["class"]]
    about = {"cell": cell.name, "concealed": law, "seed": seed, "strength": round(truth["strength"], 2)}
    about |= {"plain": round(plain.chi_square, 3), "unknown": round(plain.free.log, 1)}
    for name in truth["class"]:
        tried = [fitted(plain, r) for r in nearest([r for r in first if r.candidate.name == name], truth["sites"])]
        if tried:
            best = max(tried, key=lambda h: h.log_evidence)
            yield about | {
                "law": name,
                "with_law": round(best.chi_square, 3),
                "left_over": round(left_over(best), 4),
                "log_evidence": round(best.log_evidence, 1),
                "cpu_s": round(process_time() - began),
            }
    if not first:
        yield about | {"law": None, "cpu_s": round(process_time() - began)}


def calibrated(cell: Cell, episodes: Sequence[Episode]) -> tuple[Hypothesis, Simulator]:
    """The plain simulator at its fit, as `pipeline.calibrate` comes to it."""
    config = CalibrationConfig(threads=1)
    sound, _ = usable(cell, episodes)
    fit, held_out = selection.split(sound, config)
    data = recordings(cell, selection.fitted(cell, windows(cell, fit), config))
    judge = recordings(cell, windows(cell, held_out)).numbered(len(data.names))
    simulator = Simulator(cell, threads=1).driven(data.drives + judge.drives)
    noise = noise_of(cell, data)
    posed = Posed(simulator, data, judge, noise)
    estimate, refined = estimate_parameters(posed.problem, config, silent)
    done: Refined = refined or refine(posed.problem.likelihood, estimate.values)
    return Hypothesis((), posed.simulator, done.likelihood, done.fit), posed.simulator


def nearest(ranked: Sequence[Ranked], sites: Sequence[str]) -> list[Ranked]:
    """Choices of exactly these sites, else of the fewest more."""
    own = set(sites)
    exact = [r for r in ranked if set(r.candidate.objects) == own]
    more = sorted((r for r in ranked if own <= set(r.candidate.objects)), key=lambda r: len(r.candidate.objects))
    return (exact or more or list(ranked))[:CHOICES]


def fitted(plain: Hypothesis, ranked: Ranked) -> Hypothesis:
    """The better of two beginnings, brought to its optimum."""
    rows = np.arange(len(plain.likelihood.inputs))
    begun = [from_parent(plain, ranked, rows, STEPS), *race(plain, [(ranked.candidate.parts, modest(ranked))], rows)]
    return finished(whole(plain, min(begun, key=lambda one: one.point.cost)))


def left_over(model: Hypothesis) -> float:
    """What the laws of a model leave above the noise, as a share of what they change: rms of all that is measured."""
    changed = float(np.linalg.norm(model.bare - model.fit.linear.residual))
    return float(np.sqrt(model.above_noise)) / changed if changed > 0 else np.inf


def table(rows: Sequence[Row]) -> str:
    """Markdown."""
    head = ("cell", "concealed (strength)", "library's law", "mean square without it", "with it", "left over", "odds")
    out = [f"| {' | '.join(head)} |", "|---|---|---|---|---|---|---|"]
    for row in rows:
        about = f"| `{row['cell']}` | {row['concealed']} ({row['strength']}) |"
        if row["law"] is None:
            out.append(f"{about} none of its class is asked | {row['plain']} | - | - | - |")
            continue
        over = float(str(row["log_evidence"])) - float(str(row["unknown"]))
        left = 100 * float(str(row["left_over"]))
        share = f"{left:.1f} %" if left <= 100 else "> 100 %"
        out.append(f"{about} `{row['law']}` | {row['plain']} | {row['with_law']} | {share} | {over:.0f} |")
    return "\n".join(out)


if __name__ == "__main__":
    main()
