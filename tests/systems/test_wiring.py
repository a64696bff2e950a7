# SPDX-License-Identifier: BSD-3-Clause
"""One system, the sides' systems and their parts in a row: the same bits."""

import numpy as np
import pandas as pd
import pytest
from face_table import evaluate, flat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import Demultiplexer, LogVectorOutput, ZeroOrderHold

from dual_proxy import _core, systems
from dual_proxy.log import signal
from dual_proxy.native import NativeTwin
from dual_proxy.panda import PandaModel, add_panda_scene, p_SE_S
from dual_proxy.scenario import SCHEMES, load_scenario
from dual_proxy.station import WIRINGS, build_station

DURATION = 4.0
PERIOD = 1e-3

# Name in the separate wiring -> signal in the log.
HELD = {
    "torque": "torque",
    "dimension": "dimension",
    "force_direction": "force_direction",
}
STEP = {
    "motion_error": "motion_error",
    "rotation_error": "rotation_error",
    "reference_force": "reference_force",
    "reference_moment": "reference_moment",
    "motion_force": "motion_force",
    "contact_force": "force_space_force",
    "observed_energy": "observed_energy",
    "injected_damping": "injected_damping",
    "proxy_velocity": "robot_proxy_velocity",
    "force_selection": "force_selection",
    "haptic_reference_force": "haptic_reference_force",
    "haptic_reference_moment": "haptic_reference_moment",
    "haptic_force_selection": "haptic_force_selection",
}


class Separate:
    """The diagram of scheme `dual_proxy` from separate faces."""

    def __init__(self, scenario):
        self.builder = DiagramBuilder()
        self.logs = {}
        robot_sender = self.add_robot(scenario)
        device_sender = self.add_device(scenario)
        self.add_channel(scenario, "to_robot", device_sender, self.robot_message)
        self.add_channel(scenario, "to_device", robot_sender, self.device_message)
        self.diagram = self.builder.Build()
        self.simulator = Simulator(self.diagram)
        context = self.simulator.get_mutable_context()
        # The arm is held until the first step, as by RobotSide.
        hold = self.hold.GetMyMutableContextFromRoot(context)
        hold.SetDiscreteState(self.start_torque)
        self.simulator.Initialize()

    def add(self, system):
        # A face as the station adds it, in C++ where that is in use.
        if isinstance(system, NativeTwin):
            count = len(self.builder.GetSystems())
            return system._join(self.builder, f"{type(system).__name__} {count}")
        return self.builder.AddSystem(system)

    def connect(self, source, output, target, port):
        self.builder.Connect(source.GetOutputPort(output), target.GetInputPort(port))

    def log(self, name, port):
        self.logs[name] = LogVectorOutput(port, self.builder, publish_period=PERIOD)

    def data(self, name):
        return self.logs[name].FindLog(self.simulator.get_context()).data().T

    def split(self, port):
        """Returns the first half of a six-vector."""
        halves = self.add(Demultiplexer(6, 3))
        self.builder.Connect(port, halves.get_input_port(0))
        return halves.get_output_port(0)

    def add_robot(self, scenario):
        builder, connect = self.builder, self.connect
        params = scenario.scene
        model = PandaModel(params.tool_mass, params.gravity)
        q_start = model.inverse_kinematics(
            scenario.map.p_cw, scenario.map.R_cw, scenario.controller.q_rest
        )
        self.start_torque = -model.calc(q_start, np.zeros(7)).gravity
        scene = add_panda_scene(builder, params, q_start)
        reaction = self.add(systems.SensorReaction(scene.sensor_joint))
        sensor = self.add(
            systems.ForceTorqueSensor(
                scenario.sensor, p_SE_S, scenario.calc_seed("sensor")
            )
        )
        kinematics = self.add(systems.ArmKinematics(model))
        proxy = self.add(systems.RobotSideProxy(scenario.robot_proxy))
        controller = self.add(
            systems.OperationalSpaceController(scenario.controller, model)
        )
        self.hold = self.add(ZeroOrderHold(PERIOD, 7))
        particle_filter = self.add(
            systems.ForceSpaceParticleFilter(
                scenario.filter, scenario.calc_seed("filter")
            )
        )
        sender = self.add(systems.PoseSender(scenario.link.sender))

        builder.Connect(
            scene.reaction_forces_port, reaction.GetInputPort("reaction_forces")
        )
        builder.Connect(scene.state_port, kinematics.GetInputPort("robot_state"))
        builder.Connect(scene.state_port, controller.GetInputPort("robot_state"))
        builder.Connect(self.hold.get_output_port(), scene.actuation_port)
        builder.Connect(controller.GetOutputPort("torque"), self.hold.get_input_port())
        connect(reaction, "reaction", sensor, "reaction")
        connect(kinematics, "robot_velocity", sensor, "robot_velocity")
        for system, port in (
            (sensor, "robot_pose"),
            (proxy, "robot_pose"),
            (sender, "pose"),
        ):
            connect(kinematics, "robot_pose", system, port)
        for system in (proxy, controller):
            connect(sensor, "sensed_wrench", system, "sensed_wrench")
            connect(sensor, "ready", system, "sensor_ready")
        for system in (proxy, sender):
            connect(particle_filter, "force_selection", system, "force_selection")
        connect(particle_filter, "contact_normals", sender, "contact_normals")
        for name in (
            "motion_error",
            "rotation_error",
            "reference_force",
            "reference_moment",
            "proxy_velocity",
            "proxy_acceleration",
            "force_selection",
        ):
            connect(proxy, name, controller, name)
        for name, port in (
            ("sensed_force", self.split(sensor.GetOutputPort("sensed_wrench"))),
            ("velocity", self.split(kinematics.GetOutputPort("robot_velocity"))),
            ("motion_force", controller.GetOutputPort("motion_force")),
            ("contact_force", controller.GetOutputPort("contact_force")),
        ):
            mean = self.add(systems.WindowMean(scenario.filter.period, PERIOD))
            builder.Connect(port, mean.GetInputPort("value"))
            connect(mean, "mean", particle_filter, name)
            self.log(f"mean_{name}", mean.GetOutputPort("mean"))

        self.log("torque", self.hold.get_output_port())
        self.log("robot_state", scene.state_port)
        self.log("robot_link_status", proxy.GetOutputPort("link_status"))
        for name in ("motion_error", "rotation_error"):
            self.log(name, proxy.GetOutputPort(name))
        for name in ("reference_force", "reference_moment"):
            self.log(name, proxy.GetOutputPort(name))
        for name in (
            "motion_force",
            "contact_force",
            "observed_energy",
            "injected_damping",
        ):
            self.log(name, controller.GetOutputPort(name))
        for name in ("dimension", "force_direction", "force_selection"):
            self.log(name, particle_filter.GetOutputPort(name))
        self.log("sensed_wrench", sensor.GetOutputPort("sensed_wrench"))
        velocity = self.split(proxy.GetOutputPort("proxy_velocity"))
        self.log("proxy_velocity", velocity)
        self.robot_message = proxy.GetInputPort("haptic_message")
        return sender

    def add_device(self, scenario):
        path = scenario.handle_path()
        device = self.add(systems.SimulatedHapticDevice(path, scenario.device))
        proxy = self.add(systems.HapticSideProxy(scenario.haptic_proxy))
        controller = self.add(systems.HapticController(scenario.haptic_controller))
        hold = self.add(ZeroOrderHold(PERIOD, 6))
        sender = self.add(systems.PoseSender(scenario.link.sender))
        connect = self.connect
        connect(device, "device_pose", proxy, "device_pose")
        connect(device, "device_pose", sender, "pose")
        connect(device, "device_velocity", controller, "device_velocity")
        for name in (
            "reference_force",
            "reference_moment",
            "force_selection",
            "contact_normals",
        ):
            connect(proxy, name, controller, name)
            self.log(f"haptic_{name}", proxy.GetOutputPort(name))
        self.builder.Connect(
            controller.GetOutputPort("device_wrench"), hold.get_input_port()
        )
        self.builder.Connect(
            hold.get_output_port(), device.GetInputPort("device_wrench")
        )
        self.log("haptic_link_status", proxy.GetOutputPort("link_status"))
        self.log("device_wrench", hold.get_output_port())
        self.log("device_velocity", device.GetOutputPort("device_velocity"))
        self.device_message = proxy.GetInputPort("robot_message")
        return sender

    def add_channel(self, scenario, name, sender, target):
        link = scenario.link
        channel = self.add(
            systems.CommunicationChannel(
                link.channel, scenario.calc_seed(name), link.rate, PERIOD
            )
        )
        self.connect(sender, "message", channel, "message")
        self.builder.Connect(channel.GetOutputPort("message"), target)


def station_of(scheme, wiring):
    scenario = load_scenario("plane").with_overrides(
        {"link.delay": 0.05, "scheme": scheme}
    )
    assert scenario.control_period == PERIOD
    station = build_station(scenario, wiring=wiring)
    station.advance_to(DURATION)
    return station


@pytest.fixture(scope="module", params=SCHEMES)
def both(request):
    """A scheme's station in both wirings."""
    return [station_of(request.param, wiring) for wiring in WIRINGS]


def test_one_system_and_systems_in_a_row_give_the_same_bits(both):
    fused, separate = (station.log_frame() for station in both)
    pd.testing.assert_frame_equal(fused, separate, check_exact=True)
    assert fused["contact_force_z"].min() < -2
    assert fused["device_force_z"].max() > 1
    for side in ("robot", "haptic"):
        assert fused[f"{side}_link_status"].iloc[-1] == int(_core.LinkStatus.CONNECTED)
        assert not fused[f"{side}_bad_inputs"].any()


def test_both_wirings_export_the_same(both):
    fused, separate = (
        {
            port.get_name(): flat(evaluate(port, station.simulator.get_context()))
            for port in map(
                station.diagram.get_output_port,
                range(station.diagram.num_output_ports()),
            )
        }
        for station in both
    )
    assert set(fused) == set(separate)
    for name, value in fused.items():
        np.testing.assert_array_equal(value, separate[name], err_msg=name)
    selects = both[0].scenario.uses_selections
    assert ({"force_selection", "dimension"} <= set(fused)) == selects


# The dual proxy from its parts.


class Rows:
    """The station's log by signal. A row shows what the step before has given."""

    def __init__(self, station):
        self.station = station
        self.frame = station.log_frame()

    def data(self, name):
        return signal(self.frame, name).reshape(len(self.frame), -1)


@pytest.fixture(scope="module")
def runs():
    station = station_of("dual_proxy", "systems")
    separate = Separate(station.scenario)
    separate.simulator.AdvanceTo(DURATION)
    return Rows(station), separate


def test_the_run_goes_into_contact(runs):
    _, separate = runs
    assert separate.data("dimension")[-1] == 1
    assert separate.data("force_direction")[-1, 2] < -0.9
    assert np.max(np.abs(separate.data("device_wrench"))) > 1
    assert np.min(separate.data("mean_sensed_force")[:, 2]) < -2


def test_plant_and_device_move_alike(runs):
    station, separate = runs
    state = separate.data("robot_state")[:-1]
    np.testing.assert_array_equal(state[:, :7], station.data("joint_position"))
    np.testing.assert_array_equal(state[:, 7:], station.data("joint_velocity"))
    np.testing.assert_array_equal(
        separate.data("device_velocity")[:-1, :3], station.data("device_velocity")
    )


@pytest.mark.parametrize("name", HELD)
def test_held_signals_are_the_same(runs, name):
    station, separate = runs
    mine = separate.data(name)[1:]
    assert np.any(mine != mine[0])
    np.testing.assert_array_equal(mine, station.data(HELD[name]))


# With feedthrough, a row holds what the step at its time gives.
@pytest.mark.parametrize("name", STEP)
def test_steps_are_the_same(runs, name):
    station, separate = runs
    np.testing.assert_array_equal(separate.data(name)[:-1], station.data(STEP[name]))


def test_device_wrench_is_the_same(runs):
    station, separate = runs
    np.testing.assert_array_equal(
        separate.data("device_wrench")[1:],
        np.hstack([station.data("device_force"), station.data("device_moment")]),
    )


def test_sensed_wrench_is_the_same(runs):
    station, separate = runs
    # The sensor's last step came before the side's.
    np.testing.assert_array_equal(
        separate.data("sensed_wrench")[:-1],
        np.hstack([station.data("sensed_force"), station.data("sensed_moment")]),
    )
    assert np.all(np.any(separate.data("sensed_wrench")[510:] != 0, axis=1))


@pytest.mark.parametrize("side", ["robot", "haptic"])
def test_link_status_is_the_same(runs, side):
    station, separate = runs
    status = separate.data(f"{side}_link_status")[:-1]
    fields = list(systems.LINK_STATUS_FIELDS)
    for field in ("status", "age", "dropped"):
        np.testing.assert_array_equal(
            status[:, [fields.index(field)]],
            station.data(f"{side}_link_{field}"),
            err_msg=field,
        )


def test_outputs_are_the_same(runs):
    rows, separate = runs
    station = rows.station
    context = station.simulator.get_context()
    root = separate.simulator.get_context()
    side = station.diagram.GetSubsystemByName("robot_side")
    side_context = side.GetMyContextFromRoot(context)
    means = ("sensed_force", "velocity", "motion_force", "contact_force")
    for name in (
        *("torque", "dimension", "force_selection", "sensed_wrench"),
        *(f"mean_{mean}" for mean in means),
    ):
        value = side.GetOutputPort(name).Eval(side_context)
        port = separate.logs[name].get_input_port()
        theirs = port.Eval(separate.logs[name].GetMyContextFromRoot(root))
        assert np.any(value != 0)
        np.testing.assert_array_equal(value, theirs, err_msg=name)


# The two-channel scheme: its link carries the sensed force back.


@pytest.fixture(scope="module")
def two_channel():
    return Rows(station_of("position_force", "systems"))


def sent_force(two_channel, step):
    """The mean over a message interval that a message of that step holds."""
    interval = round(1 / (two_channel.station.scenario.link.rate * PERIOD))
    first = max(step - interval + 1, 0)
    return np.mean(two_channel.data("sensed_force")[first : step + 1], axis=0)


def test_link_carries_the_sensed_force(two_channel):
    station = two_channel.station
    context = station.simulator.get_context()

    def newest(name):
        channel = station.diagram.GetSubsystemByName(name)
        port = channel.GetOutputPort("message")
        return evaluate(port, channel.GetMyContextFromRoot(context))

    message = newest("to_device")
    assert isinstance(message, _core.ForceMessage)
    rate, delay = station.scenario.link.rate, station.scenario.link.delay
    assert message.sequence == round(message.send_time * rate)
    age = context.get_time() - message.send_time
    assert delay <= age + 1e-9 <= delay + 1 / rate + 2 * PERIOD
    np.testing.assert_allclose(
        message.force,
        sent_force(two_channel, round(message.send_time / PERIOD)),
        rtol=0,
        atol=1e-12,
    )
    assert np.linalg.norm(message.force) > 2
    assert isinstance(newest("to_robot"), _core.PoseMessage)


def test_force_on_the_hand_is_the_late_sensed_force(two_channel):
    scenario = two_channel.station.scenario
    params = scenario.schemes.position_force
    R_DB = np.asarray(scenario.map.R_DB)
    # Row by row, from the robot's signals alone: the force of the newest message
    # that a step after its sending and the delay can have.
    interval = round(1 / (scenario.link.rate * PERIOD))
    lag = round(scenario.link.delay / PERIOD) + 1
    acting = two_channel.data("haptic_reference_force")
    expected = np.zeros_like(acting)
    for row in range(len(acting)):
        sent = (row - lag) // interval * interval
        if sent >= 0:
            force = -params.force_scale * R_DB @ sent_force(two_channel, sent)
            size = max(np.linalg.norm(force), 1e-12)
            expected[row] = force * min(1.0, params.max_force / size)
    np.testing.assert_allclose(acting, expected, rtol=0, atol=1e-12)
    assert acting[:, 2].max() > 1
