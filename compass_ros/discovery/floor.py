"""`none` is never said beside a held-out error of TWICE the noise floor."""

from __future__ import annotations

from dataclasses import replace

from compass_ros.types import Mismatch, Where

TWICE = 2.0
"""Held-out error over noise floor from which what is left is not called noise: three quarters of its mean square are
something else."""
EVERYWHERE = Where("all", "all", "all")


def honest(mismatch: Mismatch, error: float, floor: float) -> Mismatch:
    """The answer as it may be published beside a held-out error and a noise floor [m or rad]."""
    if mismatch.verdict != "none" or error < TWICE * floor:
        return mismatch
    sentence = f"Something differs that no known law explains: held-out error {error / floor:.1f} times the noise."
    return replace(mismatch, verdict="unknown", where=EVERYWHERE, sentence=sentence)
