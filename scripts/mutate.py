"""Changes each number that decides a verdict, one at a time, in a copy, and asks whether a test of the verdict fails.

python scripts/mutate.py [NAME...]        status 1 where a change passed unseen; a nightly job of some minutes a number
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
DISCOVERY = Path("compass_ros", "discovery")
TESTS = tuple(
    f"test_{name}.py"
    for name in ("evidence", "discrepancy", "first_order", "floor", "form", "weakest", "weigh", "servo", "unlisted")
)
"""Of test/discovery: those that bring about verdicts on toys."""


@dataclass(frozen=True)
class Mutation:
    """A number of a file, and what stands in its place."""

    file: str
    name: str
    value: str


MUTATIONS = (
    Mutation("settings.py", "MOMENTS", "4"),
    Mutation("settings.py", "MEMORY_S", "(60.0,)"),
    Mutation("settings.py", "RHO", "(0.0, 1.0, 2.0, 5.0, 10.0, 20.0)"),
    Mutation("settings.py", "RHO_PRIOR", "(1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 1.0)"),
    Mutation("settings.py", "SHOWN, A_DECADE", "0.0, 2"),
    Mutation("settings.py", "PRIOR_UNKNOWN", "50.0"),
    Mutation("settings.py", "PRIOR_LAW", "-5000.0"),
    Mutation("zero.py", "ERROR_BARS", "1e3"),
    Mutation("first_order.py", "WIDTH", "0.02"),
    Mutation("settings.py", "SLIGHT", "1.0"),
)


def mutated(source: str, mutation: Mutation) -> str:
    """A file with the number's assignment, which may go over several lines, replaced."""
    pattern = re.compile(rf"^{mutation.name} = .*$", re.MULTILINE)
    changed, count = pattern.subn(f"{mutation.name} = {mutation.value}", source)
    if count != 1:
        raise SystemExit(f"{mutation.file}: {mutation.name} is assigned {count} times, expected once")
    return changed


def failing(mutation: Mutation) -> str:
    """The first test that fails in a copy with the mutation; empty where none does."""
    with tempfile.TemporaryDirectory(prefix="compass_mutation_") as name:
        copy = Path(name)
        for folder in ("compass_ros", "config", "test"):
            shutil.copytree(ROOT / folder, copy / folder, ignore=shutil.ignore_patterns("__pycache__", "node_modules"))
        for file in ("pyproject.toml", "setup.py", "package.xml"):
            shutil.copy(ROOT / file, copy / file)
        path = copy / DISCOVERY / mutation.file
        path.write_text(mutated(path.read_text(encoding="utf-8"), mutation), encoding="utf-8")
        tests = [str(Path("test", "discovery", test)) for test in TESTS]
        environment = os.environ | {"PYTHONPATH": str(copy), "OMP_NUM_THREADS": "1"}
        done = subprocess.run([sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests],
                              cwd=copy, env=environment, capture_output=True, text=True, check=False)  # fmt: skip
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return failed[0] if failed else ""


def main(names: list[str]) -> int:
    unseen = 0
    for mutation in MUTATIONS:
        if names and mutation.name not in names:
            continue
        first = failing(mutation)
        unseen += not first
        print(f"{mutation.name} = {mutation.value}: {first or 'NO TEST FAILS'}", flush=True)
    return int(unseen > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
