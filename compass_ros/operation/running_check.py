"""Each new episode against the simulator in force. It asks for a calibration; it never starts one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from compass_ros.cells import Cell
from compass_ros.config import read_yaml
from compass_ros.errors import BagError, ConfigError, DataError
from compass_ros.operation.current import Current, current, read
from compass_ros.operation.sequential import GapTest, begin, observe
from compass_ros.operation.versions import Versions
from compass_ros.reporting.atomic import write_text

KEPT = 1000
"""Episodes in a check; a longer one begins anew with its own gaps as reference."""


@dataclass(frozen=True)
class Verdict:
    """How the check stands after an episode."""

    version: int
    episodes: int
    """Since the check began."""
    newest_gap: float
    """In the unit of the cell's distances."""
    e_value: float
    alarm: bool
    sentence: str


class RunningCheck:
    """The check of one cell, kept on disk beside its versions: FOLDER/CELL/check_0001.yaml."""

    def __init__(self, cell: Cell, versions: Versions, false_alarm: float, threads: int = 1) -> None:
        """Raises ConfigError where the version in force, or what is known of it, cannot be read."""
        if not 0 < false_alarm < 1:
            raise ConfigError(f"false_alarm: expected a probability between 0 and 1, found {false_alarm}")
        self._cell = cell
        self._versions = versions
        self._false_alarm = false_alarm
        self._threads = threads
        self._version = versions.applied()
        self._current = self._simulator()
        self._test, self._bags = self._known()

    def renew(self, reference: Sequence[Path] = ()) -> Verdict:
        """Another version is in force: begin anew, or go on where the check of that version was.

        `reference`: bags of episodes that the calibration has never fitted; those that cannot be read are left out.
        Raises ConfigError.
        """
        self._version = self._versions.applied()
        self._current = self._simulator()
        self._test, self._bags = self._known()
        if not self._test.gaps and reference:
            self._test = begin(gap for bag in reference if (gap := self._try(bag)) is not None)
            self._keep()
        return self.verdict()

    def take(self, bag: Path) -> Verdict:
        """One more episode. An episode is counted once. Raises BagError, DataError or ConfigError if it is no use."""
        if str(bag) in self._bags:
            return self.verdict()
        gap = self._current.gap(read(self._cell, bag))
        if len(self._test.gaps) >= KEPT and not self._test.alarm(self._false_alarm):
            self._test, self._bags = begin(self._test.gaps[KEPT // 2 :]), []
        self._test = observe(self._test, gap)
        self._bags.append(str(bag))
        self._keep()
        return self.verdict()

    def drop(self, bag: Path) -> Verdict:
        """An episode was discarded: the test is what it had been without it.

        Whoever discards has seen the recording and not the test's evidence, so its rate of false alarms stays.
        """
        if str(bag) in self._bags:
            place = self._bags.index(str(bag))
            gaps = list(self._test.gaps)
            del gaps[self._test.references + place], self._bags[place]
            self._test = _replayed(gaps[: self._test.references], gaps[self._test.references :])
            self._keep()
        return self.verdict()

    def verdict(self) -> Verdict:
        test = self._test
        alarm = test.alarm(self._false_alarm)
        newest = test.gaps[-1] if test.tested else float("nan")
        if alarm:
            said = (
                f"the gap between simulator and recordings has grown (evidence {test.highest:.0f}, "
                f"asked for is {1 / self._false_alarm:.0f}): please recalibrate"
            )
        else:
            said = f"no sign that the gap has grown in {test.tested} episodes" if test.tested else "no episode yet"
        return Verdict(self._version.number, test.tested, newest, test.e_value, alarm, said)

    def _try(self, bag: Path) -> float | None:
        try:
            return self._current.gap(read(self._cell, bag))
        except (BagError, DataError, ConfigError):
            return None

    def _simulator(self) -> Current:
        return current(self._cell, self._version.folder if self._version.number else None, self._threads)

    def _known(self) -> tuple[GapTest, list[str]]:
        return _restored(self._path) if self._path.exists() else (GapTest(), [])

    @property
    def _path(self) -> Path:
        return self._versions.folder / f"check_{self._version.number:04d}.yaml"

    def _keep(self) -> None:
        reference = self._test.references
        content = {
            "reference": list(self._test.gaps[:reference]),
            "episodes": [
                {"bag": bag, "gap_m": gap} for bag, gap in zip(self._bags, self._test.gaps[reference:], strict=True)
            ],
        }
        write_text(self._path, yaml.safe_dump(content, sort_keys=False))


def _replayed(reference: Iterable[float], gaps: Iterable[float]) -> GapTest:
    """Raises DataError for gaps that are none."""
    test = begin(reference)
    for gap in gaps:
        test = observe(test, gap)
    return test


def _restored(path: Path) -> tuple[GapTest, list[str]]:
    """The test replayed from its gaps. Raises ConfigError for a file that is damaged."""
    content = read_yaml(path)
    try:
        reference, rows = content["reference"], content["episodes"]
        if not isinstance(reference, list) or not isinstance(rows, list):
            raise TypeError("no lists")
        test = _replayed(map(float, reference), [float(row["gap_m"]) for row in rows])
        return test, [str(row["bag"]) for row in rows]
    except (KeyError, TypeError, ValueError, DataError) as error:
        raise ConfigError(f"{path}: expected gaps of episodes, found something else ({error}); delete it") from error
