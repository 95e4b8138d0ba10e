"""Sites of scenes: what each joint, body, wall and drive is, by its kind; names that two things share."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from compass_ros.errors import ConfigError
from compass_ros.simulation.effects import EFFECTS, Attached, effect
from compass_ros.simulation.site_kinds import DRIVES, JOINTS, MOVING, PLANAR, SiteKind, in_words
from compass_ros.simulation.sites import Places, Site
from test.simulation.table import attached, on_table, simulator

EFFORT: tuple[SiteKind, ...] = ("effort_drive",)
CONTACTS: tuple[SiteKind, ...] = ("contacts",)
CAMERA: tuple[SiteKind, ...] = ("camera",)
SLIDES = '<joint name="{}" type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'


def places(inside: str, actuators: str = "", gravity: float = -9.81, sliding: tuple[str, ...] = ()) -> Places:
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 {gravity}"/><worldbody>{inside}</worldbody>'
        f"<actuator>{actuators}</actuator></mujoco>"
    )
    return Places(model, frozenset(sliding))


def body(name: str, joints: str, more: str = "", inside: str = "") -> str:
    return f'<body name="{name}" {more}>{joints}<geom size=".05" mass="1"/>{inside}</body>'


@pytest.mark.parametrize(
    ("joints", "gravity", "sliding", "kind"),
    [
        (SLIDES.format("x"), -9.81, (), "lying"),
        (SLIDES.format("x"), -9.81, ("it",), "table"),
        (SLIDES.format("x"), 0.0, (), "planar"),
        (SLIDES.format("x"), 0.0, ("it",), "planar"),
        (SLIDES.format("x") + '<joint type="hinge" axis="0 0 1"/>', -9.81, (), "lying"),
        (SLIDES.format("x") + '<joint type="hinge" axis="0 1 0"/>', -9.81, (), "lying"),
        (SLIDES.format("x") + '<joint type="slide" axis="0 0 1"/>', -9.81, (), "body"),
        ('<joint type="slide" axis="0 1 0"/><joint type="slide" axis="1 0 0"/>', -9.81, (), "body"),
        ('<joint type="slide" axis="1 0 0"/>', -9.81, (), "body"),
        ('<joint type="hinge" axis="0 0 1"/>', -9.81, (), "body"),
        ('<joint type="ball"/>', -9.81, (), "body"),
        ("<freejoint/>", -9.81, (), "body"),
    ],
)
def test_a_moving_body_is_of_one_kind(joints: str, gravity: float, sliding: tuple[str, ...], kind: str) -> None:
    if joints.endswith('axis="0 1 0"/>') and "hinge" in joints:
        kind = "body"  # it tips over
    site = places(body("it", joints), gravity=gravity, sliding=sliding).body("it")
    assert site == Site(kind, ("it",))  # type: ignore[arg-type]


def test_what_does_not_move_is_no_body_and_a_joint_of_many_degrees_no_joint() -> None:
    scene = places(body("fixed", "") + body("ball", '<joint name="ball" type="ball"/>', 'pos="1 0 0"'))
    assert scene.body("fixed") is None
    assert scene.body("world") is None
    assert scene.joint("ball") is None
    assert scene.of("ball", MOVING) == Site("body", ("ball",))


@pytest.mark.parametrize(
    ("joint", "kinds", "is_joint"),
    [
        ('<joint name="it" type="hinge"/>', MOVING, True),
        ('<joint name="it" type="slide"/>', MOVING, True),
        ('<joint name="it" type="hinge"/>', ("body",), False),
        (SLIDES.format("it"), MOVING, True),
        (SLIDES.format("it"), PLANAR, False),
        ('<freejoint name="it"/>', MOVING, False),
        ('<joint name="it" type="ball"/>', MOVING, False),
    ],
)
def test_a_body_and_its_joint_of_the_same_name_are_kept_apart(
    joint: str, kinds: tuple[str, ...], is_joint: bool
) -> None:
    found = places(body("it", joint)).of("it", kinds)  # type: ignore[arg-type]
    assert found is not None
    assert (found.kind in JOINTS) is is_joint


RAIL = body("cart", '<joint name="rail" type="slide" axis="1 0 0"/>')
ARM = body("arm", '<joint name="axis" type="hinge" axis="0 1 0"/>', 'pos="0 0 1"')


FINGERS = body("f1", "<joint/>", 'pos="1 0 0"') + body("f2", "<joint/>", 'pos="-1 0 0"') + body("plate", "")


@pytest.mark.parametrize(
    ("inside", "ends"),
    [
        (ARM, ("arm",)),
        (body("upper", "<joint/>", inside=body("lower", "<joint/>", 'pos="1 0 0"')), ("lower",)),
        (body("upper", "<joint/>", inside=body("flange", "", inside=body("tool", "", 'pos="1 0 0"'))), ("upper",)),
        (body("upper", "<joint/>", inside=body("flange", "", inside=FINGERS)), ("f1", "f2")),
        (body("stand", "", inside=ARM) + body("ball", "<freejoint/>"), ("arm", "ball")),
        (body("stand", ""), ()),
    ],
)
def test_a_payload_belongs_on_what_carries_no_other_link(inside: str, ends: tuple[str, ...]) -> None:
    assert places(inside).ends == ends


@pytest.mark.parametrize(
    ("actuator", "kind"),
    [
        ('<motor name="a" joint="axis"/>', "effort_drive"),
        ('<motor name="a" joint="axis" gear="50"/>', "effort_drive"),
        ('<general name="a" joint="axis" dyntype="filter" dynprm="0.1"/>', "effort_drive"),
        ('<position name="a" joint="axis" kp="5"/>', "position_drive"),
        ('<position name="a" joint="axis" kp="5" kv="1"/>', "position_drive"),
        ('<position name="a" joint="axis" kp="5" timeconst="0.1"/>', "position_drive"),
        ('<general name="a" joint="axis" biastype="affine" gainprm="80" biasprm="0 -100 -10"/>', "position_drive"),
        ('<velocity name="a" joint="axis" kv="5"/>', "velocity_drive"),
        ('<intvelocity name="a" joint="axis" kp="5" actrange="-1 1"/>', "velocity_drive"),
        ('<damper name="a" joint="axis" kv="5" ctrlrange="0 1"/>', "other_drive"),
        ('<cylinder name="a" joint="axis" area="1"/>', "effort_drive"),
        ('<muscle name="a" joint="axis" lengthrange="-1 1"/>', "other_drive"),
        ('<adhesion name="a" body="arm" ctrlrange="0 1" gain="1"/>', "effort_drive"),
    ],
)
def test_a_drive_is_what_it_is_told(actuator: str, kind: str) -> None:
    (drive,) = places(ARM, actuator).drives
    assert (drive.kind, drive.names, drive.actuators) == (kind, ("a",), (0,))


TOOL = '<joint name="{0}x" type="slide" axis="1 0 0"/><joint name="{0}y" type="slide" axis="0 1 0"/>'


@pytest.mark.parametrize(
    ("inside", "actuators", "tools"),
    [
        (body("t", TOOL.format("")), '<velocity name="a" joint="x"/><velocity name="b" joint="y"/>', [("a", "b")]),
        (body("t", TOOL.format("")), '<velocity name="a" joint="y"/><velocity name="b" joint="x"/>', [("b", "a")]),
        (body("t", TOOL.format("")), '<velocity name="a" joint="x"/><position name="b" joint="y"/>', []),
        (body("t", TOOL.format("")), '<position name="a" joint="x"/><position name="b" joint="y"/>', []),
        (body("t", TOOL.format("")), '<velocity name="a" joint="x"/>', []),
        (
            body("t", TOOL.format("") + '<joint name="z" type="slide" axis="0 0 1"/>'),
            '<velocity name="a" joint="x"/><velocity name="b" joint="y"/><velocity name="c" joint="z"/>',
            [("a", "b", "c")],
        ),
        (
            body("t", TOOL.format("1")) + body("s", TOOL.format("2"), 'pos="1 0 0"'),
            "".join(
                f'<velocity name="{n}" joint="{j}"/>' for n, j in zip("acbd", ("1x", "2x", "1y", "2y"), strict=True)
            ),
            [("a", "b"), ("c", "d")],
        ),
        (ARM + RAIL, '<velocity name="a" joint="axis"/><velocity name="b" joint="rail"/>', []),
    ],
)
def test_velocity_drives_of_one_tool_have_one_command(
    inside: str, actuators: str, tools: list[tuple[str, ...]]
) -> None:
    drives = places(inside, actuators).drives
    assert [d.names for d in drives if d.kind == "tool_drive"] == tools
    assert sorted(i for d in drives for i in d.actuators) == list(range(actuators.count("joint=")))


@pytest.mark.parametrize(
    ("inside", "could"),
    [
        (ARM, False),
        (ARM + '<geom name="floor" type="plane" size="1 1 1"/>', True),
        (ARM + '<geom name="floor" type="plane" size="1 1 1" contype="0" conaffinity="0"/>', False),
        (body("arm", '<joint axis="0 1 0"/>', inside=body("hand", '<joint axis="0 1 0"/>', 'pos="1 0 0"')), False),
        (body("a", '<joint axis="0 1 0"/>') + body("b", '<joint axis="0 1 0"/>', 'pos="1 0 0"'), True),
        ('<geom size="1"/><geom size="1"/>', False),
    ],
)
def test_contacts_are_there_where_two_geoms_could_touch(inside: str, could: bool) -> None:
    assert places(inside).touching is could


def test_all_that_stands_for_drives_contacts_and_signals_needs_no_name() -> None:
    scene = places(ARM + RAIL, '<motor name="a" joint="axis"/><position name="b" joint="rail"/>')
    assert [d.names for d in scene.sites((), DRIVES)] == [("a",), ("b",)]
    assert [d.names for d in scene.sites((), EFFORT)] == [("a",)]
    assert [d.names for d in scene.sites(("b",), DRIVES)] == [("b",)]
    assert scene.sites(("a", "b"), DRIVES) == scene.drives
    assert scene.sites(("a", "c"), DRIVES) == ()
    assert scene.missing(("c",), DRIVES) == "the scene has no drive 'c'; it has ['a', 'b']"
    assert [s.kind for s in scene.sites((), CONTACTS)] == ["contacts"]
    assert scene.missing((), CAMERA) == "the scene has no tracked body"


@pytest.mark.parametrize("name", EFFECTS)
def test_a_law_says_what_it_acts_on_and_is_refused_elsewhere_with_what_there_is(name: str) -> None:
    kind = EFFECTS[name]
    assert kind.on
    assert in_words(kind.on)
    wrong = ("nobody",)
    with pytest.raises(ConfigError, match=f"'{name}'.*'nobody'") as refused:
        Attached(kind, wrong).sites(simulator().places)
    assert "\n" not in str(refused.value)
    assert simulator().accepts(kind, attached(kind).objects) is on_table(kind)


def test_a_sized_law_acts_on_its_own_kind_alone() -> None:
    scene = places(body("it", '<joint name="it" type="hinge"/>'))
    drag = effect("viscous_drag")
    assert Attached(drag, ("it",)).sites(scene)[0].kind == "hinge"
    pinned = Attached(EFFECTS["viscous_drag"].on_kinds(("body",)), ("it",))
    assert pinned.sites(scene)[0].kind == "body"
    data = mujoco.MjData(scene.model)
    assert np.isfinite(data.qpos).all()
