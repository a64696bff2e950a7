# SPDX-License-Identifier: BSD-3-Clause
"""Faces of the dual proxy: its robot side and its haptic side."""

from __future__ import annotations

from copy import deepcopy
from operator import attrgetter
from typing import Any

from dual_proxy import _core
from dual_proxy.systems._face import (
    LINK_STATUS_FIELDS,
    Context,
    Face,
    flag,
    link_status,
    matrix,
    pose,
    pose_message,
)


class RobotSideProxy(Face):
    """Turns the device's poses into motion errors and reference forces, eq. (4).

    @system
    name: RobotSideProxy
    input_ports:
    - haptic_message      # PoseMessage (optional: without it the robot waits)
    - robot_pose          # RigidTransform X_BE
    - force_selection     # 9, row-major 3x3 (optional, zero)
    - moment_selection    # 9, row-major 3x3 (optional, zero)
    - sensed_wrench       # 6, [force; moment], N, N m, at E (optional: without
                          # it there is no bumpless hand-over)
    - sensor_ready        # 1, > 0.5 if the force sensor can be relied on
                          # (optional: it can); otherwise the robot holds its
                          # place
    output_ports:
    - motion_error        # 3, m
    - rotation_error      # 3, rad
    - reference_force     # 3, N
    - reference_moment    # 3, N m
    - proxy_pose          # RigidTransform, the limited robot proxy
    - link_status         # 7, see LINK_STATUS_FIELDS
    - proxy_velocity      # 6, [linear; angular], m/s, rad/s
    - proxy_acceleration  # 6, [linear; angular], m/s^2, rad/s^2
    @endsystem

    Everything in the base frame B. Steps every `params.period`, with
    feedthrough.

    Parameters
    ----------
    params : RobotSideProxyParams.
    """

    def __init__(self, params: _core.RobotSideProxyParams | None = None) -> None:
        super().__init__(feedthrough=True)
        self._proxy = _core.RobotSideProxy(
            deepcopy(params or _core.RobotSideProxyParams())
        )
        self._native_arguments = {"params": self._proxy.params}
        self._message = self._declare_object_input(
            "haptic_message", _core.PoseMessage()
        )
        self._pose = self._declare_pose_input("robot_pose")
        self._force_selection = self.DeclareVectorInputPort("force_selection", 9)
        self._moment_selection = self.DeclareVectorInputPort("moment_selection", 9)
        self._sensed_wrench = self.DeclareVectorInputPort("sensed_wrench", 6)
        self._sensor_ready = self.DeclareVectorInputPort("sensor_ready", 1)
        self._declare_memory(self._proxy.make_state(), self._proxy.params.period)
        for name in (
            "motion_error",
            "rotation_error",
            "reference_force",
            "reference_moment",
        ):
            self._declare_vector_output(name, 3, attrgetter(f"output.{name}"))
        self._declare_pose_output("proxy_pose", lambda state: state.output.proxy_pose)
        self._declare_vector_output(
            "link_status",
            len(LINK_STATUS_FIELDS),
            lambda state: link_status(state.link),
        )
        for name in ("proxy_velocity", "proxy_acceleration"):
            self._declare_vector_output(name, 6, attrgetter(f"output.{name}"))

    def _step(self, context: Context, state: Any) -> None:
        sensed = None
        if self._sensed_wrench.HasValue(context):
            sensed = self._sensed_wrench.Eval(context)
        self._proxy.update(
            context.get_time(),
            pose_message(self._message, context),
            *pose(self._pose, context),
            matrix(self._force_selection, context),
            matrix(self._moment_selection, context),
            sensed,
            state,
            flag(self._sensor_ready, context, True),
        )


class HapticSideProxy(Face):
    """Turns the robot's poses and selections into the force on the hand, eq. (5).

    @system
    name: HapticSideProxy
    input_ports:
    - robot_message       # PoseMessage (optional: without it there is no force)
    - device_pose         # RigidTransform X_DH, from the device's home
    output_ports:
    - reference_force     # 3, N, in D: F_h, on the hand
    - reference_moment    # 3, N m, in D
    - proxy_pose          # RigidTransform, the haptic proxy, in D
    - force_selection     # 9, row-major 3x3, in D
    - link_status         # 7, see LINK_STATUS_FIELDS
    @endsystem

    Steps every `params.period`, with feedthrough.

    Parameters
    ----------
    params : HapticSideProxyParams.
    """

    def __init__(self, params: _core.HapticSideProxyParams | None = None) -> None:
        super().__init__(feedthrough=True)
        self._proxy = _core.HapticSideProxy(
            deepcopy(params or _core.HapticSideProxyParams())
        )
        self._native_arguments = {"params": self._proxy.params}
        self._message = self._declare_object_input("robot_message", _core.PoseMessage())
        self._pose = self._declare_pose_input("device_pose")
        self._declare_memory(self._proxy.make_state(), self._proxy.params.period)
        for name in ("reference_force", "reference_moment"):
            self._declare_vector_output(name, 3, attrgetter(f"output.{name}"))
        self._declare_pose_output("proxy_pose", lambda state: state.output.proxy_pose)
        self._declare_vector_output(
            "force_selection", 9, lambda state: state.output.force_selection
        )
        self._declare_vector_output(
            "link_status",
            len(LINK_STATUS_FIELDS),
            lambda state: link_status(state.link),
        )

    def _step(self, context: Context, state: Any) -> None:
        self._proxy.update(
            context.get_time(),
            pose_message(self._message, context),
            *pose(self._pose, context),
            state,
        )


def _link_counters(link: Any) -> list[int]:
    refused = link.dropped + link.bad_inputs
    return [refused, link.bad_inputs, link.gaps, link.spikes, link.losses]
