"""What a cell sends under full load: `camera` (three discs at 90 images a second) or `arm` (poses at 1 kHz).

    python scripts/soak_sources.py camera|arm

Every message is stamped with the moment at which it is sent. The number of messages is printed when it is told to end.
"""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable

import numpy as np
import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import CameraInfo, Image

from compass_ros.nodes.images import camera_info_message, header, image_message, stamp_message
from compass_ros.tracking.scene_config import SceneConfig
from compass_ros.tracking.virtual_camera import make_camera, render

IMAGES_HZ, POSES_HZ = 90, 1000
PICTURES = 90
"""Drawn beforehand and shown over and over: drawing is not what is measured."""
Send = Callable[[int], None]


def camera(node: Node) -> Send:
    """Sends image number n; three discs go round."""
    scene = make_camera(SceneConfig())
    angle = 2 * np.pi * np.arange(PICTURES) / PICTURES
    places = {"puck1": (-0.2, 0.0), "puck2": (0.25, 0.05), "pusher": (0.0, -0.12)}
    ready = []
    for number, turn in enumerate(angle):
        shift = 0.04 * np.array([np.cos(turn), np.sin(turn)])
        poses = {name: np.tile([*(np.array(xy) + shift), 0.0], (5, 1)) for name, xy in places.items()}
        ready.append(image_message(render(scene, poses, number), header(0, "camera")))
    images = node.create_publisher(Image, "image", qos_profile_sensor_data)
    infos = node.create_publisher(CameraInfo, "camera_info", qos_profile_sensor_data)
    info = camera_info_message(scene.scene.view.camera, header(0, "camera"))

    def send(number: int) -> None:
        message = ready[number % PICTURES]
        message.header.stamp = info.header.stamp = stamp_message(time.time_ns())
        infos.publish(info)
        images.publish(message)

    return send


def arm(node: Node) -> Send:
    """Sends pose number n, whose x is n: a hole in the numbers is a lost message."""
    poses = node.create_publisher(PoseWithCovarianceStamped, "arm/pose", QoSProfile(depth=1000))
    message = PoseWithCovarianceStamped(header=header(0, "table"))

    def send(number: int) -> None:
        message.header.stamp = stamp_message(time.time_ns())
        message.pose.pose.position.x = float(number)
        poses.publish(message)

    return send


def main(role: str) -> None:
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    told = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: told.set())
    send, rate = {"camera": (camera, IMAGES_HZ), "arm": (arm, POSES_HZ)}[role]
    publish = send(Node(f"soak_{role}"))
    begun, sent = time.monotonic(), 0
    while not told.is_set():
        publish(sent)
        sent += 1
        behind = time.monotonic() - begun - sent / rate
        if behind < 0:
            time.sleep(-behind)
        elif behind > 1:  # the machine was away: go on at the rate, do not catch up
            begun += behind
    print(sent, flush=True)
    rclpy.try_shutdown()


if __name__ == "__main__":
    main(sys.argv[1])
