"""What a calibrated scene says of the drives of a robot, as a parameter file of ros2_control's `pid_controller`.

A position servo of MuJoCo exerts kp (target - q) - kv q'. That is a PID of positions on an effort interface with p = kp
and d = kv, where the target stands still between commands.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import mujoco
import yaml

from compass_ros.targets.plain_mjcf import Command
from compass_ros.targets.said import Said


def write_control(model: mujoco.MjModel, commands: Sequence[Command], out: Path) -> tuple[Said, ...]:
    """Gains of each position servo on a joint; what has no place there is a comment and is said."""
    told = {one.actuator: one for one in commands}
    gains, said, comments = {}, [], []
    for a in range(model.nu):
        name, kp = model.actuator(a).name, float(model.actuator_gainprm[a, 0])
        on_joint = int(model.actuator_trntype[a]) == int(mujoco.mjtTrn.mjTRN_JOINT)
        if not on_joint or kp <= 0 or float(model.actuator_biasprm[a, 1]) != -kp:
            said.append(Said("drive", (name,), "left out", "not a position servo on a joint"))
            continue
        joint = model.joint(int(model.actuator_trnid[a, 0])).name
        gear = float(model.actuator_gear[a, 0])
        gains[joint] = {"p": kp * gear * gear, "i": 0.0, "d": -float(model.actuator_biasprm[a, 2]) * gear * gear}
        if model.actuator_forcelimited[a]:
            gains[joint]["u_clamp_max"] = float(model.actuator_forcerange[a, 1]) * gear
            gains[joint]["u_clamp_min"] = float(model.actuator_forcerange[a, 0]) * gear
        said.append(Said("servo", (joint,), "alike", "a PID at the controller's rate"))
        of = told.get(name)
        if of is not None and of.delay_s:
            comments.append(f"# {joint}: acts {of.delay_s:.4f} s late; ros2_control has no word for that")
            said.append(Said("delay of the command", (joint,), "left out", f"{of.delay_s:.4f} s"))
        if of is not None and (of.scale != 1.0 or of.offset):
            comments.append(f"# {joint}: give it {of.scale:.6g} * target + {of.offset:.6g}")
            said.append(Said("factor and offset of the command", (joint,), "left out", "for the trajectory to have"))
    dofs = {
        "dof_names": list(gains),
        "command_interface": "effort",
        "reference_and_state_interfaces": ["position", "velocity"],
        "gains": gains,
    }
    text = yaml.safe_dump({"pid_controller": {"ros__parameters": dofs}}, sort_keys=False)
    out.write_text("\n".join([*comments, text]), encoding="utf-8")
    return tuple(said)
