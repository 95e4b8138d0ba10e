"""How a node lives and ends."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable

import rclpy
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from threadpoolctl import threadpool_limits

from compass_ros.errors import CompassError
from compass_ros.nodes.managed import ManagedNode

NOTICE_S = 0.2
"""[s] How soon an idle node notices that it is told to end."""


def run(make: Callable[[], Node], name: str, threads: int = 1) -> None:
    """Spin a node until it is told to end. A node that cannot start says why in one line, with exit status 1.

    A managed node starts by itself where its parameter says so, and ends as by the transition `shutdown`.

    Signals end the loop between two callbacks, before the context is closed: no callback finds its publishers gone.
    An exception that a signal raises inside of rclpy could surface as anything; so a signal only leaves a note.
    """
    threadpool_limits(1, "blas")  # the nodes of a cell share its cores: threads that wait for each other take them
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    told = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: told.set())
    executor = MultiThreadedExecutor(threads) if threads > 1 else SingleThreadedExecutor()
    try:
        node = make()
        executor.add_node(node)
        if isinstance(node, ManagedNode):
            node.start()
        while not told.is_set():
            executor.spin_once(timeout_sec=NOTICE_S)
        if isinstance(node, ManagedNode):
            node.end()
    except CompassError as error:
        sys.exit(f"{name}: {error}")
    finally:
        executor.shutdown()
        rclpy.try_shutdown()
