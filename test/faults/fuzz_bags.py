"""Damages bags at random and reads and recovers them: whatever happens must be a reading or a BagError, in time.

python -m test.faults.fuzz_bags [COUNT] [FIRST_SEED]        default: 100000 inputs from seed 0
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

from test.episodes.hostile import damaged, mend, read, victims

SLOWEST_S = 5.0


def main(count: int = 100_000, first: int = 0) -> int:
    """Returns the number of inputs that took too long; anything but a BagError ends the run with its traceback."""
    readings = complaints = slow = 0
    started = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        sound = victims(Path(folder))
        for seed in range(first, first + count):
            victim = sound[seed % len(sound)]
            before = time.monotonic()
            content = damaged(victim.content, seed)
            found = mend(victim, content) if victim.file.suffix == ".mcap" and seed % 7 == 0 else read(victim, content)
            complaints += isinstance(found, str)
            readings += not isinstance(found, str)
            if time.monotonic() - before > SLOWEST_S:
                slow += 1
                print(f"seed {seed} took {time.monotonic() - before:.1f} s")
            if (seed - first) % 10_000 == 9_999:
                print(f"{seed - first + 1} inputs, {time.monotonic() - started:.0f} s", flush=True)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{count} inputs: {readings} read, {complaints} refused, {slow} slow; at most {memory:.0f} MiB of memory")
    return slow


if __name__ == "__main__":
    raise SystemExit(main(*map(int, sys.argv[1:])) > 0)
