"""Drag coefficients of balls as wind tunnels found them, C_D = F / (rho A v^2 / 2)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats

DENSITY = 1.204
"""Of air at 20 degrees C and 1013 hPa [kg/m^3] (ISO 2533)."""
KINEMATIC = 1.516e-5
"""Kinematic viscosity of that air [m^2/s]."""


def smooth_sphere(reynolds: Floats) -> Floats:
    """A smooth sphere with its drag crisis near Re = 3e5. F. A. Morrison (2013), An Introduction to Fluid Mechanics,
    Cambridge, eq. 8.83; within the scatter of the data below Re = 1e6."""
    low, crisis = reynolds / 5, reynolds / 2.63e5
    return np.asarray(
        24 / reynolds
        + 2.6 * low / (1 + low**1.52)
        + 0.411 * crisis**-7.94 / (1 + crisis**-8.0)
        + 0.25 * (reynolds / 1e6) / (1 + reynolds / 1e6)
    )


def football(reynolds: Floats) -> Floats:
    """A football of 2006: 0.155 + 0.346 / (1 + exp((v - 12.19) / 1.309)), v in m/s for its diameter of 0.22 m. Fit of
    J. E. Goff and M. J. Carre (2010), Eur. J. Phys. 31, 775, to the wind tunnel of Asai et al. (2007)."""
    speed = reynolds * KINEMATIC / 0.22
    return np.asarray(0.155 + 0.346 / (1 + np.exp((speed - 12.19) / 1.309)))


def baseball(reynolds: Floats) -> Floats:
    """A baseball: F / m = (0.0039 + 0.0058 / (1 + exp((v - 35) / 5))) v^2, v in m/s. N. J. Giordano (1997),
    Computational Physics, Prentice Hall, section 2.3, from C. Frohlich (1984), Am. J. Phys. 52, 325."""
    speed = reynolds * KINEMATIC / 0.0732
    over_mass = 0.0039 + 0.0058 / (1 + np.exp((speed - 35) / 5))
    return np.asarray(2 * 0.145 * over_mass / (1.2 * np.pi * 0.0366**2))


def below_crisis(reynolds: Floats) -> Floats:
    """Any sphere below its crisis. P. P. Brown and D. F. Lawler (2003), J. Environ. Eng. 129, 222, eq. 19."""
    return np.asarray(24 / reynolds * (1 + 0.150 * reynolds**0.681) + 0.407 / (1 + 8710 / reynolds))


@dataclass(frozen=True)
class Surface:
    """A kind of ball: its coefficient at a Reynolds number, and where that stands."""

    coefficient: Callable[[Floats], Floats]
    source: str


SURFACES: Mapping[str, Surface] = {
    "football": Surface(football, "Goff and Carre (2010), Eur. J. Phys. 31, 775"),
    "smooth": Surface(smooth_sphere, "Morrison (2013), An Introduction to Fluid Mechanics, eq. 8.83"),
    "baseball": Surface(baseball, "Giordano (1997), Computational Physics, section 2.3"),
    "below_crisis": Surface(below_crisis, "Brown and Lawler (2003), J. Environ. Eng. 129, 222"),
}
