"""Follows topics by name or pattern: finds types and QoS, receives them raw, notices when a type or the QoS changes."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import NamedTuple

import yaml
from rclpy.callback_groups import CallbackGroup
from rclpy.duration import Duration
from rclpy.exceptions import NoTypeSupportImportedException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rclpy.type_support import check_for_type_support

from compass_ros.episodes.connection import Connection
from compass_ros.episodes.definitions import Definition, installed_definition
from compass_ros.episodes.notes import EPISODE_TOPIC, NOTES_TOPIC, SHOT_TOPIC
from compass_ros.episodes.pulse import Pulse
from compass_ros.errors import BagError
from compass_ros.nodes.topic_patterns import TopicPattern

HELD_NS = 10**9
"""A message that came so much later than now [ns] came before the clock was set back, and is not waited for."""
Received = Callable[[str, bytes, int, int, int | None], None]
"""Takes topic, bytes, when it came and was published [ns], the publisher's count (None with several publishers)."""


class Arrived(NamedTuple):
    """A message out of its queue."""

    topic: str
    data: bytes
    received_ns: int
    published_ns: int
    sequence: int | None


class _Fetched(CallbackGroup):
    """Of subscriptions that the executor leaves alone: for each message it would look at the whole node again, which
    takes 0.4 ms."""

    def can_execute(self, entity: object) -> bool:
        return False

    def beginning_execution(self, entity: object) -> bool:
        return False

    def ending_execution(self, entity: object) -> None:
        pass


_WRITTEN = frozenset({EPISODE_TOPIC, SHOT_TOPIC, NOTES_TOPIC})
"""What the recorder writes itself: of an episode that is played back, a pattern does not take it into another one."""


def _left_alone(_: bytes) -> None:
    """No message comes this way."""


class TopicWatch:
    """Raw subscriptions to topics that may come, go, and come back with another type; emptied by `fetch`."""

    def __init__(
        self,
        node: Node,
        topics: Mapping[str, str],
        patterns: Sequence[TopicPattern],
        depth: int,
        connected: Callable[[Connection], None],
        received: Received,
    ) -> None:
        """`topics`: where messages are received -> the name under which they are handed on. `patterns`: of others, from
        their first publisher on.

        `connected` is called when a topic is found and when its type changes, before its first message, and when a
        latched topic gets another publisher."""
        self._node = node
        self._topics = dict(topics)
        self._patterns = patterns
        self._depth = depth
        self._connected = connected
        self._received = received
        self._subscriptions: dict[str, Subscription] = {}
        self._profiles: dict[str, QoSProfile] = {}
        """Of the subscriptions."""
        self._connections: dict[str, Connection] = {}
        self._publishers: dict[str, int] = {}
        self._heard: dict[str, set[tuple[int, ...]]] = {}
        """The publishers that each subscription has had so far."""
        self._problems: dict[str, str] = {}
        self._pulse = Pulse()
        self._ahead: dict[str, Arrived] = {}
        """By topic, what came while its queue was emptied."""
        self._group = _Fetched()

    def update(self) -> None:
        """Look at the graph: subscribe to what is new, again to what has changed."""
        self._find()
        for topic in self._topics:
            publishers = self._node.get_publishers_info_by_topic(topic)
            self._publishers[topic] = len(publishers)
            if not publishers:
                self._pulse.forget(topic)
                self._problems[topic] = f"{topic} has no publisher"
                continue
            self._problems.pop(topic, None)
            try:
                self._follow(topic, publishers)
            except BagError as error:
                self._problems[topic] = f"{topic} is not recorded: {error}"

    def problems(self) -> tuple[str, ...]:
        """What is not received, or not any more, one sentence each."""
        silent = self._pulse.stopped(time.monotonic_ns()).items()
        return (*self._problems.values(), *(f"{topic} has stopped: no message for {s:.1f} s" for topic, s in silent))

    def _follow(self, topic: str, publishers: Sequence[TopicEndpointInfo]) -> None:
        """Keep the type that is received as long as anybody publishes it; else take another (the first by name)."""
        types = {publisher.topic_type for publisher in publishers}
        now = self._connections.get(topic) if topic in self._subscriptions else None
        if len(types) > 1:
            self._problems[topic] = f"{topic} is published with {len(types)} types: {', '.join(sorted(types))}"
        if now is not None and now.definition.type in types:
            offered = [publisher for publisher in publishers if publisher.topic_type == now.definition.type]
            if self._unsuited(topic, offered):
                self._unsubscribe(topic)
                self._subscribe(topic, now.definition, offered)
            elif self._latches(topic, publishers) > now.latched:
                self._connect(topic, now.definition, publishers)
            return
        if topic in self._subscriptions:  # one participant holds one type of a topic, until the executor lets go of it
            self._unsubscribe(topic)
            return  # received again from the next look on
        kind = min(types)
        offered = [publisher for publisher in publishers if publisher.topic_type == kind]
        self._subscribe(topic, _definition(kind, offered), offered)

    def _find(self) -> None:
        """Topics that fit a pattern and have come; a pattern that none fits is a problem."""
        if not self._patterns:
            return
        there = [topic for topic, _ in self._node.get_topic_names_and_types()]
        for pattern in self._patterns:
            fitting = [topic for topic in there if pattern.matches(topic) and topic not in _WRITTEN]
            for topic in fitting:
                if topic not in self._topics and self._published_by_others(topic):
                    self._topics[topic] = pattern.recorded(topic)
            if self._topics.keys().isdisjoint(fitting):
                self._problems[pattern.text] = f"no topic matches {pattern.text}"
            else:
                self._problems.pop(pattern.text, None)

    def _published_by_others(self, topic: str) -> bool:
        own = (self._node.get_name(), self._node.get_namespace())
        publishers = self._node.get_publishers_info_by_topic(topic)
        return any((publisher.node_name, publisher.node_namespace) != own for publisher in publishers)

    def _subscribe(self, topic: str, definition: Definition, offered: Sequence[TopicEndpointInfo]) -> None:
        message_class = _class(definition.type)
        profile = self._profiles[topic] = matching_qos(offered, self._depth)
        self._heard[topic] = set()
        self._connect(topic, definition, offered)
        self._subscriptions[topic] = self._node.create_subscription(
            message_class, topic, _left_alone, profile, callback_group=self._group, raw=True
        )

    def _connect(self, topic: str, definition: Definition, publishers: Sequence[TopicEndpointInfo]) -> None:
        latched = self._latches(topic, publishers)
        self._connections[topic] = Connection(self._topics[topic], definition, qos_yaml(publishers), latched)
        self._connected(self._connections[topic])

    def _latches(self, topic: str, publishers: Sequence[TopicEndpointInfo]) -> int:
        """How many publishers a latched topic has had, with these; 0 for one that is not latched."""
        heard = self._heard[topic]
        heard.update(_identities(publishers))
        return len(heard) if self._profiles[topic].durability == DurabilityPolicy.TRANSIENT_LOCAL else 0

    def _unsuited(self, topic: str, publishers: Sequence[TopicEndpointInfo]) -> bool:
        """Whether a subscription misses what the publishers that are there now say.

        A reliable one gets nothing from a publisher that is not, a latched one nothing from one that is not. Only a
        latched one gets what was said before it came; what it has heard already would come again.
        """
        now, wanted = self._profiles[topic], matching_qos(publishers, self._depth)
        deaf = now.reliability == ReliabilityPolicy.RELIABLE != wanted.reliability
        latched = [one.durability == DurabilityPolicy.TRANSIENT_LOCAL for one in (now, wanted)]
        late = latched == [False, True] and self._heard[topic].isdisjoint(_identities(publishers))
        return deaf or latched == [True, False] or late

    def _unsubscribe(self, topic: str) -> None:
        self.fetch()  # what waits is of the old type
        self._ahead.pop(topic, None)
        self._node.destroy_subscription(self._subscriptions.pop(topic))

    def fetch(self) -> int:
        """Hand on all that has come so far, in the order in which it came; until when that is [ns].

        Of the system's clock. What comes while the queues are emptied is left for the next time.
        """
        until_ns = time.time_ns()
        come: list[Arrived] = []
        for topic in self._subscriptions:
            while (one := self._next(topic, until_ns)) is not None:
                if 0 < one.received_ns - until_ns < HELD_NS:
                    self._ahead[topic] = one
                    break
                come.append(one)
        come.sort(key=lambda one: one.received_ns)
        for one in come:
            self._pulse.beat(one.topic, time.monotonic_ns())
            single = self._publishers[one.topic] == 1
            self._received(
                self._topics[one.topic], one.data, one.received_ns, one.published_ns, one.sequence if single else None
            )
        return until_ns

    def _next(self, topic: str, now_ns: int) -> Arrived | None:
        """The next message that waits on a topic; None: no other one does."""
        if topic in self._ahead:
            return self._ahead.pop(topic)
        subscription = self._subscriptions[topic]
        with subscription.handle:
            found = subscription.handle.take_message(subscription.msg_type, subscription.raw)
        if found is None:
            return None
        data, info = found
        received_ns, published_ns = info["received_timestamp"] or now_ns, info["source_timestamp"] or 0
        return Arrived(topic, data, received_ns, published_ns, info["publication_sequence_number"])


def matching_qos(publishers: Sequence[TopicEndpointInfo], depth: int) -> QoSProfile:
    """The strongest profile that receives from all publishers."""
    offered = [publisher.qos_profile for publisher in publishers]
    reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offered)
    latched = all(qos.durability == DurabilityPolicy.TRANSIENT_LOCAL for qos in offered)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def _identities(publishers: Sequence[TopicEndpointInfo]) -> set[tuple[int, ...]]:
    return {tuple(publisher.endpoint_gid) for publisher in publishers}


def qos_yaml(publishers: Sequence[TopicEndpointInfo]) -> str:
    """QoS profiles as rosbag2 (version 9) writes them."""
    return str(yaml.safe_dump([_profile(publisher.qos_profile) for publisher in publishers], sort_keys=False))


def _profile(qos: QoSProfile) -> Mapping[str, object]:
    def time(duration: Duration) -> Mapping[str, int]:
        return dict(zip(("sec", "nsec"), divmod(duration.nanoseconds, 10**9), strict=True))

    return {
        "history": qos.history.name.lower(),
        "depth": qos.depth,
        "reliability": qos.reliability.name.lower(),
        "durability": qos.durability.name.lower(),
        "deadline": time(qos.deadline),
        "lifespan": time(qos.lifespan),
        "liveliness": qos.liveliness.name.lower(),
        "liveliness_lease_duration": time(qos.liveliness_lease_duration),
        "avoid_ros_namespace_conventions": qos.avoid_ros_namespace_conventions,
    }


def _definition(kind: str, publishers: Sequence[TopicEndpointInfo]) -> Definition:
    """The installed definition. Raises BagError where there is none, or the publishers were built with another."""
    definition = installed_definition(kind)
    for publisher in publishers:
        digest = str(publisher.topic_type_hash)
        if digest.startswith("RIHS01_") and digest != definition.digest:
            raise BagError(f"its publisher {publisher.node_name} was built with another definition of {kind}")
    return definition


def _class(kind: str) -> type:
    """The message class of `package/msg/Name`. Raises BagError where its package is not installed, or not whole."""
    package, _, name = kind.split("/")
    try:
        found: type = getattr(import_module(f"{package}.msg"), name)
        check_for_type_support(found)
    except (ImportError, AttributeError, NoTypeSupportImportedException) as error:
        raise BagError(f"the package {package} of {kind} is not installed with its Python part: {error}") from error
    return found
