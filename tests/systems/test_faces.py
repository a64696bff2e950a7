# SPDX-License-Identifier: BSD-3-Clause
"""The pydrake faces: ports, start-up, reset, clone, bad values."""

import copy
import math
import re

import numpy as np
import pytest
from face_table import (
    ALONG_Z,
    FACES,
    P_SE,
    PARAMS,
    Q_START,
    R_DOWN,
    START,
    Source,
    added,
    alone,
    build,
    build_around,
    constant,
    device_params,
    evaluate,
    flat,
    operator_path,
    panda,
    prior,
    robot_pose,
    robot_proxy_params,
    robot_side_params,
    robot_state,
    sensor_params,
    spoiled,
)
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem, PortDataType
from pydrake.systems.primitives import ConstantVectorSource

from dual_proxy import _core, systems
from dual_proxy.native import native_in_use
from dual_proxy.panda import NUM_JOINTS

python_faces = pytest.mark.skipif(native_in_use(), reason="of the Python faces only")
every_face = pytest.mark.parametrize("name", FACES)


def read(diagram, context):
    ports = map(diagram.get_output_port, range(diagram.num_output_ports()))
    return {port.get_name(): flat(evaluate(port, context)) for port in ports}


def simulate(simulator, stop, step=0.0105):
    """Advances, and returns the outputs on the way as one array."""
    rows = []
    context = simulator.get_context()
    while context.get_time() < stop - 1e-9:
        simulator.AdvanceTo(min(context.get_time() + step, stop))
        outputs = read(simulator.get_system(), context)
        rows.append(np.concatenate(list(outputs.values())))
    return np.array(rows)


# Ports.


MESSAGES = (_core.Message, _core.PoseMessage, _core.ForceMessage)


def kind(value):
    """What the table calls a value; a port for messages takes any of them."""
    held = systems.get_value(value)
    return _core.PoseMessage if isinstance(held, MESSAGES) else type(held)


def port_table(face, ports):
    table = {}
    for port in ports:
        if port.get_data_type() == PortDataType.kVectorValued:
            table[port.get_name()] = port.size()
        elif port in [face.get_output_port(i) for i in range(face.num_output_ports())]:
            table[port.get_name()] = kind(port.Allocate())
        else:
            table[port.get_name()] = kind(face.AllocateInputAbstract(port))
    return table


@every_face
def test_ports_are_those_of_the_table(name):
    entry = FACES[name]
    _, face = alone(entry)
    inputs = [face.get_input_port(i) for i in range(face.num_input_ports())]
    outputs = [face.get_output_port(i) for i in range(face.num_output_ports())]
    for ports, expected in ((inputs, entry.inputs), (outputs, entry.outputs)):
        table = [(port.name, port.holds) for port in expected]
        assert list(port_table(face, ports).items()) == table


@every_face
def test_public_ports_come_first(name):
    for ports in (FACES[name].inputs, FACES[name].outputs):
        public = [port.public for port in ports]
        assert public == sorted(public, reverse=True)


@every_face
def test_docstring_lists_the_ports(name):
    entry = FACES[name]
    text = getattr(systems, entry.cls).__doc__
    assert f"name: {entry.cls}\n" in text
    block = text[text.index("@system") : text.index("@endsystem")]
    inputs, outputs = block.split("output_ports:")
    for part, expected in ((inputs, entry.inputs), (outputs, entry.outputs)):
        listed = re.findall(r"^ *- (\w+)", part, re.MULTILINE)
        assert len(set(listed)) == len(listed)
        assert {port.name for port in expected} <= set(listed)


@every_face
def test_feedthrough_is_that_of_the_table(name):
    entry = FACES[name]
    _, face = alone(entry)
    for i, port in enumerate(entry.outputs):
        assert face.HasDirectFeedthrough(output_port=i) == port.feedthrough, port.name


def test_robot_pose_of_a_side_needs_the_robot_state_only():
    for name in ("RobotSide", "RobotSideWithSensor"):
        _, face = alone(FACES[name])
        output = face.GetOutputPort("robot_pose").get_index()
        for port in FACES[name].inputs:
            index = face.GetInputPort(port.name).get_index()
            feedthrough = face.HasDirectFeedthrough(index, output)
            assert feedthrough == (port.name == "robot_state"), port.name


def test_every_face_is_in_the_table():
    faces = {
        name
        for name in systems.__all__
        if isinstance(getattr(systems, name), type)
        and issubclass(getattr(systems, name), LeafSystem)
    }
    # What is fed by a plant has tests of its own.
    assert faces - {"SensorReaction", "TeleopLoop"} == {
        entry.cls for entry in FACES.values()
    }


def test_a_side_with_simulated_hardware_is_in_the_table_both_ways():
    for cls in ("RobotSide", "HapticSide"):
        modes = [
            entry.simulated
            for entry in FACES.values()
            if entry.cls == cls and not entry.angular
        ]
        assert sorted(modes) == [False, True]


# State in the Context.


@every_face
def test_reset_gives_the_same_bits(name):
    diagram = build(FACES[name])
    simulator = Simulator(diagram)
    first = simulate(simulator, 0.25)
    simulator.reset_context(diagram.CreateDefaultContext())
    simulator.Initialize()
    np.testing.assert_array_equal(simulate(simulator, 0.25), first)
    assert np.any(first != first[0])


@every_face
def test_clone_continues_with_the_same_bits(name):
    diagram = build(FACES[name])
    simulator = Simulator(diagram)
    simulate(simulator, 0.1205)
    clone = Simulator(diagram, simulator.get_context().Clone())
    # First the clone: it shares nothing with the original.
    theirs = simulate(clone, 0.25)
    np.testing.assert_array_equal(simulate(simulator, 0.25), theirs)


@every_face
def test_context_of_another_instance_is_independent(name):
    first, second = build(FACES[name]), build(FACES[name])
    expected = simulate(Simulator(first), 0.15)
    simulator = Simulator(first)
    simulate(simulator, 0.05)
    np.testing.assert_array_equal(simulate(Simulator(second), 0.15), expected)


def memories(diagram, root):
    """What a Python face and its context hold as the algorithm's state."""
    if native_in_use():
        return []
    face = diagram.GetSystems()[0]
    context = face.GetMyContextFromRoot(root)
    return [
        context.get_abstract_state(i).get_value()
        for i in range(context.num_abstract_states())
    ]


@every_face
def test_clones_share_memory_and_do_not_influence_each_other(name):
    entry = FACES[name]
    diagram = build(entry)
    untouched = Simulator(diagram)
    simulate(untouched, 0.1205)
    expected = simulate(untouched, 0.25)

    simulator = Simulator(diagram)
    simulate(simulator, 0.1205)
    root = simulator.get_context()
    shared = memories(diagram, root)
    twin, other, late = (Simulator(diagram, root.Clone()) for _ in range(3))
    for clone in (twin, other, late):
        for mine, theirs in zip(
            shared, memories(diagram, clone.get_context()), strict=True
        ):
            assert mine is theirs  # Not a copy: what makes the test needed.
    # In one of them all inputs stand still, vectors at half of what they were.
    face = diagram.GetSystems()[0]
    context = face.GetMyMutableContextFromRoot(other.get_mutable_context())
    for port, function in entry.sources.items():
        value = function(0.0)
        vector = isinstance(value, np.ndarray) and value.ndim == 1
        value = 0.5 * value if vector else systems.make_value(value)
        face.GetInputPort(port).FixValue(context, value)

    # They take turns.
    rows = {"other": [], "mine": [], "twin": []}
    turns = {"other": other, "mine": simulator, "twin": twin}
    now = root.get_time()
    while now < 0.25 - 1e-9:
        now = min(now + 0.0105, 0.25)
        for who, turn in turns.items():
            rows[who].append(simulate(turn, now, step=1.0)[0])
    np.testing.assert_array_equal(rows["mine"], expected)
    np.testing.assert_array_equal(rows["twin"], expected)
    assert np.any(np.array(rows["other"]) != expected)
    # What was shared is still as it was.
    for mine, theirs in zip(shared, memories(diagram, late.get_context()), strict=True):
        assert mine is theirs
    np.testing.assert_array_equal(simulate(late, 0.25), expected)


@python_faces
@every_face
def test_a_step_replaces_the_memory(name):
    diagram = build(FACES[name])
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.0995)
    before = memories(diagram, simulator.get_context())
    simulator.AdvanceTo(0.2005)
    after = memories(diagram, simulator.get_context())
    assert len(after) == (FACES[name].cls != "ArmKinematics")
    for mine, theirs in zip(before, after, strict=True):
        assert mine is not theirs


def test_reading_outputs_changes_nothing():
    entry = FACES["OperationalSpaceController"]
    diagram = build(entry)
    watched, unwatched = Simulator(diagram), Simulator(diagram)
    simulate(watched, 0.2, step=0.0005)
    unwatched.AdvanceTo(0.2)
    a = read(diagram, watched.get_context())
    b = read(diagram, unwatched.get_context())
    for name, value in a.items():
        np.testing.assert_array_equal(value, b[name], err_msg=name)


def test_step_stands_for_the_rest_of_its_instant():
    diagram = build(FACES["HapticSideProxy"])
    context = diagram.CreateDefaultContext()
    before = read(diagram, context)
    simulator = Simulator(diagram, context)
    simulator.AdvancePendingEvents()
    face = diagram.GetSystems()[0]
    face_context = face.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    # What the plant does within the instant makes no second step.
    port = face.GetInputPort("device_pose")
    port.FixValue(face_context, RigidTransform([0.0, 0.0, 0.05]))
    after = read(diagram, simulator.get_context())
    for name, value in before.items():
        np.testing.assert_array_equal(after[name], value, err_msg=name)
    simulator.AdvanceTo(0.0005)
    # A second step's worth, at 20 N/s.
    np.testing.assert_allclose(
        flat(face.GetOutputPort("reference_force").Eval(face_context)),
        [0.0, 0.0, 0.04],
        atol=1e-12,
    )


def test_params_are_copied():
    params = robot_proxy_params()
    sources = FACES["RobotSideProxy"].sources
    expected = simulate(
        Simulator(build_around(systems.RobotSideProxy(params), sources)), 0.1
    )
    face = systems.RobotSideProxy(params)
    params.stiffness = 1.0
    np.testing.assert_array_equal(
        simulate(Simulator(build_around(face, sources)), 0.1), expected
    )


# Values before the first step.


def start_values(name):
    diagram = build(FACES[name])
    return read(diagram, diagram.CreateDefaultContext())


@pytest.mark.parametrize(
    "name",
    [
        "CommunicationChannel",
        "PoseSender",
        "HapticSide",
        "HapticSideWithDevice",
        "RobotSide",
        "RobotSideWithSensor",
    ],
)
def test_message_is_empty_at_the_start(name):
    assert start_values(name)["message"][0] == -1


def test_history_starts_with_nothing():
    diagram = build(FACES["ContactHistory"])
    prior = evaluate(diagram.GetOutputPort("prior"), diagram.CreateDefaultContext())
    assert prior.shape == (3, 0)


def test_filter_starts_without_contact():
    values = start_values("ForceSpaceParticleFilter")
    assert values.pop("direction_uncertainty") == math.pi / 2
    for name, value in values.items():
        np.testing.assert_array_equal(value, 0, err_msg=name)


@pytest.mark.parametrize(
    "name",
    ["HapticSide", "HapticSideWithDevice", "ForceTorqueSensor", "WindowMean"],
)
def test_starts_at_zero(name):
    port = FACES[name].acting[0]
    np.testing.assert_array_equal(start_values(name)[port], 0)


@pytest.mark.parametrize("name", ["RobotSide", "RobotSideWithSensor"])
def test_robot_side_holds_the_arm_at_the_start(name):
    gravity = panda().calc(Q_START, np.zeros(NUM_JOINTS)).gravity
    values = start_values(name)
    np.testing.assert_array_equal(values["torque"], -gravity)
    np.testing.assert_array_equal(values["signals"], 0)
    np.testing.assert_array_equal(values.get("sensed_wrench", np.zeros(6)), 0)


HOME = flat(RigidTransform())


def test_device_starts_at_its_home():
    values = start_values("SimulatedHapticDevice")
    np.testing.assert_array_equal(values["device_pose"], HOME)
    np.testing.assert_array_equal(values["device_velocity"], 0)
    values = start_values("HapticSideWithDevice")
    np.testing.assert_array_equal(values["device_pose"], HOME)


def test_robot_proxy_starts_at_the_robot():
    values = start_values("RobotSideProxy")
    np.testing.assert_allclose(values["motion_error"], 0, atol=1e-6)
    np.testing.assert_array_equal(values["reference_force"], 0)


# Optional ports.


@pytest.mark.parametrize(
    ("name", "port"),
    [
        (name, port)
        for name, entry in FACES.items()
        for port in entry.inputs
        if port.optional
    ],
    ids=lambda value: getattr(value, "name", value),
)
def test_optional_port(name, port):
    entry = FACES[name]
    diagram = build(entry, leave_out=[port.name])
    rows = simulate(Simulator(diagram), 0.15)
    assert np.all(np.isfinite(rows))
    if port.size is not None and port.name not in {"sensed_wrench", "robot_velocity"}:
        # The same as zeros, but for velocities, which are taken from the poses; a
        # sensor of which nothing is said is ready.
        zeros = np.full(port.size, 1.0 if port.name == "sensor_ready" else 0.0)
        with_zeros = build(entry, {port.name: lambda t: zeros})
        np.testing.assert_array_equal(rows, simulate(Simulator(with_zeros), 0.15))


def test_sides_without_messages_wait_and_send():
    for name, port in (
        ("RobotSide", "haptic_message"),
        ("RobotSideWithSensor", "haptic_message"),
        ("HapticSide", "robot_message"),
        ("HapticSideWithDevice", "robot_message"),
    ):
        diagram = build(FACES[name], leave_out=[port])
        simulator = Simulator(diagram)
        simulator.AdvanceTo(0.1)
        outputs = read(diagram, simulator.get_context())
        layout = FACES[name].make().layout
        side = "robot" if FACES[name].cls == "RobotSide" else "haptic"
        status = outputs["signals"][layout[f"{side}_link_status"]]
        assert status == int(_core.LinkStatus.WAITING)
        assert outputs["message"][0] == 4


@pytest.mark.parametrize("name", ["HapticSide", "HapticSideWithDevice"])
def test_without_a_message_there_is_no_force_on_the_hand(name):
    diagram = build(FACES[name], leave_out=["robot_message"])
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.1)
    np.testing.assert_array_equal(
        read(diagram, simulator.get_context())["device_wrench"], 0
    )


# Values that are none.


def spoil(function, bad):
    """The function of time from 0.05 to 0.12 s with `bad` in its place."""
    wrong = spoiled(function(0.0), bad)
    return lambda t: wrong if 0.05 <= t < 0.12 else function(t)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(
    ("name", "port"),
    [(name, port) for name, entry in FACES.items() for port in entry.sources],
)
def test_bad_values_never_raise_and_never_get_through(name, port, bad):
    entry = FACES[name]
    diagram = build(entry, {port: spoil(entry.sources[port], bad)})
    simulator = Simulator(diagram)
    context = simulator.get_context()
    for stop in (0.0495, 0.0505, 0.07, 0.1, 0.1195, 0.1205, 0.2):
        simulator.AdvanceTo(stop)
        outputs = read(diagram, context)
        for output in entry.acting:
            assert np.all(np.isfinite(outputs[output])), (output, stop)


@pytest.mark.parametrize(
    "name",
    ["OperationalSpaceController", "RobotSide", "RobotSideWithSensor"],
)
def test_the_weight_is_held_while_the_robot_state_is_none(name):
    entry = FACES[name]
    diagram = build(entry, {"robot_state": spoil(entry.sources["robot_state"], np.nan)})
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.105)
    first = read(diagram, simulator.get_context())["torque"]
    simulator.AdvanceTo(0.11)
    held = read(diagram, simulator.get_context())["torque"]
    np.testing.assert_array_equal(held, first)
    assert np.linalg.norm(held) > 1
    # There is no weight on the axis that is vertical.
    assert held[0] == 0
    simulator.AdvanceTo(0.2)
    assert np.any(read(diagram, simulator.get_context())["torque"] != held)


@pytest.mark.parametrize(
    "bad",
    [
        np.full((3, 1), np.nan),
        np.zeros((3, 1)),
        np.ones((3, 9)),
        np.ones(3),
    ],
)
def test_bad_prior_leaves_the_one_before(bad):
    if native_in_use() and np.ndim(bad) != 2:
        pytest.skip("The C++ face's port takes nothing but arrays (3, k).")
    entry = FACES["ForceSpaceParticleFilter"]
    good = build(entry)
    spoiled = build(entry, {"prior": lambda t: prior(t) if t < 0.05 else bad})
    expected = simulate(Simulator(good), 0.25)
    simulator = Simulator(spoiled)
    rows = simulate(simulator, 0.25)
    # But for the counters, before the nine numbers of the normals.
    counters = slice(-11, -9)
    np.testing.assert_array_equal(
        np.delete(rows, counters, axis=1), np.delete(expected, counters, axis=1)
    )
    np.testing.assert_array_equal(rows[-1, counters], [10, 0])


def test_rotation_that_drake_would_refuse():
    # Drake wants 3e-14; over a link come rotations that are good to less.
    angle = 0.3
    R = np.array(
        [
            [math.cos(angle), -math.sin(angle), 0.0],
            [math.sin(angle), math.cos(angle), 0.0],
            [0.0, 0.0, 1.0],
        ]
    )
    skewed = R + 1e-9 * np.arange(9).reshape(3, 3)

    def message(t):
        return _core.PoseMessage(
            sequence=0, send_time=0.0, pose=_core.Pose(p=START, R=skewed)
        )

    diagram = build(FACES["HapticSideProxy"], {"robot_message": message})
    outputs = read(diagram, diagram.CreateDefaultContext())
    np.testing.assert_allclose(outputs["proxy_pose"][3:], R.ravel(), atol=1e-7)


# Errors at construction.


def make_channel(**kwargs):
    return lambda: systems.CommunicationChannel(**kwargs)


def filter_with(**kwargs):
    def make():
        params = _core.ForceSpaceParticleFilterParams()
        for key, value in kwargs.items():
            setattr(params, key, value)
        systems.ForceSpaceParticleFilter(params)

    return make


def proxy_with_period(period):
    params = _core.RobotSideProxyParams()
    params.period = period
    systems.RobotSideProxy(params)


def controller_with_limit(limit):
    params = _core.OperationalSpaceControllerParams()
    params.torque_limit = limit
    systems.OperationalSpaceController(params)


@pytest.mark.parametrize(
    ("make", "names"),
    [
        (make_channel(rate=0.0), ["CommunicationChannel", "rate", "0"]),
        (make_channel(rate=math.nan), ["rate", "nan"]),
        (make_channel(rate=math.inf), ["rate", "inf"]),
        (make_channel(period=-0.1), ["CommunicationChannel", "period", "-0.1"]),
        (lambda: systems.WindowMean(window=0.0), ["WindowMean", "window", "0"]),
        (lambda: systems.WindowMean(period=-1.0), ["WindowMean", "period", "-1"]),
        (
            lambda: systems.ForceTorqueSensor(p_SE=np.zeros(2)),
            ["ForceTorqueSensor", "p_SE", "(3,)", "(2,)"],
        ),
        (
            lambda: systems.ForceTorqueSensor(p_SE=[0.0, math.nan, 0.0]),
            ["ForceTorqueSensor", "p_SE[1]", "[-1000, 1000], got nan"],
        ),
        (
            lambda: systems.RobotSide(q_start=np.zeros(6)),
            ["RobotSide", "q_start", "(7,)", "(6,)"],
        ),
        (
            lambda: systems.RobotSide(sensor=sensor_params(), p_SE=np.zeros(2)),
            ["RobotSide", "p_SE", "(3,)", "(2,)"],
        ),
        (
            lambda: systems.RobotSide(
                sensor=sensor_params(), p_SE=[0.0, math.nan, 0.0]
            ),
            ["RobotSide", "p_SE[1]", "[-1000, 1000], got nan"],
        ),
        (
            lambda: systems.HapticSide(device=device_params()),
            ["HapticSide", "device", "path"],
        ),
        (
            lambda: systems.HapticSide(path=operator_path()),
            ["HapticSide", "device", "path"],
        ),
        (filter_with(num_particles=1), ["num_particles", "1"]),
        (filter_with(period=-0.1), ["period", "-0.1"]),
        (lambda: proxy_with_period(0.0), ["RobotSideProxyParams", "period", "0"]),
        (lambda: controller_with_limit(np.zeros(7)), ["torque_limit"]),
        (lambda: controller_with_limit(np.ones(6)), ["torque_limit", "(7,)", "(6,)"]),
    ],
)
def test_errors_name_what_is_wrong(make, names):
    pattern = ".*".join(re.escape(name) for name in names)
    with pytest.raises(ValueError, match=pattern):
        make()


def test_a_joint_that_the_plant_has_not_is_named():
    face = systems.SensorReaction(1000)
    context = face.CreateDefaultContext()
    forces = [SpatialForce(np.zeros(3), np.zeros(3))] * 2
    face.GetInputPort("reaction_forces").FixValue(
        context, Value[list[SpatialForce]](forces)
    )
    context.SetTime(0.1)
    pattern = "`sensor_joint` expected an index of 2 joints of the plant, got 1000"
    with pytest.raises(IndexError, match=pattern):
        face.GetOutputPort("reaction").Eval(context)


def test_wrong_size_at_a_port():
    face = FACES["HapticController"].make()
    context = face.CreateDefaultContext()
    with pytest.raises((RuntimeError, SystemExit), match=r"reference_force|size"):
        face.GetInputPort("reference_force").FixValue(context, np.zeros(2))


# What single faces do.


def test_filter_in_a_diagram_finds_the_table():
    params = _core.ForceSpaceParticleFilterParams()
    inputs = {
        "sensed_force": [0.0, 0.0, -8.0],
        "velocity": [0.0, 0.0, 0.0],
        "motion_force": [0.0, 0.0, -10.0],
        "contact_force": [0.0, 0.0, 0.0],
    }
    builder = DiagramBuilder()
    face = systems.ForceSpaceParticleFilter.add_to(builder, params, seed=7)
    for name, value in inputs.items():
        source = builder.AddSystem(ConstantVectorSource(value))
        builder.Connect(source.get_output_port(), face.GetInputPort(name))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.98)
    context = face.GetMyContextFromRoot(simulator.get_context())

    algorithm = _core.ForceSpaceParticleFilter(params, seed=7)
    for _ in range(15):  # At 0, 1/15, ..., 14/15 s.
        algorithm.update(*(np.array(value) for value in inputs.values()))
    assert face.GetOutputPort("dimension").Eval(context) == [1]
    direction = face.GetOutputPort("force_direction").Eval(context)
    assert direction @ [0, 0, -1] > math.cos(math.radians(5))
    np.testing.assert_array_equal(
        face.GetOutputPort("force_selection").Eval(context),
        algorithm.force_selection.ravel(),
    )
    np.testing.assert_array_equal(
        face.GetOutputPort("particles").Eval(context).reshape(-1, 3),
        algorithm.particles.T,
    )


def test_history_in_a_ring_with_the_filter_gives_the_prior_to_the_next_visit():
    table = np.array([0.0, 0.6, -0.8])

    def presses(t):
        return t < 1.0 or t >= 4.0

    def place(t):
        """At the table, 5 cm off it, there again; from 6 s on elsewhere."""
        p = np.array([0.1 * (t >= 6.0), 0.0, 0.1])
        return RigidTransform(p if presses(t) else p - 0.05 * table)

    def pressing(t):
        return 9.0 * table * presses(t)

    builder = DiagramBuilder()
    history = systems.ContactHistory.add_to(builder)
    particle_filter = systems.ForceSpaceParticleFilter.add_to(builder)
    for source, name, target in (
        (history, "prior", particle_filter),
        (particle_filter, "force_selection", history),
        (particle_filter, "force_direction", history),
    ):
        builder.Connect(source.GetOutputPort(name), target.GetInputPort(name))
    for function, name, target in (
        (place, "robot_pose", history),
        (pressing, "sensed_force", particle_filter),
        (pressing, "motion_force", particle_filter),
    ):
        source = builder.AddSystem(Source(function))
        builder.Connect(source.get_output_port(), target.GetInputPort(name))
    simulator = Simulator(builder.Build())
    context = history.GetMyContextFromRoot(simulator.get_context())

    def prior_at(time):
        simulator.AdvanceTo(time)
        return evaluate(history.GetOutputPort("prior"), context)

    for time in (0.5, 0.99, 1.5, 3.9):  # The first visit, and off the table.
        assert prior_at(time).shape == (3, 0)
    for time in (4.2, 4.9, 5.9):  # The second.
        normals = prior_at(time)
        assert normals.shape == (3, 1)
        assert normals[:, 0] @ table > math.cos(math.radians(5))
    assert prior_at(6.2).shape == (3, 0)


class Receiver(LeafSystem):
    """Notes the age of each new message in a side's step."""

    def __init__(self):
        super().__init__()
        self.message = self.DeclareAbstractInputPort(
            "message", systems.make_value(_core.PoseMessage())
        )
        self.seen = []
        self.DeclarePeriodicPublishEvent(0.001, 0.0, self.note)

    def note(self, context):
        message = evaluate(self.message, context)
        if message.sequence > (self.seen[-1][0] if self.seen else -1):
            age = context.get_time() - message.send_time
            self.seen.append((message.sequence, age))


def received(rate, delay, duration):
    """Sequence numbers and ages of what comes from a PoseSender."""
    builder = DiagramBuilder()
    pose = builder.AddSystem(Source(robot_pose))
    params = _core.PoseSenderParams(rate=rate)
    sender = systems.PoseSender.add_to(builder, params)
    params = _core.CommunicationChannelParams(delay=delay)
    channel = systems.CommunicationChannel.add_to(builder, params, 0, rate, 0.001)
    receiver = builder.AddSystem(Receiver())
    builder.Connect(pose.get_output_port(), sender.GetInputPort("pose"))
    builder.Connect(sender.get_output_port(), channel.get_input_port())
    builder.Connect(channel.get_output_port(), receiver.get_input_port())
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(duration)
    return np.transpose(receiver.seen)


@pytest.mark.parametrize("delay", [0.0, 0.05, 0.15, 0.35])
@pytest.mark.parametrize("rate", [5.0, 50.0, 500.0])
def test_channel_delays_exactly_as_asked(rate, delay):
    sequences, ages = received(rate, delay, delay + 0.6)
    np.testing.assert_array_equal(sequences, np.arange(len(sequences)))
    assert len(sequences) >= 0.6 * rate - 1
    # One step after it was made, and the delay.
    np.testing.assert_allclose(ages, delay + 0.001, rtol=0, atol=1e-9)


# At these rates messages do not fall on the sides' steps.
@pytest.mark.parametrize("rate", [16.0, 60.0, 80.0, 300.0])
def test_channel_misses_no_message_at_odd_rates(rate):
    sequences, ages = received(rate, 0.0, 1.0)
    np.testing.assert_array_equal(sequences, np.arange(len(sequences)))
    assert len(sequences) >= rate - 1
    assert np.max(ages) < 0.0021


def schemes_messages():
    """What the schemes' sides send: name -> a message that a link may carry."""
    other = _core.Message()
    other.tag = 7
    other.body = [1.0, 2.0]
    return {
        "force": _core.ForceMessage(force=[0.0, 1.0, -5.0]),
        "pose": _core.PoseMessage(force_selection=np.eye(3)),
        "other": other,
    }


@pytest.mark.parametrize("name", schemes_messages())
def test_channel_carries_what_any_scheme_sends(name):
    def message(t):
        newest = copy.copy(schemes_messages()[name])
        newest.sequence = math.floor(t * 50 + 1e-9)
        newest.send_time = newest.sequence / 50
        return newest

    channel = systems.CommunicationChannel(
        _core.CommunicationChannelParams(delay=0.02), message=message(0.0)
    )
    diagram = build_around(channel, {"message": message})
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.1)
    got = evaluate(diagram.GetOutputPort("message"), simulator.get_context())
    # Sent at 0.0606 s; the next is under way.
    sent = message(0.0606)
    assert type(got) is type(sent)
    assert (got.sequence, got.send_time) == (3, 0.06)
    for field in ("body", "force", "force_selection"):
        if hasattr(sent, field):
            np.testing.assert_array_equal(getattr(got, field), getattr(sent, field))


def test_robot_side_proxy_alone():
    params = robot_proxy_params()
    builder = DiagramBuilder()
    face = systems.RobotSideProxy.add_to(builder, params)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = face.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    message = _core.PoseMessage(
        sequence=0, send_time=0.0, pose=_core.Pose(p=[0.01, 0.0, 0.0])
    )
    force_selection = np.diag([1.0, 0.0, 0.0])
    face.GetInputPort("haptic_message").FixValue(context, systems.make_value(message))
    face.GetInputPort("robot_pose").FixValue(context, robot_pose(0.0))
    face.GetInputPort("force_selection").FixValue(context, force_selection.ravel())

    algorithm = _core.RobotSideProxy(params)
    state = algorithm.make_state()
    for i in range(50):
        algorithm.update(
            i * 0.001,
            message,
            START,
            R_DOWN,
            force_selection,
            np.zeros((3, 3)),
            None,
            state,
        )
        simulator.AdvanceTo(i * 0.001)
        for name in ("motion_error", "reference_force", "proxy_velocity"):
            np.testing.assert_array_equal(
                face.GetOutputPort(name).Eval(context), getattr(state.output, name)
            )
    # The proxy has moved off along x, where force is controlled: pushed there.
    assert state.output.reference_force[0] > 0
    np.testing.assert_array_equal(state.output.motion_error, 0)
    status = dict(
        zip(
            systems.LINK_STATUS_FIELDS,
            face.GetOutputPort("link_status").Eval(context),
            strict=True,
        )
    )
    assert status["status"] == int(_core.LinkStatus.CONNECTED)
    assert status["received"] == 1
    assert status["age"] == pytest.approx(0.049)


def test_a_selection_from_outside_takes_the_place_of_the_sides_filter():
    entry = FACES["RobotSide"]
    ports = ("force_selection", "moment_selection", "contact_normals")
    across = np.diag([1.0, 0.0, 0.0])  # The wrench is along z.

    def run(sources, leave_out):
        diagram = build(entry, sources, leave_out)
        simulator = Simulator(diagram)
        simulator.AdvanceTo(0.5)
        context = simulator.get_context()
        outputs = read(diagram, context)
        message = evaluate(diagram.GetOutputPort("message"), context)
        used = outputs["signals"][entry.make().layout["force_selection"]]
        return outputs, used.reshape(3, 3), message.force_selection

    pressing = {"sensed_wrench": constant(0.0, 0.0, -9.0, 0.0, 0.0, 0.0)}
    outputs, used, sent = run(pressing, ports)
    assert outputs["dimension"] == 1
    np.testing.assert_array_equal(outputs["force_selection"], used.ravel())
    np.testing.assert_array_equal(sent, used)
    assert used[2, 2] > 0.9

    given = {"force_selection": lambda t: across.ravel(), **pressing}
    outputs, used, sent = run(given, ports[1:])
    np.testing.assert_array_equal(used, across)
    np.testing.assert_array_equal(sent, across)
    assert outputs["dimension"] == 0
    np.testing.assert_array_equal(outputs["force_selection"], 0)


def test_a_planner_takes_its_directions_over():
    entry = FACES["RobotSide"]
    layout = entry.make().layout

    def run(sources, leave_out=()):
        diagram = build(entry, sources, leave_out)
        simulator = Simulator(diagram)
        simulator.AdvanceTo(0.5)
        context = simulator.get_context()
        message = evaluate(diagram.GetOutputPort("message"), context)
        signals = read(diagram, context)["signals"]
        force = signals[layout["reference_force"]]
        return force, signals[layout["robot_proxy_position"]], message.force_selection

    planned = {
        "force_selection": lambda t: ALONG_Z.ravel(),
        "planner_selection": constant(*np.diag([0.0, 1.0, 1.0]).ravel()),
        "planner_position": constant(9.0, START[1] + 0.01, START[2]),
        "planner_velocity": constant(0.0, 0.0, 0.0),
        "planner_force": constant(9.0, 9.0, -3.0),
    }
    own_force, own_position, felt = run(planned, ["planner_selection"])
    np.testing.assert_array_equal(felt, ALONG_Z)
    force, position, felt = run(planned)
    np.testing.assert_array_equal(felt, 0.0)
    np.testing.assert_array_equal(force, [0.0, 0.0, -3.0])
    assert own_force[2] != pytest.approx(-3.0, abs=0.1)
    assert position[0] == pytest.approx(own_position[0], abs=1e-9)
    assert position[1] == pytest.approx(START[1] + 0.01, abs=1e-9)


def test_window_mean_is_what_a_slower_system_samples():
    diagram = build(FACES["WindowMean"])
    simulator = Simulator(diagram)
    value = FACES["WindowMean"].sources["value"]
    simulator.AdvanceTo(0.1)  # The step at 0.1 is still to come.
    np.testing.assert_allclose(
        read(diagram, simulator.get_context())["mean"],
        np.mean([value(i * 0.001) for i in range(50, 100)], axis=0),
        rtol=1e-12,
    )


def test_arm_kinematics_is_the_model():
    diagram = build(FACES["ArmKinematics"])
    context = diagram.CreateDefaultContext()
    context.SetTime(0.4)
    x = robot_state(0.4)
    terms = panda().calc(x[:7], x[7:])
    outputs = read(diagram, context)
    pose = outputs["robot_pose"]
    np.testing.assert_array_equal(pose[:3], terms.p_BE)
    np.testing.assert_array_equal(pose[3:], terms.R_BE.ravel())
    np.testing.assert_allclose(
        outputs["robot_velocity"], terms.J_BE @ x[7:], rtol=1e-12
    )


# Sides with simulated hardware: the same bits as with the system in front.


def both_ways(name, sources):
    """The diagram of one face and of two, and the output that the second adds."""
    entry = FACES[name]
    fused = build(entry, sources)
    builder = DiagramBuilder()
    side = added(builder, FACES[entry.cls].make())
    if entry.cls == "RobotSide":
        front = systems.ForceTorqueSensor.add_to(
            builder, sensor_params(), P_SE, PARAMS["sensor_seed"]
        )
        links = [
            (side, "robot_pose", front),
            (front, "sensed_wrench", side),
            (front, "ready", side, "sensor_ready"),
        ]
        kinematics = systems.ArmKinematics.add_to(builder, panda())
        links.append((kinematics, "robot_velocity", front))
        more = "sensed_wrench"
        counted = ("counters", "sensor_counters")
    else:
        front = systems.SimulatedHapticDevice.add_to(
            builder, operator_path(), device_params()
        )
        links = [
            (side, "device_wrench", front),
            (front, "device_pose", side),
            (front, "device_velocity", side),
        ]
        more = "device_pose"
        counted = ("bad_inputs", "device_bad_inputs")
    for source, port, target, *other in links:
        name = other[0] if other else port
        builder.Connect(source.GetOutputPort(port), target.GetInputPort(name))
    for port, function in {**entry.sources, **sources}.items():
        target = front if port in ("reaction", "tare") else side
        source = builder.AddSystem(Source(function))
        builder.Connect(source.get_output_port(), target.GetInputPort(port))
        if port == "robot_state":
            builder.Connect(
                source.get_output_port(), kinematics.GetInputPort("robot_state")
            )
    for i in range(side.num_output_ports()):
        port = side.get_output_port(i)
        builder.ExportOutput(port, port.get_name())
    builder.ExportOutput(front.GetOutputPort(more), more)
    builder.ExportOutput(front.GetOutputPort(counted[0]), counted[1])
    separate = builder.Build()
    return fused, separate, more


@pytest.mark.parametrize("bad", [None, np.nan, np.inf])
@pytest.mark.parametrize(
    ("name", "port"),
    [
        (name, port)
        for name, entry in FACES.items()
        if entry.simulated
        for port in entry.sources
    ],
)
def test_simulated_hardware_gives_the_same_bits(name, port, bad):
    function = FACES[name].sources[port]
    sources = {port: function if bad is None else spoil(function, bad)}
    fused, separate, more = both_ways(name, sources)
    one, two = Simulator(fused), Simulator(separate)
    seen = []
    for i in range(301):
        # The first row is of the start, before any step; all are between steps.
        if i > 0:
            one.AdvanceTo(i * 1e-3 - 0.0005)
            two.AdvanceTo(i * 1e-3 - 0.0005)
        mine = read(fused, one.get_context())
        theirs = read(separate, two.get_context())
        assert list(mine) == list(theirs)
        for output, value in mine.items():
            np.testing.assert_array_equal(
                value, theirs[output], err_msg=f"{output} in step {i}"
            )
        seen.append(mine[more])
    # It moves, and the noise is its own: not a row of zeros.
    assert len(np.unique(np.array(seen), axis=0)) > 100


def test_simulated_sensor_has_the_noise_of_its_seed():
    entry = FACES["RobotSideWithSensor"]

    def row(seed):
        face = systems.RobotSide(
            robot_side_params(), panda(), Q_START, sensor_params(), P_SE, seed
        )
        simulator = Simulator(build_around(face, entry.sources))
        simulator.AdvanceTo(0.0305)
        return read(simulator.get_system(), simulator.get_context())["sensed_wrench"]

    np.testing.assert_array_equal(row(4), row(4))
    assert np.all(row(4) != row(5))


def test_parameters_of_simulated_hardware_are_copied():
    def rows(spoil_params):
        sensor, device = sensor_params(), device_params()
        faces = {
            "RobotSideWithSensor": systems.RobotSide(
                robot_side_params(),
                panda(),
                Q_START,
                sensor,
                P_SE,
                PARAMS["sensor_seed"],
            ),
            "HapticSideWithDevice": systems.HapticSide(
                _core.HapticSideParams(), device, operator_path()
            ),
        }
        if spoil_params:
            sensor.tool_mass = 3.0
            device.hand_stiffness = 10.0
        return [
            simulate(Simulator(build_around(face, FACES[name].sources)), 0.1)
            for name, face in faces.items()
        ]

    for mine, theirs in zip(rows(True), rows(False), strict=True):
        np.testing.assert_array_equal(mine, theirs)
