"""Which parameters a cell's simulator runs with: versions on disk, applied and taken back by a person.

    FOLDER/CELL/state.yaml          the versions applied, oldest first; version 0 is the cell as configured
    FOLDER/CELL/0001/               result.json, scene.xml, its assets/, effects.yaml, report.html as a calibration
                                    left them, parameters.yaml (name: value), origin.yaml (what they came from)

A version is complete before its name appears, and no version is ever changed.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import yaml

from compass_ros.config import read_yaml
from compass_ros.errors import ConfigError, shown
from compass_ros.reporting.atomic import write_text
from compass_ros.reporting.result_json import read_result

NOT_TO_BE_APPLIED = ("fit_failed", "data_bad")
"""Verdicts that say that the parameters mean nothing."""
_STATE, _RESULT = "state.yaml", "result.json"
_COPIED = (_RESULT, "scene.xml", "effects.yaml", "report.html")
_FILES = "assets"
"""Folder of what the scene is made of."""


@dataclass(frozen=True)
class Version:
    """One version of a cell's parameters."""

    number: int
    folder: Path
    """Does not exist for version 0."""

    def __str__(self) -> str:
        return f"version {self.number}" if self.number else "version 0 (the cell as configured)"


class Versions:
    """The versions of one cell. Raises ConfigError where the disk refuses."""

    def __init__(self, folder: Path, cell: str) -> None:
        self.folder = folder.expanduser().absolute() / cell
        self.cell = cell

    def applied(self) -> Version:
        """The version in force. Raises ConfigError where the state on disk is damaged."""
        return self._version(self._stack()[-1])

    def apply(self, result: Path, origin: Mapping[str, object]) -> Version:
        """Make a calibration's folder the next version and put it in force.

        Raises:
            ConfigError: No result there, one of another cell, cut short, or one whose verdict says that it means
                nothing.
        """
        content = read_result(result / _RESULT, self.cell)
        self._check(content, result)
        stack = self._stack()
        number = max([0, *stack, *self._numbers()]) + 1
        version = self._version(number)
        parameters = {row["name"]: row["value"] for row in content["parameters"]}
        said = {"replaces": stack[-1], **origin}
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            work = Path(tempfile.mkdtemp(prefix=".new-", dir=self.folder))
            work.chmod(0o755)
            for name in _COPIED:
                if (result / name).is_file():
                    shutil.copy2(result / name, work / name)
            if (result / _FILES).is_dir():
                shutil.copytree(result / _FILES, work / _FILES)
            (work / "parameters.yaml").write_text(yaml.safe_dump(parameters, sort_keys=False), encoding="utf-8")
            (work / "origin.yaml").write_text(yaml.safe_dump(said, sort_keys=False), encoding="utf-8")
            work.rename(version.folder)
        except OSError as error:
            raise ConfigError(f"{self.folder}: cannot be written: {error.strerror}") from error
        self._write([*stack, number])
        return version

    def revert(self) -> Version:
        """Put the version in force that was there before. Raises ConfigError where there was none."""
        stack = self._stack()
        if len(stack) < 2:
            raise ConfigError(f"nothing to revert: {self.cell} runs with version 0, the cell as configured")
        self._write(stack[:-1])
        return self.applied()

    def _check(self, content: Mapping[str, object], result: Path) -> None:
        mismatch = content["mismatch"]
        verdict = mismatch["verdict"] if isinstance(mismatch, dict) else ""
        if content["cancelled"] or verdict in NOT_TO_BE_APPLIED:
            why = "the calibration was cut short" if content["cancelled"] else f"its verdict is '{verdict}'"
            raise ConfigError(f"{result}: not applied: {why}")

    def _version(self, number: int) -> Version:
        return Version(number, self.folder / f"{number:04d}")

    def _numbers(self) -> list[int]:
        return [int(path.name) for path in self.folder.glob("[0-9]*") if path.name.isdigit()]

    def _stack(self) -> list[int]:
        path = self.folder / _STATE
        if not path.exists():
            return [0]
        found = read_yaml(path).get("applied")
        numbers = [n for n in found if isinstance(n, int)] if isinstance(found, list) else []
        if not numbers or numbers != found or numbers[0] != 0:
            raise ConfigError(f"{path}: applied: expected version numbers from 0 on, found {shown(found)}")
        missing = [n for n in numbers[1:] if not (self._version(n).folder / _RESULT).is_file()]
        if missing:
            raise ConfigError(f"{path}: names version {missing[0]}, which is not in {self.folder}")
        return numbers

    def _write(self, stack: list[int]) -> None:
        write_text(self.folder / _STATE, yaml.safe_dump({"applied": stack}))
