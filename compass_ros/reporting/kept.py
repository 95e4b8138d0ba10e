"""`trajectories.npz`: what the figures need beside `result.json`, so that a report can be drawn again.

Two members, no pickle: `numbers` is one flat array of all trajectories and iterations; `about` is JSON, in which every
array is `[offset, shape...]` into `numbers`.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from compass_ros.errors import ConfigError
from compass_ros.reporting.atomic import write_bytes
from compass_ros.reporting.extras import Candidate, ReportExtras, ResidualMap, Scene
from compass_ros.reporting.from_json import from_json
from compass_ros.reporting.result_json import read_result, to_json
from compass_ros.types import Floats, Iteration, Replay, ReplayedTrack, Result

SCHEMA_ID = "compass/trajectories/1"
RESULT, TRAJECTORIES = "result.json", "trajectories.npz"
MAX_ABOUT = 10_000_000
"""Characters of `about` that are read at most."""


class _Writer:
    """Collects arrays and says where they lie."""

    def __init__(self) -> None:
        self.parts: list[Floats] = []
        self.offset = 0

    def put(self, values: Floats) -> list[int]:
        flat = np.ascontiguousarray(values, dtype=np.float64).ravel()
        place = [self.offset, *values.shape]
        self.parts.append(flat)
        self.offset += flat.size
        return place


def _track(track: ReplayedTrack, writer: _Writer) -> dict[str, Any]:
    return {
        "object": track.object,
        "time_s": writer.put(track.time_s),
        "real": writer.put(track.real),
        "nominal": writer.put(track.nominal),
        "calibrated": writer.put(track.calibrated),
        "with_effects": None if track.with_effects is None else writer.put(track.with_effects),
    }


def _map(residual: ResidualMap | None, writer: _Writer) -> dict[str, Any] | None:
    if residual is None:
        return None
    places = {name: writer.put(getattr(residual, name)) for name in ("x_m", "y_m", "value")}
    return {"label": residual.label, "unit": residual.unit, **places}


def write_trajectories(result: Result, path: Path, extras: ReportExtras | None = None) -> None:
    """Write the file; it is whole or not there. Raises ConfigError when it cannot be written."""
    known, writer = extras or ReportExtras(), _Writer()
    about = {
        "schema": SCHEMA_ID,
        "result": _fingerprint(to_json(result)),
        "replays": [
            {"episode": r.episode, "held_out": r.held_out, "tracks": [_track(t, writer) for t in r.tracks]}
            for r in result.replays
        ],
        "trace": [
            {name: writer.put(getattr(step, name)) for name in ("values", "difference", "psi")}
            | {"rollouts": step.rollouts}
            for step in result.trace
        ],
        "command": known.command,
        "scene": None if known.scene is None else asdict(known.scene),
        "candidates": [asdict(c) for c in known.candidates],
        "residual_before": _map(known.residual_before, writer),
        "residual_after": _map(known.residual_after, writer),
        "truth": dict(known.truth),
    }
    file = io.BytesIO()
    numbers = np.concatenate([np.empty(0), *writer.parts])
    np.savez_compressed(file, about=np.array(json.dumps(about)), numbers=numbers)
    write_bytes(path, file.getvalue())


def read_all(folder: str | Path) -> tuple[Result, ReportExtras]:
    """Everything that a calibration has left for tables, report and figures.

    Raises ConfigError where `folder` holds no result, an older one without trajectories, or files that do not belong
    together.
    """
    folder = Path(folder)
    content = read_result(folder / RESULT)
    path = folder / TRAJECTORIES
    about, numbers = _load(path)
    if about["result"] != _fingerprint(content):
        raise ConfigError(f"{path}: belongs to another {RESULT} than the one beside it; calibrate again")
    try:
        trace = tuple(_iteration(step, numbers) for step in about["trace"])
        replays = tuple(_replay(replay, numbers) for replay in about["replays"])
        return replace(from_json(content), trace=trace, replays=replays), _extras(about, numbers)
    except (KeyError, TypeError, ValueError, ValidationError) as error:
        raise ConfigError(f"{path}: damaged: {' '.join(str(error).split())[:200]}") from error


def _fingerprint(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _load(path: Path) -> tuple[dict[str, Any], Floats]:
    """The two members, with their schema checked."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            about, numbers = archive["about"], archive["numbers"]
    except FileNotFoundError as error:
        raise ConfigError(
            f"{path}: no such file; calibrate again, or draw where the calibration has written"
        ) from error
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise ConfigError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
    try:
        content = json.loads(str(about)) if about.nbytes <= 4 * MAX_ABOUT else None
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA_ID or "result" not in content:
        raise ConfigError(f"{path}: not a {SCHEMA_ID}")
    if numbers.ndim != 1 or numbers.dtype != np.float64:
        raise ConfigError(f"{path}: damaged: numbers: expected a flat array of float64")
    return content, numbers


def _get(place: list[int], numbers: Floats) -> Floats:
    offset, *shape = place
    size = int(np.prod(shape, dtype=np.int64))
    if offset < 0 or min(shape, default=0) < 0 or offset + size > numbers.size:
        raise ValueError(f"an array of shape {shape} at {offset} is not within {numbers.size} numbers")
    return numbers[offset : offset + size].reshape(shape)


def _iteration(step: Mapping[str, Any], numbers: Floats) -> Iteration:
    arrays = {name: _get(step[name], numbers) for name in ("values", "difference", "psi")}
    return Iteration(**arrays, rollouts=int(step["rollouts"]))


def _replay(replay: Mapping[str, Any], numbers: Floats) -> Replay:
    tracks = []
    for track in replay["tracks"]:
        arrays = {name: _get(track[name], numbers) for name in ("time_s", "real", "nominal", "calibrated")}
        effects = track["with_effects"]
        tracks.append(
            ReplayedTrack(track["object"], **arrays, with_effects=None if effects is None else _get(effects, numbers))
        )
    return Replay(str(replay["episode"]), bool(replay["held_out"]), tuple(tracks))


def _residual(residual: Mapping[str, Any] | None, numbers: Floats) -> ResidualMap | None:
    if residual is None:
        return None
    x, y, value = (_get(residual[name], numbers) for name in ("x_m", "y_m", "value"))
    return ResidualMap(residual["label"], residual["unit"], x, y, value)


def _extras(about: Mapping[str, Any], numbers: Floats) -> ReportExtras:
    return ReportExtras(
        command=str(about["command"]),
        scene=None if about["scene"] is None else TypeAdapter(Scene).validate_python(about["scene"]),
        candidates=TypeAdapter(tuple[Candidate, ...]).validate_python(about["candidates"]),
        residual_before=_residual(about["residual_before"], numbers),
        residual_after=_residual(about["residual_after"], numbers),
        truth=TypeAdapter(dict[str, float]).validate_python(about["truth"]),
    )
