"""How often-used topics are delivered."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSProfile

RELIABLE = QoSProfile(depth=10)
"""Poses, images, joint states: every subscriber hears a reliable publisher; those that ask for reliability, as RViz's
displays do by default, do not hear a best-effort one (REP 2003)."""

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""The last message, for whoever comes later too."""
