"""Faults that are put into clean recordings, each as public bug reports describe it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from compass_ros.types import Episode, Floats, Ints, Track
from test.checks.robots import changed

Fault = Callable[[Sequence[Episode], np.random.Generator], list[Episode]]


def _moving(track: Track, share: float = 0.5) -> Ints:
    """Samples at which it is away from zero and from where it is usually."""
    size = np.linalg.norm(track.value[:, :3], axis=1)
    return np.flatnonzero(size > np.quantile(size, share))


def wrapped(episodes: Sequence[Episode], rng: np.random.Generator) -> list[Episode]:
    """An angle that is reported in (-pi, pi]; turned first, so that some of the way is beyond."""
    out = []
    for e in episodes:
        value = e.tracks[0].value
        turned = value + np.pi - np.median(value)
        out.append(changed(e, value=(turned + np.pi) % (2 * np.pi) - np.pi))
    return out


def zeros_of_another(episodes: Sequence[Episode], rng: np.random.Generator) -> list[Episode]:
    """A second publisher says zeros at a rate of its own."""
    return [_with_another(e, 6, np.zeros_like) for e in episodes]


def another_constant(episodes: Sequence[Episode], rng: np.random.Generator) -> list[Episode]:
    """A second publisher says what was once true."""
    return [_with_another(e, 4, lambda value: np.tile(value.mean(axis=0) + 0.7, (len(value), 1))) for e in episodes]


def another_place(episodes: Sequence[Episode], rng: np.random.Generator) -> list[Episode]:
    """A second publisher says the same thing seen from elsewhere, every second message."""
    return [_with_another(e, 1, lambda value: 0.9 * value + 0.6) for e in episodes]


def _with_another(e: Episode, every: int, say: Callable[[Floats], Floats]) -> Episode:
    track = e.tracks[0]
    which = np.arange(0, len(track.stamp_ns), every)
    stamps = np.concatenate([track.stamp_ns, track.stamp_ns[which] + 2_000_000])
    said = track.value[which].copy()
    said[:, :3] = say(said[:, :3])
    order = np.argsort(stamps)
    return changed(e, stamp_ns=stamps[order], value=np.concatenate([track.value, said])[order])


def sporadic_zeros(episodes: Sequence[Episode], rng: np.random.Generator) -> list[Episode]:
    """Now and then a driver says zero, in three of the recordings."""
    out = list(episodes)
    for i in (1, 2, 5):
        value = out[i].tracks[0].value.copy()
        value[np.sort(rng.choice(_moving(out[i].tracks[0])[3:-3], 4, replace=False)), :3] = 0.0
        out[i] = changed(out[i], value=value)
    return out


def frozen_for_a_while(episodes: Sequence[Episode], rng: np.random.Generator) -> list[Episode]:
    """The value is repeated while it goes on, where it is fastest, in two of the recordings."""
    out = list(episodes)
    for i in (0, 3):
        value = out[i].tracks[0].value.copy()
        speed = np.linalg.norm(np.diff(value[:, :3], axis=0), axis=1)
        smooth = np.convolve(speed, np.ones(12) / 12, mode="same")
        at = int(np.clip(np.argmax(smooth[12:-20]) + 12, 12, len(value) - 20)) - 4
        value[at : at + 8] = value[at]
        out[i] = changed(out[i], value=value)
    return out


def frozen_to_the_end(episodes: Sequence[Episode], rng: np.random.Generator) -> list[Episode]:
    """The last third is one value, in every second recording."""
    out = list(episodes)
    for i in range(0, len(out), 2):
        value = out[i].tracks[0].value.copy()
        value[-len(value) // 3 :] = value[-len(value) // 3]
        out[i] = changed(out[i], value=value)
    return out


def held(episodes: Sequence[Episode], rng: np.random.Generator) -> list[Episode]:
    """Three messages for each measurement."""
    return [changed(e, value=np.repeat(e.tracks[0].value[::3], 3, axis=0)[: len(e.tracks[0].value)]) for e in episodes]


def clock_jumps(episodes: Sequence[Episode], rng: np.random.Generator) -> list[Episode]:
    """The clock is set forward, by 0.3 to 2 s, in the middle of two recordings."""
    out = list(episodes)
    for i in (1, 4):
        stamps = out[i].tracks[0].stamp_ns.copy()
        value = out[i].tracks[0].value[:, :3]
        speed = np.linalg.norm(value[6:] - value[:-6], axis=1)
        at = int(np.argmax(speed[10:-10])) + 13
        stamps[at:] += int(rng.uniform(0.3, 2.0) * 1e9)
        out[i] = changed(out[i], stamp_ns=stamps)
    return out


def degrees(episodes: Sequence[Episode], rng: np.random.Generator) -> list[Episode]:
    return [changed(e, value=np.degrees(e.tracks[0].value)) for e in episodes]


def millimetres(episodes: Sequence[Episode], rng: np.random.Generator) -> list[Episode]:
    out = []
    for e in episodes:
        value = e.tracks[0].value.copy()
        value[:, :3] *= 1000
        out.append(changed(e, value=value))
    return out


def begins_late(episodes: Sequence[Episode], rng: np.random.Generator) -> list[Episode]:
    """The recording begins some seconds before anybody lets go."""
    out = []
    for e in episodes:
        tracks = []
        lead_ns = int(rng.uniform(0.2, 6.0) * 1e9)
        for track in e.tracks:
            period = int(np.median(np.diff(track.stamp_ns)))
            stamps = np.arange(e.start_ns, e.start_ns + lead_ns, period)
            noise = np.std(np.diff(track.value, 3, axis=0), axis=0) / np.sqrt(20)
            still = track.value[0] + np.minimum(noise, 1e-3) * rng.normal(size=(len(stamps), len(noise)))
            moved = np.concatenate([stamps, track.stamp_ns + (stamps[-1] + period - track.stamp_ns[0])])
            tracks.append(Track(track.object, track.quantity, moved, np.concatenate([still, track.value])))
        out.append(Episode(e.name, e.cell, e.cell_hash, e.action, e.start_ns, tuple(tracks)))
    return out
