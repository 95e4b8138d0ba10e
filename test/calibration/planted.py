"""Analytic stand-ins for a simulator, with known causes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.types import Bools, Floats, Ints, Parameter


@dataclass(frozen=True)
class Planted:
    """E shots of an oscillator-like motion that `causes` change and the other parameters do not."""

    parameters: tuple[Parameter, ...]
    truth: Floats
    edges: Bools
    """(P, K)"""
    actions: Floats
    noise: float = 0.0
    frames: int = 20
    seed: int = 0

    def trajectories(self, values: Floats, episodes: Ints) -> Floats:
        """(B, P), (B,) -> (B, F, 2K): each factor has an x and a y."""
        factors = self.edges.shape[1]
        time = np.linspace(0.0, 1.0, self.frames)
        phase = np.arange(len(self.parameters)) * 2.399
        strength = 1.0 + 0.3 * np.sin(3.0 * self.actions[episodes, :1])
        out = np.empty((len(values), self.frames, 2 * factors))
        for k in range(factors):
            drive = (values * self.edges[:, k] * strength)[:, None, :]
            out[:, :, 2 * k] = (drive * np.sin(2 * time[:, None] + phase)).sum(axis=2)
            out[:, :, 2 * k + 1] = (np.tanh(drive) * np.cos(3 * time[:, None] + phase)).sum(axis=2)
        return out

    def measured(self) -> Floats:
        """(E, F, 2K) with correlated noise, AR(1) with coefficient 0.6."""
        episodes = np.arange(len(self.actions))
        clean = self.trajectories(np.tile(self.truth, (len(episodes), 1)), episodes)
        generator = np.random.default_rng(self.seed)
        white = generator.normal(size=clean.shape) * self.noise
        for f in range(1, self.frames):
            white[:, f] = 0.6 * white[:, f - 1] + 0.8 * white[:, f]
        return np.asarray(clean + white)

    def differences(self, values: Floats, episodes: Ints) -> Floats:
        error = self.trajectories(values, episodes) - self.measured()[episodes]
        pairs = error.reshape(*error.shape[:2], -1, 2)
        return np.asarray(np.linalg.norm(pairs, axis=3).sum(axis=1))


def planted(
    parameters: int, causes: int, *, factors: int = 2, episodes: int = 10, noise: float = 0.0, seed: int = 0
) -> Planted:
    """`causes` of the parameters are wrong and have an edge to one factor or (each third) to all."""
    generator = np.random.default_rng(seed)
    which = np.sort(generator.permutation(parameters)[:causes])
    edges = np.zeros((parameters, factors), dtype=bool)
    for n, r in enumerate(which):
        edges[r, n % factors] = True
        edges[r] |= n % 3 == 0
    truth = np.zeros(parameters)
    truth[which] = generator.uniform(0.5, 0.9, causes) * generator.choice([-1.0, 1.0], causes)
    described = tuple(Parameter(f"thing@dyna@p{r}", 0.0, -1.5, 1.5, "1", 1.0) for r in range(parameters))
    return Planted(described, truth, edges, generator.uniform(-1, 1, (episodes, 3)), noise, seed=seed)
