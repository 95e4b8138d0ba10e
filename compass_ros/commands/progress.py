"""Progress bar of long computations."""

from __future__ import annotations

import math
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as RichProgress

from compass_ros.types import Progress


class Bar:
    """A `types.Report` that draws a bar on standard error while its context is open; where that is a file,
    nothing, or a line at the beginning of each stage."""

    def __init__(self, log: bool = False) -> None:
        """`log`: write these lines."""
        self._log = log
        self._console = console = Console(stderr=True)
        self._stage = ""
        self._bar = RichProgress(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.fields[gap]}"),
            TimeElapsedColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("reading", total=1.0, gap="")

    def __enter__(self) -> Bar:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def say(self, line: str) -> None:
        """A line that stays, above the bar."""
        self._console.print(line, markup=False, highlight=False, soft_wrap=True)

    def __call__(self, progress: Progress) -> bool:
        gap = f"gap {progress.gap:.3f}" if math.isfinite(progress.gap) else ""
        if self._log and not self._console.is_terminal and progress.stage != self._stage:
            self._console.print(f"{progress.stage}, {100 * progress.done:.0f} % done")
        self._stage = progress.stage
        self._bar.update(self._task, completed=progress.done, description=progress.stage, gap=gap)
        return True
