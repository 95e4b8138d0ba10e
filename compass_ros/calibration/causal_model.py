"""The structural causal model f(epsilon, a; G) of COMPASS and its training by loss (2).

Letters: B samples of a batch, P parameters, K factors, A action fields, Z features that pass through the graph.
Inputs are normalised (parameters by the randomised box, actions by their spread) and outputs standardised by the
caller.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn

from compass_ros.config import CompassConfig

Proceed = Callable[[int, float], bool]
"""(epochs done, share of psi under the threshold) -> whether to go on."""


@contextmanager
def reproducible_torch() -> Iterator[None]:
    """One thread and no denormals while training, so that a seed gives the same bits on any number of cores."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    try:
        yield
    finally:
        torch.set_flush_denormal(False)
        torch.set_num_threads(threads)


def sample_graph(psi: Tensor, count: int, temperature: float, margin: float, generator: torch.Generator) -> Tensor:
    """Draw `count` graphs (count, P, K) from GumbelSoftmax(psi; temperature), differentiable in psi.

    The difference of two Gumbel variables is logistic, so the two-class softmax is a sigmoid of logit(psi) plus
    logistic noise (Jang et al. 2016; Maddison et al. 2016).
    """
    uniform = torch.rand(count, *psi.shape, generator=generator, dtype=psi.dtype)
    noise = torch.logit(uniform, eps=1e-6)
    return torch.sigmoid((torch.logit(psi.clamp(margin, 1.0 - margin)) + noise) / temperature)


class CausalModel(nn.Module):
    """Encoder of each parameter, graph as a linear transformation, action encoder, and one decoder of each factor.

    The decoder of factor k sees column k of g_epsilon + g_a only, so that an absent edge means that d_k does not
    depend on the parameter.
    """

    def __init__(
        self, parameters: int, actions: int, factors: int, config: CompassConfig, generator: torch.Generator
    ) -> None:
        super().__init__()
        self.inputs, self.factors = parameters, factors
        self.rows = torch.arange(parameters)
        """Parameters still in the model; the others have psi = 0 for good, see `compact`."""

        def dense(batch: tuple[int, ...], inputs: int, outputs: int) -> tuple[nn.Parameter, nn.Parameter]:
            bound = inputs**-0.5
            weight = (torch.rand(*batch, inputs, outputs, generator=generator) * 2 - 1) * bound
            bias = (torch.rand(*batch, 1, outputs, generator=generator) * 2 - 1) * bound
            return nn.Parameter(weight), nn.Parameter(bias)

        def stack(batch: tuple[int, ...], sizes: tuple[int, ...]) -> nn.ParameterList:
            pairs = itertools.pairwise(sizes)
            return nn.ParameterList([tensor for pair in pairs for tensor in dense(batch, *pair)])

        self.psi = nn.Parameter(torch.ones(parameters, factors))
        self.encoder = stack((parameters,), (1, config.emb_dim, config.causal_dim))
        self.action_encoder = stack((factors,), (actions, config.emb_dim, config.causal_dim)) if actions else None
        self.decoder = stack((factors,), (config.causal_dim, *config.hidden_dim, 1))

    def forward(self, inputs: Tensor, actions: Tensor, graph: Tensor) -> Tensor:
        """(B, P), (B, A), (B, rows, K) -> (B, K) standardised trajectory differences."""
        features = _through(self.encoder, inputs.index_select(1, self.rows).t().unsqueeze(2))  # (rows, B, Z)
        mixed = torch.einsum("pbz,bpk->kbz", features, graph)
        if self.action_encoder is not None:
            mixed = mixed + _through(self.action_encoder, actions.expand(self.factors, *actions.shape))
        return _through(self.decoder, mixed).squeeze(2).t()

    def expected(self, inputs: Tensor, actions: Tensor) -> Tensor:
        """Prediction with the graph at its probabilities psi instead of a sample: (B, P), (B, A) -> (B, K)."""
        return self.forward(inputs, actions, self.psi.expand(len(inputs), *self.psi.shape))

    def graph(self) -> Tensor:
        """(P, K) psi of all parameters."""
        full = torch.zeros(self.inputs, self.factors)
        full[self.rows] = self.psi.detach()
        return full

    def compact(self, optimizer: torch.optim.Optimizer, margin: float) -> None:
        """Drop parameters without any edge once they are a quarter of the rows; saves time, loses nothing.

        psi under `margin` gets no gradient from the data any more (the clamp of `sample_graph`), only the push to zero.
        """
        keep = (self.psi > margin).any(dim=1)
        if int(keep.sum()) > 0.75 * len(self.rows) or not keep.any():
            return
        self.rows = self.rows[keep]
        fresh = {}
        for tensor in (self.psi, *self.encoder):
            fresh[tensor] = nn.Parameter(tensor.detach()[keep])
            state = optimizer.state.pop(tensor)
            optimizer.state[fresh[tensor]] = {n: v[keep] if v.dim() > 0 else v for n, v in state.items()}
        for group in optimizer.param_groups:
            group["params"] = [fresh.get(tensor, tensor) for tensor in group["params"]]
        self.psi = fresh[self.psi]
        self.encoder = nn.ParameterList([fresh[tensor] for tensor in self.encoder])


def _through(layers: nn.ParameterList, values: Tensor) -> Tensor:
    """A batch of multilayer perceptrons with ReLU between the layers; weights and biases alternate in `layers`."""
    tensors = list(layers)
    last = len(tensors) - 2
    for i in range(0, len(tensors), 2):
        if values.shape[-1] == 1:  # an outer product: cheaper as a broadcast than as a matrix product
            values = values * tensors[i] + tensors[i + 1]
        else:
            values = torch.baddbmm(tensors[i + 1], values, tensors[i])
        if i < last:
            values = torch.relu(values)
    return values


@dataclass(frozen=True)
class Training:
    """How a training went."""

    epochs: int
    mse: float
    """Mean of the last epoch, standardised units, summed over the factors."""
    cancelled: bool


def loss(
    model: CausalModel, prediction: Tensor, target: Tensor, sparse_weight: float, norm_p: float
) -> tuple[Tensor, Tensor]:
    """Loss (2) and its first term: mean over samples of ||f - d||_2^2, plus lambda ||psi||_p^p."""
    mse = (prediction - target).square().sum(dim=1).mean()
    return mse + sparse_weight * model.psi.pow(norm_p).sum(), mse


def train(
    model: CausalModel,
    inputs: Tensor,
    actions: Tensor,
    targets: Tensor,
    sparse_weight: float,
    config: CompassConfig,
    generator: torch.Generator,
    proceed: Proceed,
) -> Training:
    """Fit phi and psi jointly with Adam; psi is projected onto [0, 1] after each step.

    Ends after `config.n_epochs`, or earlier when the mean loss (2) of `config.patience_epochs` epochs is not lower
    than that of the window before by the share `config.plateau`, or when `proceed` says no.
    """
    rest = [tensor for name, tensor in model.named_parameters() if name != "psi"]
    groups: list[dict[str, Any]] = [{"params": rest}, {"params": [model.psi], "lr": config.graph_learning_rate}]
    optimizer = torch.optim.Adam(groups, lr=config.learning_rate, fused=True)
    window, before = 0.0, float("inf")
    mean = float("nan")
    for epoch in range(1, config.n_epochs + 1):
        order = torch.randperm(len(inputs), generator=generator)
        total = torch.zeros(2)
        for batch in torch.split(order, config.batch_size):
            graph = sample_graph(model.psi, len(batch), config.temperature, config.psi_margin, generator)
            prediction = model(inputs[batch], actions[batch], graph)
            both, mse = loss(model, prediction, targets[batch], sparse_weight, config.norm_p)
            optimizer.zero_grad(set_to_none=True)
            both.backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            with torch.no_grad():
                model.psi.clamp_(0.0, 1.0)
                total += torch.stack((both, mse)) * (len(batch) / len(inputs))
        mean = float(total[1])
        window += float(total[0])
        if not proceed(epoch, float((model.graph() < config.threshold).float().mean())):
            return Training(epoch, mean, cancelled=True)
        if epoch % 20 == 0:
            model.compact(optimizer, config.psi_margin)
        if config.patience_epochs and epoch % config.patience_epochs == 0:
            if window > (1.0 - config.plateau) * before:
                return Training(epoch, mean, cancelled=False)
            window, before = 0.0, window
    return Training(config.n_epochs, mean, cancelled=False)
