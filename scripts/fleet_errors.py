"""How often `compass fleet` calls a unit odd that is not, and how far out one must be to be called so.

python -m scripts.fleet_errors          # the table of docs/weeks-and-fleets.md
"""

from __future__ import annotations

import math

import numpy as np

from compass_ros.operation.fleet import Next
from compass_ros.operation.several import BY_CHANCE, Number

DRAWS = 3000
SPREADS, OUT = (0.0, 1.0, 30.0), (5.0, 10.0, 20.0)


def named(units: int, tau: float, out: float, rng: np.random.Generator) -> float:
    """Share of fleets whose first unit is called odd: error bars 1, spread `tau`, and it lies `out` of both away."""
    count = 0
    for _ in range(DRAWS):
        values = rng.normal(0.0, tau, units) + rng.normal(0.0, 1.0, units)
        values[0] += out * math.hypot(tau, 1.0)
        said = [Number(float(value), 1.0, "") for value in values]
        count += Next(said[1:]).chance(said[0]) < BY_CHANCE
    return count / DRAWS


def main() -> None:
    rng = np.random.default_rng(0)
    print("| units | " + " | ".join(f"alike, spread {tau:g}" for tau in SPREADS), end=" | ")
    print(" | ".join(f"{out:g} out" for out in OUT) + " |")
    for units in (3, 4, 6, 8, 12):
        alike = [named(units, tau, 0.0, rng) for tau in SPREADS]
        odd = [named(units, 3.0, out, rng) for out in OUT]
        cells = [*(f"{100 * share:.2f} %" for share in alike), *(f"{100 * share:.0f} %" for share in odd)]
        print(f"| {units} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
