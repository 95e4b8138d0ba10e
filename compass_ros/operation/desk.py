"""What an operator is offered: a proposal to apply, a version to go back to, the next experiment, the running check."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from compass_ros.cells import Cell
from compass_ros.config import read_yaml
from compass_ros.episodes import find_each
from compass_ros.errors import BagError, CompassError, ConfigError, DataError
from compass_ros.operation.current import Current, Residuals, current, held_out_bags, read_usable
from compass_ros.operation.running_check import RunningCheck, Verdict
from compass_ros.operation.versions import Version, Versions
from compass_ros.reporting.result_json import read_result

RESULT, ORIGIN = "result.json", "origin.yaml"
SHOWN = 20
"""Episodes behind a mismatch map."""


class Desk:
    """Of one cell. Methods that simulate say so; all others only read and write small files."""

    def __init__(self, cell: Cell, versions: Path, output: Path, false_alarm: float) -> None:
        """`output`: where calibrations leave their result; one that lies there already is a proposal."""
        self.cell = cell
        self._versions = Versions(versions, cell.name)
        self._false_alarm = false_alarm
        self._check: RunningCheck | None = None
        self.result = output.expanduser().absolute()
        """Folder of the last calibration; it need not exist."""

    def proposal(self) -> Path | None:
        """The last calibration, as long as it is not what is in force."""
        if not (self.result / RESULT).is_file():
            return None
        return None if _digest(self.result) == _digest(self.applied().folder) else self.result

    def applied(self) -> Version:
        """Raises ConfigError where the state on disk is damaged."""
        return self._versions.applied()

    def apply(self, at: str) -> Version:
        """Put the proposal in force; `at` is the time of day, for the record. Raises ConfigError: there is none."""
        proposal = self.proposal()
        if proposal is None:
            if not (self.result / RESULT).is_file():
                raise ConfigError(f"nothing to apply: no calibration has left a result in {self.result}")
            raise ConfigError(f"nothing to apply: the last calibration is in force already, as {self.applied()}")
        origin = {"applied_at": at, "cell_hash": self.cell.hash, "result": str(proposal), **_origin(proposal)}
        return self._versions.apply(proposal, origin)

    def revert(self) -> Version:
        """Back to what was in force before. Raises ConfigError where there was nothing."""
        return self._versions.revert()

    def next_experiment(self) -> str:
        """What the last calibration asks to record next. Raises ConfigError where none has ended."""
        if not (self.result / RESULT).is_file():
            raise ConfigError("no calibration has ended yet: record 12 shots or more and calibrate")
        mismatch = read_result(self.result / RESULT)["mismatch"]
        return str(mismatch["next_experiment"] or "nothing: these recordings leave no question open")

    def values(self) -> dict[str, float]:
        """The parameters in force by name. Raises ConfigError where they cannot be read."""
        version = self.applied()
        if not version.number:
            return {p.name: p.default for p in self.cell.parameters}
        return {row["name"]: row["value"] for row in read_result(version.folder / RESULT)["parameters"]}

    def renew(self) -> Verdict:
        """Begin the check of the version in force, or go on with it. Simulates.

        The reference are episodes that its calibration held out, as far as they can still be read. Raises ConfigError.
        """
        version = self.applied()
        if self._check is None:
            self._check = RunningCheck(self.cell, self._versions, self._false_alarm)
        return self._check.renew(self._held_out(version) if version.number else ())

    def take(self, bag: Path) -> Verdict:
        """Compare one more episode with the simulator in force. Simulates. Raises CompassError if it is no use."""
        if self._check is None:
            self.renew()
        if self._check is None:
            raise ConfigError("there is no check")
        return self._check.take(bag)

    def drop(self, bag: Path) -> Verdict:
        """An episode was discarded after its end: the check goes on without it. Raises CompassError."""
        if self._check is None:
            self.renew()
        if self._check is None:
            raise ConfigError("there is no check")
        return self._check.drop(bag)

    def residuals(self) -> Residuals:
        """The last calibration against its own recordings, the first few. Simulates.

        Raises CompassError where neither can be read.
        """
        found: Current = current(self.cell, self.result, threads=1)
        try:
            bags = find_each(self._bags(self.result)).bags[:SHOWN]
            return found.residuals(read_usable(self.cell, bags).episodes)
        except BagError as error:
            raise DataError(f"none of the recordings of the last calibration can be read any more: {error}") from error

    def _held_out(self, version: Version) -> Sequence[Path]:
        names = read_result(version.folder / RESULT)["episodes"]["held_out"]
        try:
            return held_out_bags(self._bags(version.folder), names)
        except CompassError:
            return []

    def _bags(self, folder: Path) -> list[str]:
        bags = _origin(folder).get("bags")
        return [str(bag) for bag in bags] if isinstance(bags, list) else []


def _origin(folder: Path) -> dict[str, object]:
    """What a result came from; empty where nobody has written it down."""
    return dict(read_yaml(folder / ORIGIN)) if (folder / ORIGIN).is_file() else {}


def _digest(folder: Path) -> str:
    path = folder / RESULT
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
