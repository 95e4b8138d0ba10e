"""Which picture each law has, and what one sees in it."""

from __future__ import annotations

from compass_ros.simulation.sites import Site
from scripts.law_pictures.axes import Picture
from scripts.law_pictures.formulas import by_direction, field, friction_along, torque
from scripts.law_pictures.motions import BOX, SERVO, apart, ball, heavier, pendulum, puck, servo, wave
from scripts.law_pictures.signals import camera, command, heading, jitter, moving, over_a_turn, signal, steps, swing

THERE_AND_BACK = [((-0.4, 0.0), (0.5, 0.0)), ((-0.12, 0.1), (-0.5, 0.0))]
AT_WALL = [((0.0, -0.1), (0.8, 0.3))]
FAN = [0.6, 0.05, 0.02, 0.12, 0.5]
DROP = (0, 0, 0.6)
LOW = (0, 0, 0.16)
PICTURES: dict[str, Picture] = {
    "table_tilt": Picture(
        puck([0.0, 0.02], THERE_AND_BACK), "paths bend to one side of the table, whichever way the puck goes"
    ),
    "viscous_drag": Picture(torque([0.16]), "resists in proportion to speed; nothing at rest"),
    "quadratic_drag": Picture(torque([0.05]), "hardly there when slow, dominates when fast"),
    "crosswind": Picture(
        puck([0.0, 0.2, 1.5], THERE_AND_BACK),
        "a steady push to one side, which a fast puck feels otherwise than a slow one",
    ),
    "fan_field": Picture(field(FAN), "pushes away from a point, most at one distance"),
    "swirl": Picture(field(FAN), "pushes around a point"),
    "point_attraction": Picture(field([0.6, 0.05, 0.02, 0.1]), "pulls towards a point, as a magnet under the table"),
    "friction_patch": Picture(friction_along([0.05, 0.1, 0.0, 0.1]), "slower in one place only"),
    "friction_gradient": Picture(friction_along([0.08, 0.0]), "slower on one side of the table than on the other"),
    "anisotropic_friction": Picture(by_direction([0.02, 0.0]), "slows more along one direction than across it"),
    "stribeck_friction": Picture(torque([0.15, 0.5]), "extra friction when slow: sticks, then jerks"),
    "coulomb_friction": Picture(torque([0.1]), "the same size at every speed, against the motion; small motions stall"),
    "magnus": Picture(
        puck([0.5], THERE_AND_BACK),
        "paths curve to the same hand of the motion, so that there and back bend to opposite sides",
    ),
    "pulsating_lift": Picture(
        puck([0.04, 0.0, 2.0], [((-0.4, 0.0), (0.5, 0.0))], show="speed"),
        "the friction beats with one frequency, whatever the speed",
    ),
    "spring": Picture(torque([0.5, 0.3, 0.0, 0.0], "angle"), "pulls back to one angle"),
    "asymmetric_friction": Picture(torque([0.1]), "more friction forwards than backwards"),
    "load_dependent_friction": Picture(
        servo([0.6]), "friction grows with what the drive pushes: heavy moves lag, light ones do not"
    ),
    "cogging": Picture(torque([0.05, 0.03, 6.0], "angle"), "a torque that repeats as the motor turns"),
    "joint_elasticity": Picture(
        servo([0.15, 0.02, 0.8, 0.0, 0.0, 0.0], rotor=True), "rings after each step, and sags under load"
    ),
    "backlash": Picture(
        servo([0.12, 0.02, 0.8], rotor=True, told=wave, scene=SERVO.replace("<option", '<option gravity="0 0 0"')),
        "free play at each reversal: late first, then too far",
    ),
    "gravity_tilt": Picture(
        ball([0.15, 0.0], push=(1.0, 0, 2.0), axes_shown=(0, 2), seconds=0.7), "everything falls slightly to one side"
    ),
    "payload": Picture(
        pendulum([0.2, 0.0, 0.0, -0.03]),
        "swings at another pace, sags more where it is held: a weight that the scene lacks",
    ),
    "wind": Picture(
        ball([-3.0, 0.0, 0.0, 0.08], push=(2.0, 0, 2.5), axes_shown=(0, 2), seconds=0.8),
        "flight is carried along with the air",
    ),
    "buoyancy": Picture(
        ball([0.15], push=(1.5, 0, 2.0), axes_shown=(0, 2), seconds=0.7), "falls less fast than it should, at any speed"
    ),
    "pair_attraction": Picture(apart([0.5, 0.1]), "two bodies pull each other, most at one distance"),
    "tether": Picture(apart([3.0, 0.25]), "nothing until the cable is taut, then it pulls"),
    "parameter": Picture(
        heavier, "a number of the scene is wrong (here a length): the period is off and the phase runs away"
    ),
    "rate_dependent_restitution": Picture(
        ball([0.6], ("ball", "floor"), begin=DROP), "fast impacts lose more than slow ones"
    ),
    "tangential_impulse": Picture(
        puck([0.3], AT_WALL, 1.0, ("wall", "puck")),
        "loses speed along the wall: comes back more straight than it should",
    ),
    "local_wall": Picture(
        puck([0.02, 0.0], [((0.0, 0.0), (0.8, 0.0))], 0.9, ("wall",), show="x"),
        "bounces too early or too late at one wall alone",
    ),
    "off_centre_mass": Picture(
        puck([0.004, 0.006, 0.02], AT_WALL, 1.0), "wobbles after a bounce and leaves at another angle"
    ),
    "friction_cone": Picture(
        ball([1.0], (), (1.0, 0.35), (0, 1), 0.8, (0, 0, 0.05), BOX),
        "slides bend: friction is not the same along the axes and across them",
    ),
    "adhesion": Picture(ball([25.0], ("ball", "floor"), begin=LOW), "bounces less high, gentle ones above all"),
    "rolling_resistance": Picture(
        ball([0.002], ("ball", "floor"), (0.6, 0, 0, 0, 12.0, 0), (None, 0), 1.6, (0, 0, 0.0499)),
        "a rolling ball comes to rest",
    ),
    "actuation_delay": Picture(command([0.15], steps), "all of the command, later"),
    "first_order_lag": Picture(command([0.15], steps), "corners of the command are rounded"),
    "velocity_saturation": Picture(command([1.6, 8.0], swing, "speed"), "fast commands are cut off, slow ones are not"),
    "dead_band": Picture(
        command([0.25], swing, "speed"),
        "too slow by a fixed amount; small commands do nothing; a servo stops short of its target and stays there",
    ),
    "heading_bias": Picture(heading, "every push is turned by the same angle"),
    "stroke_jitter": Picture(jitter, "the same command comes out differently each time"),
    "torque_saturation": Picture(
        servo([1 / 1.0, 0.0], ("servo",)), "hard moves take longer and overshoot, easy ones are right"
    ),
    "rate_limit": Picture(
        command([0.35, 0.1], steps), "steps become ramps, with round ends; of fast sines less is left, all at once"
    ),
    "gain_error": Picture(command([-0.2], swing), "every command is too small or too large by the same share"),
    "hysteresis": Picture(command([0.5], swing), "flat tops, and lost motion at each reversal"),
    "camera_latency": Picture(moving([0.03]), "wrong by speed times a delay; right at rest"),
    "camera_scale": Picture(camera([-0.08, 0.0, 0.0]), "every distance is too short or too long by the same share"),
    "camera_rotation": Picture(camera([0.08, 0.0, 0.0]), "the picture is turned about the camera's axis"),
    "lens_distortion": Picture(camera([-0.8, 0.0, 0.0, 0.0]), "straight lines bend towards the edge"),
    "rolling_shutter": Picture(moving([0.0, 0.2, 0.0, 0.0]), "an error that depends on speed and on the row"),
    "tracking_lag": Picture(moving([0.03, 0.7]), "a delay that also smooths: curves are cut"),
    "clock_drift": Picture(signal([0.06]), "right at first, later and later off"),
    "latency": Picture(signal([0.15]), "all of the signal, later"),
    "scale": Picture(signal([0.15]), "every value is too large or too small by the same share"),
    "offset": Picture(signal([0.2]), "off by the same amount everywhere"),
    "rotation": Picture(
        camera([0.0, 0.0, 0.1], (Site("sensor", ("s",), columns=(0, 1, 2)),), True),
        "what is along one axis leaks into the others",
    ),
    "eccentricity": Picture(over_a_turn, "an error that repeats once a turn"),
}
