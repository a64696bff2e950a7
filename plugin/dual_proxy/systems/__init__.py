# SPDX-License-Identifier: BSD-3-Clause
"""The algorithms as Drake LeafSystems.

The state of each is in the Context: a diagram can be reset, cloned and run
again with the same bits. `RobotSide` and `HapticSide` do a whole side's work
of a control period in one call; the others are its parts, for diagrams of your
own.

`X.add_to(builder, ...)` adds a system to a diagram, in C++ where this build has
the C++ systems (`dual_proxy.native`); `X(...)` is always the one in Python.
Systems of your own that take or give messages use `make_value`, `set_value` and
`get_value`, which fit both.
"""

import dual_proxy._pydrake  # noqa: F401
from dual_proxy.systems._values import get_value, make_value, set_value
from dual_proxy.systems.control import (
    ArmKinematics,
    HapticController,
    OperationalSpaceController,
)
from dual_proxy.systems.link import CommunicationChannel, PoseSender
from dual_proxy.systems.loop import TeleopLoop
from dual_proxy.systems.perception import (
    ContactHistory,
    ForceSpaceParticleFilter,
    WindowMean,
)
from dual_proxy.systems.proxy import (
    LINK_STATUS_FIELDS,
    HapticSideProxy,
    RobotSideProxy,
)
from dual_proxy.systems.sides import HapticSide, RobotSide
from dual_proxy.systems.simulation import (
    ForceTorqueSensor,
    SensorReaction,
    SimulatedHapticDevice,
)

__all__ = [
    "LINK_STATUS_FIELDS",
    "ArmKinematics",
    "CommunicationChannel",
    "ContactHistory",
    "ForceSpaceParticleFilter",
    "ForceTorqueSensor",
    "HapticController",
    "HapticSide",
    "HapticSideProxy",
    "OperationalSpaceController",
    "PoseSender",
    "RobotSide",
    "RobotSideProxy",
    "SensorReaction",
    "SimulatedHapticDevice",
    "TeleopLoop",
    "WindowMean",
    "get_value",
    "make_value",
    "set_value",
]
