# SPDX-License-Identifier: BSD-3-Clause
"""The faces under test: their table of ports, what makes and what feeds them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import DiagramBuilder, LeafSystem, PortDataType

from dual_proxy import _core, systems
from dual_proxy.panda import NUM_JOINTS, PandaModel

HERE = Path(__file__).parent

PARAMS = yaml.safe_load((HERE / "params.yaml").read_text())
Q_START = np.array(PARAMS["q_start"])
P_SE = np.array(PARAMS["p_SE"])
START = np.array(PARAMS["map"]["p_cw"])
R_DOWN = np.array(PARAMS["map"]["R_cw"])
ALONG_Z = np.diag([0.0, 0.0, 1.0])

# What makes the faces.


@cache
def panda():
    return PandaModel()


def robot_proxy_params():
    params = _core.RobotSideProxyParams()
    params.map = _core.WorkspaceMapParams(**PARAMS["map"])
    return params


def robot_side_params(angular=False):
    params = _core.RobotSideParams(proxy=robot_proxy_params())
    angular_filter = params.perception.angular_filter
    angular_filter.enabled = angular
    angular_filter.filter.period = PARAMS["filter"]["period"]
    return params


def channel_params():
    return _core.CommunicationChannelParams(**PARAMS["channel"])


def filter_params():
    return _core.ForceSpaceParticleFilterParams(**PARAMS["filter"])


def history_params():
    return _core.ContactHistoryParams(**PARAMS["history"])


def sensor_params():
    return _core.ForceTorqueSensorParams(**PARAMS["sensor"])


def device_params():
    return _core.SimulatedHapticDeviceParams(**PARAMS["device"])


def operator_path():
    return _core.OperatorPath(_core.OperatorPathParams(**PARAMS["path"]))


# What stands at the input ports, as functions of time.


def pose_message(t, selection=ALONG_Z):
    """From a side that sends at 50 Hz without delay."""
    sequence = math.floor(t * 50 + 1e-9)
    return _core.PoseMessage(
        sequence=sequence,
        send_time=sequence / 50,
        pose=_core.Pose(p=np.array([0.01 * math.sin(3 * t), 0.0, -0.01 * t])),
        force_selection=selection,
    )


def robot_message(t):
    message = pose_message(t)
    message.pose = _core.Pose(
        p=START + np.array([0.0, 0.0, 0.01 * math.sin(5 * t)]), R=R_DOWN
    )
    return message


def robot_pose(t):
    return RigidTransform(
        RotationMatrix(R_DOWN), START + np.array([0.0, 0.0, -0.01 * t])
    )


def device_pose(t):
    return RigidTransform(np.array([0.0, 0.001 * math.sin(t), -0.01 * t]))


def robot_state(t):
    q = Q_START + 0.05 * math.sin(2 * t)
    return np.concatenate([q, np.full(NUM_JOINTS, 0.1 * math.cos(2 * t))])


def wave(*amplitudes):
    return lambda t: np.array(amplitudes) * math.sin(7 * t + 0.3)


def constant(*values):
    return lambda t: np.array(values)


def selection(t):
    return ALONG_Z.ravel() * (t > 0.1)


def normals(t):
    """Down, as the first column; zero before the contact."""
    result = np.zeros((3, 3))
    result[2, 0] = -float(t > 0.1)
    return result.ravel()


def planned(t):
    """A planner takes y over, and hands it back."""
    return np.diag([0.0, 1.0, 0.0]).ravel() * (0.03 < t < 0.12)


def no_selection(t):
    return np.zeros(9)


def wrench(t):
    return np.array([0.1, 0.2, -5 - math.sin(t), 0.0, 0.01, 0.0])


def ready(t):
    return np.array([0.0 if 0.05 < t < 0.07 else 1.0])


def tare(t):
    return np.array([1.0 if t > 0.04 else 0.0])


def wiping_pose(t):
    """To and fro, so that every place is visited again."""
    return RigidTransform(
        RotationMatrix(R_DOWN),
        START + np.array([0.03 * math.sin(60 * t), 0.0, -0.01 * t]),
    )


def changing_selection(t):
    """Of a table; at times of a wall along x, too."""
    return np.diag([0.0, float(math.sin(20 * t) > 0.5), 1.0]).ravel()


def changing_direction(t):
    angle = 0.1 * math.sin(11 * t)
    return np.array([math.sin(angle), 0.0, -math.cos(angle)])


def prior(t):
    return np.array([[0.0], [0.0], [-1.0]])


# The table.

TYPES = {
    "PoseMessage": _core.PoseMessage,
    "RigidTransform": RigidTransform,
    "Matrix3X": np.ndarray,
}


@dataclass(frozen=True)
class Port:
    """A port in ports.yaml, where its fields are explained."""

    name: str
    size: int | None = None
    type: str | None = None
    public: bool = False
    optional: bool = False
    feedthrough: bool = False
    acting: bool = False

    @property
    def holds(self) -> Any:
        """The size of the vector, or the type of the abstract value."""
        return self.size if self.type is None else TYPES[self.type]


@dataclass
class Entry:
    """A face in ports.yaml, with what makes it and what feeds its inputs."""

    cls: str
    inputs: list[Port]
    outputs: list[Port]
    simulated: bool
    angular: bool
    make: Callable[[], LeafSystem]
    sources: dict[str, Callable[[float], Any]]

    @property
    def acting(self) -> list[str]:
        return [port.name for port in self.outputs if port.acting]


# name -> (what makes the face, what feeds its inputs)
_MADE_AND_FED = {
    "RobotSideProxy": (
        lambda: systems.RobotSideProxy(robot_proxy_params()),
        {
            "haptic_message": pose_message,
            "robot_pose": robot_pose,
            "force_selection": selection,
            "moment_selection": no_selection,
            "sensed_wrench": wrench,
            "sensor_ready": ready,
        },
    ),
    "HapticSideProxy": (
        lambda: systems.HapticSideProxy(),
        {"robot_message": robot_message, "device_pose": device_pose},
    ),
    "CommunicationChannel": (
        lambda: systems.CommunicationChannel(channel_params(), PARAMS["channel_seed"]),
        {"message": pose_message},
    ),
    "ForceSpaceParticleFilter": (
        lambda: systems.ForceSpaceParticleFilter(
            filter_params(), PARAMS["filter_seed"]
        ),
        {
            "sensed_force": constant(0.3, 0.0, -8.0),
            "velocity": wave(0.001, 0.001, 0.0),
            "motion_force": constant(0.0, 1.0, -9.0),
            "contact_force": constant(0.0, 0.0, -3.0),
            "prior": prior,
        },
    ),
    "ContactHistory": (
        lambda: systems.ContactHistory(history_params()),
        {
            "robot_pose": wiping_pose,
            "force_selection": changing_selection,
            "force_direction": changing_direction,
        },
    ),
    "OperationalSpaceController": (
        lambda: systems.OperationalSpaceController(None, panda()),
        {
            "robot_state": robot_state,
            "motion_error": wave(0.001, 0.002, -0.001),
            "rotation_error": wave(0.01, 0.0, 0.02),
            "reference_force": constant(0.0, 0.0, -4.0),
            "reference_moment": wave(0.1, 0.0, 0.0),
            "force_selection": selection,
            "moment_selection": no_selection,
            "sensed_wrench": wrench,
            "proxy_velocity": wave(0.01, 0.0, 0.01, 0.0, 0.0, 0.1),
            "proxy_acceleration": wave(0.1, 0.0, 0.1, 0.0, 0.0, 0.1),
            "sensor_ready": ready,
        },
    ),
    "HapticController": (
        lambda: systems.HapticController(),
        {
            "reference_force": wave(1.0, 2.0, 3.0),
            "reference_moment": wave(0.1, 0.1, 0.1),
            "device_velocity": wave(0.1, 0.0, 0.1, 0.0, 0.0, 0.0),
            "force_selection": selection,
            "contact_normals": normals,
            "proxy_displacement": wave(0.001, 0.0, 0.002),
            "fixture_force": wave(0.1, 0.0, 0.2),
            "handle_force": wave(1.0, 2.0, 2.5),
        },
    ),
    "PoseSender": (
        lambda: systems.PoseSender(),
        {
            "pose": robot_pose,
            "force_selection": selection,
            "moment_selection": no_selection,
            "contact_normals": normals,
        },
    ),
    "WindowMean": (
        lambda: systems.WindowMean(PARAMS["window"]),
        {"value": wave(1.0, 2.0, -3.0)},
    ),
    "ArmKinematics": (
        lambda: systems.ArmKinematics(panda()),
        {"robot_state": robot_state},
    ),
    "ForceTorqueSensor": (
        lambda: systems.ForceTorqueSensor(sensor_params(), P_SE, PARAMS["sensor_seed"]),
        {
            "reaction": wrench,
            "robot_pose": robot_pose,
            "tare": tare,
            # Slow enough for a tare.
            "robot_velocity": wave(0.002, 0.0, 0.001, 0.0, 0.01, 0.0),
        },
    ),
    "SimulatedHapticDevice": (
        lambda: systems.SimulatedHapticDevice(operator_path(), device_params()),
        {"device_wrench": wave(0.0, 1.0, 2.0, 0.0, 0.0, 0.0)},
    ),
    "RobotSide": (
        lambda: systems.RobotSide(robot_side_params(), panda(), Q_START),
        {
            "haptic_message": pose_message,
            "robot_state": robot_state,
            "sensed_wrench": wrench,
            "force_selection": selection,
            "moment_selection": no_selection,
            "contact_normals": normals,
            "sensor_ready": ready,
            "planner_selection": planned,
            "planner_position": constant(*START),
            "planner_velocity": wave(0.01, 0.0, 0.0),
            "planner_force": constant(0.0, 0.0, -5.0),
        },
    ),
    "RobotSideWithSensor": (
        lambda: systems.RobotSide(
            robot_side_params(),
            panda(),
            Q_START,
            sensor_params(),
            P_SE,
            PARAMS["sensor_seed"],
        ),
        {
            "haptic_message": pose_message,
            "robot_state": robot_state,
            "reaction": wrench,
            "force_selection": selection,
            "moment_selection": no_selection,
            "contact_normals": normals,
            "tare": tare,
            "planner_selection": planned,
            "planner_position": constant(*START),
            "planner_velocity": wave(0.01, 0.0, 0.0),
            "planner_force": constant(0.0, 0.0, -5.0),
        },
    ),
    "RobotSideWithAngularFilter": (
        lambda: systems.RobotSide(robot_side_params(angular=True), panda(), Q_START),
        {
            "haptic_message": pose_message,
            "robot_state": robot_state,
            "sensed_wrench": wrench,
            "force_selection": selection,
            "moment_selection": selection,
            "contact_normals": normals,
            "sensor_ready": ready,
            "planner_selection": planned,
            "planner_position": constant(*START),
            "planner_velocity": wave(0.01, 0.0, 0.0),
            "planner_force": constant(0.0, 0.0, -5.0),
        },
    ),
    "HapticSide": (
        lambda: systems.HapticSide(),
        {
            "robot_message": robot_message,
            "device_pose": device_pose,
            "device_velocity": wave(0.1, 0.0, 0.1, 0.0, 0.0, 0.0),
            "handle_force": wave(1.0, 2.0, 2.5),
            "clutch": tare,
            "home": tare,
            "force_scale": constant(0.5),
            "gripper_opening": constant(0.01),
        },
    ),
    "HapticSideWithDevice": (
        lambda: systems.HapticSide(None, device_params(), operator_path()),
        {"robot_message": robot_message},
    ),
}


def _load():
    table = yaml.safe_load((HERE / "ports.yaml").read_text())
    assert list(table) == list(_MADE_AND_FED)
    return {
        name: Entry(
            cls=row.get("class", name),
            inputs=[Port(**port) for port in row["inputs"]],
            outputs=[Port(**port) for port in row["outputs"]],
            simulated=row.get("simulated", False),
            angular=row.get("angular", False),
            make=make,
            sources=sources,
        )
        for (name, row), (make, sources) in zip(
            table.items(), _MADE_AND_FED.values(), strict=True
        )
    }


FACES = _load()


class Source(LeafSystem):
    """A port whose value is a function of time."""

    def __init__(self, function):
        super().__init__()
        start = function(0.0)
        if isinstance(start, np.ndarray) and start.ndim == 1:
            self.DeclareVectorOutputPort(
                "value",
                start.size,
                lambda context, out: out.SetFromVector(function(context.get_time())),
            )
        else:
            self.DeclareAbstractOutputPort(
                "value",
                lambda: systems.make_value(start),
                lambda context, out: systems.set_value(
                    out, function(context.get_time())
                ),
            )


def added(builder, face):
    """The face in a diagram: in C++ where that is in use."""
    return face._join(builder, f"face {len(builder.GetSystems())}")


def alone(entry):
    """The face in a diagram of its own."""
    builder = DiagramBuilder()
    face = added(builder, entry.make())
    return builder.Build(), face


def build(entry, sources=None, leave_out=()):
    """A diagram of the face and its sources, with all outputs exported."""
    sources = {**entry.sources, **(sources or {})}
    for port in leave_out:
        del sources[port]
    return build_around(entry.make(), sources)


def build_around(face, sources):
    builder = DiagramBuilder()
    face = added(builder, face)
    for port, function in sources.items():
        source = builder.AddSystem(Source(function))
        builder.Connect(source.get_output_port(), face.GetInputPort(port))
    for i in range(face.num_output_ports()):
        port = face.get_output_port(i)
        builder.ExportOutput(port, port.get_name())
    return builder.Build()


# Values.


def evaluate(port, context):
    if port.get_data_type() == PortDataType.kVectorValued:
        return port.Eval(context)
    return systems.get_value(port.EvalAbstract(context))


def flat(value):
    """Every number of a port's value, matrices row by row.

    Of an array (3, k) the first column, zero if there is none.
    """
    if isinstance(value, RigidTransform):
        return np.concatenate([value.translation(), value.rotation().matrix().ravel()])
    if isinstance(value, _core.Message):  # Before the first step.
        value = _core.PoseMessage.from_message(value)
    if isinstance(value, _core.PoseMessage):
        return np.concatenate(
            [
                [value.sequence, value.send_time],
                value.pose.p,
                value.pose.R.ravel(),
                value.force_selection.ravel(),
                value.moment_selection.ravel(),
            ]
        )
    array = np.asarray(value, dtype=np.float64)
    if array.ndim == 2:
        return array[:, 0] if array.size else np.zeros(3)
    return array.ravel()


def spoiled(value, bad):
    """A value of the same type that is none, sent at 0.05 s if it is sent."""
    if isinstance(value, RigidTransform):
        return RigidTransform(np.full(3, bad))
    if isinstance(value, _core.PoseMessage):
        return _core.PoseMessage(
            sequence=99, send_time=0.05, pose=_core.Pose(p=np.full(3, bad))
        )
    return np.full_like(value, bad)
