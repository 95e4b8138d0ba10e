"""NPDR (Muratore et al., RA-L 2022): sequential neural posterior estimation of the parameters, on `sbi`.

Settings are the COMPASS paper's table: uniform prior, masked autoregressive flow, LSTM embedding of trajectories
downsampled by 2, 100 hidden features, 10 transforms, 50 epochs at 3e-4, end after 20 epochs without improvement,
combined loss, retrained in each round, MCMC with thinning 2. Chosen, because it is left open: one simulation of the
posterior is one set of parameters rolled out on all N recorded actions, its N trajectories side by side (so an
iteration of 640 rollouts has 64 simulations); an LSTM of 64 units; batches of 50; sbi's vectorised slice sampler, one
chain for each sample, on the unit box with brackets that start at its width (its default of 0.01 needs minutes a
round to grow them in 64 dimensions); the estimate is the mean of the last posterior's samples, its standard deviation
theirs.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from sbi.inference import NPE_C
from sbi.inference.posteriors.base_posterior import NeuralPosterior
from sbi.neural_nets import posterior_nn
from sbi.samplers.mcmc.slice_numpy import SliceSamplerVectorized
from sbi.utils import BoxUniform
from torch import Tensor, nn

from compass_ros.calibration.causal_model import reproducible_torch
from compass_ros.calibration.problem import Allowance, Problem
from compass_ros.calibration.rivals.network import frame_indices, vectors
from compass_ros.calibration.rivals.record import Record
from compass_ros.types import Estimate, Floats, Ints, Report

FEATURES, TRANSFORMS, EPOCHS = 100, 10, 50
SAMPLES = 64
"""Least samples of a posterior."""
WARMUP = 10
"""Sweeps over all coordinates that each chain discards."""
THIN = 2


class SequenceEmbedding(nn.Module):
    """(B, T N C) flattened trajectories -> (B, 64), the last state of an LSTM over every second frame."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.channels = channels
        self.lstm = nn.LSTM(channels, 64, batch_first=True)

    def forward(self, flat: Tensor) -> Tensor:
        _, (state, _) = self.lstm(flat.reshape(len(flat), -1, self.channels)[:, ::2])
        return torch.as_tensor(state[-1])


class NoLog:
    """sbi's `Tracker` that writes nothing; the default one makes a folder of logs in the working directory."""

    log_dir: str | None = None

    def log_metric(self, name: str, value: float, step: int | None = None) -> None:
        """Nothing is kept."""

    def log_metrics(self, metrics: dict[str, float], step: int | None = None) -> None:
        """Nothing is kept."""

    def log_params(self, params: dict[str, Any]) -> None:
        """Nothing is kept."""

    def add_figure(self, name: str, figure: Any, step: int | None = None) -> None:
        """Nothing is kept."""

    def flush(self) -> None:
        """Nothing is kept."""


def npdr(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    """Rounds of (simulate at the proposal, train, sample); the trace has the posterior mean after each round."""
    record = Record("npdr", problem, report)
    random = np.random.default_rng(seed)
    chosen = np.sort(random.permutation(problem.episodes)[: allowance.real])
    count = max(allowance.per_iteration // len(chosen), 2)
    low, width = problem.low, problem.high - problem.low
    record.measure(np.asarray(problem.start, dtype=np.float64))
    with reproducible_torch(), torch.random.fork_rng(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # sbi warns about its own defaults; nothing here depends on them
        torch.manual_seed(int(random.integers(2**63)))
        size = len(low)
        prior = BoxUniform(torch.zeros(size), torch.ones(size))
        embedding = SequenceEmbedding(len(chosen) * problem.measured.shape[2])
        estimator = posterior_nn("maf", hidden_features=FEATURES, num_transforms=TRANSFORMS, embedding_net=embedding)
        inference = NPE_C(prior, density_estimator=estimator, tracker=NoLog(), show_progress_bars=False)
        observed = _side_by_side(problem, problem.measured[chosen][None], chosen)
        proposal: NeuralPosterior | None = None
        unit = drawn = np.asarray(prior.sample((count,)), dtype=np.float64)
        for i in range(allowance.iterations):
            rolled = _simulate(problem, low + width * unit, chosen)
            record.spend(count * len(chosen))
            theta = torch.as_tensor(unit, dtype=torch.float32)
            inference.append_simulations(theta, rolled, proposal=proposal)
            inference.train(
                training_batch_size=50,
                learning_rate=3e-4,
                stop_after_epochs=20,
                max_num_epochs=EPOCHS,
                use_combined_loss=True,
                discard_prior_samples=False,
                retrain_from_scratch=True,
            )
            posterior = inference.build_posterior(sample_with="mcmc").set_default_x(observed)
            posterior.potential_fn.set_x(observed)
            proposal = posterior
            drawn = _sample(posterior, prior, max(SAMPLES, count), int(random.integers(2**32)))
            unit = drawn[:count]
            record.measure(low + width * drawn.mean(axis=0))
            if not record.proceed((i + 1) / allowance.iterations):
                break
    draws = low + width * drawn
    said = record.estimate("all rounds done", values=draws.mean(axis=0), std=draws.std(axis=0))
    return replace(said, draws=draws)


def _sample(posterior: NeuralPosterior, prior: BoxUniform, chains: int, seed: int) -> Floats:
    """(chains, P) samples: chains start at prior draws resampled by their density, as sbi does by default."""

    def log_density(unit: Floats) -> Floats:
        theta = torch.as_tensor(unit, dtype=torch.float32)
        return np.asarray(posterior.potential_fn(theta, track_gradients=False), dtype=np.float64)

    candidates = np.asarray(prior.sample((1000,)), dtype=np.float64)
    weight = log_density(candidates)
    random = np.random.RandomState(seed)
    weight = np.exp(weight - weight.max())
    start = candidates[random.choice(len(candidates), chains, p=weight / weight.sum())]
    sampler = SliceSamplerVectorized(
        log_density, start, num_chains=chains, thin=THIN, tuning=WARMUP, verbose=False, init_width=1.0, max_width=1.0
    )
    sampler.rng = random
    return np.asarray(sampler.run(THIN))[:, -1]


def _simulate(problem: Problem, values: Floats, chosen: Ints) -> Tensor:
    """(B, P) -> (B, T N C): each set of parameters on all chosen episodes."""
    rolled = problem.trajectories(np.repeat(values, len(chosen), axis=0), np.tile(chosen, len(values)))
    return _side_by_side(problem, rolled.reshape(len(values), len(chosen), *rolled.shape[1:]), chosen)


def _side_by_side(problem: Problem, trajectories: Floats, chosen: Ints) -> Tensor:
    """(B, N, F, C) -> (B, T N C), frame by frame."""
    batch, frames = len(trajectories), len(frame_indices(problem))
    flat = vectors(problem, trajectories.reshape(-1, *trajectories.shape[2:]), np.tile(chosen, batch))
    return flat.reshape(batch, len(chosen), frames, -1).permute(0, 2, 1, 3).reshape(batch, -1)
