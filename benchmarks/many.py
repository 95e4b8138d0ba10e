"""Eight items of two seconds of one core each, by every executor: `python benchmarks/many.py` (docs/many.md)."""

from __future__ import annotations

import os
import sys
import time
from functools import partial
from importlib.util import find_spec
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
os.environ.setdefault("PYTHONPATH", sys.path[0])

from compass_ros.executors import Executor, Processes, Ray
from test.executors.tasks import busy, squared

ITEMS, SECONDS = 8, 2.0


def main() -> None:
    ways: list[tuple[str, Executor]] = [("one process", Processes(1)), ("two processes", Processes(2))]
    if find_spec("ray"):
        ways.append(("ray, this machine", Ray("local")))
        list(Ray("local").each(squared, range(4)))  # its start is not counted: a cluster is there already
    first = None
    for name, by in ways:
        begun = time.monotonic()
        answers = list(by.each(partial(busy, SECONDS), range(ITEMS)))
        took = time.monotonic() - begun
        first = first or took
        print(f"| {name} | {took:.1f} | {first / took:.2f} | {len(answers)} |", flush=True)
    print("load:", *os.getloadavg())


if __name__ == "__main__":
    main()
