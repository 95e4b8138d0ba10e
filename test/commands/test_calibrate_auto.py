"""`compass calibrate --parameters auto`: every field of the scene goes into the result, and from there into force."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.operation.current import current
from compass_ros.reporting.result_json import read_result
from test.conftest import Run

BAGS = Path(__file__).parents[2] / "bags"
QUICK = ("--method", "random", "--rollouts", 16, "--no-discover", "--progress", "none")


@pytest.mark.slow
def test_a_calibration_of_the_whole_scene_is_written_and_can_be_put_in_force(run: Run, tmp_path: Path) -> None:
    status, _, err = run("calibrate", BAGS, "--parameters", "auto", *QUICK, "--out", tmp_path / "out")
    assert status == 0, err
    rows = read_result(tmp_path / "out" / "result.json")["parameters"]
    cell = load("air_hockey", "auto")
    assert [row["name"] for row in rows] == [p.name for p in cell.parameters]
    in_force = current(load("air_hockey"), tmp_path / "out")
    np.testing.assert_allclose(in_force.values, [row["value"] for row in rows])
    scene = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "scene.xml"))
    gaps = {f"{scene.geom(a).name}+{scene.geom(b).name}": gap
            for a, b, gap in zip(scene.pair_geom1, scene.pair_geom2, scene.pair_gap, strict=True)}  # fmt: skip
    found = {row["name"].removesuffix("@dyna@gap"): row["value"] for row in rows if row["name"].endswith("@dyna@gap")}
    assert gaps == {pair: pytest.approx(found[pair]) for pair in gaps}
