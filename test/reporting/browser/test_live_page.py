"""The pages of several results and of a calibration that runs, in a real browser."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PIL import Image

from compass_ros.commands.fleet import fleet
from compass_ros.commands.history import history
from compass_ros.reporting import write_report, write_result
from compass_ros.reporting.live import LiveReport
from compass_ros.types import Progress, Result, silent
from test.operation.many_results import units, weeks

if TYPE_CHECKING:
    from test.reporting.browser.conftest import Page

WAIT_S = 60.0


def until(there: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + WAIT_S
    while not there():
        assert time.monotonic() < end, what
        time.sleep(0.2)


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("kind", ["history", "fleet"])
def test_pages_of_several_results_draw_quietly_and_fit(page: Page, kind: str, width: int, tmp_path: Path) -> None:
    folders, command = (weeks, history) if kind == "history" else (units, fleet)
    path = tmp_path / "page.html"
    command(folders(tmp_path / "results"), path)
    page.show(path, width)
    page.settle()
    assert page.console == []
    assert [url for url in page.requests if not url.startswith("data:")] == [path.as_uri()]
    assert page.evaluate("document.documentElement.scrollWidth") == width
    drawn = page.evaluate("[...document.querySelectorAll('.plot')].filter((p) => p.querySelector('.main-svg')).length")
    assert drawn == page.evaluate("document.querySelectorAll('.plot').length") >= 4


def colours(page: Page, path: Path) -> int:
    """Of the window below everything that is not the report."""
    page.screenshot(path, whole=False)
    with Image.open(path) as picture:
        below = picture.convert("RGB").crop((0, 160, picture.width, picture.height)).getcolors(1 << 20)
    return len(below or ())


def test_a_calibration_that_runs_shows_progress_then_its_report(page: Page, result: Result, tmp_path: Path) -> None:
    with LiveReport(tmp_path, 0, computing=True) as live:
        live.beside(silent)(Progress("calibrate", 1, 0.4, 0.01, float("nan")))
        page.show(live.address, 1280)
        until(lambda: "40 %" in page.evaluate("document.body.innerText"), "progress")
        assert "No result yet" in page.evaluate("document.body.innerText")
        write_report(result, tmp_path / "report.html")
        write_result(result, tmp_path / "result.json")
        until(lambda: colours(page, tmp_path / "window.png") > 200, "the report")
        assert "What is known so far" in page.evaluate("document.body.innerText")
        live.end()
        until(lambda: "done" in page.evaluate("document.getElementById('state').textContent"), "the end")
        assert page.console == []
        hosts = {url.split("/")[2] for url in page.requests if url.startswith("http")}
        assert hosts == {f"localhost:{live.port}"}
