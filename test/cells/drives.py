"""Small scenes with one drive each: every kind of actuator of MuJoCo on every kind of transmission."""

from __future__ import annotations

_SCENE = """
<mujoco model="drive">
  <compiler autolimits="true"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <site name="anchor" pos="0.3 0 1.2"/>
    {fixed}
    <body name="link" pos="0 0 1">
      {joint}
      <geom name="link" type="box" pos="0.02 0 -0.1" size="0.02 0.03 0.1" mass="0.4"/>
      <site name="grip" pos="0 0 -0.2"/>
      <body name="tip" pos="0 0 -0.2">
        <joint name="wrist" axis="0 1 0" damping="0.01"/>
        <geom name="tip" type="capsule" fromto="0 0 0 0.02 0 -0.1" size="0.01" mass="0.1"/>
        <site name="end" pos="0 0 -0.1"/>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="cable" stiffness="3" damping="0.1"><site site="anchor"/><site site="end"/></spatial>
    {tendon}
  </tendon>
  <actuator>{actuator}</actuator>
</mujoco>
"""
_HINGE = '<joint name="swing" axis="0 1 0" damping="0.02" armature="0.002"/>'
_FIXED = '<fixed name="both"><joint joint="swing" coef="1"/><joint joint="wrist" coef="-0.5"/></fixed>'


def scene(actuator: str, joint: str = _HINGE, tendon: str = "", fixed: str = "") -> str:
    """A link on a joint `swing` with a smaller one on the joint `wrist`; the actuator has to be called `drive`."""
    return _SCENE.format(actuator=actuator, joint=joint, tendon=tendon, fixed=fixed)


_BALL, _FREE = '<joint name="swing" type="ball" damping="0.02"/>', '<freejoint name="swing"/>'
_SLIDE = '<joint name="swing" type="slide" axis="1 0 0" damping="0.5"/>'
DRIVES = {
    "motor": scene('<motor name="drive" joint="swing" gear="2" ctrlrange="-1 1" forcerange="-3 3"/>'),
    "position": scene('<position name="drive" joint="swing" kp="20" kv="2"/>'),
    "position, damping ratio": scene('<position name="drive" joint="swing" kp="20" dampratio="0.7" timeconst="0.05"/>'),
    "velocity": scene('<velocity name="drive" joint="swing" kv="3"/>', _SLIDE),
    "integrated velocity": scene('<intvelocity name="drive" joint="swing" kp="30" kv="1" actrange="-1 1"/>'),
    "damper": scene('<damper name="drive" joint="swing" kv="2" ctrlrange="0 2"/>'),
    "cylinder": scene('<cylinder name="drive" joint="swing" timeconst="0.1" area="0.5" bias="0.1 -2 -0.3"/>', _SLIDE),
    "muscle": scene('<muscle name="drive" tendon="cable" lengthrange="0.3 0.9" force="30"/>'),
    "muscle, scaled": scene('<muscle name="drive" joint="swing" lengthrange="-1.5 1.5" scale="50"/>'),
    "adhesion": scene(
        '<adhesion name="drive" body="tip" ctrlrange="0 1" gain="4"/>',
        fixed='<geom name="wall" type="plane" size="1 1 1" pos="0.03 0 0" zaxis="-1 0 0"/>',
    ),
    "gripper": scene(
        '<general name="drive" joint="swing" ctrlrange="0 255" gainprm="0.3137255" biastype="affine"'
        ' biasprm="0.02 -100 -10" forcerange="-5 5"/>'
    ),
    "affine gain": scene(
        '<general name="drive" joint="swing" gaintype="affine" gainprm="0.5 0.2 -0.1" dyntype="filterexact"'
        ' dynprm="0.03"/>'
    ),
    "DC motor": scene('<dcmotor name="drive" joint="swing" motorconst="0.5" resistance="2"/>'),
    "DC motor, whole": scene(
        '<dcmotor name="drive" joint="swing" motorconst="0.5" resistance="2" inductance="0.02" cogging="0.01 6 0.3"/>'
    ),
    "fixed tendon": scene('<position name="drive" tendon="both" kp="15" kv="1"/>', tendon=_FIXED),
    "spatial tendon": scene('<motor name="drive" tendon="cable" gear="-3"/>'),
    "site": scene('<general name="drive" site="grip" gear="0 0 0 0 1.5 0"/>'),
    "site against another": scene('<position name="drive" site="end" refsite="anchor" gear="1 0 0.5 0 0 0" kp="10"/>'),
    "slider-crank": scene('<motor name="drive" cranksite="end" slidersite="anchor" cranklength="0.6" gear="2"/>'),
    "ball joint": scene('<motor name="drive" joint="swing" gear="0.3 1 0"/>', _BALL),
    "joint in parent": scene('<motor name="drive" jointinparent="swing" gear="0 1 0.2"/>', _BALL),
    "free joint": scene('<motor name="drive" joint="swing" gear="0 0 5 0 0.1 0"/>', _FREE),
    "delayed": scene('<position name="drive" joint="swing" kp="20" kv="2" delay="0.04" nsample="30"/>'),
}
"""name -> MJCF"""
