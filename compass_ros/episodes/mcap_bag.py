"""MCAP files of any recorder as topics and messages."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from mcap.records import Channel, Message, Schema

from compass_ros.episodes import mcap_stream
from compass_ros.episodes.raw import CutOffError, RawMessage, RawTopic, one_line, type_name
from compass_ros.errors import BagError


def messages(path: Path) -> Iterator[RawTopic | RawMessage]:
    """Topics and messages in the order of writing. Raises BagError without the file's name, or OSError."""
    try:
        if not mcap_stream.begins(path):
            raise BagError("expected MCAP, found a file that does not begin as one")
        if not mcap_stream.is_whole(path):
            raise CutOffError("truncated, the file has no end")
        yield from _of_records(path)
    except mcap_stream.BROKEN as error:
        raise BagError(f"damaged: {one_line(error)}") from error


def _of_records(path: Path) -> Iterator[RawTopic | RawMessage]:
    schemas: dict[int, Schema] = {}
    topics: dict[int, RawTopic] = {}
    for record in mcap_stream.records(path):
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel) and record.id not in topics:
            same = sum(topic.name == record.topic for topic in topics.values())
            topics[record.id] = _topic(record, schemas.get(record.schema_id), str(same + 1) if same else "")
            yield topics[record.id]
        elif isinstance(record, Message):
            if record.channel_id not in topics:
                raise BagError(f"damaged: a message on channel {record.channel_id}, which was never declared")
            yield RawMessage(topics[record.channel_id], record.log_time, record.data)


def _topic(channel: Channel, schema: Schema | None, number: str) -> RawTopic:
    """ROS 2 messages are `cdr`; `ros1` is what `mcap convert` makes of a ROS 1 bag, with the names of ROS 1.

    `number`: among the channels of one topic, from the second on: a publisher each.
    """
    ros1 = channel.message_encoding == "ros1"
    name = type_name(schema.name) if schema is not None else "unknown"
    if schema is None or channel.message_encoding not in ("cdr", "ros1"):
        name = f"{name} ({channel.message_encoding or 'in no encoding'})"
    digest = channel.metadata.get("md5sum" if ros1 else "topic_type_hash", "")
    return RawTopic(
        channel.topic,
        name,
        "" if digest == "*" else digest,
        ros1,
        qos=channel.metadata.get("offered_qos_profiles", ""),
        definition=schema.data.decode(errors="replace") if schema is not None else "",
        encoding=schema.encoding if schema is not None else "",
        publisher=channel.metadata.get("callerid", number),
    )
