"""Driven scenes of which is known what recordings of them can tell."""

from __future__ import annotations

from pathlib import Path

from compass_ros.cells import Cell, load

LINK = """<mujoco model="link"><compiler angle="radian"/>
<option timestep="0.002" integrator="implicitfast" gravity="{gravity}"/><worldbody>
<body name="link"><joint name="axis" axis="0 1 0" damping="0.3" armature="0.02" {range}/>
<inertial pos="{pos}" mass="1" diaginertia="0.001 0.001 0.001"/></body>
</worldbody><actuator>{drive}</actuator></mujoco>"""
ARM = """<mujoco model="arm"><compiler angle="radian"/><option timestep="0.002" integrator="implicitfast"/><worldbody>
<body name="upper"><joint name="shoulder" axis="0 1 0" damping="0.5" armature="0.02" range="-1.5 2"/>
<inertial pos="0.15 0 0" mass="1.2" diaginertia="0.01 0.01 0.01"/>
<body name="lower" pos="0.3 0 0"><joint name="elbow" axis="0 1 0" damping="0.3" armature="0.01" range="-2 2"/>
<inertial pos="0.12 0 0.03" mass="0.7" diaginertia="0.004 0.004 0.004"/></body></body>
</worldbody><actuator><position name="shoulder" joint="shoulder" kp="80" kv="4" forcerange="-{most} {most}"/>
<position name="elbow" joint="elbow" kp="40" kv="2" forcerange="-9 9"/></actuator></mujoco>"""
POSITION = '<position name="axis" joint="axis" kp="30" kv="2" forcerange="-8 8"/>'
VELOCITY = '<velocity name="axis" joint="axis" kv="5" forcerange="-8 8"/>'
MOTOR = '<motor name="axis" joint="axis" gear="2" ctrlrange="-1.5 1.5"/>'
STRONG = '<motor name="axis" joint="axis"/>'
QUANTITY = {POSITION: "joint_position", VELOCITY: "joint_velocity", MOTOR: "joint_effort", STRONG: "joint_effort"}

MASS = "{name: link@dyna@mass, field: body_mass, of: link, default: 1, bounds: [0.1, 9], half_width: 0.3, unit: kg}"
CENTRE = (
    "{{name: link@dyna@centre, field: 'body_ipos[{}]', of: link, default: {}, bounds: [-1, 1], half_width: 0.05, "
    "unit: m}}"
)
ARMATURE = (
    "{name: axis@dyna@armature, field: dof_armature, of: axis, default: 0.02, bounds: [0, 1], half_width: 0.02, "
    "unit: kg m^2}"
)
DAMPING = (
    "{name: axis@dyna@damping, field: dof_damping, of: axis, default: 0.3, bounds: [0, 9], half_width: 0.1, "
    "unit: N m s/rad}"
)
GAIN = (
    "{name: axis@actuation@gain, field: servo_gain, of: axis, default: 30, bounds: [1, 99], half_width: 9, "
    "unit: N m/rad}"
)
DELAY = (
    "{name: axis@actuation@delay, field: input_delay_s, of: told, default: 0.01, bounds: [0, 0.2], half_width: 0.01, "
    "unit: s}"
)
GRAVITY = (
    "{name: world@dyna@gravity, field: 'opt.gravity[2]', default: -9.81, bounds: [-12, -8], half_width: 1, unit: m/s^2}"
)
ZERO = (
    "{name: axis@sensing@zero, field: joint_zero, of: axis, default: 0, bounds: [-1, 1], half_width: 0.05, unit: rad}"
)
OFFSET = (
    "{name: axis@actuation@offset, field: input_offset, of: told, default: 0, bounds: [-1, 1], half_width: 0.05, "
    "unit: rad}"
)


def link(
    folder: Path,
    parameters: list[str],
    drive: str = POSITION,
    gravity: str = "0 0 -9.81",
    pos: str = "0.2 0 0",
    limits: str = 'range="-2 2"',
) -> Cell:
    """A link on a driven joint, measured by an encoder."""
    (folder / "link.xml").write_text(LINK.format(gravity=gravity, pos=pos, range=limits, drive=drive))
    return _cell(folder, "link", ["axis"], QUANTITY[drive], parameters)


def arm(folder: Path, most: float = 20.0) -> Cell:
    """Two links under gravity, servos; the centres and masses of both, and what their drives do."""
    (folder / "arm.xml").write_text(ARM.format(most=most))
    parameters = []
    for joint, body, kp, centre in (("shoulder", "upper", 80, 0.15), ("elbow", "lower", 40, 0.12)):
        parameters += [
            GAIN.replace("axis", joint).replace("30", str(kp)).replace("99", "400"),
            DAMPING.replace("axis", joint).replace("0.3", "0.4"),
            CENTRE.format(0, centre).replace("link", body),
            ZERO.replace("axis", joint),
        ]
    return _cell(folder, "arm", ["shoulder", "elbow"], "joint_position", parameters)


def _cell(folder: Path, name: str, joints: list[str], quantity: str, parameters: list[str]) -> Cell:
    of = ", ".join(joints)
    lines = [
        f"name: {name}",
        "dynamics: mjcf",
        f"model: {name}.xml",
        "windows: {length_s: 2.0}",
        f"inputs: [{{name: told, topic: /joint_commands, quantity: {quantity}, of: [{of}]}}]",
        f"signals: [{{name: joints, topic: /joint_states, quantity: joint_position, of: [{of}], noise: 0.0005}}]",
        "parameters:",
        *(f"  - {p}" for p in parameters),
    ]
    (folder / f"{name}.yaml").write_text("\n".join(lines) + "\n")
    return load(str(folder / f"{name}.yaml"))
