"""COMPASS: causality between environment parameters and the sim-to-real gap (Algorithm 1 of the paper).

The policy stays as it is: the actions are those of the recordings. One iteration measures the gap, randomises the
parameters that still have an edge, fits the causal model from scratch and descends its prediction inside the
randomised box.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from compass_ros.calibration.causal_model import CausalModel, reproducible_torch, train
from compass_ros.calibration.randomization import Box, active_parameters, randomise, randomised_box
from compass_ros.config import CompassConfig
from compass_ros.types import (
    Bools,
    Differences,
    Estimate,
    Floats,
    Graph,
    Ints,
    Iteration,
    Parameter,
    Progress,
    Report,
)

_PROGRESS_EPOCHS = 800
"""Epochs after which a training is drawn as done; most end on a plateau between 500 and 1200."""


@dataclass(frozen=True)
class _Step:
    """What one iteration gives to the next."""

    values: Floats
    psi: Floats
    rollouts: int
    moved: float
    """Largest move of a parameter, in half-widths."""
    cancelled: bool


def compass(
    differences: Differences,
    actions: Floats,
    parameters: tuple[Parameter, ...],
    factors: tuple[str, ...],
    start: Floats,
    config: CompassConfig,
    seed: int,
    report: Report,
) -> Estimate:
    """Estimate parameters from `actions` (E, A) of E recorded episodes, starting at `start` (P,).

    Returns the values of the iteration with the smallest measured mean trajectory difference; the trace has every
    iteration. Each iteration costs E rollouts to measure the gap and N x M to fit the model; a last E measure the
    final values. `std` is NaN: the method gives a point. `identifiable` marks the parameters that kept an edge.
    """
    generator = np.random.default_rng(seed)
    episodes = np.arange(len(actions), dtype=np.int64)
    values = np.array(start, dtype=np.float64)
    psi = np.ones((len(parameters), len(factors)))
    trace: list[Iteration] = []
    spent = 0
    reason, converged = f"all {config.n_round} iterations done", False
    with reproducible_torch():
        for i in range(config.n_round + 1):
            measured = differences(np.tile(values, (len(episodes), 1)), episodes).mean(axis=0)
            spent += len(episodes)
            trace.append(Iteration(values, measured, psi, spent))
            gap = float(measured.mean())
            if gap <= config.stop_gap_m:
                reason, converged = (
                    f"the mean trajectory difference {gap:.4g} m is at or below {config.stop_gap_m:g} m",
                    True,
                )
                break
            if i == config.n_round:
                break
            chosen = np.sort(generator.permutation(episodes)[: config.n_cmd_action])
            step = _iterate(differences, actions, chosen, parameters, values, psi, i, gap, config, generator, report)
            spent += step.rollouts
            values, psi, converged = step.values, step.psi, step.moved < 0.1
            if step.cancelled:
                trace.append(Iteration(trace[-1].values, trace[-1].difference, psi, spent))
                reason, converged = f"cancelled in iteration {i + 1} of {config.n_round}", False
                break
            if not active_parameters(psi, config.threshold).any():
                trace.append(Iteration(trace[-1].values, trace[-1].difference, psi, spent))
                reason, converged = f"no parameter has an edge after iteration {i + 1}", False
                break
    best = min(trace, key=lambda entry: float(entry.difference.mean()))
    graph = Graph(tuple(p.name for p in parameters), factors, trace[-1].psi, config.threshold)
    nothing = np.full(len(parameters), np.nan)
    return Estimate("compass", best.values, nothing, graph.active(), graph, tuple(trace), spent, converged, reason)


def _iterate(
    differences: Differences,
    actions: Floats,
    episodes: Ints,
    parameters: tuple[Parameter, ...],
    values: Floats,
    psi: Floats,
    index: int,
    gap: float,
    config: CompassConfig,
    generator: np.random.Generator,
    report: Report,
) -> _Step:
    """Randomise, roll out, fit the model from scratch, update the parameters."""
    active = active_parameters(psi, config.threshold)
    box = randomised_box(values, active, parameters)
    batch = np.repeat(episodes, config.n_sim)
    samples = randomise(box, len(batch), generator)
    d = differences(samples, batch)

    def proceed(epoch: int, sparsity: float) -> bool:
        if epoch % 5:
            return True
        done = (index + min(epoch / _PROGRESS_EPOCHS, 0.95)) / config.n_round
        pruned = 1.0 - (1.0 - sparsity) * float(active.mean())
        return report(Progress("causal graph", index + 1, done, gap, pruned))

    noise = torch.Generator().manual_seed(int(generator.integers(2**63)))
    inputs, scaled_actions = _normalised(samples, box, active), _standardised(actions)
    targets = _standardised(d)
    model = CausalModel(int(active.sum()), actions.shape[1], d.shape[1], config, noise)
    weight = config.sparse_weight * config.sw_discount**index
    training = train(model, inputs, scaled_actions[batch], targets, weight, config, noise, proceed)
    learned = np.zeros_like(psi)
    learned[active] = model.graph().double().numpy()
    if training.cancelled:
        return _Step(values, learned, len(batch), 0.0, cancelled=True)
    shares = torch.as_tensor(d.std(axis=0) / max(float(d.std(axis=0).sum()), 1e-30), dtype=torch.float32)
    centre = _normalised(values[None], box, active)[0]
    found = descend(model, scaled_actions[episodes], shares, centre, config)
    updated = values.copy()
    middle, half = (box.low + box.high) / 2, (box.high - box.low) / 2
    kept = active_parameters(learned, config.threshold)
    updated[active] = middle[active] + half[active] * found.double().numpy()
    updated = np.where(kept, np.clip(updated, box.low, box.high), values)
    widths = np.array([p.half_width for p in parameters])
    moved = float(np.max(np.abs(updated - values)[widths > 0] / widths[widths > 0], initial=0.0))
    return _Step(updated, learned, len(batch), moved, cancelled=False)


def predicted_gap(model: CausalModel, actions: Tensor, shares: Tensor, inputs: Tensor) -> Tensor:
    """J of (3) at `inputs` (P,), averaged over `actions` (E, A), in units of the sum of the factors' spreads.

    J in metres is (1/K) sum_k (mean_k + std_k f_k); `shares` (K,) = std_k / sum std leaves out the constant and the
    scale.
    """
    return (model.expected(inputs.expand(len(actions), -1), actions) @ shares).mean()


def descend(model: CausalModel, actions: Tensor, shares: Tensor, start: Tensor, config: CompassConfig) -> Tensor:
    """Update (3): projected gradient descent on the fixed model from `start` (P,) inside the box [-1, 1]^P."""
    inputs = start.clone()
    for _ in range(config.update_steps):
        inputs.requires_grad_()
        (gradient,) = torch.autograd.grad(predicted_gap(model, actions, shares, inputs), inputs)
        following = (inputs.detach() - config.update_rate * gradient).clamp(-1.0, 1.0)
        step = float((following - inputs.detach()).abs().max())
        inputs = following
        if step < config.update_tolerance:
            break
    return inputs.detach()


def _normalised(values: Floats, box: Box, active: Bools) -> Tensor:
    """(B, P) -> (B, active) with the randomised box at [-1, 1]."""
    half = np.maximum((box.high - box.low) / 2, 1e-300)
    scaled = (values - (box.low + box.high) / 2) / half
    return torch.as_tensor(scaled[:, active], dtype=torch.float32)


def _standardised(values: Floats) -> Tensor:
    """(B, D) with mean 0 and standard deviation 1 in each column; constant columns become 0."""
    spread = values.std(axis=0)
    return torch.as_tensor((values - values.mean(axis=0)) / np.where(spread > 0, spread, 1.0), dtype=torch.float32)
