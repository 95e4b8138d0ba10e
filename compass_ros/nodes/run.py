"""How a node lives and ends."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from threadpoolctl import threadpool_limits

from compass_ros.errors import CompassError
from compass_ros.nodes.alarms import Alarms
from compass_ros.nodes.managed import LOOK_S, ManagedNode
from compass_ros.nodes.requests import one_line
from compass_ros.nodes.surroundings import Surroundings
from compass_ros.places import data_home

ROS_ERRORS = (
    rclpy_implementation.RCLError,
    rclpy_implementation.RCLInvalidROSArgsError,
    rclpy_implementation.UnknownROSArgsError,
)
"""What ROS makes of arguments, parameter files and folders that it cannot use."""
NOTICE_S = 0.2
"""[s] How soon an idle node notices that it is told to end."""


@contextmanager
def connected(name: str) -> Iterator[None]:
    """ROS from here to the end of the block. Signals are Python's own: SIGTERM raises KeyboardInterrupt too.

    A node that cannot start, or that cannot go on for a reason that was foreseen, says why in one line, with status 1:
    a CompassError, a parameter or a name that ROS refuses, a log that cannot be written.
    """
    if not any(os.environ.get(place) for place in ("ROS_LOG_DIR", "ROS_HOME", "HOME")):  # systemd, containers
        os.environ["ROS_LOG_DIR"] = str(data_home() / "log")
    try:
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    except ROS_ERRORS as error:
        hint = "; ROS_LOG_DIR names a folder for logs that can be written" if "logging" in str(error) else ""
        sys.exit(f"{name}: {one_line(str(error).split(', at ')[0])}{hint}")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    except (CompassError, ParameterException, NameValidationException) as error:
        sys.exit(f"{name}: {one_line(str(error))}")
    finally:
        rclpy.try_shutdown()


def _watch(node: Node) -> None:
    """A plain node says in its log what is wrong around it."""
    around, alarms = Surroundings(node), Alarms(node.get_logger())
    steady = Clock(clock_type=ClockType.STEADY_TIME)
    node.create_timer(LOOK_S, lambda: alarms.take(around.problems()), clock=steady)


def run(make: Callable[[], Node], name: str, threads: int = 1) -> None:
    """Spin a node until it is told to end. A node that cannot start says why in one line, with exit status 1.

    A managed node starts by itself where its parameter says so, and ends as by the transition `shutdown`.

    Signals end the loop between two callbacks, before the context is closed: no callback finds its publishers gone.
    An exception that a signal raises inside of rclpy could surface as anything; so a signal only leaves a note.
    """
    threadpool_limits(1, "blas")  # the nodes of a cell share its cores: threads that wait for each other take them
    told = threading.Event()
    with connected(name):
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: told.set())
        executor = MultiThreadedExecutor(threads) if threads > 1 else SingleThreadedExecutor()
        try:
            node = make()
            executor.add_node(node)
            if isinstance(node, ManagedNode):
                node.start()
            else:
                _watch(node)
            while not told.is_set():
                executor.spin_once(timeout_sec=NOTICE_S)
            if isinstance(node, ManagedNode):
                node.end()
        finally:
            executor.shutdown()
