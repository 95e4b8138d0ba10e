"""The causal model: sampling of the graph, gradients, what an absent edge means."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import torch

from compass_ros.calibration.causal_model import CausalModel, loss, reproducible_torch, sample_graph, train
from compass_ros.calibration.compass import descend, predicted_gap
from compass_ros.config import CompassConfig

CONFIG = CompassConfig(emb_dim=4, causal_dim=5, hidden_dim=(7,), n_epochs=30, patience_epochs=0, batch_size=16)


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    with reproducible_torch():
        yield


def model(parameters: int = 3, actions: int = 2, factors: int = 2, seed: int = 0) -> CausalModel:
    return CausalModel(parameters, actions, factors, CONFIG, torch.Generator().manual_seed(seed))


def test_sampled_edges_have_the_probability_psi() -> None:
    psi = torch.tensor([[0.1, 0.5], [0.8, 1.0]], dtype=torch.float64)
    graphs = sample_graph(psi, 20_000, 1.0, 1e-3, torch.Generator().manual_seed(1))
    assert float(graphs.min()) >= 0.0
    assert float(graphs.max()) <= 1.0
    share = (graphs > 0.5).double().mean(dim=0).numpy()  # the argmax of a Gumbel-Softmax follows psi at any temperature
    assert np.allclose(share, [[0.1, 0.5], [0.8, 0.999]], atol=0.012)


def test_gradient_of_the_sample_by_finite_differences() -> None:
    weight = torch.linspace(-1, 1, 6, dtype=torch.float64).reshape(1, 3, 2)

    def value(psi: torch.Tensor) -> torch.Tensor:
        return (sample_graph(psi, 4, 0.7, 1e-3, torch.Generator().manual_seed(2)) * weight).sum()

    psi = torch.tensor([[0.1, 0.4], [0.5, 0.6], [0.7, 0.95]], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(value, (psi,))


def test_loss_is_mean_square_plus_sparsity() -> None:
    causal = model()
    prediction = torch.tensor([[1.0, 2.0], [3.0, 4.0]])
    target = torch.tensor([[0.0, 2.0], [3.0, 2.0]])
    both, mse = loss(causal, prediction, target, 0.01, 1.0)
    assert float(mse) == 2.5  # (1 + 4) / 2
    assert np.isclose(both.item(), 2.5 + 0.01 * 6)  # psi: ones, 3 x 2


def test_gradient_of_j_by_finite_differences() -> None:
    causal = model().double()
    shares = torch.tensor([0.3, 0.7], dtype=torch.float64)
    actions = torch.linspace(-1, 1, 8, dtype=torch.float64).reshape(4, 2)
    inputs = torch.tensor([0.2, -0.4, 0.7], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda at: predicted_gap(causal, actions, shares, at), (inputs,))


def test_descent_lowers_j_and_stays_in_the_box() -> None:
    causal = model(seed=3)
    shares, actions, start = torch.tensor([0.5, 0.5]), torch.zeros(2, 2), torch.zeros(3)
    config = CompassConfig(update_rate=5.0, update_steps=200)
    with torch.no_grad():
        before = float(predicted_gap(causal, actions, shares, start))
    end = descend(causal, actions, shares, start, config)
    with torch.no_grad():
        after = float(predicted_gap(causal, actions, shares, end))
    assert after < before
    assert float(end.abs().max()) <= 1.0


def test_without_an_edge_a_factor_does_not_depend_on_a_parameter() -> None:
    causal = model()
    graph = torch.ones(5, 3, 2)
    graph[:, 1, 0] = 0.0
    inputs = torch.rand(5, 3, generator=torch.Generator().manual_seed(0))
    moved = inputs.clone()
    moved[:, 1] += 1.0
    actions = torch.zeros(5, 2)
    with torch.no_grad():
        change = (causal(moved, actions, graph) - causal(inputs, actions, graph)).abs().amax(dim=0)
    assert float(change[0]) == 0.0
    assert float(change[1]) > 1e-4


def _data(parameters: int) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    inputs = torch.rand(256, parameters, generator=torch.Generator().manual_seed(4)) * 2 - 1
    return inputs, torch.zeros(256, 0), torch.stack((inputs[:, 0], inputs[:, 1]), dim=1)


def test_training_stops_on_a_plateau_and_when_told() -> None:
    inputs, actions, targets = _data(2)
    flat = CompassConfig(n_epochs=400, patience_epochs=10, plateau=0.5, batch_size=16)
    generator = torch.Generator().manual_seed(0)
    ended = train(model(2, 0), inputs, actions, targets, 0.0, flat, generator, lambda epoch, _: True)
    assert ended.epochs < 400
    assert not ended.cancelled
    stopped = train(model(2, 0), inputs, actions, targets, 0.0, flat, generator, lambda epoch, _: epoch < 7)
    assert stopped.epochs == 7
    assert stopped.cancelled


def test_dropping_dead_parameters_keeps_the_others_and_their_order() -> None:
    inputs, actions, targets = _data(12)
    config = replace(CONFIG, n_epochs=80, hidden_dim=(16,), learning_rate=0.005, graph_learning_rate=0.03)
    causal = CausalModel(12, 0, 2, config, torch.Generator().manual_seed(5))
    train(causal, inputs, actions, targets, 0.02, config, torch.Generator().manual_seed(6), lambda epoch, _: True)
    assert len(causal.rows) < 9  # a quarter and more has gone
    graph = causal.graph()
    assert graph.shape == (12, 2)
    assert float(graph[0, 0]) > 0.9
    assert float(graph[1, 1]) > 0.9
    assert float(graph[2:].max()) < 0.1
