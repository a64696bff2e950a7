# SPDX-License-Identifier: BSD-3-Clause
"""An arm that speaks FCI on 127.0.0.1, with a force sensor at its wrist: franka-sim,
with its communication and motion limits enforced.

python simulator.py ARM.xml POSTURE HOST:PORT TRUTH.npy

Runs in an environment of its own (requirements.txt beside it), and imports nothing of
the project. POSTURE: seven joints, rad, with commas. What its sensor counts, as ATI's
report the load on them, goes by UDP to HOST:PORT each step: six int32, big-endian, uN
and uN m, [force; moment] of the tool on the sensor. The arm's own estimate, without the
tool's weight, is in its state. Prints `ready` once a client may connect; SIGTERM ends
it. TRUTH.npy then has a row a step: time on the monotonic clock, s; force of the tip on
the table, N; the tip's place, m, in B.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import time

import mujoco
import numpy as np
from franka_sim import FrankaSimServer, mujoco_franka_sim

mjcf, posture, feed, truth_path = sys.argv[1:]
os.environ["FR3_MJCF"] = mjcf
q_start = np.array([float(q) for q in posture.split(",")])
mujoco_franka_sim.ARM_INITIAL_Q = q_start
ESTIMATE_NOISE = [0.02] * 3 + [0.002] * 3  # N, N m, standard deviation.
FLANGE = np.array([0, 0, mujoco_franka_sim.FLANGE_OFFSET_Z])  # m, in link 7.


class WristSensor(mujoco_franka_sim.MujocoFrankaSim):
    """The arm, which tells what its wrist and its tip feel."""

    def __init__(self) -> None:
        super().__init__()
        self.latest_joint_positions = q_start.copy()
        self.truth: list[tuple[float, ...]] = []
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        host, port = feed.split(":")
        self._feed = (host, int(port))
        self._tip = -1
        self._random = np.random.default_rng(1)
        self.server: FrankaSimServer | None = None

    def _bind_model(self) -> None:
        super()._bind_model()
        self._tip = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_GEOM, "tip")

    def _read_and_publish_state(self) -> None:
        super()._read_and_publish_state()
        data = self.data
        # MuJoCo's is what the arm does to the tool.
        counts = (-1e6 * data.sensordata).clip(-2e9, 2e9).astype(">i4")
        self._socket.sendto(counts.tobytes(), self._feed)
        R = data.xmat[self.ee_body_id].reshape(3, 3)
        flange = data.xpos[self.ee_body_id] + R @ FLANGE
        force, moment = np.zeros(3), np.zeros(3)
        one = np.zeros(6)
        for i, contact in enumerate(data.contact):
            if self._tip in (contact.geom1, contact.geom2):
                mujoco.mj_contactForce(self.model, data, i, one)
                on_table = contact.frame.reshape(3, 3).T @ one[:3]
                on_table *= 1 if contact.geom1 == self._tip else -1
                force += on_table
                moment += np.cross(contact.pos - flange, on_table)
        estimate = np.concatenate([R.T @ force, R.T @ moment])
        estimate += self._random.normal(0, ESTIMATE_NOISE)
        if self.server is not None:
            self.server.robot_state.state["K_F_ext_hat_K"] = estimate.tolist()
        self.truth.append((time.monotonic(), *force, *data.geom_xpos[self._tip]))


def main() -> None:
    """Serve until SIGTERM."""
    arm = WristSensor()
    server = FrankaSimServer(
        host="127.0.0.1",
        enable_gripper=False,
        physics_sim=arm,
        enforce_comm_constraints=True,
        enforce_motion_limits=True,
    )
    arm.server = server

    def end(*_: object) -> None:
        np.save(truth_path, np.array(arm.truth))
        os._exit(0)

    signal.signal(signal.SIGTERM, end)

    def tell() -> None:
        while server.server_socket is None or not arm.truth:
            time.sleep(0.05)
        print("ready", flush=True)

    threading.Thread(target=tell, daemon=True).start()
    server.start()


if __name__ == "__main__":
    main()
