# SPDX-License-Identifier: BSD-3-Clause
"""Samples of a simulated wrist sensor, to try `dual-proxy calibrate-tool` with.

    python examples/04_tool_poses.py poses.csv
    dual-proxy calibrate-tool poses.csv

An arm holds a tool of 0.83 kg for a second in each of six poses; the sensor has
a bias and noise. With a real one, `dp.RdtSensor(...).read().value` takes the
place of what is simulated here, and the robot's own pose that of `tilts`.
"""

import sys

import numpy as np

import dual_proxy as dp

mass, com = 0.83, np.array([0.004, -0.011, 0.062])  # kg, m in S.
# rad, about x and y of B, from the tool pointing down: four sides, and level.
tilts = np.deg2rad([[0, 0], [60, 0], [-60, 0], [0, 60], [0, -60], [90, 20]])
hold, move, rate = 1.0, 0.5, 200.0  # s, s, Hz.

sensor = dp.ForceTorqueSensor(
    dp.ForceTorqueSensorParams(
        force_bias=[3.1, -7.4, 12.9],
        moment_bias=[0.21, -0.34, 0.08],
        force_noise_std=0.2,
        moment_noise_std=0.005,
    )
)
state = sensor.make_state(seed=1)


def multiply(a, b):
    """Returns the product of two quaternions (w, x, y, z)."""
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.array([w, *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


def about(axis, angle):
    """Returns the quaternion of a turn about an axis."""
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * np.eye(3)[axis])])


def rotation(quaternion):
    """Returns its matrix."""
    w, v = quaternion[0], quaternion[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * (w * cross + cross @ cross)


rows = []
for begin, end in zip(tilts, [*tilts[1:], tilts[-1]], strict=True):
    for i in range(round((hold + move) * rate)):
        tilt = begin + (end - begin) * max(0.0, (i / rate - hold) / move)
        turned = multiply(about(1, tilt[1]), about(0, tilt[0]))
        quaternion = multiply(turned, about(0, np.pi))  # R_BS.
        R_BS = rotation(quaternion)
        # What the arm exerts on the tool: it carries the tool's weight.
        force = R_BS.T @ [0, 0, mass * 9.81]
        reaction = [*force, *np.cross(com, force)]
        sensor.update(reaction, np.zeros(3), R_BS, np.zeros(3), state)
        rows.append([len(rows) / rate, *quaternion, *state.measured])

np.savetxt(
    sys.argv[1],
    rows,
    fmt="%.6f",
    delimiter=",",
    header="t,qw,qx,qy,qz,fx,fy,fz,mx,my,mz",
    comments="",
)
print(f"{len(rows)} samples in {sys.argv[1]}")
