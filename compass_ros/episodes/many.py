"""Many bags at once: one that is bad never costs the others, and is named with the reason."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from compass_ros.episodes.reader import Hashes, find_bags, read_episode
from compass_ros.episodes.sources import Source
from compass_ros.errors import BagError, CompassError
from compass_ros.types import Episode, LeftOut


@dataclass(frozen=True)
class Found:
    """The bags that paths name, and the paths that name none."""

    bags: tuple[Path, ...]
    left_out: tuple[LeftOut, ...]


@dataclass(frozen=True)
class Reading:
    """What could be read; sorted by name, then start."""

    episodes: tuple[Episode, ...]
    left_out: tuple[LeftOut, ...]


def find_each(paths: Iterable[str | Path]) -> Found:
    """As `find_bags`, each path by itself. Raises BagError where there is no bag at all."""
    found: dict[Path, Path] = {}
    left_out = []
    for path in paths:
        try:
            if not Path(path).exists():
                raise BagError(f"{path}: no such bag")
            for bag in find_bags([path]):
                found.setdefault(bag.resolve(), bag)
        except BagError as error:
            left_out.append(_left_out(path, error))
        except OSError as error:
            left_out.append(LeftOut(str(path), f"cannot be read: {error.strerror}"))
    if not found:
        raise BagError(_none(left_out) if left_out else "no episodes: expected at least one bag, found none")
    return Found(tuple(found.values()), tuple(left_out))


def read_each(
    paths: Iterable[str | Path],
    sources: Sequence[Source],
    cell: str = "",
    cell_hash: Hashes = "",
    use: Callable[[Episode], object] = lambda episode: episode,
) -> Reading:
    """As `read_episodes`, without the bags that cannot be read, or of which `use` raises a CompassError.

    Raises BagError where nothing is left.
    """
    found = find_each(paths)
    episodes, left_out = [], list(found.left_out)
    for bag in found.bags:
        try:
            episode = read_episode(bag, sources, cell, cell_hash)
            use(episode)
            episodes.append(episode)
        except CompassError as error:
            left_out.append(_left_out(bag, error))
    if not episodes:
        raise BagError(_none(left_out))
    return Reading(tuple(sorted(episodes, key=lambda e: (e.name, e.start_ns, e.source))), tuple(left_out))


def _left_out(path: str | Path, error: CompassError) -> LeftOut:
    return LeftOut(str(path), str(error).removeprefix(f"{path}: ").removeprefix(f"{path}/"))


def _none(left_out: Sequence[LeftOut]) -> str:
    """Why nothing is left, in one line."""
    first = left_out[0]
    others = f"; none of the other {len(left_out) - 1} can be used either" if len(left_out) > 1 else ""
    return f"{first.bag}: {first.reason}{others}"
