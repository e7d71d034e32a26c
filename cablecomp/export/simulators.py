"""A joint as MJCF (MuJoCo) and as URDF."""

from __future__ import annotations

from math import sqrt
from xml.sax.saxutils import escape, quoteattr

from cablecomp.config import JointConfig
from cablecomp.control.options import MotorModel
from cablecomp.export.equivalent import Equivalent, loads


def mujoco_model(config: JointConfig, found: Equivalent, motor: MotorModel) -> str:
    """MJCF: motor and joint as hinges, between them a fixed tendon q_out − ratio q_in with stiffness, damping
    and dry friction.

    A tendon's spring and friction act side by side: load over deflection is a loop of the drive's slope and
    width. Inertias are those of the control file; the actuator is the drive's own position loop.
    """
    damping = 2.0 * motor.structural_damping * sqrt(found.stiffness_Nm_per_rad * motor.output_inertia_kgm2)
    kp, kv = motor.stiffness_Nm_per_rad, motor.damping_Nms_per_rad
    return f"""<mujoco model={quoteattr(config.name)}>
{_remarks(config, found)}  <compiler angle="radian"/>
  <option timestep="0.0005" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody>
    <body name="motor">
      <joint name="motor" type="hinge" axis="0 0 1" armature="{motor.inertia_kgm2:.6g}"
             damping="{motor.viscous_Nms_per_rad:.6g}"/>
      <geom type="cylinder" size="{config.drive.stage[0].input_radius_m:.6g} 0.01" mass="1e-6"
            contype="0" conaffinity="0"/>
    </body>
    <body name="joint" pos="0.2 0 0">
      <joint name="joint" type="hinge" axis="0 0 1" armature="{motor.output_inertia_kgm2:.6g}"
             damping="{motor.output_viscous_Nms_per_rad:.6g}"{_range(config)}/>
      <geom type="cylinder" size="{config.drive.stage[-1].output_radius_m:.6g} 0.01" mass="1e-6"
            contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <tendon>
    <fixed name="cable" stiffness="{found.stiffness_Nm_per_rad:.8g}" damping="{damping:.6g}" springlength="0"
           frictionloss="{found.friction_Nm:.8g}" solreffriction="0.001 1" solimpfriction="0.9999 0.9999 0.001">
      <joint joint="joint" coef="1"/>
      <joint joint="motor" coef="{-found.ratio:.10g}"/>
    </fixed>
  </tendon>
  <actuator>
    <general name="drive" joint="motor" biastype="affine" gainprm="{kp:.6g}" biasprm="0 {-kp:.6g} {-kv:.6g}"/>
  </actuator>
</mujoco>
"""


def urdf_model(config: JointConfig, found: Equivalent, motor: MotorModel) -> str:
    """URDF: the joint alone, with dry friction and damping; motor angle as a joint that it follows (`mimic`).

    The format knows neither stiffness nor play nor friction between two joints: the drive is rigid here, and
    its friction is the joint's.
    """
    low, high = config.limits.joint_position_min_rad, config.limits.joint_position_max_rad
    bounds = "" if low is None or high is None else f'lower="{low:.6g}" upper="{high:.6g}" '
    kind = "revolute" if bounds else "continuous"
    speed = config.limits.motor_velocity_max_rad_s
    limit = f'{bounds}effort="{found.most_Nm:.6g}" velocity="{100.0 if speed is None else speed * found.ratio:.6g}"'
    inertia = motor.output_inertia_kgm2
    remarks = _remarks(
        config, found, "no stiffness and no backlash: the format has neither (see the numbers above)"
    )
    return f"""<?xml version="1.0"?>
<robot name={quoteattr(config.name)}>
{remarks}  <link name="base"/>
  <link name="output">
    <inertial>
      <mass value="0.001"/>
      <inertia ixx="{inertia:.6g}" ixy="0" ixz="0" iyy="{inertia:.6g}" iyz="0" izz="{inertia:.6g}"/>
    </inertial>
  </link>
  <link name="motor"/>
  <joint name="joint" type="{kind}">
    <parent link="base"/>
    <child link="output"/>
    <axis xyz="0 0 1"/>
    <limit {limit}/>
    <dynamics damping="{motor.output_viscous_Nms_per_rad:.6g}" friction="{found.friction_Nm:.8g}"/>
  </joint>
  <joint name="motor" type="continuous">
    <parent link="base"/>
    <child link="motor"/>
    <axis xyz="0 0 1"/>
    <mimic joint="joint" multiplier="{1.0 / found.ratio:.10g}"/>
  </joint>
</robot>
"""


def _range(config: JointConfig) -> str:
    low, high = config.limits.joint_position_min_rad, config.limits.joint_position_max_rad
    return "" if low is None or high is None else f' range="{low:.6g} {high:.6g}"'


def _remarks(config: JointConfig, found: Equivalent, *more: str) -> str:
    """Comment with the numbers in words and what is left out."""
    lines = [
        f"stiffness {found.stiffness_Nm_per_rad:.5g} Nm/rad, friction of the path {found.friction_Nm:.4g} Nm, "
        f"equivalent backlash {1e3 * found.backlash_rad:.4g} mrad, from {loads(config, found.most_Nm)}",
        "left out:",
        *(f"  {line}" for line in (*more, *found.lost(config))),
    ]
    return "".join(f"  <!-- {escape(line).replace('--', '- -')} -->\n" for line in lines)
