"""Tune-Net (Allevato et al., CoRL 2019): regress the step in the parameters from a pair of trajectories, then repeat
it.

Trained once on the rollouts of the whole allowance (6400 in the COMPASS paper), which are drawn uniformly within the
bounds; then ten updates, each from new rollouts at the current values beside the recorded ones. Chosen, because it is
left open: pairs are drawn anew in each batch among the rollouts of the same action, and the steps proposed by the
recorded episodes are averaged.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from compass_ros.calibration.causal_model import reproducible_torch
from compass_ros.calibration.problem import Allowance, Problem
from compass_ros.calibration.rivals.network import fit, perceptron, spread, vectors
from compass_ros.calibration.rivals.record import Record
from compass_ros.types import Estimate, Floats, Report

UPDATES = 10
"""K of the paper's table."""


def tune_net(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    """Spends the allowance at once, then E rollouts for each update; returns the best measured values."""
    random = np.random.default_rng(seed)
    record = Record("tune-net", problem, report)
    with reproducible_torch():
        chosen = np.sort(random.permutation(problem.episodes)[: allowance.real])
        each = allowance.rollouts // len(chosen)
        episodes = np.repeat(chosen, each)
        unit = random.random((len(episodes), len(problem.parameters)))
        values = problem.low + (problem.high - problem.low) * unit
        rolled = vectors(problem, problem.trajectories(values, episodes), episodes)
        record.spend(len(episodes))
        all_actions = torch.as_tensor(problem.actions, dtype=torch.float32)
        action_mean, action_spread = spread(all_actions)
        actions = (all_actions - action_mean) / action_spread
        mean, deviation = spread(rolled)
        network = _trained(record, (rolled - mean) / deviation, unit, actions[episodes], each, random)
        current = np.asarray(problem.start, dtype=np.float64)
        record.measure(current)
        for i in range(UPDATES if not record.cancelled else 0):
            all_episodes = problem.episodes
            here = problem.trajectories(np.tile(current, (len(all_episodes), 1)), all_episodes)
            record.spend(len(all_episodes))
            real = vectors(problem, problem.measured, all_episodes)
            pair = (vectors(problem, here, all_episodes), real)
            scaled = [(side - mean) / deviation for side in pair]
            with torch.no_grad():
                step: Floats = network(torch.cat((*scaled, actions), dim=1)).mean(dim=0).double().numpy()
            current = np.clip(current + step * (problem.high - problem.low), problem.low, problem.high)
            record.measure(current)
            if not record.proceed(0.9 + 0.1 * (i + 1) / UPDATES):
                break
    return record.estimate(f"{UPDATES} updates done", values=None)


def _trained(
    record: Record, rolled: Tensor, unit: Floats, actions: Tensor, each: int, random: np.random.Generator
) -> nn.Sequential:
    """Network from (first trajectory, second trajectory, action) to the step in the parameters, as shares of the
    bounds."""
    generator = torch.Generator().manual_seed(int(random.integers(2**63)))
    places = torch.as_tensor(unit, dtype=torch.float32)
    network = perceptron(2 * rolled.shape[1] + actions.shape[1], places.shape[1], generator)

    def pairs(first: Tensor) -> tuple[Tensor, Tensor]:
        start = (first // each) * each  # rollouts lie action by action
        second = start + torch.randint(each, (len(first),), generator=generator)
        inputs = torch.cat((rolled[first], rolled[second], actions[first]), dim=1)
        return inputs, places[second] - places[first]

    fit(network, pairs, len(rolled), generator, lambda epoch: record.proceed(0.9 * min(epoch / 800, 1.0)))
    return network
