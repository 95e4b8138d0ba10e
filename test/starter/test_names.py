"""Names of one thing in two spellings are found, and names of two things are not taken for one."""

from __future__ import annotations

import pytest

from compass_ros.starter.names import matched, tokens

PAIRS = {
    "the same": (["a_1", "b"], ["b", "a_1"], ["a_1", "b"]),
    "case and separators": (["Upper-Pan", "elbowFlex"], ["elbow_flex", "upper_pan"], ["upper_pan", "elbow_flex"]),
    "the word joint": (["upper_pan_joint", "wrist_1_joint"], ["wrist_1", "upper_pan"], ["upper_pan", "wrist_1"]),
    "a prefix in the model": (["joint_1", "joint_2"], ["arm_joint1", "arm_joint2"], ["arm_joint1", "arm_joint2"]),
    "a prefix in the recordings": (["fr3_joint1", "fr3_joint2"], ["joint2", "joint1"], ["joint1", "joint2"]),
    "a prefix in each": (["arm/Joint_02", "arm/Joint_01"], ["robot0_joint1", "robot0_joint2"],
                         ["robot0_joint2", "robot0_joint1"]),
    "the end of the name": (["left_elbow", "gripper"], ["robot_left_elbow", "robot_hand"], ["robot_left_elbow", None]),
    "two arms": (["left/j1", "right/j1"], ["left_arm_joint_1", "right_arm_joint_1"],
                 ["left_arm_joint_1", "right_arm_joint_1"]),
    "two arms, the same words": (["left_arm/j1", "right_arm/j1"], ["left_arm_joint_1", "right_arm_joint_1"],
                                 ["left_arm_joint_1", "right_arm_joint_1"]),
    "one name for two": (["elbow"], ["left_elbow", "right_elbow"], [None]),
    "two names for one": (["left_elbow", "right_elbow"], ["elbow"], [None, None]),
    "nothing": (["rotation", "pitch"], ["shoulder", "elbow"], [None, None]),
    "legs": (["LF_HAA", "RF_HAA"], ["rf_haa_joint", "lf_haa_joint"], ["lf_haa_joint", "rf_haa_joint"]),
    "one more": (["joint_1", "joint_2", "finger_joint"], ["joint2", "joint1"], ["joint1", "joint2", None]),
}  # fmt: skip


@pytest.mark.parametrize("pair", PAIRS)
def test_names_of_one_thing(pair: str) -> None:
    recorded, model, expected = PAIRS[pair]
    found = matched(recorded, model)
    assert [found[name].model if name in found else None for name in recorded] == expected
    assert all((name == match.model) == (match.how == "") for name, match in found.items())


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("panda_joint1", ("panda", "joint", "1")),
        ("elbowFlexJoint", ("elbow", "flex", "joint")),
        ("robot0/Joint-07", ("robot", "0", "joint", "7")),
        ("LF_HAA", ("lf", "haa")),
        ("J1", ("j", "1")),
    ],
)
def test_words_of_a_name(name: str, words: tuple[str, ...]) -> None:
    assert tokens(name) == words
