"""How a node with a single thread lives and ends."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from compass_ros.errors import CompassError


def run(make: Callable[[], Node], name: str) -> None:
    """Spin a node until it is told to end. A node that cannot start says why in one line, with exit status 1.

    Signals end the loop between two callbacks or inside of one, before the context is closed: a callback never finds
    its publishers gone.
    """
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        rclpy.spin(make())
    except CompassError as error:
        sys.exit(f"{name}: {error}")
    except KeyboardInterrupt:
        return
    finally:
        rclpy.try_shutdown()
