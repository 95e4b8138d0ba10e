"""A scene of several files: each counts in the cell's hash, and the written scene takes them along."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml
from PIL import Image

from compass_ros.cells import Cell, load
from compass_ros.cells.scene_files import scene_files
from compass_ros.simulation import Simulator
from compass_ros.simulation.export import write_scene
from compass_ros.types import Floats
from test.cells.written import content, differing

TIME = np.arange(0, 0.4, 0.02)
ROD = '<mesh name="rod" file="{}"/>'
ARM = """
  <body name="arm" pos="0 0 1">
    <joint name="swing" axis="0 1 0" damping="0.01"/>
    <geom name="rod" type="mesh" mesh="rod" mass="0.4" contype="0" conaffinity="0"/>{}
  </body>
"""
URDF = """
<robot name="arm">{}
  <link name="base"/>
  <joint name="swing" type="continuous">
    <parent link="base"/><child link="arm"/><axis xyz="0 1 0"/><origin xyz="0 0 1"/>
  </joint>
  <link name="arm">
    <inertial>
      <origin xyz="0.05 0 -0.1"/><mass value="0.4"/>
      <inertia ixx="0.012" iyy="0.011" izz="0.003" ixy="0.0002" ixz="0.0003" iyz="-0.0001"/>
    </inertial>
    <collision><geometry><mesh filename="{}"/></geometry></collision>
  </link>
</robot>
"""


def document(assets: str = "", compiler: str = "", before: str = "", geom: str = "", arm: bool = True) -> str:
    asset = f"<asset>{assets}</asset>" if assets else ""
    body = f"<worldbody>{ARM.format(geom)}</worldbody>" if arm else ""
    return f"<mujoco>{compiler}{before}{asset}{body}</mujoco>"


def textured(file: str, more: str = "") -> str:
    return f'{ROD.format("rod.obj")}<texture name="t" type="2d" {file}/><material name="m" texture="t"/>{more}'


_PAINTED = '<geom name="patch" type="box" size="0.1 0.1 0.1" material="m" contype="0" conaffinity="0" mass="0.1"/>'
_HILLS = '<geom name="hills" type="hfield" hfield="hills" contype="0" conaffinity="0"/>'
_ATTACH = (
    '<asset><model name="other" file="parts/arm.xml"/></asset>'
    '<worldbody><frame pos="0.1 0 0"><attach model="other" body="arm" prefix="r_"/></frame></worldbody>'
)
_SKIN = '<skin name="skin" file="skin.skn"/>'
LAYOUTS: dict[str, dict[str, str]] = {
    "mesh beside it": {"scene.xml": document(ROD.format("rod.obj")), "rod.obj": "mesh"},
    "meshdir": {"scene.xml": document(ROD.format("rod.obj"), '<compiler meshdir="m/s"/>'), "m/s/rod.obj": "mesh"},
    "assetdir": {"scene.xml": document(ROD.format("rod.obj"), '<compiler assetdir="a"/>'), "a/rod.obj": "mesh"},
    "STL in a folder": {"scene.xml": document(ROD.format("deep/er/rod.stl")), "deep/er/rod.stl": "stl"},
    "included beside it": {
        "scene.xml": document(before='<include file="assets.xml"/>'),
        "assets.xml": document(ROD.format("rod.obj"), arm=False),
        "rod.obj": "mesh",
    },
    "included from below, mesh below": {
        "scene.xml": document(before='<!-- -- <include file="no.xml"/> --><include file="parts/assets.xml"/>'),
        "parts/assets.xml": document(ROD.format("rod.obj"), arm=False),
        "parts/rod.obj": "mesh",
    },
    "included from below, meshdir above": {
        "scene.xml": document(compiler='<compiler meshdir="m"/>', before='<include file="parts/assets.xml"/>'),
        "parts/assets.xml": document(ROD.format("rod.obj"), arm=False),
        "m/rod.obj": "mesh",
    },
    "included by an included": {
        "scene.xml": document(before='<include file="parts/a.xml"/>'),
        "parts/a.xml": '<mujoco><include file="b.xml"/></mujoco>',
        "parts/b.xml": document(ROD.format("rod.obj"), arm=False),
        "parts/rod.obj": "mesh",
    },
    "attached with a meshdir of its own": {
        "scene.xml": f"<mujoco>{_ATTACH}</mujoco>",
        "parts/arm.xml": document(ROD.format("rod.obj"), '<compiler meshdir="m"/>'),
        "parts/m/rod.obj": "mesh",
    },
    "texture": {
        "scene.xml": document(textured('file="t.png"'), '<compiler texturedir="tex" meshdir="m"/>', geom=_PAINTED),
        "m/rod.obj": "mesh",
        "tex/t.png": "png",
    },
    "cube texture": {
        "scene.xml": document(
            ROD.format("rod.obj")
            + '<texture name="t" type="cube" fileright="r.png" fileleft="l.png"/><material name="m" texture="t"/>',
            geom=_PAINTED,
        ),
        "rod.obj": "mesh",
        "r.png": "png",
        "l.png": "png",
    },
    "two files of one name": {
        "scene.xml": document(textured('file="one/a.png"', '<texture name="u" type="2d" file="two/a.png"/>')),
        "rod.obj": "mesh",
        "one/a.png": "png",
        "two/a.png": "png",
    },
    "height field": {
        "scene.xml": document(
            ROD.format("rod.obj") + '<hfield name="hills" file="h.png" size="1 1 0.1 0.1"/>',
            '<compiler meshdir="m"/>',
            before=f"<worldbody>{_HILLS}</worldbody>",
        ),
        "m/rod.obj": "mesh",
        "m/h.png": "png",
    },
    "skin": {"scene.xml": document(ROD.format("rod.obj") + _SKIN), "rod.obj": "mesh", "skin.skn": "skin"},
    "URDF": {"scene.urdf": URDF.format("", "rod.obj"), "rod.obj": "mesh"},
    "URDF with a meshdir": {
        "scene.urdf": URDF.format('<mujoco><compiler meshdir="m" strippath="true"/></mujoco>', "x/y/rod.obj"),
        "m/rod.obj": "mesh",
    },
}
layouts = pytest.mark.parametrize("layout", LAYOUTS)
_CORNERS = np.array([[x, y, z] for x in (0.0, 0.03) for y in (0.0, 0.02) for z in (-0.4, 0.0)]) + np.array([0.01, 0, 0])
_SIDES = ((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
          (1, 5, 7), (1, 7, 3))  # fmt: skip


def _obj(path: Path) -> None:
    lines = ["v {} {} {}".format(*corner) for corner in _CORNERS]
    path.write_text("\n".join(lines + ["f {} {} {}".format(*(i + 1 for i in side)) for side in _SIDES]))


def _stl(path: Path) -> None:
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
    triangles = np.zeros(len(_SIDES), record)
    triangles["corners"] = _CORNERS[np.array(_SIDES)]
    path.write_bytes(bytes(80) + np.uint32(len(_SIDES)).tobytes() + triangles.tobytes())


def _png(path: Path) -> None:
    seed = sum(map(ord, str(path.name) + path.parent.name))
    Image.fromarray(np.random.default_rng(seed).integers(0, 255, (8, 8), dtype=np.uint8)).save(path)


def _skn(path: Path) -> None:
    """MuJoCo's binary skin: counts, vertices, texture coordinates, faces, then each bone."""
    name = b"arm".ljust(40, b"\0")
    numbers = np.array([0, 0, 0, 0.1, 0, 0, 0, 0.1, 0], "<f4").tobytes() + np.array([0, 1, 2], "<i4").tobytes()
    bone = name + np.array([0, 0, 1, 1, 0, 0, 0], "<f4").tobytes() + np.array([3, 0, 1, 2], "<i4").tobytes()
    path.write_bytes(np.array([3, 0, 1, 1], "<i4").tobytes() + numbers + bone + np.ones(3, "<f4").tobytes())


def _changed(kind: str, content: bytes) -> bytes:
    """Other bytes that say as much."""
    if kind == ".skn":
        return content[:-4] + np.float32(0.5).tobytes()
    if kind == ".stl":
        return b"!" + content[1:]  # of the header that says nothing: a file of another length is refused
    return content + (b"<!-- -->" if kind in (".xml", ".urdf") else b"\n")


FILES: dict[str, Callable[[Path], None]] = {"mesh": _obj, "stl": _stl, "png": _png, "skin": _skn}


def cell_of(folder: Path, layout: str) -> Cell:
    for name, what in LAYOUTS[layout].items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if what in FILES:
            FILES[what](path)
        else:
            path.write_text(what)
    model = next(iter(LAYOUTS[layout]))
    joint = {"name": "swing", "quantity": "joint", "body": "r_swing" if "attached" in layout else "swing"}
    said = content([joint], start=[{"object": "swing"}], auto=True, model=model)
    (folder / "cell.yaml").write_text(yaml.safe_dump(said))
    return load(folder / "cell.yaml")


def swing(model: mujoco.MjModel, angle: float) -> Floats:
    data, seen = mujoco.MjData(model), []
    data.qpos[0] = angle
    for moment in TIME:
        while data.time < moment - 1e-9:
            mujoco.mj_step(model, data)
        seen.append(float(data.qpos[0]))
    return np.array(seen)


@layouts
def test_the_written_scene_lies_where_it_lies(tmp_path: Path, layout: str) -> None:
    source, out = tmp_path / "source", tmp_path / "out"
    cell = cell_of(source, layout)
    values = np.array([min(p.default + p.half_width, p.high) for p in cell.parameters])
    times = np.tile(TIME, (1, 1))
    seen = Simulator(cell, threads=1).observe(values[None], np.array([[0.7, 0.0]]), times)[0, :, 0]
    out.mkdir()
    write_scene(cell, cell.defaults, out / "scene.xml")
    as_drawn = mujoco.MjModel.from_xml_path(str(cell.model_path))
    same = differing(as_drawn, mujoco.MjModel.from_xml_path(str(out / "scene.xml")), 1e-6)
    assert same <= {
        "_sizes",
        "names",
        "names_map",
        "paths",
        "mesh_pathadr",
        "tex_pathadr",
        "hfield_pathadr",
        "skin_pathadr",
    }
    write_scene(cell, values, out / "scene.xml")
    shutil.rmtree(source)
    moved = tmp_path / "elsewhere"
    out.rename(moved)
    again = mujoco.MjModel.from_xml_path(str(moved / "scene.xml"))
    assert np.abs(swing(again, 0.7) - seen).max() < 1e-7
    assert np.ptp(seen) > 0.05


@layouts
def test_every_file_counts_in_the_hash(tmp_path: Path, layout: str) -> None:
    first = cell_of(tmp_path, layout).hash
    assert cell_of(tmp_path, layout).hash == first
    for name in LAYOUTS[layout]:
        path = tmp_path / name
        before = path.read_bytes()
        path.write_bytes(_changed(path.suffix, before))
        changed = {p.name for p in scene_files(tmp_path / next(iter(LAYOUTS[layout]))).further}
        assert name == next(iter(LAYOUTS[layout])) or path.name in changed, name
        try:
            assert load(tmp_path / "cell.yaml").hash != first, name
        finally:
            path.write_bytes(before)
