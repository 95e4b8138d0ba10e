"""EXI-Net (Murooka et al., ICRA 2021): a dynamics model conditioned on the parameters, which are then found through it.

Each iteration, as in the COMPASS paper's reproduction: randomise all parameters around the current ones, learn
(parameters, action) -> trajectory, and move the parameters by back-propagation until the predicted trajectories meet
the recorded ones. Chosen, because the tables leave it open: the model predicts the whole trajectory (its 640 samples
an iteration are rollouts), the implicit part is empty (every tunable parameter is explicit), the parameters move by
Adam with the table's learning rate times ten inside the randomised box.
"""

from __future__ import annotations

import numpy as np
import torch

from compass_ros.calibration.causal_model import reproducible_torch
from compass_ros.calibration.problem import Allowance, Problem
from compass_ros.calibration.randomization import Box, randomise, randomised_box
from compass_ros.calibration.rivals.network import LEARNING_RATE, fit, perceptron, spread, vectors
from compass_ros.calibration.rivals.record import Record
from compass_ros.types import Estimate, Floats, Report

STEPS = 1000
"""Most gradient steps on the parameters in an iteration."""


def exi_net(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    """Spends `allowance.iterations` x N x M rollouts, and E a time to measure; returns the best measured values."""
    random = np.random.default_rng(seed)
    record = Record("exi-net", problem, report)
    values = np.asarray(problem.start, dtype=np.float64)
    everything = np.ones(len(values), dtype=bool)
    with reproducible_torch():
        for i in range(allowance.iterations):
            record.measure(values)
            box = randomised_box(values, everything, problem.parameters)
            moved = _iterate(problem, allowance, box, random, record, i)
            if moved is None:
                return record.estimate("cancelled")
            values = moved
        record.measure(values)
    return record.estimate("the allowance is spent")


def _iterate(
    problem: Problem, allowance: Allowance, box: Box, random: np.random.Generator, record: Record, index: int
) -> Floats | None:
    chosen = np.sort(random.permutation(problem.episodes)[: allowance.real])
    episodes = np.repeat(chosen, allowance.sim)
    samples = randomise(box, len(episodes), random)
    rolled = vectors(problem, problem.trajectories(samples, episodes), episodes)
    record.spend(len(episodes))
    generator = torch.Generator().manual_seed(int(random.integers(2**63)))
    middle, half = (box.low + box.high) / 2, np.maximum((box.high - box.low) / 2, 1e-300)
    inputs = torch.as_tensor((samples - middle) / half, dtype=torch.float32)
    all_actions = torch.as_tensor(problem.actions, dtype=torch.float32)
    action_mean, action_spread = spread(all_actions)
    actions = (all_actions - action_mean) / action_spread
    mean, deviation = spread(rolled)
    joined = torch.cat((inputs, actions[episodes]), dim=1)
    targets = (rolled - mean) / deviation
    network = perceptron(joined.shape[1], targets.shape[1], generator)

    def proceed(epoch: int) -> bool:
        return epoch % 5 != 0 or record.proceed((index + min(epoch / 800, 0.95)) / allowance.iterations)

    if not fit(network, lambda batch: (joined[batch], targets[batch]), len(joined), generator, proceed):
        return None
    real = (vectors(problem, problem.measured[chosen], chosen) - mean) / deviation
    found = torch.zeros(inputs.shape[1], requires_grad=True)
    optimizer = torch.optim.Adam([found], lr=10 * LEARNING_RATE)
    network.requires_grad_(False)
    for _ in range(STEPS):
        predicted = network(torch.cat((found.expand(len(chosen), -1), actions[chosen]), dim=1))
        loss = (predicted - real).square().mean()
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        optimizer.step()
        with torch.no_grad():
            found.clamp_(-1.0, 1.0)
    return np.asarray(np.clip(middle + half * found.detach().double().numpy(), box.low, box.high))
