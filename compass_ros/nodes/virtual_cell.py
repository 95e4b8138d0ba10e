"""Node `virtual_cell`: stands where a robot cell and its camera stand.

It takes a shot command, plays it in a simulator of its own whose parameters nobody else knows, and in which physics may
act that no other has, and publishes what a camera over the table and the arm's driver would: images, camera_info, joint
states, targets and the tool's pose. True poses stay inside. The service `~/reveal` tells parameters and physics when a
demonstration ends.

Image stamps are simulated sensor times (the middle of each exposure), exactly one period apart; they start at the
clock's time and go on however long the drawing takes; the arm's encoders are read by the same clock, some times for
each image. The bias of the tracked positions is drawn as what it is in a
real cell: table, walls and obstacle stand shifted against the fiducials.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from compass_ros_interfaces.msg import ShotCommand
from numpy.typing import NDArray
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Trigger

from compass_ros.cells import load
from compass_ros.concealed.stage import Secret, Stage, read_secret
from compass_ros.errors import CompassError, ConfigError
from compass_ros.nodes import images
from compass_ros.nodes.play import PER_IMAGE, action_of, hidden_values, play, resting, table_shift
from compass_ros.nodes.qos import RELIABLE
from compass_ros.nodes.run import run
from compass_ros.nodes.virtual_arm import VirtualArm
from compass_ros.tracking.scene_config import SceneConfig, scene_config
from compass_ros.tracking.tracker import use_one_core
from compass_ros.tracking.virtual_camera import draw, expose, make_camera

CAMERA_FRAME = "virtual_camera_optical_frame"


class VirtualCell(Node):
    """A camera that never stops, and a shot at a time."""

    def __init__(self) -> None:
        super().__init__("virtual_cell")
        self._declare()
        self._cell = load(self.get_parameter("cell").value)
        file, seed = self.get_parameter("hidden_parameters_file").value, self.get_parameter("seed").value
        answer = self.get_parameter("answer_file").value
        secret = read_secret(Path(answer), self._cell) if answer else Secret(hidden_values(self._cell, file, seed))
        self._stage = Stage(self._cell, secret)
        self._scene = self._read_scene()
        self._camera = make_camera(self._scene, seed, table_shift(self._cell, secret.values))
        self._readings = int(self.get_parameter("readings").value)
        self._rest = self._play = resting(self._stage, self._scene, self._readings)
        self._command: ShotCommand | None = None
        self._frame = str(self.get_parameter("frame").value)
        self._drawn: NDArray[np.uint8] | None = None
        self._start_ns = self.get_clock().now().nanoseconds
        self._images_taken = 0
        self._image_of_play = 0

        self._images = self.create_publisher(Image, "image", RELIABLE)
        self._infos = self.create_publisher(CameraInfo, "camera_info", RELIABLE)
        self._arm = VirtualArm(self, self._frame, self._scene.arm, self.get_parameter("encoder_step_m").value)
        self._shots = self.create_publisher(ShotCommand, "~/shot", 10)
        self.create_subscription(ShotCommand, "~/command", self._on_command, 10)
        self.create_service(Trigger, "~/reveal", self._on_reveal)
        rate = self._scene.camera.rate_hz
        self.create_timer(1 / (rate * self.get_parameter("real_time_factor").value), self._on_time)
        self.get_logger().info(f"cell '{self._cell.name}' is ready, {rate} images a second")

    def _declare(self) -> None:
        def describe(text: str, **ranges: object) -> ParameterDescriptor:
            return ParameterDescriptor(description=text, read_only=True, **ranges)

        self.declare_parameter("cell", "air_hockey", describe("name of the cell to stand for, or path of its YAML"))
        hidden = "YAML of true parameters, name: value, the others at their defaults; empty: drawn with `seed`"
        self.declare_parameter("hidden_parameters_file", "", describe(hidden))
        answer = "JSON of true parameters and concealed physics, as `compass demo` seals it; replaces the file above"
        self.declare_parameter("answer_file", "", describe(answer))
        seeds = [IntegerRange(from_value=0, to_value=2**31 - 1, step=1)]
        self.declare_parameter("seed", 0, describe("seed of the hidden parameters and the noise", integer_range=seeds))
        factors = [FloatingPointRange(from_value=0.05, to_value=20.0)]
        faster = "simulated seconds in one second: images come so much faster, their stamps do not change"
        self.declare_parameter("real_time_factor", 1.0, describe(faster, floating_point_range=factors))
        self.declare_parameter("noise", 2.5, describe("standard deviation of the sensor's noise [grey levels]"))
        self.declare_parameter("exposure_s", 0.004, describe("exposure of an image [s]"))
        self.declare_parameter("light", 0.30, describe("share of light that is missing in the darkest corner"))
        self.declare_parameter("frame", "table", describe("frame of the values of a shot and of the tool's pose"))
        often = [IntegerRange(from_value=1, to_value=16, step=1)]
        readings = "how often the arm's encoders are read for each image"
        self.declare_parameter("readings", PER_IMAGE, describe(readings, integer_range=often))
        steps = [FloatingPointRange(from_value=0.0, to_value=0.01)]
        counts = "what the encoders of the tool's axes count in [m]"
        self.declare_parameter("encoder_step_m", 1e-5, describe(counts, floating_point_range=steps))
        self.declare_parameter("arm", True, describe("draw the arm that holds the pusher"))

    def _read_scene(self) -> SceneConfig:
        camera = {name: self.get_parameter(name).value for name in ("noise", "exposure_s")}
        content: dict[str, object] = {"camera": camera, "light": self.get_parameter("light").value}
        if not self.get_parameter("arm").value:
            content["arm"] = None
        return scene_config(content, "parameters of virtual_cell")

    def _on_command(self, command: ShotCommand) -> None:
        try:
            if command.cell not in ("", self._cell.name):
                raise ConfigError(f"shot command: for cell '{command.cell}', this is '{self._cell.name}'")
            if self._command is not None:
                raise ConfigError("shot command: refused, a shot is being played")
            action = action_of(self._cell, command.names, command.values)
        except CompassError as error:
            self.get_logger().error(str(error))
            return
        self._play = play(self._stage, self._scene, action, self._readings)
        self._command, self._image_of_play = command, 0

    def _on_time(self) -> None:
        """Take one image."""
        now_ns = self._start_ns + round(self._images_taken * 1e9 / self._scene.camera.rate_hz)
        head = images.header(now_ns, CAMERA_FRAME)
        poses = self._play.poses(self._image_of_play)
        if self._drawn is None or not self._play.still(self._image_of_play):
            self._drawn = draw(self._camera, poses)
        picture = expose(self._camera, self._drawn, self._images_taken)
        self._images.publish(images.image_message(picture, head))
        self._infos.publish(images.camera_info_message(self._camera.scene.view.camera, head))
        self._arm.publish(self._play.of_arm(self._image_of_play), now_ns)
        self._announce(now_ns)
        self._images_taken += 1
        self._image_of_play += 1

    def _announce(self, now_ns: int) -> None:
        """Say when the motion begins; after the last still image all is put back, and the cell is free again."""
        if self._command is None:
            return
        if self._image_of_play == self._play.begin:
            shot = ShotCommand(header=images.header(now_ns, self._frame), cell=self._cell.name)
            shot.names, shot.values = self._command.names, self._command.values
            self._shots.publish(shot)
        if self._image_of_play >= self._play.length:
            self._command, self._play, self._drawn = None, self._rest, None

    def _on_reveal(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        names = [parameter.name for parameter in self._cell.parameters]
        secret = self._stage.secret
        truth = {
            "cell": self._cell.name,
            "parameters": dict(zip(names, secret.values.tolist(), strict=True)),
            "effects": [
                {"name": i.law.name, "objects": list(i.objects), "size": i.size, "shape": dict(i.shape)}
                for i in secret.ingredients
            ],
        }
        response.success, response.message = True, json.dumps(truth)
        return response


def main() -> None:
    use_one_core()
    run(VirtualCell, "virtual_cell")


if __name__ == "__main__":
    main()
