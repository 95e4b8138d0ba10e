"""A network on top of a simulator: what that leaves of recordings, learned from the command, the time and what it says.

Residual physics as in TossingBot (Zeng et al., 2019, IEEE Transactions on Robotics 36): the simulator predicts, the
network corrects. Of what is stepped: `augmented.py`.
"""

from __future__ import annotations

import copy

import numpy as np
import torch
from torch import Tensor, nn

from compass_ros.types import Floats, Ints

MEMBERS = 5
HIDDEN = 64
EPOCHS = 300
DECAY = 1e-3


class Ensemble:
    """Five networks, each on another four fifths of the recordings and kept where the fifth fits best; their mean."""

    def __init__(self, features: Floats, left: Floats, recording: Ints, seed: int) -> None:
        """(N, X) features, (N, Y) what is left, NaN where not known, and of which recording each of the N rows is."""
        self._middle, self._scale = features.mean(axis=0), np.maximum(features.std(axis=0), 1e-9)
        seen = ~np.isnan(left).any(axis=1)
        self._size = np.maximum(left[seen].std(axis=0), 1e-9)
        x, y = self._tensor(features), torch.as_tensor(left / self._size, dtype=torch.float32)
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            fifth = np.random.default_rng(seed).permutation(recording.max() + 1)[recording] % MEMBERS
            self._members = [_fitted(x, y, seen & (fifth != m), seen & (fifth == m), m) for m in range(MEMBERS)]

    def __call__(self, features: Floats) -> Floats:
        """(N, Y) for (N, X)."""
        x = self._tensor(features)
        with torch.no_grad():
            mean = torch.stack([member(x) for member in self._members]).mean(dim=0).double().numpy()
        return np.asarray(mean * self._size)

    def _tensor(self, features: Floats) -> Tensor:
        return torch.as_tensor((features - self._middle) / self._scale, dtype=torch.float32)


class Residual:
    """The correction of whole shots that was learned; callable as `belief.Correction`."""

    def __init__(self, commands: Floats, time_s: Floats, said: Floats, measured: Floats, seed: int) -> None:
        """(E, A) commands, (F,) times [s], (E, F, C) what the simulator said and what was measured, NaN where not."""
        features = self._features(commands, time_s, said)
        episode = np.repeat(np.arange(len(commands)), len(time_s))
        self._left = Ensemble(features, (measured - said).reshape(len(features), -1), episode, seed)

    def __call__(self, commands: Floats, time_s: Floats, said: Floats) -> Floats:
        return np.asarray(said + self._left(self._features(commands, time_s, said)).reshape(said.shape))

    @staticmethod
    def _features(commands: Floats, time_s: Floats, said: Floats) -> Floats:
        """(B F, A + 1 + C)"""
        shape = said.shape[:2]
        of_command = np.broadcast_to(commands[:, None], (*shape, commands.shape[1]))
        time = np.broadcast_to(time_s[None, :, None], (*shape, 1))
        return np.asarray(np.concatenate([of_command, time, said], axis=2).reshape(shape[0] * shape[1], -1))


def _fitted(x: Tensor, y: Tensor, fit: Floats, judge: Floats, seed: int) -> nn.Module:
    last = nn.Linear(HIDDEN, y.shape[1])
    nn.init.zeros_(last.weight)  # begins as no correction
    nn.init.zeros_(last.bias)
    network = nn.Sequential(nn.Linear(x.shape[1], HIDDEN), nn.Tanh(), nn.Linear(HIDDEN, HIDDEN), nn.Tanh(), last)
    optimizer = torch.optim.AdamW(network.parameters(), lr=3e-3, weight_decay=DECAY)
    generator = torch.Generator().manual_seed(seed)
    rows, others = torch.as_tensor(np.flatnonzero(fit)), torch.as_tensor(np.flatnonzero(judge))
    best, kept = float("inf"), copy.deepcopy(network)
    for _ in range(EPOCHS):
        for batch in torch.split(rows[torch.randperm(len(rows), generator=generator)], 256):
            loss = (network(x[batch]) - y[batch]).square().mean()
            optimizer.zero_grad(set_to_none=True)
            loss.backward()
            optimizer.step()
        with torch.no_grad():
            missed = float((network(x[others]) - y[others]).square().mean())
        if missed < best:
            best, kept = missed, copy.deepcopy(network)
    return kept
