"""sbi's misspecification check: could these observations have come from this simulator at all?

`sbi.diagnostics.misspecification` compares observed with simulated data by their maximum mean discrepancy (Gaussian
kernel, bandwidth by the median heuristic) and takes the p-value from shuffles of the simulated data. It says whether,
never what.
"""

from __future__ import annotations

import torch
from sbi.diagnostics.misspecification import calc_misspecification_mmd

from compass_ros.calibration.causal_model import reproducible_torch
from compass_ros.types import Floats


def misspecification_p(observed: Floats, simulated: Floats, seed: int, shuffles: int = 500) -> float:
    """p-value for (n, d) observations among (m, d) simulations, n < m; columns of the simulations get scale one."""
    scale = simulated.std(axis=0)
    scale[scale == 0] = 1.0
    with reproducible_torch(), torch.random.fork_rng():
        torch.manual_seed(seed)
        seen, made = (torch.as_tensor(x / scale, dtype=torch.float32) for x in (observed, simulated))
        p, _ = calc_misspecification_mmd(seen, made, mode="x_space", n_shuffle=shuffles, max_samples=len(simulated))
    return float(p)
