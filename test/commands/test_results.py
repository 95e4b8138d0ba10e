"""`compass report` and `compass diagnose`: an earlier result, drawn and explained again."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from compass_ros.reporting import write_report, write_result
from compass_ros.reporting.kept import RESULT, TRAJECTORIES, write_trajectories
from compass_ros.types import Result
from test.conftest import Run
from test.reporting.conftest import synthetic_extras, synthetic_result


@pytest.fixture
def result() -> Result:
    return synthetic_result("named")


@pytest.fixture
def folder(result: Result, tmp_path: Path) -> Path:
    """What a calibration leaves, as far as these commands read it."""
    write_report(result, tmp_path / "report.html", synthetic_extras())
    write_trajectories(result, tmp_path / TRAJECTORIES, synthetic_extras())
    write_result(result, tmp_path / RESULT)
    return tmp_path


def test_the_report_is_drawn_again(folder: Path, run: Run) -> None:
    path = folder / "report.html"
    before = path.read_bytes()
    path.unlink()
    status, out, err = run("report", folder)
    assert (status, err) == (0, "")
    assert out.endswith("report.html\n")
    assert path.read_bytes() == before


def test_a_truth_that_became_known_is_shown(folder: Path, run: Run) -> None:
    truth = folder / "truth.yaml"
    truth.write_text(yaml.safe_dump({"puck1@dyna@damping": -5.4321}))
    status, _, err = run("report", folder, "--truth", truth, "--out", folder / "told" / "report.html")
    assert (status, err) == (0, "")
    assert "5.4321" in (folder / "told" / "report.html").read_text()
    assert "5.4321" not in (folder / "report.html").read_text()


def test_a_result_is_explained_in_words_and_figures(folder: Path, result: Result, run: Run) -> None:
    status, out, err = run("diagnose", folder, "--figures", folder / "png")
    assert (status, err) == (0, "")
    text = " ".join(out.split())
    assert result.mismatch.sentence in text
    for word in ("Missing physics named", "fan_field", "0.208 ± 0.011", "point_attraction", "on free slides"):
        assert word in text
    assert all(name in text for name in result.mismatch.undetectable)
    drawn = sorted(path.stem for path in (folder / "png").iterdir())
    assert [name for name in drawn if not name.startswith("worst_")] == [
        "causal_graph", "error_over_time", "gap", "left_over", "parameters",
    ]  # fmt: skip
    (worst,) = (name for name in drawn if name.startswith("worst_"))
    assert worst.removeprefix("worst_") in result.held_out
    assert all(path.read_bytes()[:4] == b"\x89PNG" for path in (folder / "png").iterdir())


@pytest.mark.parametrize("command", ["report", "diagnose"])
@pytest.mark.parametrize(
    ("truth", "said"),
    [
        ("puck1@dyna@dampin: -5", "unknown parameter 'puck1@dyna@dampin'; did you mean 'puck1@dyna@damping'?"),
        ("puck1@dyna@damping: much", "expected a number, found str"),
    ],
)
def test_a_truth_that_is_none_is_one_line(command: str, truth: str, said: str, folder: Path, run: Run) -> None:
    (folder / "truth.yaml").write_text(truth)
    status, out, err = run(command, folder, "--truth", folder / "truth.yaml")
    assert (status, out) == (1, "")
    assert said in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("command", ["report", "diagnose"])
def test_a_folder_without_a_result_is_one_line(command: str, tmp_path: Path, run: Run) -> None:
    status, out, err = run(command, tmp_path)
    assert (status, out) == (1, "")
    assert err.startswith(f"compass: {tmp_path / 'result.json'}: cannot be read")
    assert list(tmp_path.iterdir()) == []
