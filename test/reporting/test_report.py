"""The report's text: complete for every verdict, and nothing in a bag or cell becomes markup or script."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from compass_ros.reporting import Candidate, ReportExtras, write_report
from compass_ros.reporting.drawing import MAX_REPLAYS, distance_map, figure_data
from compass_ros.reporting.numbers import MISSING
from compass_ros.reporting.report import embedded_json, render
from compass_ros.reporting.view.gap import ladder
from compass_ros.reporting.view.page import questions
from compass_ros.reporting.view.parameters import told_rows
from compass_ros.reporting.words import VERDICT_TITLE
from compass_ros.types import Gap, Graph, Replay, ReplayedTrack, Result, Verdict

HOSTILE = '</script><script>window.hacked=1</script><img src=x onerror="window.hacked=1">\'"&<!--'
VOID = ("meta", "link", "img", "br", "wbr", "circle", "path")


class Outline(HTMLParser):
    """Collects elements, their attributes and text; checks that they nest."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self.scripts: list[str] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert not self._open, f"never closed: {self._open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self._open, f"</{tag}> closes nothing"
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1] == "script":
            self.scripts.append(data)
        elif not self._open or self._open[-1] != "style":
            self.text.append(" ".join(data.split()))

    def figures(self) -> Any:
        return json.loads(self.scripts[0])

    def said(self) -> str:
        return " ".join(filter(None, self.text))


@pytest.fixture(scope="module")
def outline(result: Result, extras: ReportExtras) -> Outline:
    return Outline(render(result, extras))


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_every_verdict_renders(verdict: Verdict, make_result: Callable[[Verdict], Result]) -> None:
    result = make_result(verdict)
    said = Outline(render(result, ReportExtras())).said()
    assert VERDICT_TITLE[verdict] in said
    assert result.mismatch.next_experiment in said
    for effect in result.mismatch.effects:
        assert effect.name in said
        assert all(other in said for other in effect.equivalents)


def test_says_what_it_must(outline: Outline, result: Result, extras: ReportExtras) -> None:
    said = outline.said()
    assert "0.21 ± 0.01 m/s²; held-out error 19.6 → 1.0 mm" in said
    assert extras.command in said
    assert "2 of 10 active parameters not identifiable" in said
    assert "episode_0009: 4 frames without puck2" in said
    assert "0.8463 ± 0.0031" in said
    assert "54 further parameters" in said
    assert "within 12 cm of (0.020, −0.010) m" in said  # the sign that readers see
    laws = [law.name for one in result.mismatch.explanations for law in one.laws if law.name != "unknown"]
    for name in (*result.mismatch.undetectable, *laws, *result.versions):
        assert name in said


def test_a_result_without_explanations_shows_the_candidates(result: Result, extras: ReportExtras) -> None:
    old = replace(result, mismatch=replace(result.mismatch, explanations=()))
    said = Outline(render(old, extras)).said()
    assert all(candidate.name in said for candidate in extras.candidates)


def test_every_parameter_is_in_the_heat_map(outline: Outline, result: Result) -> None:
    cells = [a for tag, a in outline.tags if tag == "td" and (a.get("class") or "").startswith("cell")]
    assert len(cells) == result.graph.psi.size
    edges = [a for a in cells if "edge" in (a["class"] or "").split()]
    assert len(edges) == int((result.graph.psi >= result.graph.threshold).sum())


def test_held_out_episodes_come_first_and_are_marked(outline: Outline, result: Result) -> None:
    drawn = [(e["name"], e["held_out"]) for e in outline.figures()["episodes"]]
    assert {name for name, held_out in drawn if held_out} == set(result.held_out)
    assert [held_out for _, held_out in drawn] == sorted((held_out for _, held_out in drawn), reverse=True)
    assert outline.said().count("held out") >= len(result.held_out)


def test_nothing_is_loaded_from_outside(outline: Outline) -> None:
    for tag, attributes in outline.tags:
        assert "src" not in attributes, tag
        assert (attributes.get("href") or "#").startswith(("#", "data:,")), attributes
    policy = next(a["content"] for t, a in outline.tags if t == "meta" and a.get("http-equiv"))
    assert policy is not None
    assert policy.startswith("default-src 'none'")
    assert "http" not in policy
    assert "unsafe-inline" not in policy.partition("script-src")[2]


def hostile(result: Result) -> tuple[Result, ReportExtras]:
    """Every name and sentence that comes from a file, replaced."""
    effect = replace(result.mismatch.effects[0], name=HOSTILE, equivalents=(HOSTILE,))
    effect = replace(effect, parameters={HOSTILE: replace(effect.parameters["strength"], unit=HOSTILE)})
    assert result.mismatch.where is not None
    mismatch = replace(
        result.mismatch,
        where=replace(result.mismatch.where, object=HOSTILE),
        effects=(effect,),
        undetectable=(HOSTILE,),
        next_experiment=HOSTILE,
        sentence=HOSTILE,
    )
    replays = tuple(
        replace(r, episode=HOSTILE, tracks=tuple(replace(t, object=HOSTILE) for t in r.tracks)) for r in result.replays
    )
    graph = replace(result.graph, parameters=(HOSTILE,) * 64, factors=(HOSTILE,) * 2)
    changed = replace(
        result,
        cell=HOSTILE,
        method=HOSTILE,
        versions={HOSTILE: HOSTILE},
        warnings=(HOSTILE,),
        fit=(HOSTILE,),
        held_out=(HOSTILE,),
        parameters=tuple(replace(row, name=HOSTILE, unit=HOSTILE) for row in result.parameters),
        graph=graph,
        mismatch=mismatch,
        replays=replays,
    )
    return changed, ReportExtras(HOSTILE, candidates=(Candidate(HOSTILE, HOSTILE, 1.0, 1.0, True, HOSTILE),))


def test_hostile_names_are_text(result: Result, outline: Outline) -> None:
    page = Outline(render(*hostile(result)))
    assert HOSTILE in page.said().replace("  ", " ")
    assert len(page.scripts) == len(outline.scripts) == 3
    assert page.scripts[1:] == outline.scripts[1:]
    assert not [attributes for tag, attributes in page.tags if tag == "img"]
    assert not [name for _, attributes in page.tags for name in attributes if name.startswith("on")]
    assert page.figures()["episodes"][0]["name"] == HOSTILE


def test_embedded_json_has_no_markup() -> None:
    data = {"name": HOSTILE + "\u2028"}
    text = embedded_json(data)
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text) == data


def test_same_result_same_page(result: Result, extras: ReportExtras, tmp_path: Path) -> None:
    write_report(result, tmp_path / "report.html", extras)
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == render(result, extras)
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_bare_result_renders(result: Result) -> None:
    bare = replace(
        result, replays=(), trace=(), gap={}, parameters=(), fit=(), held_out=(), noise_floor_m=float("nan"),
        graph=Graph((), (), np.zeros((0, 0)), 0.5), versions={},
    )  # fmt: skip
    said = Outline(render(bare, ReportExtras())).said()
    assert "No episode was replayed." in said
    assert "Nothing held out" in said
    assert "nan" not in said.lower().split()


def test_where_nothing_is_held_out_the_fitted_episodes_are_shown(result: Result) -> None:
    fitted: dict[Any, dict[Any, Gap]] = {model: {"fit": parts["fit"]} for model, parts in result.gap.items()}
    shown = ladder(replace(result, gap=fitted, held_out=()))
    assert "fitted" in shown["on"]
    assert all(row["place"] is not None for row in shown["rows"])
    assert [row["text"] for row in shown["rows"]] == [row["fit"] for row in ladder(result)["rows"]]
    assert {row["held_out"] for row in shown["rows"]} == {MISSING}
    assert "never" in ladder(result)["on"]


def spatial(result: Result, columns: int) -> Result:
    """The same tracks as spatial positions with orientation, or as joint angles."""

    def widen(path: Any) -> Any:
        if path is None or columns == 1:
            return None if path is None else path[:, :1]
        height = 0.2 * np.sin(np.arange(len(path)) / 9.0)
        return np.column_stack([path[:, 0], 0 * path[:, 1], height, np.ones(len(path)), np.zeros((len(path), 3))])

    def convert(t: ReplayedTrack) -> ReplayedTrack:
        paths = [widen(path) for path in (t.real, t.nominal, t.calibrated, t.with_effects)]
        return ReplayedTrack(t.object, t.time_s, *paths)

    return replace(result, replays=tuple(replace(r, tracks=tuple(map(convert, r.tracks))) for r in result.replays))


def test_spatial_tracks_are_drawn_in_the_plane_of_motion(result: Result) -> None:
    data = figure_data(spatial(result, 7), ReportExtras())
    assert data["axes"] == ["x", "z"]
    assert len(data["episodes"][0]["tracks"][0]["real"]) == 2


@pytest.mark.parametrize("widths", [(7, 2), (3, 2), (2, 3, 1), (1, 2), (7, 2, 1), (7, 1)])
def test_tracks_of_every_width_are_drawn_together(result: Result, widths: tuple[int, ...]) -> None:
    time = np.arange(9) / 30
    paths = [np.sin(np.outer(time, 1 + np.arange(width))) for width in widths]
    tracks = tuple(ReplayedTrack(f"body{i}", time, p, p + 0.1, p + 0.01, None) for i, p in enumerate(paths))
    data = figure_data(replace(result, replays=(Replay("mixed", True, tracks),)), ReportExtras())
    assert [len(track["real"]) for track in data["episodes"][0]["tracks"]] == [min(width, 2) for width in widths]
    assert data["axes"] == (["x", "y"] if 2 in widths else data["axes"])


def test_joint_tracks_have_errors_and_no_table(result: Result) -> None:
    data = figure_data(spatial(result, 1), ReportExtras())
    assert len(data["episodes"][0]["tracks"][0]["real"]) == 1
    assert data["maps"]["before"] is None


def test_errors_are_distances(result: Result) -> None:
    track = result.replays[0].tracks[0]
    drawn = next(e for e in figure_data(result, ReportExtras())["episodes"] if e["name"] == result.replays[0].episode)
    errors = drawn["tracks"][0]["error_mm"]["calibrated"]
    assert errors == pytest.approx(np.hypot(*(track.calibrated - track.real).T) * 1e3, abs=1e-3)


def test_distance_map_finds_a_planted_place() -> None:
    x = np.linspace(-0.4, 0.4, 801)
    real = np.column_stack([x, np.full_like(x, 0.1)])
    calibrated = real + np.where(np.abs(x - 0.2) < 0.05, 0.007, 0.001)[:, None] * np.array([0.0, 1.0])
    replay = Replay("planted", True, (ReplayedTrack("puck1", x, real, real, calibrated, None),))
    found = distance_map([replay], "calibrated", (0, 1))
    assert found is not None
    row = found.value[np.isfinite(found.value).any(axis=1)][0]
    assert np.nanmax(row) == pytest.approx(7.0, abs=1e-6)
    assert found.x_m[np.nanargmax(row)] == pytest.approx(0.2, abs=0.05)
    assert row[np.argmin(np.abs(found.x_m))] == pytest.approx(1.0, abs=1e-6)
    assert distance_map([replay], "with_effects", (0, 1)) is None


def test_many_episodes_are_cut_and_it_is_said(result: Result) -> None:
    many = replace(result, replays=result.replays * 6)
    page = Outline(render(many, ReportExtras()))
    assert len(page.figures()["episodes"]) == MAX_REPLAYS
    assert f"{12 * 6 - MAX_REPLAYS} further episodes are not drawn: fitted, with the smallest errors." in page.said()


def test_parameters_that_can_be_told_come_first_and_alone_are_counted(result: Result) -> None:
    sure, doubtful, still = (next(r for r in result.parameters if r.name == f"puck{i}@dyna@mass") for i in (1, 2, 1))
    sure = replace(sure, value=0.03, std=0.001, active=False, identifiable=True)
    doubtful = replace(doubtful, value=0.08, std=0.001, active=True, identifiable=False)
    still = replace(still, name="still", std=0.001, active=True, identifiable=True)
    few = replace(result, parameters=(doubtful, still, sure))
    assert [row.name for row in told_rows(few)] == [sure.name, "still", doubtful.name]
    first = questions(few)[0]
    assert first["answer"] == "1 of 3"
    assert first["detail"].startswith("were wrong; 1 more moved but is not identifiable; 2 have an edge")
    assert [p["identifiable"] for p in figure_data(few, ReportExtras())["calibration"]["parameters"]] == [
        False,
        True,
        True,
    ]


def test_what_a_trajectory_difference_is_is_said_beside_its_curves(outline: Outline) -> None:
    said = outline.said()
    assert "averaged over the fitted episodes" in said.partition("How they moved")[2]
    assert "summed over time" in said.partition("Which parameters cause the difference")[2]
