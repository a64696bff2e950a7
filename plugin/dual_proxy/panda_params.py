# SPDX-License-Identifier: BSD-3-Clause
"""The scene of a Panda above a table, as plain numbers (no Drake).

The frame is the robot base B, which is Drake's world.
"""

from dual_proxy._core import BoxParams, PandaSceneParams

__all__ = [
    "CORNER_RADIUS",
    "TIP_RADIUS",
    "TOOL_COM_S",
    "TOOL_MASS",
    "BoxParams",
    "PandaSceneParams",
]

#: Radius of the tool's spherical tip around E, m.
TIP_RADIUS = PandaSceneParams.TIP_RADIUS
#: Radius of the balls in the corners of a flat tool, m.
CORNER_RADIUS = PandaSceneParams.CORNER_RADIUS
#: Mass beyond the flange, kg, and its centre of mass, (3,), m, in S.
TOOL_MASS = PandaSceneParams.TOOL_MASS
TOOL_COM_S = PandaSceneParams.TOOL_COM_S
