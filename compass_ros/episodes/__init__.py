"""MCAP bag <-> Episode: crash-safe writing, recovery, reading of anybody's bags, import of tables.

The bag is the only hand-over from a live cell to a calibration. One bag holds one episode. `tables.import_tables` and
`recording.Recorder` are imported from where they are: a reader needs neither.
"""

from compass_ros.episodes.episode_writer import write_episode
from compass_ros.episodes.many import Reading, find_each, read_each
from compass_ros.episodes.reader import (
    BagContent,
    TopicSummary,
    find_bags,
    list_topics,
    read_bag,
    read_episode,
    read_episodes,
)
from compass_ros.episodes.recovery import Recovery, recover, reindex, unfinished
from compass_ros.episodes.sources import Source, default_sources, default_topic

__all__ = [
    "BagContent",
    "Reading",
    "Recovery",
    "Source",
    "TopicSummary",
    "default_sources",
    "default_topic",
    "find_bags",
    "find_each",
    "list_topics",
    "read_bag",
    "read_each",
    "read_episode",
    "read_episodes",
    "recover",
    "reindex",
    "unfinished",
    "write_episode",
]
