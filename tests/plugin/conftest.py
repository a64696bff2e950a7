# SPDX-License-Identifier: BSD-3-Clause
"""A synthetic run of scene `plane` whose every metric is known by hand."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from dual_proxy.log import SIGNALS, make_frame

# Of the angular filter, which scene `plane` does without.
ANGULAR = {
    "moment_dimension",
    "moment_selection",
    "contact_moment_dimension",
    "contact_rotation_axis",
    *(name for name in SIGNALS if name.startswith("angular_filter")),
}

CONTACT_START = 3.0
CONTACT_END = 16.2
LIFT = 16.0
CONTACT_HEIGHT = 0.41
DEPTH = 0.04
FORCE = 6.5

Arrays = dict[str, np.ndarray]


@pytest.fixture(scope="session", autouse=True)
def _signals():
    """Have Ctrl-C and a hang-up act, which a shell or nohup turns off for what it
    starts in the background; what tests start has them from here."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)


def _arrays(scenario) -> tuple[np.ndarray, Arrays]:
    """Press on the table from 3 s, lift from 16 s, lose contact at 16.2 s."""
    time = np.arange(20001) * 1e-3
    n = len(time)
    values: Arrays = {
        name: np.zeros((n, len(entry.components)))
        for name, entry in SIGNALS.items()
        if name not in ANGULAR
    }
    touching = (time >= CONTACT_START) & (time < CONTACT_END)
    # The hand in B: above, below the surface, and up again within 0.4 s.
    hand = np.tile(scenario.map.p_cw, (n, 1))
    hand[:, 2] = np.interp(
        time,
        [1.0, CONTACT_START, LIFT, LIFT + 0.4],
        [0.48, CONTACT_HEIGHT - DEPTH, CONTACT_HEIGHT - DEPTH, 0.48],
    )
    robot = hand.copy()
    robot[:, 2] = np.maximum(hand[:, 2], CONTACT_HEIGHT)
    to_device = scenario.map.R_DB.T / scenario.map.scale
    values["hand_position"] = (hand - scenario.map.p_cw) @ to_device
    values["device_position"] = (robot - scenario.map.p_cw) @ to_device
    values["robot_position"] = robot
    values["robot_proxy_position"] = hand
    values["joint_position"][:] = scenario.controller.q_rest
    values["robot_orientation"][:, 0] = 1.0
    values["robot_proxy_orientation"][:, 0] = 1.0
    values["contact_force"][touching, 2] = -FORCE
    values["contact_normal"][touching, 2] = -1.0
    values["contact_dimension"][touching] = 1
    values["dimension"][touching] = 1
    values["force_direction"][touching, 2] = -1.0
    values["force_selection"][touching, 8] = 1.0
    return time, values


@pytest.fixture
def make_log() -> Callable[..., pd.DataFrame]:
    """Return a function that makes the log, changed by a callback."""

    def make(scenario, change=None) -> pd.DataFrame:
        time, values = _arrays(scenario)
        if change is not None:
            change(SimpleNamespace(time=time, **values))
        return make_frame(time, values)

    return make
