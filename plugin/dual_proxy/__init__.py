# SPDX-License-Identifier: BSD-3-Clause
"""Haptic teleoperation with local autonomy, for Drake.

The algorithms (the dual proxy, the link, the Force-Space Particle Filter, the
controllers, what is simulated) are compiled classes that need no Drake; their
parameters are `...Params` structs. `dual_proxy.systems` has them as Drake
LeafSystems, `dual_proxy.station` as a whole diagram; both import pydrake, and
only when they are used. `run` runs an experiment.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from dual_proxy._core import (
    CommunicationChannel,
    CommunicationChannelParams,
    ContactScene,
    ContactSceneParams,
    ContactSurface,
    ContactSurfaceParams,
    ForceCommunicationChannel,
    ForceLoop,
    ForceLoopParams,
    ForceMessage,
    ForceSender,
    ForceSpaceParticleFilter,
    ForceSpaceParticleFilterAlgorithm,
    ForceSpaceParticleFilterParams,
    ForceSpaceParticleFilterThresholds,
    ForceTorqueSensor,
    ForceTorqueSensorParams,
    HapticController,
    HapticControllerParams,
    HapticSide,
    HapticSideParams,
    HapticSideProxy,
    HapticSideProxyParams,
    LinkMonitor,
    LinkMonitorParams,
    LinkStatus,
    OperationalSpaceController,
    OperationalSpaceControllerParams,
    OperatorPath,
    OperatorPathParams,
    PointRobot,
    PointRobotParams,
    Pose,
    PoseInterpolatorParams,
    PoseMessage,
    PoseSender,
    PoseSenderParams,
    PositionForceHapticSide,
    PositionForceHapticSideParams,
    RobotSide,
    RobotSideParams,
    RobotSideProxy,
    RobotSideProxyParams,
    SelectionBlend,
    SelectionBlendParams,
    SimulatedHapticDevice,
    SimulatedHapticDeviceParams,
    TimeDomainPassivity,
    TimeDomainPassivityParams,
    TrajectoryLimiter,
    TrajectoryLimiterParams,
    VirtualSpring,
    VirtualSpringParams,
    WindowMean,
    WorkspaceLimits,
    WorkspaceLimitsParams,
    WorkspaceMap,
    WorkspaceMapParams,
    calc_operational_space_inertia,
    rate_limit,
    saturate,
)
from dual_proxy.log import load_log, save_log
from dual_proxy.run import Run, RunError, run
from dual_proxy.scenario import (
    Scenario,
    ScenarioError,
    list_scenarios,
    load_scenario,
)

if TYPE_CHECKING:
    from dual_proxy import station, systems

__all__ = [
    "CommunicationChannel",
    "CommunicationChannelParams",
    "ContactScene",
    "ContactSceneParams",
    "ContactSurface",
    "ContactSurfaceParams",
    "ForceCommunicationChannel",
    "ForceLoop",
    "ForceLoopParams",
    "ForceMessage",
    "ForceSender",
    "ForceSpaceParticleFilter",
    "ForceSpaceParticleFilterAlgorithm",
    "ForceSpaceParticleFilterParams",
    "ForceSpaceParticleFilterThresholds",
    "ForceTorqueSensor",
    "ForceTorqueSensorParams",
    "HapticController",
    "HapticControllerParams",
    "HapticSide",
    "HapticSideParams",
    "HapticSideProxy",
    "HapticSideProxyParams",
    "LinkMonitor",
    "LinkMonitorParams",
    "LinkStatus",
    "OperationalSpaceController",
    "OperationalSpaceControllerParams",
    "OperatorPath",
    "OperatorPathParams",
    "PointRobot",
    "PointRobotParams",
    "Pose",
    "PoseInterpolatorParams",
    "PoseMessage",
    "PoseSender",
    "PoseSenderParams",
    "PositionForceHapticSide",
    "PositionForceHapticSideParams",
    "RobotSide",
    "RobotSideParams",
    "RobotSideProxy",
    "RobotSideProxyParams",
    "Run",
    "RunError",
    "Scenario",
    "ScenarioError",
    "SelectionBlend",
    "SelectionBlendParams",
    "SimulatedHapticDevice",
    "SimulatedHapticDeviceParams",
    "TimeDomainPassivity",
    "TimeDomainPassivityParams",
    "TrajectoryLimiter",
    "TrajectoryLimiterParams",
    "VirtualSpring",
    "VirtualSpringParams",
    "WindowMean",
    "WorkspaceLimits",
    "WorkspaceLimitsParams",
    "WorkspaceMap",
    "WorkspaceMapParams",
    "calc_operational_space_inertia",
    "list_scenarios",
    "load_log",
    "load_scenario",
    "rate_limit",
    "run",
    "saturate",
    "save_log",
    "station",
    "systems",
]


def __getattr__(name: str) -> object:
    """Imports the parts that need pydrake when they are first used."""
    if name in ("station", "systems"):
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
