# SPDX-License-Identifier: BSD-3-Clause
"""What hardware needs otherwise than a simulation; C++ has the values' tests."""

import copy

import pytest

import dual_proxy as dp


def test_a_copy_is_changed():
    side = dp.RobotSideParams()
    before = copy.deepcopy(side)
    hardware = dp.make_hardware_defaults(side)
    assert side == before
    controller = hardware.controller
    assert controller.force_gain == 0.5
    assert controller.moment_gain == 0.5
    assert controller.force_passivity.actuation_delay == 3
    assert not controller.gravity_compensation
    assert not controller.acceleration_feed_forward
    assert hardware.proxy.reclutch
    hardware.validate()


def test_what_is_no_robot_side_is_refused():
    with pytest.raises(TypeError):
        dp.make_hardware_defaults(dp.HapticSideParams())
