"""How many rollouts a calibration asks for, in batches of which size, and what share of its time they are.

    python benchmarks/gpu_counts.py OUT.json CELL BAG... [-- words for compass calibrate]

Runs `compass calibrate` in this process on one thread with a hook around the batches of rollouts; OUT.jsonl beside OUT
has a line for each as it comes: rollouts, steps, seconds of the clock and of the processor, MuJoCo's and those of the
writing of models. OUT has how many there were of each size, whole batches put together of the parts that the suite
rolls out at once, and `benchmarks/gpu.py` reads it (docs/gpu.md).
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

from typer.testing import CliRunner

from compass_ros.cli import app
from compass_ros.simulation.physics import Physics
from compass_ros.simulation.player import Player
from compass_ros.simulation.simulator import CHUNK
from compass_ros.types import Floats


def together(parts: Iterable[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """(rollouts, steps) of whole batches: a full part goes on with the next one of as many steps."""
    sum_of, last = 0, 0
    for rollouts, steps in parts:
        if sum_of and (steps != last or sum_of % CHUNK):
            yield sum_of, last
            sum_of = 0
        sum_of, last = sum_of + rollouts, steps
    if sum_of:
        yield sum_of, last


def summary(cell: str, lines: Iterable[str]) -> dict[str, object]:
    """What `benchmarks/gpu.py` reads, of all lines."""
    rows = [json.loads(line) for line in lines]
    batches = Counter(together((row["rollouts"], row["steps"]) for row in rows if "rollouts" in row))
    whole = next((row["whole"]["cpu_s"] for row in rows if "whole" in row), float("nan"))
    return {
        "cell": cell,
        "whole_s": round(whole, 1),
        "rollouts_s": round(sum(row["cpu_s"] for row in rows if "rollouts" in row), 1),
        "batches": [{"rollouts": size, "steps": steps, "count": n} for (size, steps), n in sorted(batches.items())],
    }


def main() -> None:
    words = sys.argv[1:]
    own, more = (words[: words.index("--")], words[words.index("--") + 1 :]) if "--" in words else (words, [])
    out, cell, bags = Path(own[0]), own[1], own[2:]
    play = Player.play
    each = out.with_suffix(".jsonl")
    with each.open("w", encoding="utf-8") as lines, tempfile.TemporaryDirectory() as folder:

        def counted(
            self: Player, physics: Physics, values: Floats, start: Floats, controls: Floats | None, steps: int
        ) -> tuple[Floats, Floats]:
            wall, cpu = time.perf_counter(), time.process_time()
            answer = play(self, physics, values, start, controls, steps)
            spent = time.perf_counter() - wall, time.process_time() - cpu
            row = {"rollouts": len(values), "steps": steps, "wall_s": round(spent[0], 5), "cpu_s": round(spent[1], 5)}
            lines.write(json.dumps(row) + "\n")
            lines.flush()
            return answer

        Player.play = counted  # type: ignore[method-assign]
        config = Path(folder) / "config.yaml"
        config.write_text("threads: 1\n", encoding="utf-8")
        wall, cpu = time.perf_counter(), time.process_time()
        asked = ["calibrate", *bags, "--cell", cell, "--config", str(config), "--progress", "none"]
        done = CliRunner().invoke(app, [*asked, "--out", str(Path(folder) / "result"), *more])
        if done.exit_code:
            sys.exit(done.output)
        whole = {"cell": cell, "wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}
        lines.write(json.dumps({"whole": whole}) + "\n")
    print(done.output)
    counts = summary(cell, each.read_text(encoding="utf-8").splitlines())
    out.write_text(json.dumps(counts) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
