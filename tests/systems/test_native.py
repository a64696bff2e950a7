# SPDX-License-Identifier: BSD-3-Clause
"""Which faces serve, and what is said where they cannot."""

import numpy as np
import pandas as pd
import pytest
from pydrake.systems.framework import DiagramBuilder, LeafSystem

import dual_proxy as dp
from dual_proxy import _core, native, systems

needs_native = pytest.mark.skipif(
    not dp.native_available(), reason="built where Drake's C++ library is found"
)


def add(choice, monkeypatch, **kwargs):
    monkeypatch.setenv("DUAL_PROXY_FACES", choice)
    builder = DiagramBuilder()
    return builder, systems.PoseSender.add_to(builder, **kwargs)


def test_python_faces_on_request(monkeypatch):
    builder, system = add("python", monkeypatch)
    assert isinstance(system, systems.PoseSender)
    assert system.get_name() == "PoseSender"
    assert builder.GetSystems() == [system]


@needs_native
@pytest.mark.parametrize("choice", ["native", "auto"])
def test_native_faces_where_they_are_built(choice, monkeypatch):
    _builder, system = add(choice, monkeypatch, name="sender")
    assert not isinstance(system, LeafSystem)
    assert system.get_name() == "sender"
    assert system.GetInputPort("force_selection").size() == 9


def test_auto_is_python_where_they_are_not(monkeypatch):
    monkeypatch.setattr(native, "_load", lambda: (None, "no such module"))
    assert not dp.native_available()
    _builder, system = add("auto", monkeypatch)
    assert isinstance(system, systems.PoseSender)


def test_errors_say_what_to_do(monkeypatch):
    with pytest.raises(ValueError, match="one of python, native, auto, got 'cpp'"):
        add("cpp", monkeypatch)
    monkeypatch.setattr(native, "_load", lambda: (None, "no such module"))
    with pytest.raises(ValueError, match=r"no such module.*docs/use_from_cpp\.md"):
        add("native", monkeypatch)
    monkeypatch.setenv("DUAL_PROXY_FACES", "python")
    with pytest.raises(TypeError, match="no_such"):
        systems.PoseSender.add_to(DiagramBuilder(), no_such=1)


@pytest.mark.parametrize("choice", ["python", "auto"])
def test_bad_arguments_are_errors_of_the_class_for_both(choice, monkeypatch):
    monkeypatch.setenv("DUAL_PROXY_FACES", choice)
    with pytest.raises(ValueError, match=r"WindowMean: field `period` .* got 0"):
        systems.WindowMean.add_to(DiagramBuilder(), period=0.0)


@needs_native
def test_only_what_pydrake_made_is_taken():
    module = native.native_module()
    for wrong in ("builder", None, _core.PoseMessage()):
        with pytest.raises(TypeError, match="`builder` expected a pydrake"):
            module.add_block(wrong, "sender", systems.PoseSender()._block)


@pytest.mark.parametrize("choice", ["python", "auto"])
@pytest.mark.parametrize("kind", [_core.PoseMessage, _core.ForceMessage])
def test_messages_go_in_and_come_out(choice, kind, monkeypatch):
    monkeypatch.setenv("DUAL_PROXY_FACES", choice)
    value = systems.make_value(kind(sequence=3))
    assert systems.get_value(value).sequence == 3
    systems.set_value(value, kind(sequence=4))
    assert systems.get_value(value).sequence == 4
    assert systems.get_value(value.Clone()).sequence == 4
    assert isinstance(systems.get_value(value), kind)


@needs_native
def test_values_of_another_type_are_refused(monkeypatch):
    monkeypatch.setenv("DUAL_PROXY_FACES", "native")
    value = systems.make_value(_core.PoseMessage())
    with pytest.raises(TypeError, match="expected"):
        systems.set_value(value, np.eye(3))
    # One type for all messages: a receiver looks at what it holds.
    systems.set_value(value, _core.ForceMessage(sequence=5))
    assert isinstance(systems.get_value(value), _core.ForceMessage)
    normals = systems.make_value(np.eye(3))
    np.testing.assert_array_equal(systems.get_value(normals), np.eye(3))


@needs_native
@pytest.mark.parametrize("scheme", dp.scenario.SCHEMES)
def test_a_run_is_the_same_bit_for_bit(scheme, monkeypatch):
    logs = []
    for choice in ("python", "native"):
        monkeypatch.setenv("DUAL_PROXY_FACES", choice)
        logs.append(dp.run("plane", scheme=scheme, delay=0.05, duration=4.0).log)
    pd.testing.assert_frame_equal(*logs, check_exact=True)
    assert (logs[0]["contact_force_z"] < -1.0).any()
