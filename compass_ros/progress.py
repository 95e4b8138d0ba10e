"""Progress that never runs backwards."""

from __future__ import annotations

import math
from dataclasses import replace

from compass_ros.types import Progress, Report


class Steady:
    """A `Report` before another one. What begins anew, as a calibration does whose held-out episodes are changed, gets
    what is left of the whole; the share done never falls, and `end` makes it 1."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._base = self._done = self._raw = 0.0

    def __call__(self, progress: Progress) -> bool:
        raw = min(max(progress.done, 0.0), 1.0)
        if raw < self._raw:
            self._base = self._done
        self._raw = raw
        self._done = max(self._done, self._base + (1.0 - self._base) * raw)
        return self._report(replace(progress, done=self._done))

    def share(self, low: float, high: float) -> Report:
        """A `Report` whose whole is this share of the whole."""
        return lambda progress: self(replace(progress, done=low + (high - low) * progress.done))

    def end(self, stage: str) -> None:
        """All is done."""
        self._done = 1.0
        self._report(Progress(stage, 0, 1.0, math.nan, math.nan))
