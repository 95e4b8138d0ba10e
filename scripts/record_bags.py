"""Record the shipped bags anew, for the cell as it is now: `make bags`. Real nodes play, see and record four shots.

A bag names its cell's configuration by a hash; after a change to the cell, bags of the old one are refused. Where the
shipped bags already belong to the cell, nothing is done.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from compass_ros.cells import Cell, load
from compass_ros.episodes import Source, find_bags, read_episode

BAGS = Path(__file__).parents[1] / "bags"
SHOTS = 4


def current(cell: Cell, bags: Path = BAGS) -> bool:
    """Whether there are bags, and all of them were recorded in this configuration of the cell."""
    sources = [Source(o.topic or f"/puck_tracker/{o.name}/pose", o.name, o.quantity) for o in cell.objects]
    found = find_bags([bags])
    return len(found) == SHOTS and all(read_episode(bag, sources).cell_hash == cell.hash for bag in found)


def main() -> None:
    if current(load("air_hockey")):
        print(f"{BAGS}: of this cell already")
        return
    with tempfile.TemporaryDirectory() as folder:
        demo = Path(folder) / "demo"
        words = ["demo", "--shots", str(SHOTS), "--out", str(demo), "--method", "random", "--effect", "none"]
        subprocess.run([sys.executable, "-m", "compass_ros.cli", *words], check=True)
        for bag in BAGS.glob("episode_*"):
            shutil.rmtree(bag)
        for bag in sorted((demo / "bags").glob("episode_*")):
            shutil.copytree(bag, BAGS / bag.name)
    print(f"{BAGS}: recorded anew; run `make test`, then commit them")


if __name__ == "__main__":
    main()
