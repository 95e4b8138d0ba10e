"""The discrepancy: a Gaussian process over generalised forces and over signals, in time or over the state.

delta_s(t) ~ GP(0, size_s^2 exp(-(t - t')^2 / (2 l^2))): an acceleration in each direction s of what is tracked, or one
along its motion, or an error of each signal s, another one in each episode; or an acceleration that is one function of
place and velocity in all of them (`kernels.py`). On all sites or signals, or on one of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from compass_ros.discovery.evidence import Tangent, log_mean, log_sum
from compass_ros.discovery.kernels import KERNELS, shared
from compass_ros.discovery.response import Response
from compass_ros.discovery.settings import KEPT, MEMORY_S, RHO, RHO_PRIOR
from compass_ros.discovery.sized import Sized, Spread, mean, sized
from compass_ros.types import Floats

TimeOrState = Literal["time", "place", "velocity", "state"]
ALL = "all"
"""Sites, or signals, together."""


def spread(response: Response, sizes: Floats, memory_s: float = MEMORY_S[0], moving: bool = False) -> Spread | None:
    """A discrepancy in time of (S,) sizes; None where all are zero.

    `moving`: only along the way that a thing moves, as friction does; else in all directions.
    """
    moments, on = response.kicks.moments_s, np.flatnonzero(sizes > 0)
    if not len(on):
        return None
    kernel = np.exp(-0.5 * ((moments[:, None] - moments) / memory_s) ** 2)
    variance, axes = np.linalg.eigh(kernel)
    kept = variance > KEPT * variance[-1]
    root = axes[:, kept] * np.sqrt(variance[kept])
    if moving:
        ways = sizes[:, None] * response.ways  # (E, K, S, n)
        out = ways[..., None] * root[:, None, None, :]
        return Spread(out.reshape(len(out), out.shape[1] * out.shape[2], -1))
    out = np.zeros((len(moments), len(sizes), len(on), root.shape[1]))
    for i, s in enumerate(on):
        out[:, s, i] = sizes[s] * root
    return Spread(out.reshape(len(moments) * len(sizes), -1))


def spreads(response: Response, sizes: Floats) -> list[Spread]:
    """Of each correlation length; of forces in all directions and along the motion. None where all sizes are zero."""
    kinds = (False, True) if np.any(sizes[: len(response.site_of)] > 0) else (False,)
    found = (spread(response, sizes, memory_s, moving) for moving in kinds for memory_s in MEMORY_S)
    return [one for one in found if one is not None]


@dataclass(frozen=True, eq=False)
class Part:
    """A model with a discrepancy of one part, of any length and size."""

    of: TimeOrState
    """What it is a function of."""
    name: str
    """Of a site or a signal; ALL of them."""
    response: Response
    spreads: Sequence[Spread]
    found: Sequence[Sized]

    @property
    def log(self) -> float:
        """Log evidence."""
        return float(log_mean([one.log for one in self.found]))

    @cached_property
    def pushes(self) -> Floats:
        """(E, K, S) posterior mean of the most probable one."""
        best = int(np.argmax([one.logs.max() for one in self.found]))
        size = float(self.found[best].sizes[np.argmax(self.found[best].logs)])
        pushes = mean(self.response.tangent, self.spreads[best], size)
        return pushes.reshape(-1, len(self.response.kicks.moments_s), len(self.response.unit))


@dataclass(frozen=True, eq=False)
class Free:
    """A model as it is, and with a discrepancy of any size."""

    alone: float
    """Log evidence of the model as it is."""
    forces: tuple[Part, ...]
    """Of the same with a discrepancy of forces in time: on all sites, and on each of them alone."""
    signals: tuple[Part, ...]
    """With one of signals in time: of all, and of each encoder or other signal alone; none where no signal changes."""
    state: tuple[Part, ...]
    """With forces that are a function of the state, of each kernel on all sites and on each alone."""

    @property
    def log(self) -> float:
        """With a discrepancy of any of these kinds, equally probable."""
        kinds = (self.forces, self.signals, self.state)
        return float(log_mean([log_mean([part.log for part in kind]) for kind in kinds if kind]))

    @property
    def pushes(self) -> Floats:
        """(E, K, S) posterior mean of forces in time."""
        return max(self.forces, key=lambda part: part.log).pushes


def free(response: Response) -> Free:
    """The model of a response with a discrepancy of any size."""
    asked = kinds_of(response)
    alone, *found = sized(response.tangent, [None, *(s for kind in asked for part in kind.values() for s in part)])
    each = iter(found)
    kinds = [tuple(Part(*key, response, of, [next(each) for _ in of]) for key, of in kind.items()) for kind in asked]
    return Free(alone.log, *kinds)


def kinds_of(response: Response) -> list[dict[tuple[TimeOrState, str], list[Spread]]]:
    """What a discrepancy may be without a law, equally probable: of forces in time, of signals in time, and of forces
    as a function of the state; of each the parts that it may have, and of each part the lengths."""
    forces, signals = (
        {ALL: np.sum(list(each.values()), axis=0) * response.unit}
        | ({name: on * response.unit for name, on in each.items()} if len(each) > 1 else {})
        for each in (on_sites(response), of_signals(response))
    )
    kinds: list[dict[tuple[TimeOrState, str], list[Spread]]] = [
        {("time", name): spreads(response, sizes) for name, sizes in forces.items()},
        {("time", name): spreads(response, sizes) for name, sizes in signals.items()},
        {(kernel, name): shared(response, kernel, sizes) for kernel in KERNELS for name, sizes in forces.items()},
    ]
    return [{key: of for key, of in kind.items() if of} for kind in kinds]


def on_sites(response: Response) -> dict[str, Floats]:
    """(S,) 1 for the forces on each site."""
    signals = len(response.unit) - len(response.site_of)
    on_each = [np.pad((response.site_of == n).astype(float), (0, signals)) for n in range(len(response.sites))]
    return dict(zip((site.name for site in response.sites), on_each, strict=True))


def of_signals(response: Response) -> dict[str, Floats]:
    """(S,) 1 for the errors of each encoder, by `signal.joint`, and of each other signal."""
    out: dict[str, Floats] = {}
    for signal in response.simulator.cell.signals:
        if not signal.fitted:
            continue
        named = zip(signal.numbers, range(signal.first, signal.first + signal.size), strict=True)
        each = {f"{signal.name}.{n}": slice(i, i + 1) for n, i in named} if signal.jointed and signal.size > 1 else {}
        for name, columns in (each or {signal.name: signal.columns}).items():
            out[name] = np.zeros(len(response.unit))
            out[name][len(response.site_of) :][columns] = 1.0
    return out


def with_law(response: Response, sizes: Floats) -> tuple[float, float]:
    """Log evidence of a model with laws, and the posterior mean of rho, the discrepancy's size as a share of theirs.

    In time, or over place, velocity or both, equally probable: a law whose form is wrong is wrong in the same way in
    every episode, and in what the law itself depends on.

    Args:
        sizes: (S,) rms of the laws along the fitted motion.
    """
    kinds = [spreads(response, sizes), *(of for kernel in KERNELS if (of := shared(response, kernel, sizes)))]
    alone, *found = sized(response.tangent, [None, *(one for kind in kinds for one in kind)], RHO[1:])
    logs, each_of = [], iter(found)
    for kind in kinds:
        of_lengths = [next(each_of).logs for _ in kind] or [np.full(len(RHO) - 1, alone.log)]
        logs.append(np.append(alone.log, log_mean(of_lengths)))
    each = np.array(logs) + np.log(RHO_PRIOR) - np.log(len(logs))
    total = log_sum(each.ravel())
    return total, float(np.exp(each - total).sum(axis=0) @ np.array(RHO))


def to_first_order(response: Response, sizes: Floats, columns: Sequence[Floats]) -> list[float]:
    """Rise of the log evidence of a model with laws by one law more, for each (E, D, a) columns of such a one.

    `sizes`: as in `with_law`, of the laws that the model has; the discrepancy stays theirs.
    """
    root = spread(response, sizes)

    def of(tangent: Tangent) -> float:
        alone, found = sized(tangent, [None, root], RHO[1:])
        return log_sum(np.append(alone.logs, np.broadcast_to(found.logs, len(RHO) - 1)) + np.log(RHO_PRIOR))

    alone = of(response.tangent)
    return [of(response.tangent.more(c, np.zeros(c.shape[2]))) - alone for c in columns]
