# SPDX-License-Identifier: BSD-3-Clause
"""The project's Panda over a table, as an MJCF for franka-sim."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydrake.math import RotationMatrix

from dual_proxy.panda import TOOL_MOMENTS, PandaModel, p_SE_S
from dual_proxy.scenario import Scenario
from dual_proxy.scene_params import TIP_RADIUS, TOOL_COM_S, TOOL_MASS

# Of the joints, beyond the model's: rotors, kg m^2, N m s/rad, N m. The hold servo of
# franka-sim needs 0.1 of the first.
ROTOR, DAMPING, FRICTION = 0.1, 0.3, 0.1
# MuJoCo's constraint as a spring: N/m and N s/m times its inertia's part; see
# known values of `solimp` and of the tip's apparent inverse mass, 1/kg.
IMPEDANCE, INVERSE_MASS = 0.01, 0.372


def write_panda_mjcf(
    scenario: Scenario, path: Path, stiffness: float = 3e4, damping: float = 15.0
) -> None:
    """Write the arm, without its tool's mass in link 7, the tool behind a site `wrist`
    with a force and a torque sensor, and the table of a scenario.

    stiffness, damping : N/m, N s/m, of the table.
    """
    least = 1e-3  # kg, of a tool.
    arm = PandaModel(least).arm_params
    scene = scenario.scene
    tool_mass = scene.tool_mass - least
    scale = (1 - IMPEDANCE) * INVERSE_MASS
    table = [
        f'<geom name="table" type="box" size="0.3 0.4 0.05" priority="1" condim="3" '
        f'pos="{_text([0.5, 0, scene.table_height - 0.05])}" '
        f'friction="{scene.friction} 0.001 0.0001" '
        f'solimp="{IMPEDANCE} {IMPEDANCE} 0.001" '
        f'solref="{-stiffness * scale:.6g} {-damping * scale:.6g}"/>'
    ]
    links = ['<body name="fr3_link0">']
    for i in range(7):
        links += [
            f'<body name="fr3_link{i + 1}" pos="{_text(np.array(arm.p_PJ)[:, i])}" '
            f'quat="{_quaternion(arm.R_PJ[i])}">',
            _inertial(arm.mass[i], np.array(arm.com)[:, i], np.array(arm.inertia[i])),
            f'<joint name="fr3_joint{i + 1}" axis="0 0 1" armature="{ROTOR}" '
            f'damping="{DAMPING}" frictionloss="{FRICTION}"/>',
        ]
    moments = np.array(TOOL_MOMENTS) * tool_mass / TOOL_MASS
    links += [
        f'<body name="tool" pos="{_text(np.array(arm.p_LE) - p_SE_S)}">',
        _inertial(tool_mass, np.array(TOOL_COM_S), np.diag(moments)),
        '<site name="wrist"/>',
        f'<geom name="tip" type="sphere" size="{TIP_RADIUS}" pos="{_text(p_SE_S)}"/>',
        "</body>",
        *["</body>"] * 8,
    ]
    motors = [f'<motor joint="fr3_joint{i}"/>' for i in range(1, 8)]
    path.write_text(
        "\n".join(
            [
                '<mujoco model="panda"><compiler angle="radian"/>',
                '<option timestep="0.001" integrator="implicitfast" cone="elliptic"/>',
                *("<worldbody>", *table, *links, "</worldbody>"),
                *("<actuator>", *motors, "</actuator>"),
                '<sensor><force site="wrist"/><torque site="wrist"/></sensor>',
                "</mujoco>",
            ]
        )
    )


def _inertial(mass: float, com: np.ndarray, about_com: np.ndarray) -> str:
    full = about_com[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return (
        f'<inertial pos="{_text(com)}" mass="{mass:.9g}" fullinertia="{_text(full)}"/>'
    )


def _quaternion(rotation: np.ndarray) -> str:
    return _text(RotationMatrix(np.array(rotation)).ToQuaternion().wxyz())


def _text(values: np.ndarray) -> str:
    return " ".join(f"{value:.12g}" for value in np.ravel(values))
