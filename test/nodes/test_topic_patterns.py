"""Patterns of topics, as a recorder reads them."""

from __future__ import annotations

import pytest

from compass_ros.nodes.topic_patterns import example, is_pattern, topic_pattern

pytestmark = pytest.mark.ros

CASES: list[tuple[str, str, list[str], list[str]]] = [
    # pattern, namespace, topics that match (as in the bag where another namespace is left out), topics that do not
    ("/arm/*", "/", ["/arm/x", "/arm/left/x"], ["/arm", "/arm2/x", "/arm/_x", "/my/arm/x"]),
    ("/*", "/cell", ["/x", "/arm/left/x"], ["/_x", "/a/_action/feedback"]),
    ("/a/_action/*", "/", ["/a/_action/feedback"], ["/b/_action/feedback"]),
    ("/tool?/pose", "/", ["/tool1/pose"], ["/tool/pose", "/tool12/pose"]),
    ("/cam[0-2]", "/", ["/cam0", "/cam2"], ["/cam3", "/cam", "/cam22"]),
    ("*/joint_states", "/", ["/left/joint_states", "/a/b/joint_states"], ["/joint_states"]),
    ("arm/*", "/", ["/arm/x"], ["/cell/arm/x"]),
]


@pytest.mark.parametrize(("given", "namespace", "matching", "others"), CASES, ids=[case[0] for case in CASES])
def test_what_a_pattern_matches(given: str, namespace: str, matching: list[str], others: list[str]) -> None:
    assert is_pattern(given)
    pattern = topic_pattern(given, namespace)
    assert [topic for topic in (*matching, *others) if pattern.matches(topic)] == matching
    assert [pattern.recorded(topic) for topic in matching] == matching


@pytest.mark.parametrize("namespace", ["/cell1", "/a/b", "/x1/y/z", "/arm", "/cell_"])
def test_a_relative_pattern_is_in_the_namespace_and_its_bag_is_not(namespace: str) -> None:
    pattern = topic_pattern("arm/*", namespace)
    assert pattern.matches(f"{namespace}/arm/x")
    assert not pattern.matches("/arm/x")
    assert pattern.recorded(f"{namespace}/arm/x") == "/arm/x"


@pytest.mark.parametrize(
    ("given", "name"),
    [("/a/*", "/a/x"), ("/a?b", "/axb"), ("/c[0-9]", "/cx"), ("*", "x"), ("/a[b", "/a[b"), ("/a b*", "/a bx")],
)
def test_the_other_letters_of_a_pattern_are_checked_as_those_of_a_name(given: str, name: str) -> None:
    assert example(given) == name
