"""Images that never became poses: recorded bags against the camera's rate.

    python benchmarks/frames.py out/demo/bags [--rate 60]

Between the first and the last pose of a bag the camera took an image every 1 / rate; each should have a pose of every
object. A frame without any pose was lost between camera and recorder; one without some pose has an object unseen.
"""

from __future__ import annotations

import argparse

import numpy as np

from compass_ros.cells import load
from compass_ros.episodes import default_sources, read_episodes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bags", nargs="+")
    parser.add_argument("--cell", default="air_hockey")
    parser.add_argument("--rate", type=float, default=60.0)
    arguments = parser.parse_args()
    cell = load(arguments.cell)
    expected = lost = unseen = 0
    for episode in read_episodes(arguments.bags, default_sources([o.name for o in cell.objects]), cell.name):
        frames = [np.round(track.stamp_ns * 1e-9 * arguments.rate).astype(int) for track in episode.tracks]
        any_of = np.unique(np.concatenate(frames))
        taken = int(any_of[-1] - any_of[0]) + 1
        expected += taken
        lost += taken - len(any_of)
        unseen += sum(len(any_of) - len(np.unique(one)) for one in frames)
    print(f"{expected} images at {arguments.rate:g} Hz: {lost} lost, {unseen} poses missing of single objects")


if __name__ == "__main__":
    main()
