"""All checks of a set of recordings of one cell, before anything is computed from them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from compass_ros.cells import Cell
from compass_ros.cells.limits import limits
from compass_ros.cells.registry import dynamics_of
from compass_ros.checks.doubts import doubts
from compass_ros.checks.finding import Finding
from compass_ros.checks.signals import LookedAt, Part, labels, look, parts, unlooked
from compass_ros.checks.units import units
from compass_ros.checks.window import windows
from compass_ros.errors import DataError
from compass_ros.types import Episode, LeftOut, Track

LEAST = 3
"""Sound recordings from which the others are left out."""


@dataclass(frozen=True)
class Checked:
    """Recordings that were looked at."""

    episodes: tuple[Episode, ...]
    """Those to use, mended where that is sure."""
    recordings: Mapping[str, Episode]
    """All of them by name, mended and with their time 0 where the motion begins."""
    left_out: tuple[LeftOut, ...]
    """The others, and why."""
    findings: tuple[Finding, ...]
    signals: Mapping[str, LookedAt]
    """By name, those that say where something is."""
    remarks: tuple[str, ...]
    """What is odd about the set as a whole, one sentence each."""

    @property
    def bad(self) -> tuple[Finding, ...]:
        """What forbids any conclusion on physics."""
        return tuple(one for one in self.findings if one.severity == "bad")

    @property
    def said(self) -> tuple[str, ...]:
        """Everything, one sentence each."""
        return (*(one.sentence for one in self.findings), *self.remarks)

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
    of = {name: tuple(parts(cell.signal(name), allowed[name], cell.spec.noise_m)) for name in allowed}
    findings = units(cell, named, of, float(model.stat.extent)) + _frames(cell, named)
    signals = _looked(named, of, {one.signal for one in findings if one.kind == "units"})
    findings += [one for signal in signals.values() for one in signal.findings]
    found = windows(cell, _mended(named, signals), signals, {name for one in findings for name in _wrong(one)})
    findings += found.findings
    if len(found.still) == len(named) and not (cell.action or cell.spec.inputs):
        raise DataError(f"no recording holds a motion: {findings[-1].sentence}")
    out = _left_out(named, findings, found.still)
    used = tuple(episode for name, episode in found.episodes.items() if name not in out)
    return Checked(used, found.episodes, tuple(out.values()), tuple(findings), signals, doubts(cell, used))


def _looked(
    named: Mapping[str, Episode], of: Mapping[str, Sequence[Part]], wrong: Collection[str]
) -> dict[str, LookedAt]:
    """Each signal; where the units of one of its parts are `wrong`, as it is."""
    out = {}
    for name, own in of.items():
        seen = [(recording, track) for recording, e in named.items() for track in e.tracks if track.object == name]
        tracks = {recording: track for recording, track in seen if len(track.value) > 1}
        if tracks:
            out[name] = (unlooked if any(part.name in wrong for part in own) else look)(tracks, own)
    return out


def _mended(named: Mapping[str, Episode], signals: Mapping[str, LookedAt]) -> dict[str, Episode]:
    def of(recording: str, track: Track) -> Track:
        return signals[track.object].tracks.get(recording, track) if track.object in signals else track

    return {name: replace(e, tracks=tuple(of(name, track) for track in e.tracks)) for name, e in named.items()}


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


def _left_out(named: Mapping[str, Episode], findings: Sequence[Finding], still: Sequence[str]) -> dict[str, LeftOut]:
    """Recordings that nothing is computed from: the still ones, and the wrong ones where enough others are sound."""
    wrong = {name for one in findings for name in _wrong(one)} | set(still)
    sound = len(named) - len(wrong)
    chosen = wrong if sound >= max(LEAST, len(wrong)) else set(still)
    if len(chosen) == len(named):
        return {}
    why = {name: [f"{one.signal}: {one.looks}" for one in findings if name in one.samples] for name in chosen}
    return {name: LeftOut(e.source or name, "; ".join(why[name])) for name, e in named.items() if name in chosen}


def _wrong(finding: Finding) -> tuple[str, ...]:
    """Recordings that nothing may be concluded from."""
    return tuple(finding.samples) if finding.severity == "bad" else ()
