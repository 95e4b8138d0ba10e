"""What is odd about a set of recordings, though each of them can be read: said with the result, never repaired."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.scene_source import missing_meshes
from compass_ros.cells.signals import turned
from compass_ros.types import Episode, Floats, Track

FEW = 8
"""Fewer episodes than this leave little to hold out."""
_STILL = 6.0
"""An object that stays within so many standard deviations of its median, as the sensor states them, has not moved."""
_EXPECTED = 2.0
"""The least such distance, in the noise that the cell expects."""
_COMMON = 0.5
"""Correlation of two objects' scatter from which most of it is common to both: common over all variance."""
_CHANCE = 1e-4
"""Probability of a correlation as high by chance, at most."""


def doubts(cell: Cell, episodes: Sequence[Episode]) -> tuple[str, ...]:
    """One sentence each; empty when nothing is odd."""
    said = [_few(episodes), _alike(episodes)]
    said += [_unmoved(spec.name, episodes, cell.spec.noise_m) for spec in cell.objects]
    said += [_unturned(signal.name, episodes) for signal in cell.signals if signal.quantity == "pose"]
    places = [spec.name for spec in cell.objects if spec.quantity in ("xy", "xyz", "pose")]
    said.append(_shaking(places, episodes))
    said += [missing_meshes(cell.model_path), *_remarks(episodes)]
    return tuple(filter(None, said))


def _remarks(episodes: Sequence[Episode]) -> list[str]:
    """What reading said, each sentence once with the episodes that it is about."""
    about: dict[str, list[str]] = {}
    for episode in episodes:
        for remark in episode.remarks:
            about.setdefault(remark, []).append(episode.name)
    return [f"{', '.join(names[:3])}{', ...' * (len(names) > 3)}: {remark}" for remark, names in about.items()]


def _few(episodes: Sequence[Episode]) -> str:
    if len(episodes) >= FEW:
        return ""
    many = f"{len(episodes)} episodes are" if len(episodes) > 1 else "one episode is"
    return f"{many} few: {FEW} or more tell parameters apart and leave some to judge by"


def _alike(episodes: Sequence[Episode]) -> str:
    """Recordings of a real camera are never equal to the last bit."""
    seen: dict[bytes, str] = {}
    copies = []
    for episode in episodes:
        content = b"".join(track.value.tobytes() for track in episode.tracks)
        if content in seen:
            copies.append(episode.name)
        seen.setdefault(content, episode.name)
    if not copies:
        return ""
    return (
        f"{len(copies)} of {len(episodes)} episodes are copies of others ({', '.join(copies[:3])}"
        f"{', ...' * (len(copies) > 3)}): they add nothing, and held-out copies of fitted episodes judge nothing"
    )


def _unmoved(name: str, episodes: Sequence[Episode], expected: float) -> str:
    tracks = [track for episode in episodes for track in episode.tracks if track.object == name]
    if not tracks or any(_moves(track, expected) for track in tracks):
        return ""
    return f"{name} never moves in {len(episodes)} episodes: nothing can be said about its parameters"


def _unturned(name: str, episodes: Sequence[Episode]) -> str:
    tracks = [track for episode in episodes for track in episode.tracks if track.object == name]
    if not tracks or turned(tracks):
        return ""
    return f"{name} has one and the same orientation in all messages: where none is measured, say `quantity: position`"


def _shaking(names: Sequence[str], episodes: Sequence[Episode]) -> str:
    """What is seen of several objects at one moment, one camera sees: where they jitter together at rest, it moves."""
    for one, other in combinations(names, 2):
        scatter = [_at_rest(episode, one, other) for episode in episodes]
        of_one, of_other = np.concatenate([np.zeros((2, 0)), *scatter], axis=1)
        if not of_one.any() or not of_other.any():
            continue
        common, chance = _correlation(of_one, of_other)
        if common > _COMMON and chance < _CHANCE:
            size = 1e3 * float(np.sqrt(common) * np.sqrt(of_one.std() * of_other.std()))
            how = f"correlation {common:.2f}, {size:.2g} mm"
            return f"{one} and {other} jitter together while they rest ({how}): their camera or its mount moves"
    return ""


def _correlation(one: Floats, other: Floats) -> tuple[float, float]:
    """Of two rows of numbers, and the probability of so much by chance."""
    from scipy.stats import pearsonr  # takes a second to import

    found = pearsonr(one, other, alternative="greater")
    return float(found.statistic), float(found.pvalue)


def _at_rest(episode: Episode, one: str, other: str) -> Floats:
    """(2, 2 n) of each object: x and y at n stamps before the command at which both were seen, less their medians.

    Medians, for what never changes is then zero to the last bit.
    """
    tracks = [track for name in (one, other) for track in episode.tracks if track.object == name]
    if len(tracks) < 2:
        return np.zeros((2, 0))
    before = [track.stamp_ns[track.stamp_ns < episode.start_ns] for track in tracks]
    both = np.intersect1d(before[0], before[1])
    if not len(both):
        return np.zeros((2, 0))
    seen = [track.value[np.isin(track.stamp_ns, both), :2] for track in tracks]
    return np.stack([(place - np.median(place, axis=0)).ravel() for place in seen])


def _moves(track: Track, expected: float) -> bool:
    spread = np.abs(track.value - np.median(track.value, axis=0)).max()
    limit = max(_STILL * float(np.median(track.std)) if track.std is not None else 0.0, _EXPECTED * expected)
    return bool(spread > limit)
