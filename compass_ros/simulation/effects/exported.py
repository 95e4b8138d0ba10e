"""Fitted effects as YAML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as validated

from compass_ros.cells.dynamics import Sliding
from compass_ros.config import read_yaml
from compass_ros.errors import ConfigError, shown
from compass_ros.simulation.effects.attached import Attached
from compass_ros.simulation.effects.effect import Effect
from compass_ros.simulation.effects.parameter import in_unit
from compass_ros.simulation.effects.registry import effect
from compass_ros.simulation.extents import unit_sizes
from compass_ros.simulation.site_kinds import SiteKind

_strict = ConfigDict(extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True)
class FittedEffect:
    """An effect with its values and standard deviations, in the order of its quantities."""

    attached: Attached
    values: tuple[float, ...]
    std: tuple[float, ...]


@dataclass(frozen=True)
class Exported:
    """What has to be added to a calibrated scene."""

    effects: tuple[FittedEffect, ...]
    sliding: Mapping[str, Sliding]
    """The table's friction by body, (1,) each."""


@validated(frozen=True, config=_strict, kw_only=True)
class _Value:
    value: float
    unit: str
    std: float | None = None
    """None: not known."""


@validated(frozen=True, config=_strict, kw_only=True)
class _Entry:
    name: str
    objects: tuple[str, ...]
    values: Mapping[str, _Value]
    on: SiteKind | None = None
    """What kind of site the objects are, where that decides what the numbers mean; None: what the scene says."""


@validated(frozen=True, config=_strict, kw_only=True)
class _Contact:
    friction: float
    creep: float
    load: float


@validated(frozen=True, config=_strict, kw_only=True)
class _File:
    effects: tuple[_Entry, ...]
    sliding: Mapping[str, _Contact]


def write_effects(effects: Sequence[FittedEffect], sliding: Mapping[str, Sliding], path: Path) -> None:
    """Write name, objects and values with units, and the table's friction, which is no part of the scene."""
    file = _File(
        effects=tuple(_entry(fitted) for fitted in effects),
        sliding={
            name: _Contact(friction=float(s.friction[0]), creep=float(s.creep[0]), load=float(s.load[0]))
            for name, s in sliding.items()
        },
    )
    content = TypeAdapter(_File).dump_python(file, mode="json")
    for entry in content["effects"]:
        if entry["on"] is None:
            del entry["on"]
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")


def _entry(fitted: FittedEffect) -> _Entry:
    kind = fitted.attached.effect
    known = effect(kind.name)
    rows = zip(kind.quantities, fitted.values, fitted.std, strict=True)
    return _Entry(
        name=kind.name,
        objects=fitted.attached.objects,
        values={q.name: _Value(value=v, unit=q.unit, std=s if np.isfinite(s) else None) for q, v, s in rows},
        on=kind.on[0] if len(kind.on) == 1 and (kind.on != known.on or _units(kind) != _units(known)) else None,
    )


def as_entry(fitted: FittedEffect) -> dict[str, object]:
    """A law with its values, as `write_effects` says it of one."""
    said: dict[str, object] = TypeAdapter(_Entry).dump_python(_entry(fitted), mode="json")
    return said


def from_entry(entry: Mapping[str, object], path: Path | str) -> FittedEffect:
    """What `as_entry` said; `path`: where it was found."""
    return _fitted(TypeAdapter(_Entry).validate_python(entry), path)


def read_effects(path: Path | str) -> Exported:
    """What `write_effects` wrote. Raises ConfigError with one line."""
    try:
        file = TypeAdapter(_File).validate_python(read_yaml(Path(path)))
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"])
        raise ConfigError(f"{path}: {field}: {first['msg']}, found {shown(first['input'])}") from error
    sliding = {
        name: Sliding(name, np.array([c.friction]), np.array([c.creep]), np.array([c.load]))
        for name, c in file.sliding.items()
    }
    return Exported(tuple(_fitted(entry, path) for entry in file.effects), sliding)


def _fitted(entry: _Entry, path: Path | str) -> FittedEffect:
    values = _renamed(entry)
    found = {name: value.unit for name, value in values.items()}
    variants = _variants(entry, path)
    kind = next((v for v in variants if _units(v) == _later(v, found) | found), variants[0])
    has = _later(kind, found) | found
    if (expected := _units(kind)) != has:
        wrong = shown({name: unit for name, unit in found.items() if expected.get(name) != unit})
        absent = [name for name in expected if name not in has]
        without = f", and no {', '.join(absent)}" if absent else ""
        raise ConfigError(f"{path}: {entry.name}: expected values with units {expected}, found {wrong}{without}")
    given = [values.get(q.name, _Value(value=0.0, unit=q.unit)) for q in kind.quantities]
    std = tuple(float("nan") if v.std is None else v.std for v in given)
    return FittedEffect(Attached(kind, entry.objects), tuple(v.value for v in given), std)


def _renamed(entry: _Entry) -> dict[str, _Value]:
    """Values by the names and in the units that they have now."""
    out = dict(entry.values)
    for q in effect(entry.name).quantities:
        name, unit, factor = q.formerly or ("", "", 1.0)
        if name in out and out[name].unit == unit:
            value, std = out[name].value, out.pop(name).std
            out[q.name] = _Value(value=factor * value, unit=q.unit, std=None if std is None else factor * std)
    return out


def _variants(entry: _Entry, path: Path | str) -> list[Effect]:
    """The effect as it can be on the kind of site that an entry speaks of: units depend on that."""
    kind = effect(entry.name)
    if kind.apart:  # its unit is that of a number of the scene
        return [in_unit(value.unit) for value in entry.values.values()] or [kind]
    if entry.on is None:
        return [kind]
    if entry.on not in kind.on:
        raise ConfigError(f"{path}: {entry.name}: on: expected one of {', '.join(kind.on)}, found '{entry.on}'")
    return [kind.at(size) for size in unit_sizes(entry.on)] or [kind.on_kinds((entry.on,))]


def _later(kind: Effect, found: Mapping[str, str]) -> dict[str, str]:
    """Numbers that a law has got since a file was written, and that are zero in it."""
    return {q.name: q.unit for q in kind.quantities if q.later and q.name not in found}


def _units(kind: Effect) -> dict[str, str]:
    return {q.name: q.unit for q in kind.quantities}
