"""The report in a real browser: it draws, it stays quiet, it asks for nothing, it fits a phone."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from compass_ros.reporting import Candidate, ReportExtras, write_report
from compass_ros.types import Result, Verdict
from test.by_night import but
from test.reporting.arm import arm

if TYPE_CHECKING:
    from test.reporting.browser.conftest import Page

HOSTILE = '</script><script>window.hacked=1</script><img src=x onerror="window.hacked=1"><a href="javascript:1">'
SIZES = {"phone": 390, "desk": 1280}


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory, result: Result, extras: ReportExtras) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(result, path, extras)
    return path


def quiet(page: Page, path: Path) -> None:
    """Nothing on the console, and no request but the file itself."""
    assert page.console == []
    assert [url for url in page.requests if not url.startswith("data:")] == [path.as_uri()]


def background(page: Page) -> int:
    """Brightness of the page's ground, 0 to 255."""
    red = page.evaluate("getComputedStyle(document.body).backgroundColor.match(/\\d+/)[0]")
    return int(red)


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("size", SIZES)
def test_draws_quietly_and_fits(page: Page, report: Path, size: str, dark: bool, tmp_path: Path) -> None:
    page.show(report, SIZES[size], dark=dark)
    page.settle()
    quiet(page, report)
    assert page.evaluate("document.documentElement.scrollWidth") == SIZES[size]
    assert page.evaluate("document.querySelectorAll('.plot:not([hidden])').length") == 16
    assert page.evaluate(
        "[...document.querySelectorAll('.plot:not([hidden])')].every((p) => p.querySelector('.main-svg'))"
    )
    assert (background(page) < 60) is dark
    folder = Path(os.environ.get("COMPASS_SCREENSHOTS", tmp_path))
    picture = folder / f"report_{size}_{'dark' if dark else 'light'}.png"
    page.screenshot(picture)
    assert picture.stat().st_size > 50_000


VERDICTS = ("none", "ambiguous", "unknown", "fit_failed", "data_bad", "not_evaluated")


@pytest.mark.parametrize("verdict", but(VERDICTS, "unknown", "data_bad"))
def test_every_verdict_is_quiet(
    page: Page, make_result: Callable[[Verdict], Result], verdict: Verdict, tmp_path: Path
) -> None:
    path = tmp_path / "report.html"
    write_report(make_result(verdict), path)
    page.show(path, 390)
    page.settle()
    quiet(page, path)
    assert page.evaluate("document.documentElement.scrollWidth") == 390


def traces(page: Page, plot: str, what: str) -> Any:
    return page.evaluate(f"document.getElementById('{plot}').data.map((t) => {what})")


def test_choosing_an_episode_draws_it(page: Page, report: Path) -> None:
    page.show(report, 1280)
    before = traces(page, "table-plot", "t.x[0]")
    page.evaluate("document.querySelector('[data-episode=\"5\"]').click()")
    assert traces(page, "table-plot", "t.x[0]") != before
    assert page.evaluate("document.querySelector('[aria-checked=true]').dataset.episode") == "5"
    quiet(page, report)


def test_the_legend_hides_a_model_in_both_figures(page: Page, report: Path) -> None:
    page.show(report, 1280)
    assert "nominal" in traces(page, "error-plot", "t.name")
    page.evaluate("[...document.querySelectorAll('#legend button')].find((b) => b.textContent === 'nominal').click()")
    assert "nominal" not in traces(page, "error-plot", "t.name")
    assert page.evaluate("document.querySelector('#legend [aria-pressed=false]').textContent") == "nominal"


def test_pointing_at_an_error_marks_the_moment_on_the_table(page: Page, report: Path) -> None:
    page.show(report, 1280)
    page.evaluate("document.getElementById('error-plot').scrollIntoView({behavior: 'instant', block: 'center'})")
    box = page.evaluate("document.querySelector('#error-plot .nsewdrag').getBoundingClientRect().toJSON()")
    assert not any(traces(page, "table-plot", "t.marker && t.marker.symbol === 'circle-open' && t.x.length > 0"))
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
    page.evaluate("new Promise((done) => setTimeout(done, 150))")
    assert any(traces(page, "table-plot", "t.marker && t.marker.symbol === 'circle-open' && t.x.length === 2"))
    quiet(page, report)


@pytest.fixture
def of_arm(result: Result, tmp_path: Path) -> Path:
    path = tmp_path / "report.html"
    write_report(arm(result), path)
    return path


@pytest.mark.parametrize("size", SIZES)
def test_signals_are_drawn_as_they_were_recorded(page: Page, of_arm: Path, size: str) -> None:
    page.show(of_arm, SIZES[size])
    page.settle()
    assert page.evaluate("document.documentElement.scrollWidth") == SIZES[size]
    assert page.evaluate("document.getElementById('table-plot').hidden")
    names = traces(page, "signal-plot", "t.name")
    assert names == ["recorded", "nominal", "calibrated"] * 5  # two joints, three numbers of the imu
    titles = page.evaluate("document.getElementById('signal-plot').layout.annotations.map((a) => a.text)")
    assert titles[:3] == ["joints.elbow [rad]", "joints.wrist [rad]", "imu wx [rad/s]"]
    recorded, nominal = traces(page, "signal-plot", "t.y[10]")[:2]
    assert nominal - recorded == pytest.approx(0.1, abs=1e-4)
    for plot in ("signal-plot", "error-plot"):
        title = page.evaluate(f"document.getElementById('{plot}').layout.xaxis.title.text")
        assert title == "time since the window began [s]"
    quiet(page, of_arm)


def test_the_noise_floor_is_in_the_legend_and_dotted_in_each_panel(page: Page, of_arm: Path) -> None:
    page.show(of_arm, 1280)
    assert page.evaluate("document.querySelector('#legend > span').textContent") == "noise floor"
    lines = page.evaluate("document.getElementById('error-plot').layout.shapes.map((s) => [s.y0, s.line])")
    assert [y for y, _ in lines] == [0.5, 0.5, 30.0]
    assert {line["dash"] for _, line in lines} == {f"{line['width']}px,3px" for _, line in lines}  # dots, not dashes


def test_pointing_at_an_error_marks_the_moment_in_the_signals(page: Page, of_arm: Path) -> None:
    page.show(of_arm, 1280)
    page.evaluate("document.getElementById('error-plot').emit('plotly_hover', {points: [{x: 1.5}]})")
    marks = "document.getElementById('signal-plot').layout.shapes.map((s) => s.x0)"
    assert page.evaluate(marks) == [1.5]
    page.evaluate("document.getElementById('error-plot').emit('plotly_unhover', {})")
    assert page.evaluate(marks) == []


@pytest.mark.parametrize("width", [360, 420, 560])
def test_the_whole_menu_is_on_a_narrow_screen(page: Page, report: Path, width: int) -> None:
    page.show(report, width)
    ends = page.evaluate("[...document.querySelectorAll('.bar nav a')].map((a) => a.getBoundingClientRect().right)")
    assert len(ends) == 6
    assert max(ends) <= width
    assert page.evaluate(
        "document.querySelector('.bar nav').scrollWidth <= document.querySelector('.bar nav').clientWidth"
    )


def test_the_theme_can_be_switched(page: Page, report: Path) -> None:
    page.show(report, 1280)
    light, ink = background(page), traces(page, "table-plot", "t.marker && t.marker.color")
    page.evaluate("document.getElementById('theme').click()")
    assert background(page) < 60 < light
    assert traces(page, "table-plot", "t.marker && t.marker.color") != ink
    page.evaluate("document.getElementById('theme').click()")
    assert background(page) == light


def test_hostile_names_do_nothing(page: Page, result: Result, tmp_path: Path) -> None:
    replays = tuple(
        replace(r, episode=HOSTILE, tracks=tuple(replace(t, object=HOSTILE) for t in r.tracks)) for r in result.replays
    )
    rows = tuple(replace(row, name=HOSTILE, unit=HOSTILE) for row in result.parameters)
    graph = replace(result.graph, parameters=(HOSTILE,) * 64, factors=(HOSTILE, HOSTILE + "2"))
    mismatch = replace(result.mismatch, sentence=HOSTILE, next_experiment=HOSTILE)
    bad = replace(result, cell=HOSTILE, replays=replays, parameters=rows, graph=graph, mismatch=mismatch)
    path = tmp_path / "report.html"
    write_report(bad, path, ReportExtras(HOSTILE, candidates=(Candidate(HOSTILE, HOSTILE, 1.0, 1.0, True, HOSTILE),)))
    page.show(path, 1280)
    page.settle()
    quiet(page, path)
    assert page.evaluate("typeof window.hacked") == "undefined"
    assert page.evaluate("document.images.length") == 0
    assert page.evaluate("[...document.querySelectorAll('a')].every((a) => /^#/.test(a.getAttribute('href')))")
    assert HOSTILE in page.evaluate("document.querySelector('#table-plot').textContent")
