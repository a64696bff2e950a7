# SPDX-License-Identifier: BSD-3-Clause
"""A port of the wrong type is refused when connected, or named in the error."""

import itertools
import re

import numpy as np
import pytest
from face_table import FACES, Source, added
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

import dual_proxy as dp
from dual_proxy import systems

VALUES = {
    "PoseMessage": dp.PoseMessage(sequence=0),
    "ForceMessage": dp.ForceMessage(sequence=0),
    "RigidTransform": RigidTransform(),
    "Matrix3X": np.zeros((3, 1)),
}
PORTS = [
    (name, port)
    for name, entry in FACES.items()
    for port in entry.inputs
    if port.type is not None
]


@pytest.mark.parametrize(
    ("face", "port", "wrong"),
    [
        (face, port, wrong)
        for (face, port), wrong in itertools.product(PORTS, VALUES)
        if wrong != port.type
    ],
    ids=lambda item: getattr(item, "name", item),
)
def test_the_error_names_system_port_and_types(face, port, wrong):
    builder = DiagramBuilder()
    dut = added(builder, FACES[face].make())
    dut.set_name("dut")
    for name, function in FACES[face].sources.items():
        if name == port.name:
            function = lambda t: VALUES[wrong]  # noqa: E731
        source = builder.AddNamedSystem(f"source of {name}", Source(function))
        try:
            builder.Connect(source.get_output_port(), dut.GetInputPort(name))
        except RuntimeError as error:  # Of Drake.
            refused = str(error)
            break
    else:
        refused = ""
    if refused:
        assert name == port.name
        assert "Mismatched value types" in refused
        assert re.search(rf"source of {name}.*{name}.*dut", refused, re.DOTALL)
        return
    simulator = Simulator(builder.Build())
    expected = VALUES[port.type]
    # Of the Python faces, and of the C++ ones.
    with pytest.raises(
        (TypeError, RuntimeError),
        match=f"dut: input port `{port.name}` expected {type(expected).__name__}, "
        f"got {type(VALUES[wrong]).__name__}$",
    ):
        simulator.AdvanceTo(0.05)


def test_the_error_names_a_system_without_a_name_by_its_class():
    dut = FACES["HapticSideProxy"].make()
    context = dut.CreateDefaultContext()
    for name, function in FACES["HapticSideProxy"].sources.items():
        value = function(0.0)
        if name == "robot_message":
            value = dp.ForceMessage(sequence=0)
        if not isinstance(value, np.ndarray):
            value = AbstractValue.Make(value)
        dut.GetInputPort(name).FixValue(context, value)
    with pytest.raises(
        TypeError,
        match=r"^HapticSideProxy: input port `robot_message` expected PoseMessage, "
        r"got ForceMessage$",
    ):
        dut.get_output_port(0).Eval(context)


def test_an_empty_message_is_of_any_kind():
    dut = FACES["HapticSideProxy"].make()
    context = dut.CreateDefaultContext()
    pose = AbstractValue.Make(RigidTransform())
    dut.GetInputPort("device_pose").FixValue(context, pose)
    for message in (dp.Message(), dp.ForceMessage()):
        port = dut.GetInputPort("robot_message")
        port.FixValue(context, AbstractValue.Make(message))
        force = dut.GetOutputPort("reference_force").Eval(context)
        np.testing.assert_array_equal(force, 0)


@pytest.mark.parametrize("message", [dp.ForceMessage, "PoseMessage", np.zeros(3)])
def test_a_channel_for_what_is_no_message_is_refused(message):
    with pytest.raises(TypeError, match="CommunicationChannel: `message` expected"):
        systems.CommunicationChannel(message=message)
