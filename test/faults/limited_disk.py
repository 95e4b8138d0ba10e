"""Records until the disk refuses, and prints what the recorder says; run where the disk is small.

python limited_disk.py FOLDER [LIMIT_BYTES]     LIMIT_BYTES: the kernel refuses to let a file grow beyond this
"""

from __future__ import annotations

import resource
import sys
from pathlib import Path

from compass_ros.episodes.recording import Connection, Recorder
from compass_ros.errors import BagError
from test.episodes.planted import PUCK1, START_NS, pose_bytes
from test.episodes.test_recording import POSES

MOST = 100_000


def main(folder: str, limit: str = "") -> None:
    if limit:
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(limit), int(limit)))
    recorder = Recorder(Path(folder))
    connection: Connection = POSES
    recorder.connect(connection)
    recorder.start("shot", "air_hockey", "", {}, START_NS)
    taken = 0
    try:
        while taken < MOST:
            stamp = START_NS + taken * 10**7
            recorder.take(PUCK1[0].topic, pose_bytes(stamp, x=taken), stamp, stamp)
            taken += 1
    except BagError:
        print(taken, recorder.status.state, recorder.status.message, sep="\n")
        recorder.take(PUCK1[0].topic, b"", START_NS, START_NS)  # ignored: the episode is over
    try:
        recorder.stop()
    except BagError as error:
        print(error)


if __name__ == "__main__":
    main(*sys.argv[1:])
