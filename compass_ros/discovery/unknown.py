"""Where something acts that has no name: flexible pushes, warps and launches, each weighed by its evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from compass_ros.discovery.choice import Choice
from compass_ros.discovery.screen import Space
from compass_ros.types import Channel, Floats, Phase, Region, Where

_SIZES = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1)
"""Prior sizes of a flexible push that are tried [m/s^2; of a joint its unit, `Impulses.push`]."""
_LENGTH = 0.12
"""Distance over which a flexible push is alike [m; of a joint `Impulses.length`]."""
_SHARED = 0.5
"""Part of a push's variance that is the same for all movers at one place and time; the rest is each mover's own."""
_CLEARLY = 10.0
"""Log evidence from which a push stands out, and by which a push on one mover must surpass one on all."""
_HALF = 0.6
"""Share of the pushes' strength that a region must hold to be told as the place."""
_PHASE: Mapping[Channel, Phase] = {"actuation": "strike", "contact": "object_contact", "sensing": "all"}
"""Where an effect of each channel but `dynamics` shows."""


@dataclass(frozen=True)
class _Push:
    """A flexible push at its best prior size."""

    gain: float
    """Log evidence over no push."""
    mean: Floats
    """(E, K, N, 2) [m/s^2]"""


def whereabouts(space: Space, choice: Choice) -> tuple[Where, bool]:
    """Object, phase and channel of what is left, and whether it stands out at all.

    Pushes that depend smoothly on place and time, on all movers or on one, are weighed against the best fits of known
    effects of the other channels: what explains more says where it is. What is struck first moves the others too, so a
    push on it alone explains almost all of a push on all: one mover is told only where the others clearly feel nothing.
    """
    movers = space.pushes.movers
    pushes = {objects: _push(space, objects) for objects in dict.fromkeys([movers, *((m,) for m in movers)])}
    best = max(pushes, key=lambda objects: pushes[objects].gain + (_CLEARLY if objects == movers else 0.0))
    others = {j.added[0].effect.channel: j for j in reversed(choice.singles) if j.added[0].effect.channel != "dynamics"}
    rival = min(others.values(), key=lambda j: j.fit.point.cost, default=None)
    explained = choice.floor + choice.excess - rival.fit.point.cost if rival else 0.0
    if rival is not None and explained > 1.2 * pushes[best].gain:
        channel = rival.added[0].effect.channel
        return Where("all", _PHASE[channel], channel), True
    name = best[0] if len(best) == 1 and len(movers) > 1 else "all"
    return Where(name, "free", "dynamics", _region(space, pushes[best])), pushes[best].gain > _CLEARLY


def _kernel(space: Space, objects: tuple[str, ...]) -> Floats:
    """(E K N, E K N) covariance of a push at all moments of all episodes: smooth in place, so episodes share it."""
    pushes = space.pushes
    place = (pushes.paths[..., :2] / pushes.length[:, None]).reshape(-1, 2)
    time = np.broadcast_to(pushes.moments[None, :, None], pushes.paths.shape[:3]).ravel()
    acts = np.array([m in objects for m in pushes.movers])
    on = np.broadcast_to(acts, pushes.paths.shape[:3]).ravel().astype(float)
    mover = np.broadcast_to(np.arange(len(pushes.movers)), pushes.paths.shape[:3]).ravel()
    alike = np.where(mover[:, None] == mover[None], 1.0, _SHARED)
    apart = np.sum((place[:, None] - place[None]) ** 2, axis=2) / _LENGTH**2
    field = np.exp(-0.5 * apart)
    pulse = np.exp(-0.5 * ((time[:, None] - time[None]) / 0.15) ** 2)
    return np.asarray((field + pulse) * alike * on[:, None] * on[None])


def _push(space: Space, objects: tuple[str, ...]) -> _Push:
    """The flexible push of the prior size that explains most."""
    pushes = space.pushes
    shape = pushes.paths.shape[:3]
    kernel = _kernel(space, objects)
    root = np.linalg.cholesky(kernel + 1e-6 * np.eye(len(kernel)))
    keep = min(120, len(root))
    vectors, values, _ = np.linalg.svd(root, full_matrices=False)
    basis = (vectors[:, :keep] * values[:keep]).reshape(*shape, keep)
    both = np.zeros((*shape, 2, 2 * keep))
    both[..., 0, :keep] = basis
    both[..., 1, keep:] = basis
    weights = (both * pushes.push[:, None, None]).reshape(shape[0], -1, 2 * keep)
    matrix, pull = space.reduced(weights)
    kappa = space.likelihood.correlation_time
    best = _Push(-np.inf, np.zeros((*shape, 2)))
    for size in _SIZES:
        inner = size**2 * matrix / kappa + np.eye(len(pull))
        mean = -np.linalg.solve(inner, size * pull / kappa)
        gain = -0.5 * size * float(pull @ mean) - 0.5 * kappa * float(np.linalg.slogdet(inner)[1])
        if gain > best.gain:
            best = _Push(gain, np.asarray((weights @ (size * mean)).reshape(*shape, 2)))
    return best


def _region(space: Space, push: _Push) -> Region | None:
    """A disc that holds most of the push's strength, where it is clearly smaller than the table; none of joints."""
    if space.pushes.joints.any():
        return None
    strength = np.sum(push.mean**2, axis=3).ravel()
    place = space.pushes.paths[..., :2].reshape(-1, 2)
    if strength.sum() <= 0:
        return None
    centre = (strength[:, None] * place).sum(axis=0) / strength.sum()
    far = np.hypot(*(place - centre).T)
    order = np.argsort(far)
    inside = np.searchsorted(np.cumsum(strength[order]), 0.9 * strength.sum())
    radius = float(far[order][min(inside, len(far) - 1)])
    share = float(np.mean(far <= radius))
    return Region((float(centre[0]), float(centre[1])), radius) if share < _HALF else None
