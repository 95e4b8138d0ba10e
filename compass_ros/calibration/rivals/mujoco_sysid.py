"""What `mujoco.sysid` does once the residual is built: `mujoco.minimize.least_squares` on whole trajectories.

`mujoco.sysid.optimize` hands its residual function to this solver by default; the residual here is the same one
(predicted minus measured at the recorded stamps, each channel over the norm of what was measured, as sysid's
`normalize_residual` does), from the batched simulator instead of a list of models. Not over the noise: the solver's
regularizer ends at an absolute 1e8, which is nothing beside a Hessian of residuals in units of a micrometre. No
restarts: sysid has none.
"""

from __future__ import annotations

import io

import numpy as np
from mujoco import minimize

from compass_ros.calibration.problem import Allowance, Problem
from compass_ros.calibration.rivals.record import Record
from compass_ros.types import Estimate, Floats, Report

STEP = 1e-3
"""Finite-difference step as a share of the half-width. Chosen: the solver's default, 1.5e-8 of the value itself,
drowns in the roughness of contacts; its documentation asks for parameters of order one, which half-widths give."""


class _SpentError(Exception):
    """Carries the end of the allowance, or a cancellation, out of the solver."""


def mujoco_sysid(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    """Levenberg-Marquardt with box bounds on all P parameters at once; `seed` is unused: nothing is drawn.

    Coordinates are half-widths from the lower bound, where the solver expects its middle of the box.

    One Jacobian costs P x E rollouts. Standard deviations are those of sysid's own intervals: s^2 (J'J)^-1, NaN where
    the Jacobian does not see a parameter.
    """
    record = Record("mujoco-sysid", problem, report)
    start, width = np.asarray(problem.start, dtype=np.float64), problem.half_width
    episodes, limit = len(problem.actions), allowance.rollouts
    record.measure(start)

    scale = _normalised(problem)[:, None]

    def residual(columns: Floats) -> Floats:
        """(P, B) -> (R, B)."""
        if record.rollouts + columns.shape[1] * episodes > limit or record.cancelled:
            raise _SpentError
        values = problem.low + width * columns.T
        record.spend(len(values) * episodes)
        record.proceed(record.rollouts / limit)
        return problem.residuals(values).T * scale

    bounds = [np.zeros(len(start)), (problem.high - problem.low) / width]
    seen: list[minimize.IterLog] = []

    def remember(log: list[minimize.IterLog]) -> None:
        if log:
            seen[:] = log
            record.measure(problem.low + width * np.asarray(log[-1].candidate).ravel())

    try:
        found, _ = minimize.least_squares(
            x0=(start - problem.low) / width,
            residual=residual,
            bounds=bounds,
            eps=STEP,
            max_iter=allowance.rollouts,
            verbose=minimize.Verbosity.FULLITER,  # as sysid does: only then a log has its Jacobian
            output=io.StringIO(),
            iter_callback=remember,
        )
        record.measure(problem.low + width * np.asarray(found).ravel())
        reason = "the solver converged or found no reduction"
    except _SpentError:
        reason = "the allowance is spent"
    return record.estimate(reason, std=_deviations(seen, width))


def _normalised(problem: Problem) -> Floats:
    """(E F C) factors that bring weighted residuals to sysid's: sqrt(2) over the norm of a channel in its episode."""
    seen = problem.weight > 0
    norm = np.linalg.norm(np.where(seen, problem.measured, 0.0), axis=1, keepdims=True)  # (E, 1, C)
    factor = np.sqrt(2.0) / np.maximum(norm, 1e-12)
    return np.asarray(np.where(seen, factor / np.where(seen, problem.weight, 1.0), 0.0).ravel())


def _deviations(log: list[minimize.IterLog], width: Floats) -> Floats:
    """(P,) standard deviations from the last Jacobian and residual, NaN where there is none."""
    full = [entry for entry in log if entry.jacobian is not None and entry.residual is not None]
    if not full:
        return np.full(len(width), np.nan)
    jacobian, residual = np.asarray(full[-1].jacobian), np.asarray(full[-1].residual).ravel()
    freedom = max(int(np.count_nonzero(residual)) - len(width), 1)
    scale = float(residual @ residual) / freedom
    variance = scale * np.diag(np.linalg.pinv(jacobian.T @ jacobian, hermitian=True))
    seen = np.linalg.norm(jacobian, axis=0) > 1e-9 * np.linalg.norm(jacobian)
    return np.where(seen & (variance > 0), np.sqrt(np.maximum(variance, 0)) * width, np.nan)
