"""Where a discrepancy sits: on which joint, or in a signal."""

from __future__ import annotations

import numpy as np

from compass_ros.discovery.discrepancy import Free, spread
from compass_ros.discovery.evidence import evidences, log_sum
from compass_ros.discovery.response import Response
from compass_ros.discovery.settings import FREE
from compass_ros.types import Where


def whereabouts(response: Response, free: Free) -> Where:
    """Site and channel of a free discrepancy: the one site whose discrepancy has the highest evidence, or all."""
    if not free.of_forces:
        return Where("all", "all", "sensing")
    count = len(response.site_of)
    logs = []
    for chosen in (None, *range(len(response.sites))):
        on = np.zeros(len(response.unit))
        on[:count] = 1.0 if chosen is None else response.site_of == chosen
        found = evidences(response.tangent, [spread(response, s * on * response.unit) for s in FREE])
        logs.append(log_sum(np.array([f.log for f in found])))
    best = int(np.argmax(logs)) - 1
    name = response.sites[best].name if best >= 0 and len(response.sites) > 1 else "all"
    return Where(name, "free", "dynamics")
