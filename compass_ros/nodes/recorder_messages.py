"""What the recorder says: an episode's status, and its health."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from builtin_interfaces.msg import Duration, Time
from compass_ros_interfaces.msg import EpisodeInfo
from diagnostic_msgs.msg import DiagnosticStatus

from compass_ros.episodes.notes import STATES, EpisodeHeader
from compass_ros.nodes.diagnostic import diagnostic


def episode_message(status: EpisodeHeader, problems: Sequence[str] = ()) -> EpisodeInfo:
    """`problems`: what is wrong now, one sentence each; joins what is said of the episode."""
    message = EpisodeInfo(
        state=STATES.index(status.state),
        episode=status.episode,
        cell=status.cell,
        cell_hash=status.cell_hash,
        bag=status.bag,
        messages=status.messages,
        topics=list(status.topics),
        message="; ".join(filter(None, [status.message, *(p for p in problems if p not in status.message)])),
    )
    message.header.stamp = Time(sec=status.start_ns // 10**9, nanosec=status.start_ns % 10**9)
    message.duration = Duration(sec=status.duration_ns // 10**9, nanosec=status.duration_ns % 10**9)
    return message


def health_message(
    name: str, status: EpisodeHeader, values: Mapping[str, object], problems: Sequence[str]
) -> DiagnosticStatus:
    """`values`: numbers for people; `problems`: one sentence each."""
    said = [*problems, *filter(None, [status.message])]
    level = DiagnosticStatus.ERROR if status.state == "failed" else DiagnosticStatus.WARN
    level = level if said else DiagnosticStatus.OK
    return diagnostic(f"{name}: episodes", level, "; ".join(said) or status.state, values)
