"""Sealing an answer: a salted hash beside the bags, the answer itself where no calibration looks."""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from compass_ros.errors import BagError, ConfigError

SEAL = "seal.json"
ANSWERS = Path("~/.local/share/compass_ros/answers")


@dataclass(frozen=True)
class Opened:
    """An answer that belongs to its seal and to its bags."""

    answer: Mapping[str, object]
    path: Path


def seal(answer: Mapping[str, object], world: Path, bags: Mapping[str, Path], answers: Path) -> Path:
    """Write WORLD/seal.json and ANSWERS/<hash>.json; return the path of the answer.

    The hash covers a random salt, the answer and the content of every bag: neither can change unnoticed, and a guess of
    the answer cannot be checked. Raises ConfigError where the answers would lie beside the bags or cannot be written.
    """
    folder = apart(answers, world)
    salted = dict(answer) | {"salt": secrets.token_hex(16), "bags": {name: digest(bag) for name, bag in bags.items()}}
    code = _hash(salted)
    path = folder / f"{code[:16]}.json"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(salted, indent=1), encoding="utf-8")
        path.chmod(0o600)
        content = {"schema": "compass/seal/1", "cell": answer["cell"], "sha256": code, "bags": sorted(bags)}
        (world / SEAL).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{error.filename}: cannot be written: {error.strerror}") from error
    return path


def apart(answers: Path, world: Path) -> Path:
    """The folder of the answers. Raises ConfigError where it lies under the world's."""
    folder = answers.expanduser().resolve()
    if folder.is_relative_to(world.resolve()):
        raise ConfigError(f"--answers {answers}: lies under {world}, beside the bags; choose a folder elsewhere")
    return folder


def unseal(world: Path, answers: Path) -> Opened:
    """The answer of a world. Raises BagError where answer, seal and bags do not belong together."""
    sealed = _read(world / SEAL, "expected the seal of a concealed world")
    code = str(sealed.get("sha256", ""))
    path = answers.expanduser() / f"{code[:16]}.json"
    answer = _read(path, f"expected the answer of {world}")
    if _hash(answer) != code:
        raise BagError(f"{path}: was altered; its hash is {_hash(answer)[:16]}..., the seal says {code[:16]}...")
    digests = answer.get("bags")
    assert isinstance(digests, dict)  # the hash holds
    for name, expected in digests.items():
        if digest(world / name) != expected:
            raise BagError(f"{world / name}: was altered since it was sealed")
    return Opened(answer, path)


def digest(bag: Path) -> str:
    """SHA-256 of the recording in a bag. Raises BagError where there is none."""
    files = sorted(bag.glob("*.mcap"))
    if not files:
        raise BagError(f"{bag}: no recording, expected one of the sealed bags")
    total = hashlib.sha256()
    for file in files:
        total.update(file.read_bytes())
    return total.hexdigest()


def _hash(salted: Mapping[str, object]) -> str:
    return hashlib.sha256(json.dumps(salted, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def _read(path: Path, expected: str) -> Mapping[str, object]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise BagError(f"{path}: cannot be read: {error.strerror}; {expected}") from error
    except json.JSONDecodeError as error:
        raise BagError(f"{path}: not valid JSON: {error}; {expected}") from error
    if not isinstance(content, dict):
        raise BagError(f"{path}: expected an object, found {type(content).__name__}")
    return content
