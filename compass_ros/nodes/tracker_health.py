"""The tracker's health in one second: rates, latencies, what was seen, what is wrong."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus

from compass_ros.nodes.diagnostic import diagnostic
from compass_ros.tracking.tracker import Frame

_REMEMBERED, _FEW = 60, 5


@dataclass
class Counts:
    """Since the last diagnostics."""

    images: int = 0
    missed: int = 0
    unusable: int = 0
    busy_s: float = 0.0
    latency_ms: list[float] = field(default_factory=list)
    """From the arrival of an image to the publication of its poses."""
    age_ms: list[float] = field(default_factory=list)
    """From an image's stamp to the publication of its poses; means something where camera and node share a clock."""
    seen: dict[str, int] = field(default_factory=dict)

    def take(self, frame: Frame) -> None:
        """What was seen in an image."""
        for sighting in frame.sightings:
            self.seen[sighting.object] = self.seen.get(sighting.object, 0) + sighting.seen


class StampGaps:
    """Counts images that never came, from the stamps of those that did. The camera's period is what two fifths of
    the last gaps keep below: stamps may jitter, and many images may be missing."""

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._gaps: deque[int] = deque(maxlen=_REMEMBERED)

    def take(self, stamp_ns: int) -> int:
        """Images missing before this one."""
        last, self._last_ns = self._last_ns, stamp_ns
        if last is None or stamp_ns <= last:
            return 0
        self._gaps.append(stamp_ns - last)
        period = float(np.quantile(self._gaps, 0.4))
        return max(round((stamp_ns - last) / period) - 1, 0) if len(self._gaps) > _FEW else 0


def health_message(
    name: str, counts: Counts, seconds: float, residual_px: float, objects: Iterable[str], problems: Sequence[str]
) -> DiagnosticStatus:
    """`seconds`: what the counts are counted over; `problems`: one sentence each."""
    images = max(counts.images, 1)
    values = {
        "images": str(counts.images),
        "rate [1/s]": f"{counts.images / seconds:.1f}",
        "missed images": str(counts.missed),
        "unusable images": str(counts.unusable),
        "ms an image": f"{1e3 * counts.busy_s / images:.2f}",
        "latency p50 [ms]": _quantile(counts.latency_ms, 0.5),
        "latency p99 [ms]": _quantile(counts.latency_ms, 0.99),
        "age of the image p50 [ms]": _quantile(counts.age_ms, 0.5),
        "reprojection error [px]": f"{residual_px:.3f}",
        **{f"seen {name}": str(counts.seen.get(name, 0)) for name in objects},
        **{f"share of images with {name}": f"{counts.seen.get(name, 0) / images:.3f}" for name in objects},
    }
    level = DiagnosticStatus.WARN if problems else DiagnosticStatus.OK
    return diagnostic(f"{name}: tracking", level, "; ".join(problems) or "tracking", values)


def _quantile(values: Sequence[float], share: float) -> str:
    return f"{np.quantile(values, share):.1f}" if values else "nan"
