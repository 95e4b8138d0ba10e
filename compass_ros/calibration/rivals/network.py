"""What EXI-Net and Tune-Net share: trajectories as vectors, a multilayer perceptron, its training."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor, nn

from compass_ros.calibration.problem import Problem
from compass_ros.types import Floats, Ints

HIDDEN = (256, 256)
EPOCHS = 4000
BATCH = 64
LEARNING_RATE = 1e-3
PATIENCE, PLATEAU = 100, 0.01
"""The same early end as ours: a training stops when `PATIENCE` epochs lowered the loss by less than `PLATEAU`."""
FRAMES = 50
"""Frames of a trajectory that a network sees, spread evenly; the paper's trajectories have 50 steps."""


def vectors(problem: Problem, trajectories: Floats, episodes: Ints) -> Tensor:
    """(B, F, C) -> (B, FRAMES C) as 32-bit; what was not seen in the recording is 0 in both."""
    chosen = frame_indices(problem)
    seen = problem.weight[episodes][:, chosen] > 0
    flat = np.where(seen, trajectories[:, chosen], 0.0).reshape(len(trajectories), -1)
    return torch.as_tensor(flat, dtype=torch.float32)


def frame_indices(problem: Problem) -> Ints:
    """At most FRAMES indices of frames."""
    frames = problem.measured.shape[1]
    return np.unique(np.linspace(0, frames - 1, min(FRAMES, frames)).round().astype(np.int64))


def perceptron(inputs: int, outputs: int, generator: torch.Generator) -> nn.Sequential:
    """ReLU network with the hidden layers of the paper's tables."""
    sizes = (inputs, *HIDDEN, outputs)
    layers: list[nn.Module] = []
    for rows, columns in itertools.pairwise(sizes):
        linear = nn.Linear(rows, columns)
        with torch.no_grad():
            for tensor in (linear.weight, linear.bias):
                tensor.copy_((torch.rand(tensor.shape, generator=generator) * 2 - 1) * rows**-0.5)
        layers += [linear, nn.ReLU()]
    return nn.Sequential(*layers[:-1])


Pairs = Callable[[Tensor], tuple[Tensor, Tensor]]
"""Indices of a batch -> inputs and targets."""


def fit(
    network: nn.Module, pairs: Pairs, count: int, generator: torch.Generator, proceed: Callable[[int], bool]
) -> bool:
    """Mean squared error with Adam on batches of `count` samples; False when `proceed` stopped it."""
    optimizer = torch.optim.Adam(network.parameters(), lr=LEARNING_RATE, fused=True)
    window, before = 0.0, float("inf")
    for epoch in range(1, EPOCHS + 1):
        total = torch.zeros(())
        for batch in torch.split(torch.randperm(count, generator=generator), BATCH):
            inputs, targets = pairs(batch)
            loss = (network(inputs) - targets).square().mean()
            optimizer.zero_grad(set_to_none=True)
            loss.backward()
            optimizer.step()
            total += loss.detach() * len(batch)
        window += total.item() / count
        if not proceed(epoch):
            return False
        if epoch % PATIENCE == 0:
            if window > (1.0 - PLATEAU) * before:
                return True
            window, before = 0.0, window
    return True


def spread(values: Tensor) -> tuple[Tensor, Tensor]:
    """Mean and standard deviation of each column; 1 where a column is constant."""
    deviation = values.std(dim=0, unbiased=False)
    return values.mean(dim=0), torch.where(deviation > 1e-9, deviation, torch.ones_like(deviation))
