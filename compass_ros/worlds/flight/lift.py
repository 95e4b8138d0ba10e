"""Lift coefficients of spinning balls over the spin parameter S = r omega / v, C_L = F / (rho A v^2 / 2)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from compass_ros.types import Floats
from compass_ros.worlds.flight.drag import Surface


def two_lines(spin: Floats) -> Floats:
    """1.5 S up to 0.1, from there 0.09 + 0.6 S. G. S. Sawicki, M. Hubbard, W. J. Stronge (2003), Am. J. Phys. 71,
    1152, eq. 8."""
    return np.asarray(np.where(spin < 0.1, 1.5 * spin, 0.09 + 0.6 * spin))


def saturating(spin: Floats) -> Floats:
    """1 / (2.32 + 0.4 / S). A. M. Nathan (2008), Am. J. Phys. 76, 119 (data), and his trajectory calculator (fit)."""
    return np.asarray(spin / (2.32 * spin + 0.4))


def felt(spin: Floats) -> Floats:
    """A tennis ball: 1 / (2.022 + 0.981 / S). A. Stepanek (1988), Am. J. Phys. 56, 138."""
    return np.asarray(spin / (2.022 * spin + 0.981))


LIFTS: Mapping[str, Surface] = {
    "two_lines": Surface(two_lines, "Sawicki, Hubbard, Stronge (2003), Am. J. Phys. 71, 1152"),
    "saturating": Surface(saturating, "Nathan (2008), Am. J. Phys. 76, 119"),
    "felt": Surface(felt, "Stepanek (1988), Am. J. Phys. 56, 138"),
}
