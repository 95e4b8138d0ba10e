"""Pictures of docs/weeks-and-fleets.md, from results with planted changes and from a real calibration that is watched.

python -m scripts.draw_weeks [FOLDER]          # needs /usr/bin/chromium
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

from compass_ros.commands.fleet import fleet
from compass_ros.commands.history import history
from compass_ros.reporting.live import LiveReport
from compass_ros.types import Progress, silent
from test.operation.many_results import units, weeks
from test.reporting.browser.conftest import open_page

if TYPE_CHECKING:
    from test.reporting.browser.conftest import Page

ROOT = Path(__file__).parents[1]
DRAWN_S = 12.0
"""What a busy machine needs to draw a report inside a page."""


def shoot(page: Page, shown: Path | str, picture: Path, height: int) -> None:
    """The first window of a page as a JPEG."""
    page.show(shown, 1100, height)
    time.sleep(DRAWN_S)
    with tempfile.TemporaryDirectory() as work:
        page.screenshot(Path(work) / "page.png", whole=False)
        with Image.open(Path(work) / "page.png") as taken:
            taken.convert("RGB").save(picture, quality=82, optimize=True)


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images"
    with tempfile.TemporaryDirectory() as made, open_page(Path(made) / "profile") as page:
        work, own = Path(made), ROOT / "examples" / "own_cell"
        history(weeks(work / "weeks"), work / "history.html")
        fleet(units(work / "units"), work / "fleet.html")
        shoot(page, work / "history.html", folder / "history.jpg", 820)
        shoot(page, work / "fleet.html", folder / "fleet.jpg", 800)
        words = (
            "calibrate",
            "--cell",
            own / "pendulum.yaml",
            "--out",
            work / "pendulum",
            "--no-discover",
            own / "bags",
        )
        subprocess.run([sys.executable, "-m", "compass_ros.cli", *map(str, words)], check=True, capture_output=True)
        with LiveReport(work / "pendulum", 0, computing=False) as live:
            live.beside(silent)(Progress("screen explanations", 4, 0.78, 0.0142, float("nan")))
            shoot(page, live.address, folder / "live.jpg", 620)


if __name__ == "__main__":
    main()
