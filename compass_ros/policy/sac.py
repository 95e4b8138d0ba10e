"""Soft actor-critic (Haarnoja et al., ICML 2018) on many rollouts side by side, as lean as small networks ask for.

Networks, entropy, discount and smoothing are the COMPASS paper's table. Rollouts cost far more here than steps of
learning, so that it learns more often than there: the paper takes 32 steps on 32 transitions after 512 new ones.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from compass_ros.types import Floats, Progress, Report, silent


class Rollouts(Protocol):
    """B rollouts side by side that all end after `horizon` steps. Actions are from -1 to 1."""

    seen: int
    chosen: int
    count: int
    horizon: int

    def reset(self) -> Floats:
        """(B, S) what is seen at the start of new rollouts."""
        ...

    def step(self, actions: Floats) -> tuple[Floats, Floats]:
        """(B, A) -> (B, S) what is seen then and (B,) rewards."""
        ...


@dataclass(frozen=True)
class Settings:
    """The paper's table, and what is ours."""

    hidden: tuple[int, ...] = (32, 32)
    entropy: float = 0.005
    discount: float = 0.99
    smoothing: float = 0.005
    rate: float = 1e-3
    """The paper has 0.0003."""
    batch: int = 128
    """The paper has 32."""
    steps: int = 40
    """Of learning after each step of all rollouts; the paper has 4."""
    warmup: int = 256
    """Transitions by chance before anything is learned; the paper has 100."""


@dataclass(frozen=True)
class Policy:
    """A trained one, as weights."""

    layers: tuple[tuple[Floats, Floats], ...]
    """Weight (n, m) and bias (m,) of each layer; the last one gives means, then logarithms of deviations."""

    def act(self, seen: Floats, rng: np.random.Generator | None = None) -> Floats:
        """(B, A) the best actions for (B, S), or with `rng` drawn from the policy."""
        x = seen
        for weight, bias in self.layers[:-1]:
            x = np.maximum(x @ weight + bias, 0.0)
        mean, log = np.split(x @ self.layers[-1][0] + self.layers[-1][1], 2, axis=1)
        if rng is not None:
            mean = mean + np.exp(np.clip(log, *_LOG)) * rng.standard_normal(mean.shape)
        return np.asarray(np.tanh(mean))

    def save(self, path: Path) -> None:
        """As NPZ: weight0, bias0, ..."""
        numbered = [(f"{i}", *layer) for i, layer in enumerate(self.layers)]
        kept = {f"weight{i}": w for i, w, _ in numbered} | {f"bias{i}": b for i, _, b in numbered}
        np.savez(path, **kept)


def read(path: Path) -> Policy:
    """What `Policy.save` has written."""
    with np.load(path) as kept:
        return Policy(tuple((kept[f"weight{i}"], kept[f"bias{i}"]) for i in range(len(kept.files) // 2)))


_LOG = (-20.0, 2.0)


class _Net:
    """N multilayer perceptrons side by side."""

    def __init__(self, sizes: Sequence[int], copies: int, generator: torch.Generator) -> None:
        self.layers: list[tuple[Tensor, Tensor]] = []
        for rows, columns in itertools.pairwise(sizes):
            bound = rows**-0.5
            weight, bias = (
                (2 * torch.rand(shape, generator=generator) - 1) * bound
                for shape in ((copies, rows, columns), (copies, 1, columns))
            )
            self.layers.append((weight.requires_grad_(), bias.requires_grad_()))

    def __call__(self, x: Tensor) -> Tensor:
        """(B, n) -> (N, B, m)"""
        h = x.expand(len(self.layers[0][0]), *x.shape)
        for weight, bias in self.layers[:-1]:
            h = torch.relu(torch.baddbmm(bias, h, weight))
        return torch.baddbmm(self.layers[-1][1], h, self.layers[-1][0])

    @property
    def parameters(self) -> list[Tensor]:
        return [tensor for pair in self.layers for tensor in pair]


class _Learner:
    """Actor, two critics and their slow copies."""

    def __init__(self, seen: int, chosen: int, settings: Settings, seed: int) -> None:
        self.settings, self.generator = settings, torch.Generator().manual_seed(seed)
        self.actor = _Net((seen, *settings.hidden, 2 * chosen), 1, self.generator)
        sizes = (seen + chosen, *settings.hidden, 1)
        self.critics, self.slow = _Net(sizes, 2, self.generator), _Net(sizes, 2, self.generator)
        self._follow(1.0)
        self._of_actor = torch.optim.Adam(self.actor.parameters, lr=settings.rate, fused=True)
        self._of_critics = torch.optim.Adam(self.critics.parameters, lr=settings.rate, fused=True)

    def act(self, seen: Tensor) -> tuple[Tensor, Tensor]:
        """Actions and their log-probabilities."""
        mean, log = self.actor(seen)[0].chunk(2, dim=1)
        log = log.clamp(*_LOG)
        fresh = torch.randn(mean.shape, generator=self.generator)
        raw = mean + log.exp() * fresh
        action = torch.tanh(raw)
        squash = 2 * (math.log(2) - raw - torch.nn.functional.softplus(-2 * raw))
        return action, (-0.5 * fresh**2 - log - 0.5 * math.log(2 * math.pi) - squash).sum(dim=1)

    def learn(self, seen: Tensor, action: Tensor, reward: Tensor, then: Tensor, goes_on: Tensor) -> None:
        """One step on a batch."""
        target = reward
        if bool(goes_on.any()):
            with torch.no_grad():
                following, log = self.act(then)
                value = self.slow(torch.cat((then, following), dim=1))[:, :, 0].min(dim=0).values
                target = reward + self.settings.discount * goes_on * (value - self.settings.entropy * log)
        said = self.critics(torch.cat((seen, action), dim=1))[:, :, 0]
        loss = 0.5 * (said - target).square().mean(dim=1).sum()
        self._of_critics.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]  # torch
        self._of_critics.step()
        own, log = self.act(seen)
        value = self.critics(torch.cat((seen, own), dim=1))[:, :, 0].min(dim=0).values
        self._of_actor.zero_grad(set_to_none=True)
        (self.settings.entropy * log - value).mean().backward()  # type: ignore[no-untyped-call]  # torch
        self._of_actor.step()
        if bool(goes_on.any()):
            self._follow(self.settings.smoothing)

    def _follow(self, share: float) -> None:
        with torch.no_grad():
            for slow, fast in zip(self.slow.parameters, self.critics.parameters, strict=True):
                slow.lerp_(fast, share)

    def policy(self) -> Policy:
        """The actor as arrays."""
        return Policy(tuple((w[0].detach().double().numpy(), b[0, 0].detach().double().numpy())
                            for w, b in self.actor.layers))  # fmt: skip


def learn(
    rollouts: Rollouts, transitions: int, seed: int, settings: Settings | None = None, report: Report = silent
) -> Policy:
    """Train on about so many transitions. The same seed gives the same bits on the same machine."""
    s, threads = settings or Settings(), torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        return _learn(rollouts, transitions, seed, s, report)
    finally:
        torch.set_num_threads(threads)


def _learn(rollouts: Rollouts, transitions: int, seed: int, s: Settings, report: Report) -> Policy:
    learner, rng = _Learner(rollouts.seen, rollouts.chosen, s, seed), np.random.default_rng([seed, 1])
    rounds = max(math.ceil(transitions / rollouts.count), 1)
    size = rounds * rollouts.count
    kept = [torch.zeros(size, n) for n in (rollouts.seen, rollouts.chosen, rollouts.seen)]
    reward, goes_on = torch.zeros(size), torch.zeros(size)
    seen, at = rollouts.reset(), 0
    for i in range(rounds):
        if at < min(s.warmup, size // 2):
            action = rng.uniform(-1, 1, (rollouts.count, rollouts.chosen))
        else:
            with torch.no_grad():
                action = learner.act(torch.as_tensor(seen, dtype=torch.float32))[0].double().numpy()
        then, gained = rollouts.step(action)
        ended = (i + 1) % rollouts.horizon == 0
        own = slice(at, at + rollouts.count)
        for where, what in zip(kept, (seen, action, then), strict=True):
            where[own] = torch.as_tensor(what, dtype=torch.float32)
        reward[own], goes_on[own] = torch.as_tensor(gained, dtype=torch.float32), 0.0 if ended else 1.0
        at += rollouts.count
        seen = rollouts.reset() if ended else then
        if at >= min(s.warmup, size // 2):
            for _ in range(s.steps):
                rows = torch.as_tensor(rng.integers(0, at, s.batch))
                learner.learn(kept[0][rows], kept[1][rows], reward[rows], kept[2][rows], goes_on[rows])
        if not report(Progress("train", at, at / size, math.nan, math.nan)):
            break
    return learner.policy()
