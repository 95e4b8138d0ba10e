"""All checks of a set of recordings of one cell, before anything is computed from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from compass_ros.cells import Cell
from compass_ros.cells.limits import Limits, limits
from compass_ros.cells.registry import dynamics_of
from compass_ros.checks.doubts import doubts
from compass_ros.checks.finding import Finding
from compass_ros.checks.signals import Signal, labels, signal
from compass_ros.checks.units import units
from compass_ros.checks.window import windows
from compass_ros.errors import DataError
from compass_ros.types import Episode, Track

LEAST = 3
"""Sound recordings from which the others are left out."""


@dataclass(frozen=True)
class Checked:
    """Recordings that were looked at."""

    episodes: tuple[Episode, ...]
    """Those to use, mended where that is sure."""
    left_out: tuple[str, ...]
    """Names of the others."""
    findings: tuple[Finding, ...]
    signals: tuple[Signal, ...]
    remarks: tuple[str, ...]
    """What is odd about the set as a whole, one sentence each."""

    @property
    def bad(self) -> tuple[Finding, ...]:
        """What forbids any conclusion on physics."""
        return tuple(one for one in self.findings if one.severity == "bad")

    @property
    def said(self) -> tuple[str, ...]:
        """Everything, one sentence each."""
        left = (f"{', '.join(self.left_out)}: left out",) if self.left_out else ()
        return (*(one.sentence for one in self.findings), *left, *self.remarks)

    @property
    def sentence(self) -> str:
        """Why there is no verdict; empty where there may be one."""
        if not self.bad:
            return ""
        from_others = f" The parameters are from the other {len(self.episodes)}." if self.left_out else ""
        return f"The recordings are wrong: {'. '.join(one.sentence for one in self.bad)}.{from_others}"


def check(cell: Cell, episodes: Sequence[Episode]) -> Checked:
    """Look at all recordings. Raises DataError where none of them holds a motion."""
    named = dict(zip(labels(episodes), episodes, strict=True))
    model = dynamics_of(cell).model
    allowed = limits(cell, model)
    signals = _signals(cell, named, allowed)
    mended = {
        name: replace(episode, tracks=tuple(_track(signals, name, track) for track in episode.tracks))
        for name, episode in named.items()
    }
    findings = [one for s in signals.values() for one in s.findings] + _frames(cell, named)
    if not any(one.severity == "bad" for one in findings):
        findings += units(cell, mended, allowed, float(model.stat.extent))
    found = windows(cell, mended, tuple(signals.values()), {name for one in findings for name in _wrong(one)})
    findings += found.findings
    if len(found.still) == len(named) and not cell.action:
        raise DataError(f"no recording holds a motion: {found.findings[-1].sentence}")
    out = _left_out(tuple(named), findings, () if cell.action else found.still)
    used = tuple(episode for name, episode in found.episodes.items() if name not in out)
    return Checked(used, out, tuple(findings), tuple(signals.values()), doubts(cell, used))


def _signals(cell: Cell, named: Mapping[str, Episode], allowed: Mapping[str, Limits]) -> dict[str, Signal]:
    out = {}
    for o in cell.objects:
        seen = [(name, track) for name, e in named.items() for track in e.tracks if track.object == o.name]
        tracks = {name: track for name, track in seen if len(track.value) > 1}
        if tracks:
            out[o.name] = signal(o.name, tracks, allowed[o.name], cell.spec.noise_m)
    return out


def _track(signals: Mapping[str, Signal], name: str, track: Track) -> Track:
    return signals[track.object].tracks.get(name, track) if track.object in signals else track


def _frames(cell: Cell, named: Mapping[str, Episode]) -> list[Finding]:
    """Objects that are seen in several frames, of which the cell names none."""
    out = []
    for o in cell.objects:
        seen = {name: e for name, e in named.items() if any(track.object == o.name for track in e.others)}
        if not seen or o.frame:
            continue
        frames = sorted({t.frame for e in seen.values() for t in (*e.tracks, *e.others) if t.object == o.name})
        looks = f"seen in {len(frames)} frames, {', '.join(frames)}: which of them is the scene's is not known"
        out.append(Finding("frames", "bad", o.name, dict.fromkeys(seen, ()), f"{looks}; `frame` in the cell's YAML"))
    return out


def _left_out(names: tuple[str, ...], findings: Sequence[Finding], still: tuple[str, ...]) -> tuple[str, ...]:
    """Recordings that nothing is computed from: the still ones, and the wrong ones where enough others are sound."""
    wrong = {name for one in findings for name in _wrong(one)} | set(still)
    sound = len(names) - len(wrong)
    chosen = wrong if sound >= max(LEAST, len(wrong)) else set(still)
    return tuple(name for name in names if name in chosen)


def _wrong(finding: Finding) -> tuple[str, ...]:
    """Recordings that nothing may be concluded from."""
    return tuple(finding.samples) if finding.severity == "bad" else ()
