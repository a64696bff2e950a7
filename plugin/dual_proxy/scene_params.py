# SPDX-License-Identifier: BSD-3-Clause
"""The scene around an arm, as plain numbers (no Drake).

The frame is the robot base B, which is Drake's world.
"""

from dual_proxy._core import SceneParams, SurfaceParams

__all__ = [
    "CORNER_RADIUS",
    "TIP_RADIUS",
    "TOOL_COM_S",
    "TOOL_MASS",
    "SceneParams",
    "SurfaceParams",
]

#: Radius of the tool's spherical tip around E, m.
TIP_RADIUS = SceneParams.TIP_RADIUS
#: Radius of the balls in the corners of a flat tool, m.
CORNER_RADIUS = SceneParams.CORNER_RADIUS
#: Mass beyond the flange, kg, and its centre of mass, (3,), m, in S.
TOOL_MASS = SceneParams.TOOL_MASS
TOOL_COM_S = SceneParams.TOOL_COM_S
