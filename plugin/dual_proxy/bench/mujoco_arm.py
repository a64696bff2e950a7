# SPDX-License-Identifier: BSD-3-Clause
"""The Panda in MuJoCo with a controller in NumPy, as people write it: what
`dual-proxy bench peer` holds this package against.

An operational-space controller follows a given motion of the robot's proxy: along
the table with position control, down on it with a virtual spring's force and a PI
loop. The table's normal is known to it, and its force sensor is
perfect. There is no teleoperation: no operator, device, link, filter or log of
them.
"""

from __future__ import annotations

import importlib.resources
import re
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dual_proxy._core import _PANDA
from dual_proxy.panda import R_BE_DOWN, TOOL_MOMENTS, p_SE_S
from dual_proxy.scenario import Scenario
from dual_proxy.scene_params import TIP_RADIUS, TOOL_COM_S, TOOL_MASS

__all__ = ["MujocoArm", "Path", "PinocchioTerms", "arm_urdf"]

Array = NDArray[np.float64]

_TOOL = """
  <link name="tool">
    <inertial>
      <origin xyz="{com}"/>
      <mass value="{mass}"/>
      <inertia ixx="{m[0]}" iyy="{m[1]}" izz="{m[2]}" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <collision>
      <origin xyz="{tip}"/>
      <geometry><sphere radius="{radius}"/></geometry>
    </collision>
  </link>
  <joint name="ft_sensor" type="fixed">
    <parent link="panda_link7"/>
    <child link="tool"/>
    <origin xyz="{flange}"/>
  </joint>
  <link name="tool_point"/>
  <joint name="to_tool_point" type="fixed">
    <parent link="tool"/>
    <child link="tool_point"/>
    <origin xyz="{tip}"/>
  </joint>
</robot>"""

# Of the force loop beside the spring's force: share of the error that is fed back,
# of its integral 1/s, N s/m, and the low-pass on the sensed force, s.
_FORCE_GAIN = 1.0
_INTEGRAL_GAIN = 5.5
_FORCE_DAMPING = 20.0
_FILTER_TIME = 1.0 / (2.0 * np.pi * 100.0)
# MuJoCo's stiffness and damping (solref) of a contact: with this arm's apparent mass
# and MuJoCo's impedance of 0.95 some 30 kN/m. The default is seven times as stiff
# and damped such that a tool that slides is lifted, and chatters.
_MATCHED_CONTACT = (-400.0, -5.0)
# Nearer than this to the table, m, the tool is pressed on it.
_NEAR = 1e-3


def arm_urdf() -> str:
    """Return this package's arm with its tool, as other readers of URDF take it:
    without what is only seen, in which there are shapes of Drake's own."""

    def triple(values: Any) -> str:
        return " ".join(f"{value:.17g}" for value in values)

    file = importlib.resources.files("dual_proxy").joinpath("robots/panda/panda.urdf")
    text = re.sub(r"<visual>.*?</visual>", "", file.read_text("utf-8"), flags=re.S)
    tool = _TOOL.format(
        com=triple(TOOL_COM_S),
        mass=TOOL_MASS,
        m=TOOL_MOMENTS,
        tip=triple(p_SE_S),
        radius=TIP_RADIUS,
        flange=triple(_PANDA["flange"]),
    )
    return text.replace("</robot>", tool)


class Path(NamedTuple):
    """The motion of the robot's proxy, every control period from time 0."""

    positions: Array
    """(n, 3), m, in B."""
    velocities: Array
    """(n, 3), m/s."""


class PinocchioTerms:
    """The terms of the arm by Pinocchio."""

    def __init__(self) -> None:
        import pinocchio

        self._pin: Any = pinocchio
        self._model = pinocchio.buildModelFromXML(arm_urdf())
        self._data = self._model.createData()
        self._frame = self._model.getFrameId("tool_point")

    def calc(self, q: Array, v: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Return position and orientation of E, Jacobian (6, 7), mass matrix, and
        bias with gravity."""
        pin, model, data = self._pin, self._model, self._data
        mass = pin.crba(model, data, q)
        bias = pin.nonLinearEffects(model, data, q, v)
        pin.computeJointJacobians(model, data, q)
        pose = pin.updateFramePlacement(model, data, self._frame)
        J = pin.getFrameJacobian(
            model, data, self._frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        return pose.translation, pose.rotation, J, mass, bias


class MujocoArm:
    """The arm at a table, simulated and controlled.

    Parameters
    ----------
    scenario : whose table, gains and control period.
    path : of the robot's proxy.
    q_start : (7,), rad.
    pinocchio : whether the controller's terms are Pinocchio's, not MuJoCo's.
    matched : whether contacts are about as stiff as the scenario's, not MuJoCo's
        default.
    torques : (n, 7), N m, in place of the controller: of a run that was the same.

    Attributes
    ----------
    torques, positions, forces, references : what was commanded, (n, 7), N m; of
        each period so far where E was, m, and what robot and table pushed each
        other with down the normal, true and as it should be, N.
    """

    def __init__(
        self,
        scenario: Scenario,
        path: Path,
        q_start: Any,
        pinocchio: bool = False,
        matched: bool = True,
        torques: Array | None = None,
    ) -> None:
        import mujoco

        self._mj: Any = mujoco
        scene = scenario.scene
        spec = mujoco.MjSpec.from_string(arm_urdf())
        spec.option.timestep = scenario.control_period
        height = scene.table_height
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[scene.table_size[0] / 2, scene.table_size[1] / 2, height / 2],
            pos=[*scene.table_center, height / 2],
        )
        for geom in spec.geoms:
            geom.friction[0] = scene.friction
            if matched:
                geom.solref[:] = _MATCHED_CONTACT
        # The reader takes what is welded for one body, the last link.
        link = spec.body("panda_link7")
        link.add_site(name="tool_point", pos=p_SE_S + _PANDA["flange"])
        self._model: Any = spec.compile()
        self._data: Any = mujoco.MjData(self._model)
        self._data.qpos[:] = q_start
        self._site = mujoco.mj_name2id(
            self._model, mujoco.mjtObj.mjOBJ_SITE, "tool_point"
        )
        self._path = path
        self._controller = scenario.controller
        self._spring = scenario.robot_proxy
        self._q_rest = np.asarray(q_start, dtype=np.float64)
        self._pinocchio = PinocchioTerms() if pinocchio else None
        self._period = scenario.control_period
        self._replayed = torques
        # Where the tool point is when it touches, m.
        self._surface = height + TIP_RADIUS
        self._filtered = 0.0
        self._integral = 0.0
        self._step = 0
        self.torques: list[Array] = []
        self.positions: list[Array] = []
        self.forces: list[float] = []
        self.references: list[float] = []

    def advance_to(self, time: float) -> None:
        """Simulate up to `time`, s."""
        mj, model, data = self._mj, self._model, self._data
        for _ in range(self._step, round(time / self._period)):
            if self._replayed is not None:
                data.qfrc_applied[:] = self._replayed[self._step]
                mj.mj_step(model, data)
            else:
                # What is known of a state, then what it takes, then the step.
                mj.mj_step1(model, data)
                data.qfrc_applied[:] = self._control()
                mj.mj_step2(model, data)
            self._step += 1

    def _control(self) -> Array:
        """Return the torques of this period, (7,), N m."""
        q, v = self._data.qpos, self._data.qvel
        if self._pinocchio is None:
            x, R, J, mass, bias = self.calc_terms()
        else:
            x, R, J, mass, bias = self._pinocchio.calc(q, v)
        gains = self._controller
        row = min(self._step, len(self._path.positions) - 1)
        error = self._path.positions[row] - x
        twist = J @ v
        # Half of the axis times the sine of the angle from R to where it should be.
        turn = 0.5 * sum(np.cross(R[:, i], R_BE_DOWN[:, i]) for i in range(3))
        acceleration = np.concatenate(
            [
                gains.position_stiffness * error
                + gains.position_damping * (self._path.velocities[row] - twist[:3]),
                gains.rotation_stiffness * turn - gains.rotation_damping * twist[3:],
            ]
        )
        sensed = self._sense()
        reference = min(-self._spring.stiffness * error[2], self._spring.max_force)
        inverse = np.linalg.inv(mass)
        touching = x[2] < self._surface + _NEAR and reference > 0.0
        if touching:
            acceleration[2] = 0.0
        Lambda = np.linalg.inv(J @ inverse @ J.T)
        wrench = Lambda @ acceleration
        if touching:
            wrench[2] -= self._push(reference, sensed) + _FORCE_DAMPING * twist[2]
        else:
            self._filtered = self._integral = 0.0
        posture = gains.posture_stiffness * (self._q_rest - q)
        posture -= gains.posture_damping * v
        null = np.eye(len(q)) - J.T @ Lambda @ J @ inverse
        torque: Array = J.T @ wrench + null @ (mass @ posture) + bias
        self.torques.append(torque)
        self.positions.append(x.copy())
        self.forces.append(sensed)
        self.references.append(reference)
        return torque

    def _push(self, reference: float, sensed: float) -> float:
        """Return the force down the normal for a reference, N."""
        share = self._period / (self._period + _FILTER_TIME)
        self._filtered += share * (sensed - self._filtered)
        error = reference - self._filtered
        self._integral += _INTEGRAL_GAIN * error * self._period
        return reference + _FORCE_GAIN * error + self._integral

    def calc_terms(self) -> tuple[Array, Array, Array, Array, Array]:
        """Return MuJoCo's terms of the state, as `PinocchioTerms.calc`."""
        mj, model, data = self._mj, self._model, self._data
        J = np.zeros((6, model.nv))
        mj.mj_jacSite(model, data, J[:3], J[3:], self._site)
        mass = np.zeros((model.nv, model.nv))
        mj.mj_fullM(model, data, mass)
        R = data.site_xmat[self._site].reshape(3, 3)
        return data.site_xpos[self._site], R, J, mass, data.qfrc_bias

    def _sense(self) -> float:
        """Return the force down the table's normal, N."""
        force = 0.0
        wrench = np.zeros(6)
        for i in range(self._data.ncon):
            self._mj.mj_contactForce(self._model, self._data, i, wrench)
            force += wrench[0]
        return force
